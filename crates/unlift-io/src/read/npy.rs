//! Reads positions and descriptors from NumPy arrays.
//!
//! Our own reader: few types are needed, and a header that declares 2^62 rows must be an error.

use std::path::Path;

use unlift::descriptors::Values;

use super::bytes::{Bytes, Field, Scalar};
use super::lines::{axes, number, quoted};
use crate::error::Error;
use crate::read::map_input::Input;

pub(crate) const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// The maximum number of columns of points. Wider arrays are descriptors.
const MOST_COLUMNS: u64 = 16;
/// Names of arrays, or of fields of three values, that contain all coordinates.
pub(super) const PLACES: [&str; 7] =
    ["xyz", "position", "positions", "points", "points3d", "coordinates", "pts"];
/// The least number of points at which a column of row numbers is an error. Fewer may match by
/// accident.
const TELLING: usize = 10;

/// Reads positions from an `.npy` file, in either byte and memory order.
///
/// The array has the shape `(n, 3)`, or more columns of which the first three are x, y and z, or
/// fields of these names. A first column of row numbers is an error.
pub fn positions(path: &Path) -> Result<Input, Error> {
    of_points(&mut Bytes::open(path)?, "npy")
}

pub(super) fn of_points(bytes: &mut Bytes, format: &'static str) -> Result<Input, Error> {
    let header = Header::read(bytes)?;
    let mut found = Input { format, ..Input::default() };
    let (rows, layout) = match header.points() {
        Some(points) => points,
        None if header.is_structured() => {
            return Err(
                bytes.error("fields of numbers called x, y and z", quoted(header.type_text()))
            );
        }
        None if header.scalar().is_none() => {
            return Err(header.wrong_type(bytes, "numbers, or fields called x, y and z"));
        }
        None => return Err(bytes.error("an array of shape (n, 3)", header.shape_text())),
    };
    let (columns, fortran) = match layout {
        Layout::Rows { fields, size } => {
            check_size(bytes, rows, Some(size))?;
            let mut row = vec![0; size as usize];
            for _ in 0..rows {
                bytes.fill(&mut row, "values")?;
                found.positions.push(fields.map(|(field, big)| field.of(&row, big)));
            }
            return Ok(found);
        }
        Layout::Matrix { columns } => (columns, header.fortran(bytes)?),
    };
    let Some((scalar, big)) = header.scalar() else { return Ok(found) };
    let array = Array { scalar, big, fortran, rows, columns };
    array.check(bytes)?;
    found.positions = vec![[0.0; 3]; rows as usize];
    array.read(bytes, |_, row, column, value| {
        if column < 3 {
            found.positions[row][column] = value;
        }
        Ok(())
    })?;
    if columns > 3 {
        let firsts = || found.positions.iter().map(|position| position[0]).enumerate();
        let is_numbered = |from: usize| firsts().all(|(row, x)| x == (row + from) as f64);
        if found.positions.len() >= TELLING && (is_numbered(0) || is_numbered(1)) {
            let expected = "x, y and z in the first columns";
            return Err(bytes.error(expected, "the row number"));
        }
        found.notes.push(format!("the first 3 of {columns} columns are read as x, y and z"));
    }
    Ok(found)
}

pub(super) enum Layout {
    Matrix {
        columns: u64,
    },
    /// Records of `size` bytes: the field of each coordinate, and true if it is big-endian.
    Rows {
        fields: [(Field, bool); 3],
        size: u64,
    },
}

/// Parses a type: how a value is stored, and true if it is big-endian.
fn stored(text: &str) -> Option<(Scalar, bool)> {
    let (big, text) = (text.starts_with('>'), text.trim_start_matches(['<', '>', '|', '=']));
    let kind = *text.as_bytes().first()?;
    Some((
        Scalar::of_kind(kind, number(&text.as_bytes()[1..])?).filter(|_| b"fiu".contains(&kind))?,
        big,
    ))
}

/// The size in bytes of a value of a type.
fn size_of(text: &str) -> Option<u64> {
    let text = text.trim_start_matches(['<', '>', '|', '=']);
    let digits = text.get(1..)?.split('[').next()?;
    let n: u64 = number(digits.as_bytes())?;
    // Text has four bytes per letter.
    n.checked_mul(if text.starts_with('U') { 4 } else { 1 })
}

/// Reads descriptors `(n, dim)` from an `.npy` file of bytes or of floats of 2, 4 or 8 bytes, in
/// either byte and memory order.
///
/// Returns the row-major values and `dim`. Floats of 8 bytes are rounded to 4. The number of rows
/// must be one of `counts`.
pub fn descriptors(path: &Path, counts: [usize; 2]) -> Result<(Values, usize), Error> {
    let mut bytes = Bytes::open(path)?;
    let header = Header::read(&mut bytes)?;
    let known = [Scalar::U8, Scalar::F16, Scalar::F32, Scalar::F64];
    let Some((scalar, big)) = header.scalar().filter(|(scalar, _)| known.contains(scalar)) else {
        let expected = "bytes, or floats of 2, 4 or 8 bytes (u1, f2, f4, f8)";
        return Err(header.wrong_type(&bytes, expected));
    };
    let fortran = header.fortran(&bytes)?;
    let (rows, columns) = match header.sides() {
        Some([rows, columns]) if counts.contains(&(rows as usize)) && columns > 0 => {
            (rows, columns)
        }
        sides => {
            let n = counts[0];
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
    let (n, dim) = (rows as usize, columns as usize);
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
    fn check(&self, bytes: &Bytes) -> Result<(), Error> {
        check_size(bytes, self.rows, self.columns.checked_mul(self.scalar.size() as u64))
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
                let (row, column) = if self.fortran { (i, o) } else { (o, i) };
                each(bytes, row, column, self.scalar.read(buffer, self.big))?;
            }
        }
        Ok(())
    }
}

