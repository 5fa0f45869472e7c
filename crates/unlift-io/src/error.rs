//! The error of this crate.

use std::fmt;
use std::io;
use std::path::PathBuf;

use unlift::OneLine;

/// The place of an error in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file (or folder) as a whole.
    Whole,
    /// A line of a text file, counted from 1.
    Line(u64),
    /// A byte of a binary file.
    Byte {
        /// The structure that was read: `record 12`, `header`.
        what: String,
        /// Offset of its first byte, counted from 0.
        at: u64,
    },
    /// Another named place: a column, a table, a row.
    Named(String),
}

impl From<&str> for Place {
    fn from(name: &str) -> Self {
        Self::from(name.to_owned())
    }
}

impl From<String> for Place {
    fn from(name: String) -> Self {
        if name.is_empty() { Self::Whole } else { Self::Named(name) }
    }
}

/// A file that cannot be read or written, or whose content is wrong.
///
/// Prints as one line: `points.txt:17: expected 3 coordinates, found 2`, or `points3D.bin: record
/// 12 (byte 4711): expected 8 bytes, found end of file`. Control characters are escaped.
#[derive(Debug)]
pub struct Error {
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Content {
        place: Place,
        expected: String,
        found: String,
    },
    /// What cannot be done, `read` or `write`, and why.
    System(&'static str, io::Error),
    Core(unlift::Error),
}

impl Error {
    /// Creates an error about the content of `path`: what was expected at `place`, and what was
    /// found.
    ///
    /// An empty `place` means the whole file.
    pub fn new(
        path: impl Into<PathBuf>,
        place: impl Into<Place>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self {
            path: path.into(),
            kind: Kind::Content {
                place: place.into(),
                expected: expected.into(),
                found: found.into(),
            },
        }
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
            _ => return Self { path: path.into(), kind: Kind::System("read", source) },
        };
        Self::new(path, Place::Whole, expected, found)
    }

    /// Creates an error for a `path` that cannot be written.
    pub fn write(path: impl Into<PathBuf>, source: io::Error) -> Self {
        let (expected, found) = match source.kind() {
            io::ErrorKind::PermissionDenied => ("a writable place", "no permission to write"),
            io::ErrorKind::ReadOnlyFilesystem => ("a writable place", "a read-only file system"),
            io::ErrorKind::StorageFull => ("space to write", "a full disk"),
            io::ErrorKind::QuotaExceeded => ("space to write", "a used-up quota"),
            io::ErrorKind::FileTooLarge => ("space to write", "a limit on the size of files"),
            _ => return Self { path: path.into(), kind: Kind::System("write", source) },
        };
        Self::new(path, Place::Whole, expected, found)
    }

    /// Creates an error for values from `path` that the core library refused.
    pub fn core(path: impl Into<PathBuf>, source: unlift::Error) -> Self {
        Self { path: path.into(), kind: Kind::Core(source) }
    }

    /// Adds a prefix to the place of the error: `images.npz: image a.jpg, column x: expected
    /// ...`.
    pub(crate) fn within(self, what: &str) -> Self {
        let kind = match self.kind {
            Kind::Content { place: Place::Whole, expected, found } => {
                Kind::Content { place: what.into(), expected, found }
            }
            Kind::Content { place: Place::Named(name), expected, found } => {
                Kind::Content { place: format!("{what}, {name}").into(), expected, found }
            }
            Kind::Core(source) => Kind::Core(source.within(what)),
            other => other,
        };
        Self { kind, ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        OneLine(self.path.display()).fmt(f)?;
        match &self.kind {
            Kind::Content { place, expected, found } => {
                match place {
                    Place::Whole => {}
                    Place::Line(line) => write!(f, ":{line}")?,
                    Place::Byte { what, at } => write!(f, ": {} (byte {at})", OneLine(what))?,
                    Place::Named(name) => write!(f, ": {}", OneLine(name))?,
                }
                let (expected, found) = (OneLine(expected), OneLine(found));
                write!(f, ": expected {expected}, found {found}")
            }
            Kind::System(step, source) => write!(f, ": cannot {step}: {}", OneLine(source)),
            Kind::Core(source) => write!(f, ": {}", OneLine(source)),
        }
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
        let core = || unlift::Error::new("point 3", "finite coordinates", "[NaN, 0.0, 0.0]");
        let byte = Place::Byte { what: "record 12".into(), at: 4711 };
        let io = |kind| io::Error::new(kind, "other\ntext");
        let table = [
            (Error::new("points.txt", Place::Line(17), "3 coordinates", "2"), "points.txt:17: expected 3 coordinates, found 2"),
            (Error::new("points3D.bin", byte, "8 bytes", "end of file"), "points3D.bin: record 12 (byte 4711): expected 8 bytes, found end of file"),
            (Error::new("a.ply", "", "a number", "x\ny"), "a.ply: expected a number, found x\\ny"),
            (Error::read("a.ply", io(io::ErrorKind::NotFound)), "a.ply: expected a file or folder, found nothing"),
            (Error::read("a.csv", io(io::ErrorKind::PermissionDenied)), "a.csv: expected a readable file, found no permission to read"),
            (Error::write("out", io(io::ErrorKind::FileTooLarge)), "out: expected space to write, found a limit on the size of files"),
            (Error::new("a\u{202e}b", "c\u{9b}", "d", "e\u{2028}"), "a\\u{202e}b: c\\u{9b}: expected d, found e\\u{2028}"),
            (Error::read("a\nb", io(io::ErrorKind::Other)), "a\\nb: cannot read: other\\ntext"),
            (Error::write("out", io(io::ErrorKind::Other)), "out: cannot write: other\\ntext"),
            (Error::core("a.csv", core()), "a.csv: point 3: expected finite coordinates, found [NaN, 0.0, 0.0]"),
        ];
        for (error, line) in table {
            assert_eq!(error.to_string(), line);
        }
    }
}
