//! NumPy arrays: positions, and descriptors.
//!
//! A reader of our own rather than a crate: the arrays we take are of few types, and a header that
//! declares 2^62 rows must be an error on one line, not an overflow.

use std::path::Path;

use unlift::descriptors::Values;

use crate::error::Error;
use crate::read::bytes::Bytes;
use crate::read::lines::{number, quoted};
use crate::read::scalar::Scalar;

/// How every array begins.
pub(crate) const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// Reads positions `(n, 3)` from an `.npy` file of 4- or 8-byte floats, in either byte and memory order.
///
/// # Errors
/// When the file cannot be read, is malformed, holds another type or shape, or a value that is not
/// finite.
pub fn positions(path: &Path) -> Result<Vec<[f64; 3]>, Error> {
    let (mut bytes, header) = Header::open(path)?;
    let (scalar, big) = match header.scalar() {
        Some(stored @ (Scalar::F32 | Scalar::F64, _)) => stored,
        _ => return Err(header.wrong_type(&bytes, "floats of 4 or 8 bytes (f4, f8)")),
    };
    let fortran = header.fortran(&bytes)?;
    let Some([n, 3]) = header.sides() else {
        return Err(bytes.error("an array of shape (n, 3)", header.shape_text()));
    };
    let array = Array { scalar, big, fortran, rows: n, columns: 3 };
    array.check(&bytes)?;
    let mut positions = vec![[0.0; 3]; n as usize];
    array.read(&mut bytes, |bytes, row, column, value| {
        if !value.is_finite() {
            let expected = format!("a finite coordinate of point {row}");
            return Err(bytes.error(expected, value.to_string()));
        }
        positions[row][column] = value;
        Ok(())
    })?;
    Ok(positions)
}

/// Reads descriptors `(n, dim)` from an `.npy` file of bytes or of 2-, 4- or 8-byte floats, in either
/// byte and memory order: their values, row-major, and `dim`. Floats of 8 bytes are rounded to 4.
///
/// # Errors
/// When the file cannot be read, is malformed, holds another type, does not have `n` rows, or has a
/// value that is not finite as a float of 4 bytes.
pub fn descriptors(path: &Path, n: usize) -> Result<(Values, usize), Error> {
    let (mut bytes, header) = Header::open(path)?;
    let Some((scalar, big)) = header.scalar() else {
        let expected = "bytes, or floats of 2, 4 or 8 bytes (u1, f2, f4, f8)";
        return Err(header.wrong_type(&bytes, expected));
    };
    let fortran = header.fortran(&bytes)?;
    let (rows, columns) = match header.sides() {
        Some([rows, columns]) if rows == n as u64 && columns > 0 => (rows, columns),
        sides => {
            let expected = format!("an array of shape ({n}, dimension), a row per point");
            let found = match sides {
                Some([_, columns]) if columns == n as u64 => {
                    format!("{}, rows and columns exchanged", header.shape_text())
                }
                _ => header.shape_text(),
            };
            return Err(bytes.error(expected, found));
        }
    };
    let array = Array { scalar, big, fortran, rows, columns };
    array.check(&bytes)?;
    let dim = columns as usize;
    if scalar == Scalar::U8 {
        let mut values = vec![0; n * dim];
        array.read(&mut bytes, |_, row, column, value| {
            values[row * dim + column] = value as u8;
            Ok(())
        })?;
        return Ok((Values::U8(values), dim));
    }
    let mut values = vec![0.0; n * dim];
    array.read(&mut bytes, |bytes, row, column, value| {
        let single = value as f32;
        if !single.is_finite() {
            let expected = format!("a finite value (as a float of 4 bytes) in row {row}");
            return Err(bytes.error(expected, format!("{value:e}")));
        }
        values[row * dim + column] = single;
        Ok(())
    })?;
    Ok((Values::F32(values), dim))
}

