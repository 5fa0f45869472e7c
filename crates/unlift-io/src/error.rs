//! The error of this crate.

use std::fmt::{self, Display};
use std::io;
use std::path::{Path, PathBuf};

use unlift::OneLine;

/// A file that cannot be read or written, or whose content is wrong.
///
/// Prints as one line: `points.txt:17: expected 3 coordinates, found 2`, or `points3D.bin: record
/// 12 (byte 4711): expected 8 bytes, found end of file`. Control characters are escaped.
#[derive(Debug)]
pub struct Error {
    path: PathBuf,
    /// The place as it is printed behind the path: `:17` or `: record 12`, or nothing.
    place: String,
    problem: String,
}

impl Error {
    /// Creates an error about the content of `path`: what was expected at `place`, and what was found.
    ///
    /// A place is a record, a column or a table. An empty one means the whole file, or folder.
    pub fn new(
        path: impl Into<PathBuf>,
        place: impl AsRef<str>,
        expected: impl Display,
        found: impl Display,
    ) -> Self {
        let place = match place.as_ref() {
            "" => String::new(),
            place => format!(": {place}"),
        };
        Self { path: path.into(), place, problem: format!("expected {expected}, found {found}") }
    }

    /// Creates an error about a line of a text file, counted from 1.
    pub(crate) fn at_line(
        path: &Path,
        line: u64,
        expected: impl Display,
        found: impl Display,
    ) -> Self {
        Self { place: format!(":{line}"), ..Self::new(path, "", expected, found) }
    }

    /// Creates an error for a `path` that cannot be read.
    ///
    /// Common causes are in our own words, because system messages differ between platforms.
    pub fn read(path: impl Into<PathBuf>, source: io::Error) -> Self {
        let (expected, found) = match source.kind() {
            io::ErrorKind::NotFound => ("a file or folder", "nothing"),
            io::ErrorKind::IsADirectory => ("a file", "a folder"),
            io::ErrorKind::NotADirectory => ("a folder", "a file"),
            io::ErrorKind::PermissionDenied => ("a readable file", "no permission to read"),
            _ => return Self::of_whole(path, format!("cannot read: {source}")),
        };
        Self::new(path, "", expected, found)
    }

    /// Creates an error for a `path` that cannot be written.
    pub fn write(path: impl Into<PathBuf>, source: io::Error) -> Self {
        let (expected, found) = match source.kind() {
            io::ErrorKind::PermissionDenied => ("a writable place", "no permission to write"),
            io::ErrorKind::ReadOnlyFilesystem => ("a writable place", "a read-only file system"),
            io::ErrorKind::StorageFull => ("space to write", "a full disk"),
            io::ErrorKind::QuotaExceeded => ("space to write", "a used-up quota"),
            io::ErrorKind::FileTooLarge => ("space to write", "a limit on the size of files"),
            _ => return Self::of_whole(path, format!("cannot write: {source}")),
        };
        Self::new(path, "", expected, found)
    }

    /// Creates an error for values from `path` that the core library refused.
    pub fn core(path: impl Into<PathBuf>, source: unlift::Error) -> Self {
        Self::of_whole(path, source.to_string())
    }

    fn of_whole(path: impl Into<PathBuf>, problem: String) -> Self {
        Self { path: path.into(), place: String::new(), problem }
    }

    /// Adds a prefix to the place of the error: `images.npz: image a.jpg, column x: expected ...`.
    pub(crate) fn within(self, what: &str) -> Self {
        Self { place: format!(": {what}{}", self.place.replacen(": ", ", ", 1)), ..self }
    }
}

impl Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (place, problem) = (OneLine(&self.place), OneLine(&self.problem));
        write!(f, "{}{place}: {problem}", OneLine(self.path.display()))
    }
}

// Without a source: the text already contains the cause.
impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[rustfmt::skip] // One row per line.
    fn every_kind_prints_one_line() {
        let io = |kind| io::Error::new(kind, "other\ntext");
        let table = [
            (Error::read("a.csv", io(io::ErrorKind::PermissionDenied)), "a.csv: expected a readable file, found no permission to read"),
            (Error::write("out", io(io::ErrorKind::FileTooLarge)), "out: expected space to write, found a limit on the size of files"),
            (Error::new("a\u{202e}b", "c\u{9b}", "d", "e\u{2028}"), "a\\u{202e}b: c\\u{9b}: expected d, found e\\u{2028}"),
            (Error::read("a\nb", io(io::ErrorKind::Other)), "a\\nb: cannot read: other\\ntext"),
            (Error::write("out", io(io::ErrorKind::Other)), "out: cannot write: other\\ntext"),
        ];
        for (error, line) in table {
            assert_eq!(error.to_string(), line);
        }
    }
}
