//! The error of this crate.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

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
    Content { place: Place, expected: String, found: String },
    Read(io::Error),
    Write(io::Error),
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
    pub fn read(path: impl Into<PathBuf>, source: io::Error) -> Self {
        Self { path: path.into(), kind: Kind::Read(source) }
    }

    /// Creates an error for a `path` that cannot be written.
    pub fn write(path: impl Into<PathBuf>, source: io::Error) -> Self {
        Self { path: path.into(), kind: Kind::Write(source) }
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

    /// Replaces the path of the error by one that the user gave.
    #[must_use]
    pub fn at(self, path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), ..self }
    }

    /// The file or folder that the error is about.
    pub fn path(&self) -> &Path {
        &self.path
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
            Kind::Read(source) => match read_cause(source.kind()) {
                Some(cause) => write!(f, ": {cause}"),
                None => write!(f, ": cannot read: {}", OneLine(source)),
            },
            Kind::Write(source) => match write_cause(source.kind()) {
                Some(cause) => write!(f, ": {cause}"),
                None => write!(f, ": cannot write: {}", OneLine(source)),
            },
            Kind::Core(source) => write!(f, ": {}", OneLine(source)),
        }
    }
}

/// Common causes in our own words, because system messages differ between platforms.
fn read_cause(kind: io::ErrorKind) -> Option<&'static str> {
    Some(match kind {
        io::ErrorKind::NotFound => "expected a file or folder, found nothing",
        io::ErrorKind::IsADirectory => "expected a file, found a folder",
        io::ErrorKind::NotADirectory => "expected a folder, found a file",
        io::ErrorKind::PermissionDenied => "expected a readable file, found no permission to read",
        _ => return None,
    })
}

fn write_cause(kind: io::ErrorKind) -> Option<&'static str> {
    Some(match kind {
        io::ErrorKind::PermissionDenied => {
            "expected a writable place, found no permission to write"
        }
        io::ErrorKind::ReadOnlyFilesystem => {
            "expected a writable place, found a read-only file system"
        }
        io::ErrorKind::StorageFull => "expected space to write, found a full disk",
        io::ErrorKind::QuotaExceeded => "expected space to write, found a used-up quota",
        io::ErrorKind::FileTooLarge => {
            "expected space to write, found a limit on the size of files"
        }
        _ => return None,
    })
}

impl std::error::Error for Error {
    // The text already contains the cause.
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        None
    }
}

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
