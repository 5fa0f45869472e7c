//! Columns and coordinates of points.

use super::lines::{Lines, number, quoted};
use super::scalar::Scalar;
use crate::error::Error;

/// Finds the columns `x`, `y` and `z` among names, or returns the first missing one. Case, quotes
/// and a unit in brackets are ignored.
pub fn axes<'a>(names: impl Iterator<Item = &'a [u8]> + Clone) -> Result<[usize; 3], &'static str> {
    let find = |axis: &'static str| {
        names.clone().position(|name| is_called(name, axis.as_bytes())).ok_or(axis)
    };
    Ok([find("x")?, find("y")?, find("z")?])
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
    const NONE: [&[u8]; 7] = [b"", b"null", b"none", b"na", b"n/a", b"nan(ind)", b"nan(snan)"];
    let none = |word: &[u8]| {
        let word = word.strip_prefix(b"-").unwrap_or(word);
        // Microsoft's C library prints non-finite numbers like 1.#QNAN and 1.#INF00.
        word.starts_with(b"1.#") || NONE.iter().any(|none| word.eq_ignore_ascii_case(none))
    };
    number(word).or_else(|| none(word).then_some(f64::NAN))
}

/// Parses the next `N` of the `words` of a line as coordinates. Errors name them `what`.
pub fn coordinates<'a, const N: usize>(
    lines: &Lines,
    words: &mut impl Iterator<Item = &'a [u8]>,
    what: &str,
) -> Result<[f64; N], Error> {
    let mut values = [0.0; N];
    for value in &mut values {
        let word = words.next().ok_or_else(|| lines.error(what, "end of line"))?;
        *value = coordinate(word).ok_or_else(|| lines.error(what, quoted(word)))?;
    }
    Ok(values)
}

/// A number in a row of bytes: its offset and type.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    pub at: usize,
    pub scalar: Scalar,
}

impl Field {
    pub fn of(self, row: &[u8], big: bool) -> f64 {
        self.scalar.read(&row[self.at..self.at + self.scalar.size()], big)
    }
}
