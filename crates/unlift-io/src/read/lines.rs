//! Reads text files line by line, and their columns and coordinates.

use std::fmt::Display;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use super::bytes::Bytes;
use crate::error::Error;
use crate::input::{self, Budget};

/// The maximum length of a line in bytes, enough for the track of a point in a million photos.
pub(crate) const LONGEST_LINE: u64 = 16 << 20;
/// The least number of points at which a column of row numbers is an error. Fewer may match by accident.
pub(super) const TELLING: usize = 10;

/// A reader of text lines, counted from 1, as bytes: names need not be UTF-8.
pub(crate) struct Lines {
    path: PathBuf,
    reader: BufReader<File>,
    line: Vec<u8>,
    number: u64,
    at: u64,
    len: u64,
}

impl Lines {
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (file, len) = input::open(path)?;
        let reader = BufReader::new(file);
        Ok(Self { path: path.to_owned(), reader, line: Vec::new(), number: 0, at: 0, len })
    }

    /// Returns a binary reader of the bytes after the current line.
    pub fn into_bytes(self) -> Bytes {
        Bytes::continuing(&self.path, self.reader, self.at, self.len)
    }

    pub fn room<T>(&self, place: &str, n: u64) -> Result<Vec<T>, Error> {
        Budget::new(&self.path, self.len).room(place, n)
    }

    /// Returns an error if `n` rows of `n_values` values, with a digit and a separator each, exceed the rest of the file.
    pub fn expect_room(&self, n: u64, what: &str, n_values: u64) -> Result<(), Error> {
        let most = (self.len.saturating_sub(self.at) + 1) / n_values.saturating_mul(2);
        if n <= most {
            return Ok(());
        }
        let expected = format!("at most {most} {what} (by the size of the file)");
        Err(Error::new(&self.path, "header", expected, n.to_string()))
    }

    /// Reads the next line. Returns false at the end of the file. A zero byte or a line over [`LONGEST_LINE`] is an error.
    pub fn advance(&mut self) -> Result<bool, Error> {
        self.line.clear();
        let mut limited = self.reader.by_ref().take(LONGEST_LINE + 1);
        let read = limited.read_until(b'\n', &mut self.line);
        let read = read.map_err(|e| Error::read(&self.path, e))?;
        if read == 0 {
            return Ok(false);
        }
        self.number += 1;
        self.at += read as u64;
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

    /// Reads up to the next line that is neither blank nor a comment. Returns false at the end of the file.
    pub fn advance_to_data(&mut self) -> Result<bool, Error> {
        while self.advance()? {
            let line = self.line();
            if !line.is_empty() && !line.starts_with(b"#") {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Reads the next line, which has `what`.
    pub fn expect_line(&mut self, what: &str) -> Result<(), Error> {
        if self.advance()? { Ok(()) } else { Err(self.end_error(what)) }
    }

    /// Reads up to the next line that is neither blank nor a comment, which has `what`.
    pub fn expect_data(&mut self, what: &str) -> Result<(), Error> {
        if self.advance_to_data()? { Ok(()) } else { Err(self.end_error(what)) }
    }

    pub fn line(&self) -> &[u8] {
        self.line.trim_ascii()
    }

    /// The current line without its line end. The first of tab-separated fields may be empty.
    pub fn untrimmed(&self) -> &[u8] {
        let line = self.line.strip_suffix(b"\n").unwrap_or(&self.line);
        line.strip_suffix(b"\r").unwrap_or(line)
    }

    pub fn error(&self, expected: impl Display, found: impl Display) -> Error {
        Error::at_line(&self.path, self.number, expected, found)
    }

    /// Returns an error at the end of the file, where another line was expected.
    pub fn end_error(&self, expected: impl Display) -> Error {
        Error::at_line(&self.path, self.number + 1, expected, "end of file")
    }
}

pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

pub(crate) fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

pub(crate) fn quoted(word: &[u8]) -> String {
    format!("\"{}\"", shortened(&String::from_utf8_lossy(word), 40))
}

/// Returns `text`, or its first `longest` characters and dots.
pub(crate) fn shortened(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((at, _)) => format!("{}...", &text[..at]),
        None => text.to_owned(),
    }
}

/// Finds the columns `x`, `y` and `z` among names. Case, quotes and a unit in brackets are ignored.
pub fn axes<'a>(names: impl Iterator<Item = &'a [u8]> + Clone) -> Option<[usize; 3]> {
    let find = |titles: [&[u8]; 3]| {
        names.clone().position(|name| titles.iter().any(|title| is_called(name, title)))
    };
    // ParaView numbers the columns of points.
    Some([
        find([b"x", b"Points:0", b"Points_0"])?,
        find([b"y", b"Points:1", b"Points_1"])?,
        find([b"z", b"Points:2", b"Points_2"])?,
    ])
}

pub fn is_called(name: &[u8], wanted: &[u8]) -> bool {
    plain(name).eq_ignore_ascii_case(wanted)
}

/// Removes quotes and a unit in brackets from a name.
pub fn plain(name: &[u8]) -> &[u8] {
    let end = name.iter().position(|byte| b"([".contains(byte)).filter(|&at| at > 0);
    let name = name[..end.unwrap_or(name.len())].trim_ascii();
    let name = name.strip_prefix(b"\"").unwrap_or(name);
    name.strip_suffix(b"\"").unwrap_or(name)
}

/// Parses a coordinate. Common words for a missing value are NaN.
pub fn coordinate(word: &[u8]) -> Option<f64> {
    let quoted = word.strip_prefix(b"\"").and_then(|word| word.strip_suffix(b"\""));
    let word = quoted.unwrap_or(word);
    const NONE: [&[u8]; 7] = [b"", b"null", b"none", b"na", b"n/a", b"nan(ind)", b"nan(snan)"];
    let none = |word: &[u8]| {
        let word = word.strip_prefix(b"-").unwrap_or(word);
        // Microsoft's C library prints non-finite numbers like 1.#QNAN and 1.#INF00.
        word.starts_with(b"1.#") || NONE.iter().any(|none| word.eq_ignore_ascii_case(none))
    };
    number(word).or_else(|| none(word).then_some(f64::NAN))
}

/// Parses the next of the `words` of a line. Errors name it `what`.
pub fn next<'a, T>(
    lines: &Lines,
    words: &mut impl Iterator<Item = &'a [u8]>,
    what: &str,
    parse: impl Fn(&[u8]) -> Option<T>,
) -> Result<T, Error> {
    let word = words.next().ok_or_else(|| lines.error(what, "end of line"))?;
    parse(word).ok_or_else(|| lines.error(what, quoted(word)))
}

/// Parses the next `N` of the `words` of a line as coordinates. Errors name them `what`.
pub fn coordinates<'a, const N: usize>(
    lines: &Lines,
    words: &mut impl Iterator<Item = &'a [u8]>,
    what: &str,
) -> Result<[f64; N], Error> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = next(lines, words, what, coordinate)?;
    }
    Ok(values)
}