/// A matrix whose values come next in the file.
struct Array {
    scalar: Scalar,
    big: bool,
    fortran: bool,
    rows: u64,
    columns: u64,
}

impl Array {
    /// # Errors
    /// When the rest of the file is not what the header promises.
    fn check(&self, bytes: &Bytes) -> Result<(), Error> {
        let Self { rows, columns, .. } = self;
        let row = columns.checked_mul(self.scalar.size() as u64);
        if row.and_then(|row| rows.checked_mul(row)) == Some(bytes.remaining()) {
            return Ok(());
        }
        let row = row.map_or("too many".to_owned(), |row| row.to_string());
        let expected = format!("{rows} rows of {row} bytes");
        Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())))
    }

    /// Calls `each` with row, column and value of every number, in the order of the file.
    fn read(
        &self,
        bytes: &mut Bytes,
        mut each: impl FnMut(&Bytes, usize, usize, f64) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (rows, columns) = (self.rows as usize, self.columns as usize);
        let (outer, inner) = if self.fortran { (columns, rows) } else { (rows, columns) };
        let mut buffer = [0; 8];
        let buffer = &mut buffer[..self.scalar.size()];
        for o in 0..outer {
            for i in 0..inner {
                bytes.fill(buffer, "values")?;
                if self.big {
                    buffer.reverse();
                }
                let (row, column) = if self.fortran { (i, o) } else { (o, i) };
                each(bytes, row, column, self.scalar.read(buffer))?;
            }
        }
        Ok(())
    }
}

/// The header of an array: a Python dictionary of three known keys.
struct Header(Vec<u8>);

impl Header {
    /// Opens `path` and reads up to the first value.
    fn open(path: &Path) -> Result<(Bytes, Self), Error> {
        let mut bytes = Bytes::open(path)?;
        let mut magic = [0; 8];
        bytes.fill(&mut magic, "magic and version")?;
        if &magic[..6] != MAGIC {
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
        Ok((bytes, Self(header)))
    }

    /// The text of a value.
    fn value(&self, key: &str) -> Option<&str> {
        let header = std::str::from_utf8(&self.0).ok()?;
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

    fn type_text(&self) -> &str {
        self.value("descr").unwrap_or_default().trim_matches(['\'', '"'])
    }

    /// How a value is stored, and whether its first byte is the most significant one.
    fn scalar(&self) -> Option<(Scalar, bool)> {
        Some(match self.type_text() {
            "|u1" | "u1" => (Scalar::U8, false),
            "<f2" => (Scalar::F16, false),
            "<f4" => (Scalar::F32, false),
            "<f8" => (Scalar::F64, false),
            ">f2" => (Scalar::F16, true),
            ">f4" => (Scalar::F32, true),
            ">f8" => (Scalar::F64, true),
            _ => return None,
        })
    }

    fn wrong_type(&self, bytes: &Bytes, expected: &str) -> Error {
        bytes.error(expected, quoted(self.type_text().as_bytes()))
    }

    /// Whether columns, not rows, are contiguous.
    fn fortran(&self, bytes: &Bytes) -> Result<bool, Error> {
        match self.value("fortran_order") {
            Some("True") => Ok(true),
            Some("False") => Ok(false),
            other => {
                let found = quoted(other.unwrap_or_default().as_bytes());
                Err(bytes.error("fortran_order True or False", found))
            }
        }
    }

    fn shape_text(&self) -> String {
        quoted(self.value("shape").unwrap_or_default().as_bytes())
    }

    /// Rows and columns of an array of two dimensions.
    fn sides(&self) -> Option<[u64; 2]> {
        let inner = self.value("shape")?.strip_prefix('(')?.strip_suffix(')')?;
        let mut parts = inner.split(',').map(str::trim);
        let sides = [number(parts.next()?.as_bytes())?, number(parts.next()?.as_bytes())?];
        parts.all(str::is_empty).then_some(sides)
    }
}
