//! The columns of points: which of them are x, y and z, and how a coordinate is written.

use super::lines::{Lines, number, quoted};
use super::scalar::Scalar;
use crate::error::Error;

/// Where `x`, `y` and `z` are among names of columns, in either case, quoted or not, with a unit in brackets or not.
///
/// # Errors
/// The first of them that is not there.
pub fn axes<'a>(names: impl Iterator<Item = &'a [u8]> + Clone) -> Result<[usize; 3], &'static str> {
    let find = |axis: &'static str| {
        names.clone().position(|name| is_called(name, axis.as_bytes())).ok_or(axis)
    };
    Ok([find("x")?, find("y")?, find("z")?])
}

/// Whether a column is called `wanted`, as [`axes`] compares names.
pub fn is_called(name: &[u8], wanted: &[u8]) -> bool {
    plain(name).eq_ignore_ascii_case(wanted)
}

/// A name without quotes and without the unit behind it.
pub fn plain(name: &[u8]) -> &[u8] {
    let end = name.iter().position(|byte| b"([".contains(byte)).filter(|&at| at > 0);
    let name = name[..end.unwrap_or(name.len())].trim_ascii();
    let name = name.strip_prefix(b"\"").unwrap_or(name);
    name.strip_suffix(b"\"").unwrap_or(name)
}

/// The coordinate written as `word`: NaN where programs write that there is none.
pub fn coordinate(word: &[u8]) -> Option<f64> {
    const NONE: [&[u8]; 7] = [b"", b"null", b"none", b"na", b"n/a", b"nan(ind)", b"nan(snan)"];
    let none = |word: &[u8]| {
        let word = word.strip_prefix(b"-").unwrap_or(word);
        // As C of Microsoft prints what is not finite: 1.#QNAN, 1.#INF00.
        word.starts_with(b"1.#") || NONE.iter().any(|none| word.eq_ignore_ascii_case(none))
    };
    number(word).or_else(|| none(word).then_some(f64::NAN))
}

/// The coordinates in the next `N` of the `words` of a line, which are called `what`.
///
/// # Errors
/// When there are fewer words, or one is no number.
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

/// A number in a row of bytes: where it begins, and how it is stored.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    pub at: usize,
    pub scalar: Scalar,
}

impl Field {
    /// The number.
    ///
    /// # Panics
    /// When the row is too short.
    pub fn of(self, row: &[u8], big: bool) -> f64 {
        self.scalar.read(&row[self.at..self.at + self.scalar.size()], big)
    }
}