fn check_size(bytes: &Bytes, rows: u64, row: Option<u64>) -> Result<(), Error> {
    if row.and_then(|row| rows.checked_mul(row)) == Some(bytes.remaining()) {
        return Ok(());
    }
    let row = row.map_or("too many".to_owned(), |row| row.to_string());
    let expected = format!("{rows} rows of {row} bytes");
    Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())))
}

/// The header of an array: a Python dictionary with three keys.
pub(super) struct Header(Vec<u8>);

impl Header {
    pub(super) fn read(bytes: &mut Bytes) -> Result<Self, Error> {
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
        Ok(Self(header))
    }

    fn value(&self, key: &str) -> Option<&str> {
        let header = std::str::from_utf8(&self.0).ok()?;
        let at = [format!("'{key}'"), format!("\"{key}\"")]
            .iter()
            .find_map(|key| header.find(key).map(|at| at + key.len()))?;
        let text = header[at..].trim_start().strip_prefix(':')?.trim_start();
        // A tuple or a list ends with its bracket, other values with a comma or the end of the
        // dictionary.
        let end = match text.as_bytes().first()? {
            b'(' => text.find(')')? + 1,
            b'[' => text.find(']')? + 1,
            _ => text.find([',', '}'])?,
        };
        Some(text[..end].trim())
    }

    fn type_text(&self) -> &[u8] {
        self.value("descr").unwrap_or_default().trim_matches(['\'', '"']).as_bytes()
    }

    fn scalar(&self) -> Option<(Scalar, bool)> {
        stored(std::str::from_utf8(self.type_text()).ok()?)
    }

    fn is_structured(&self) -> bool {
        self.type_text().starts_with(b"[")
    }

    /// Returns the number of points and the places of their coordinates, if the array can be
    /// points.
    pub(super) fn points(&self) -> Option<(u64, Layout)> {
        if !self.is_structured() {
            let [rows, columns] = self.sides().filter(|_| self.scalar().is_some())?;
            let is_usual = (3..=MOST_COLUMNS).contains(&columns);
            return is_usual.then_some((rows, Layout::Matrix { columns }));
        }
        let rows = self.value("shape")?.strip_prefix('(')?.split([',', ')']).next()?;
        let (mut names, mut fields, mut size) = (Vec::new(), Vec::new(), 0u64);
        let mut places = None;
        // Examples: ('x', '<f4'), ('xyz', '<f4', (3,))
        for entry in self.value("descr")?.split("('").skip(1) {
            let mut parts = entry.split(['\'', ',', '(', ')', ' ']).filter(|part| !part.is_empty());
            let (name, kind) = match entry.starts_with('\'') {
                // Padding between fields has no name.
                true => ("", parts.next()?),
                false => (parts.next()?, parts.next()?),
            };
            let n = parts
                .map_while(|part| number::<u64>(part.as_bytes()))
                .try_fold(1u64, u64::checked_mul);
            let (n, each, at) = (n?, size_of(kind)?, usize::try_from(size).ok()?);
            size = size.checked_add(n.checked_mul(each)?)?;
            let Some((scalar, big)) = stored(kind) else { continue };
            let field = |at| (Field { at, scalar }, big);
            if n == 3 && PLACES.iter().any(|known| name.eq_ignore_ascii_case(known)) {
                places = Some(std::array::from_fn(|axis| field(at + axis * scalar.size())));
            } else if n == 1 {
                names.push(name.as_bytes());
                fields.push(field(at));
            }
        }
        let by_name = || axes(names.iter().copied()).ok().map(|at| at.map(|at| fields[at]));
        Some((
            number(rows.trim().as_bytes())?,
            Layout::Rows { fields: places.or_else(by_name)?, size },
        ))
    }

    fn wrong_type(&self, bytes: &Bytes, expected: &str) -> Error {
        bytes.error(expected, quoted(self.type_text()))
    }

    /// Returns true if columns are contiguous, false if rows are.
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

    fn sides(&self) -> Option<[u64; 2]> {
        let inner = self.value("shape")?.strip_prefix('(')?.strip_suffix(')')?;
        let mut parts = inner.split(',').map(str::trim);
        let sides = [number(parts.next()?.as_bytes())?, number(parts.next()?.as_bytes())?];
        parts.all(str::is_empty).then_some(sides)
    }
}
