//! Text files, a line at a time.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use crate::error::{Error, Place};
use crate::input;

/// Bytes of a line at most: as many as a point takes that a million photos show. A file of one endless
/// line is not read to its end.
pub(crate) const LONGEST_LINE: u64 = 16 << 20;

/// Lines of a text file, counted from 1, as bytes: names need not be UTF-8.
pub(crate) struct Lines {
    path: PathBuf,
    reader: BufReader<File>,
    line: Vec<u8>,
    number: u64,
}

impl Lines {
    /// A reader at the start of `path`.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (file, _) = input::open(path)?;
        Ok(Self::continuing(path, BufReader::new(file), 0))
    }

    /// A reader of a file of which `number` lines were already read from `reader`.
    pub fn continuing(path: &Path, reader: BufReader<File>, number: u64) -> Self {
        Self { path: path.to_owned(), reader, line: Vec::new(), number }
    }

    /// Reads the next line, whatever it holds; false at the end of the file.
    ///
    /// # Errors
    /// When the line holds a zero byte: the file is not text; when it is longer than [`LONGEST_LINE`].
    pub fn advance(&mut self) -> Result<bool, Error> {
        self.line.clear();
        let mut limited = self.reader.by_ref().take(LONGEST_LINE + 1);
        let read = limited.read_until(b'\n', &mut self.line);
        if read.map_err(|e| Error::read(&self.path, e))? == 0 {
            return Ok(false);
        }
        self.number += 1;
        if self.line.contains(&0) {
            return Err(self.error("text", "binary data"));
        }
        if self.line.len() as u64 > LONGEST_LINE {
            let expected = format!("a line of at most {}", input::size(LONGEST_LINE));
            return Err(self.error(expected, "a longer one"));
        }
        if self.number == 1 && self.line.starts_with(b"\xef\xbb\xbf") {
            self.line.drain(..3);
        }
        Ok(true)
    }

    /// Reads up to the next line that is neither blank nor a comment; false at the end of the file.
    pub fn advance_to_data(&mut self) -> Result<bool, Error> {
        while self.advance()? {
            let line = self.line();
            if !line.is_empty() && !line.starts_with(b"#") {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The current line without the space around it.
    pub fn line(&self) -> &[u8] {
        self.line.trim_ascii()
    }

    /// The current line without its end: between tabs, a first field may be empty.
    pub fn untrimmed(&self) -> &[u8] {
        let line = self.line.strip_suffix(b"\n").unwrap_or(&self.line);
        line.strip_suffix(b"\r").unwrap_or(line)
    }

    /// An error in the current line.
    pub fn error(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::new(&self.path, Place::Line(self.number), expected, found)
    }

    /// An error at the end of the file, where another line should be.
    pub fn end_error(&self, expected: impl Into<String>) -> Error {
        let place = Place::Line(self.number + 1);
        Error::new(&self.path, place, expected, "end of file")
    }
}

/// Words of a line between spaces and tabs.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// The number written as `word`, if it is one.
pub(crate) fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word as it appears in an error: quoted, and cut when it is long.
pub(crate) fn quoted(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(word);
    if text.chars().count() <= LONGEST {
        format!("\"{text}\"")
    } else {
        format!("\"{}...\"", text.chars().take(LONGEST).collect::<String>())
    }
}
