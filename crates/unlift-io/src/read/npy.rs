//! NumPy arrays of positions.
//!
//! A reader of our own rather than a crate: the arrays we take are of two types, and a header that
//! declares 2^62 rows must be an error on one line, not an overflow.

use std::path::Path;

use crate::error::Error;
use crate::read::bytes::Bytes;
use crate::read::lines::{number, quoted};

/// Reads positions `(n, 3)` from an `.npy` file of 4- or 8-byte floats, in either byte and memory order.
///
/// # Errors
/// When the file cannot be read, is malformed, holds another type or shape, or a value that is not
/// finite.
pub fn read(path: &Path) -> Result<Vec<[f64; 3]>, Error> {
    let mut bytes = Bytes::open(path)?;
    let mut magic = [0; 8];
    bytes.fill(&mut magic, "magic and version")?;
    if &magic[..6] != b"\x93NUMPY" {
        return Err(bytes.error("a NumPy file", quoted(&magic[..6])));
    }
    let len = match magic[6] {
        1 => {
            let mut len = [0; 2];
            bytes.fill(&mut len, "header length")?;
            u32::from(u16::from_le_bytes(len))
        }
        2 | 3 => bytes.u32("header length")?,
        version => return Err(bytes.error("NumPy format 1, 2 or 3", version.to_string())),
    };
    if u64::from(len) > bytes.remaining() {
        let expected = format!("a header of {len} bytes");
        return Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())));
    }
    let mut header = vec![0; len as usize];
    bytes.fill(&mut header, "header")?;

    let descr = value(&header, "descr").unwrap_or_default();
    let descr = descr.trim_matches(['\'', '"']);
    let (size, big) = match descr {
        "<f4" => (4, false),
        "<f8" => (8, false),
        ">f4" => (4, true),
        ">f8" => (8, true),
        _ => return Err(bytes.error("floats of 4 or 8 bytes (f4, f8)", quoted(descr.as_bytes()))),
    };
    let fortran = match value(&header, "fortran_order") {
        Some("True") => true,
        Some("False") => false,
        other => {
            let found = quoted(other.unwrap_or_default().as_bytes());
            return Err(bytes.error("fortran_order True or False", found));
        }
    };
    let shape = value(&header, "shape").unwrap_or_default();
    let n = rows(shape)
        .ok_or_else(|| bytes.error("an array of shape (n, 3)", quoted(shape.as_bytes())))?;
    if n.checked_mul(3 * size) != Some(bytes.remaining()) {
        let expected = format!("{n} rows of {} bytes", 3 * size);
        return Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())));
    }

    let n = n as usize;
    let mut positions = vec![[0.0; 3]; n];
    let mut buffer = [0; 8];
    let buffer = &mut buffer[..size as usize];
    for i in 0..3 * n {
        bytes.fill(buffer, "values")?;
        if big {
            buffer.reverse();
        }
        let value = match *buffer {
            [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            _ => unreachable!("4 or 8 bytes"),
        };
        let (row, column) = if fortran { (i % n, i / n) } else { (i / 3, i % 3) };
        if !value.is_finite() {
            let expected = format!("a finite coordinate of point {row}");
            return Err(bytes.error(expected, value.to_string()));
        }
        positions[row][column] = value;
    }
    Ok(positions)
}

/// The text of a value in the header, a Python dictionary of three known keys.
fn value<'a>(header: &'a [u8], key: &str) -> Option<&'a str> {
    let header = std::str::from_utf8(header).ok()?;
    let at = [format!("'{key}'"), format!("\"{key}\"")]
        .iter()
        .find_map(|key| header.find(key).map(|at| at + key.len()))?;
    let text = header[at..].trim_start().strip_prefix(':')?.trim_start();
    // A tuple ends with its parenthesis, anything else with a comma or the end of the dictionary.
    let end = match text.starts_with('(') {
        true => text.find(')')? + 1,
        false => text.find([',', '}'])?,
    };
    Some(text[..end].trim())
}

/// The `n` of a shape `(n, 3)`.
fn rows(shape: &str) -> Option<u64> {
    let inner = shape.strip_prefix('(')?.strip_suffix(')')?;
    let mut parts = inner.split(',').map(str::trim);
    let n = number(parts.next()?.as_bytes())?;
    let is_3 = parts.next()? == "3";
    (is_3 && parts.all(str::is_empty)).then_some(n)
}
