//! Reads positions and descriptors from NumPy arrays and archives of them.
//!
//! Our own reader: few types are needed, and a header that declares 2^62 rows must be an error.

use std::io::Read;
use std::path::Path;

use unlift::descriptors::Values;

use super::archive::Archive;
use super::bytes::{Bytes, Field, Scalar};
use super::lines::{TELLING, axes, number, quoted};
use crate::error::Error;
use crate::read::map_input::Input;
use crate::stage;

pub(crate) const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// The maximum number of columns of points. Wider arrays are descriptors.
const MOST_COLUMNS: u64 = 16;
/// Names of arrays, or of fields of three values, that contain all coordinates.
const PLACES: [&str; 7] =
    ["xyz", "position", "positions", "points", "points3d", "coordinates", "pts"];

/// Reads positions from an `.npy` file, in either byte and memory order.
///
/// The array has the shape `(n, 3)`, or more columns of which the first three are x, y and z, or
/// fields of these names. A first column of row numbers is an error.
pub fn positions(path: &Path) -> Result<Input, Error> {
    of_points(&mut Bytes::open(path)?, "npy")
}

/// Reads positions from the array of points in a NumPy archive. Several or none are an error.
pub fn archived_positions(path: &Path) -> Result<Input, Error> {
    let mut archive = Archive::open(path)?;
    let all = archive.arrays();
    if all.iter().any(|(_, name)| name.rsplit('/').next() == Some("unlift")) {
        let kind = stage::declared_kind(path).map(|kind| kind.to_string());
        let found = kind.unwrap_or_else(|| "a stage file of unlift".to_owned());
        return Err(Error::new(path, "", "points of a map", found));
    }
    let (mut fit, mut has_points) = (Vec::new(), false);
    for (at, name) in &all {
        let header = archive.array(*at, name).and_then(|mut bytes| Header::read(&mut bytes));
        if let Some((_, layout)) = header.ok().and_then(|header| header.points()) {
            fit.push((*at, &**name));
            has_points |= !matches!(layout, Layout::Matrix(4..));
        }
    }
    let has = |start: &str| all.iter().any(|(_, name)| name.starts_with(start));
    // Some programs store position, size and angle of keypoints in one array, beside descriptors.
    let beside_descriptors = has("descriptors") && !has_points;
    if has("keypoints") || has("OPENSFM_FEATURES") || beside_descriptors {
        return Err(Error::new(path, "", "points of a map", "features of an image"));
    }
    let is_known = |name: &str| PLACES.iter().any(|known| name.eq_ignore_ascii_case(known));
    if fit.iter().filter(|(_, name)| is_known(name)).count() == 1 {
        fit.retain(|(_, name)| is_known(name));
    }
    let [(at, name)] = fit[..] else {
        if fit.is_empty() {
            fit = all.iter().map(|(at, name)| (*at, &**name)).collect();
        }
        let names: Vec<String> =
            fit.iter().take(5).map(|(_, name)| quoted(name.as_bytes())).collect();
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let expected = "one array of points, (n, 3), or one that is called points or xyz";
        return Err(Error::new(path, "", expected, found));
    };
    let mut input = of_points(&mut archive.array(at, name)?, "npz")?;
    if all.len() > 1 {
        input.notes.push(format!("read, the array {} of {}", quoted(name.as_bytes()), all.len()));
    }
    Ok(input)
}

fn of_points<R: Read>(bytes: &mut Bytes<R>, format: &'static str) -> Result<Input, Error> {
    let header = Header::read(bytes)?;
    let mut input = Input { format, ..Input::default() };
    let Some((rows, layout)) = header.points() else {
        return Err(match header.scalar() {
            Some(_) => bytes.error("an array of shape (n, 3)", header.shape_text()),
            None => {
                let found = quoted(header.type_text().as_bytes());
                bytes.error("numbers, or fields of numbers called x, y and z", found)
            }
        });
    };
    let columns = match layout {
        Layout::Rows { fields, size } => {
            check_size(bytes, rows, Some(size))?;
            let mut row = vec![0; size as usize];
            for _ in 0..rows {
                bytes.fill(&mut row, "values")?;
                input.positions.push(fields.map(|field| field.of(&row)));
            }
            return Ok(input);
        }
        Layout::Matrix(columns) => columns as usize,
    };
    let Some(numbers) = header.numbers(bytes)? else { return Ok(input) };
    let any = |bytes: &Bytes<R>, _, x| bytes.error("a number", x);
    let values = numbers.read(bytes, Some, any)?;
    input.positions = values.chunks_exact(columns).map(|row| [row[0], row[1], row[2]]).collect();
    if columns > 3 {
        let firsts = || input.positions.iter().map(|position| position[0]).enumerate();
        let is_numbered = |from: usize| firsts().all(|(row, x)| x == (row + from) as f64);
        if input.positions.len() >= TELLING && (is_numbered(0) || is_numbered(1)) {
            return Err(bytes.error("x, y and z in the first columns", "the row number"));
        }
        input.notes.push(format!("the first 3 of {columns} columns are read as x, y and z"));
    }
    Ok(input)
}

enum Layout {
    /// Rows of this number of columns.
    Matrix(u64),
    /// Records of `size` bytes, with the field of each coordinate.
    Rows { fields: [Field; 3], size: u64 },
}

/// Parses a type: how a value is stored, and true if it is big-endian.
fn stored(text: &str) -> Option<(Scalar, bool)> {
    let (big, text) = (text.starts_with('>'), text.trim_start_matches(['<', '>', '|', '=']));
    let (&kind, size) = text.as_bytes().split_first()?;
    let scalar = Scalar::of_kind(kind, number(size)?).filter(|_| b"fiu".contains(&kind))?;
    Some((scalar, big))
}

fn size_of(text: &str) -> Option<u64> {
    let text = text.trim_start_matches(['<', '>', '|', '=']);
    let digits = text.get(1..)?.split('[').next()?;
    let n: u64 = number(digits.as_bytes())?;
    // Text has four bytes per letter.
    n.checked_mul(if text.starts_with('U') { 4 } else { 1 })
}

/// Reads descriptors `(n, dim)` from an `.npy` file of bytes or of floats of 2, 4 or 8 bytes, in either byte and memory order.
///
/// Returns the row-major values and `dim`. Floats of 8 bytes are rounded to 4. The number of rows must be one of `counts`.
pub fn descriptors(path: &Path, counts: [usize; 2]) -> Result<(Values, usize), Error> {
    let mut bytes = Bytes::open(path)?;
    let header = Header::read(&mut bytes)?;
    let known = [Scalar::U8, Scalar::F16, Scalar::F32, Scalar::F64];
    let numbers = header.numbers(&bytes)?.filter(|numbers| known.contains(&numbers.scalar));
    let Some(numbers) = numbers else {
        let expected = "bytes, or floats of 2, 4 or 8 bytes (u1, f2, f4, f8)";
        return Err(bytes.error(expected, quoted(header.type_text().as_bytes())));
    };
    let sides = header.sides();
    let is_right = |[rows, dim]: &[u64; 2]| counts.contains(&(*rows as usize)) && *dim > 0;
    let Some([_, dim]) = sides.filter(is_right) else {
        let n = counts[0];
        let expected = format!("an array of shape ({n}, dimension), a row per point");
        let is_exchanged = sides.is_some_and(|[_, columns]| columns == n as u64);
        let exchanged = if is_exchanged { ", rows and columns exchanged" } else { "" };
        return Err(bytes.error(expected, header.shape_text() + exchanged));
    };
    Ok((numbers.descriptors(&mut bytes)?, dim as usize))
}

/// Numbers whose values come next in the file.
pub(crate) struct Numbers {
    pub scalar: Scalar,
    pub shape: Vec<u64>,
    pub big: bool,
    /// True if columns are contiguous, false if rows are.
    pub fortran: bool,
}

impl Numbers {
    /// Reads all numbers in the order of rows, each converted by `convert`, and checks that nothing
    /// follows. Where `convert` returns `None`, `wrong` makes the error of an index and its value.
    pub fn read<R: Read, T: Copy + Default>(
        &self,
        bytes: &mut Bytes<R>,
        convert: impl Fn(f64) -> Option<T>,
        wrong: impl Fn(&Bytes<R>, usize, f64) -> Error,
    ) -> Result<Vec<T>, Error> {
        const CHUNK: usize = 1 << 13;
        let (rows, rest) = self.shape.split_first().unwrap_or((&1, &[]));
        let size = self.scalar.size;
        let row = rest.iter().try_fold(size as u64, |all, &side| all.checked_mul(side));
        check_size(bytes, *rows, row)?;
        let n = self.shape.iter().product::<u64>() as usize;
        let mut values = bytes.room("values", n as u64)?;
        values.resize(n, T::default());
        let mut buffer = vec![0; size * CHUNK.min(n)];
        for first in (0..n).step_by(CHUNK) {
            let buffer = &mut buffer[..size * CHUNK.min(n - first)];
            bytes.fill(buffer, "values")?;
            for (at, value) in (first..).zip(buffer.chunks_exact(size)) {
                let at = if self.fortran { self.row_major(at) } else { at };
                let value = self.scalar.read(value, self.big);
                values[at] = convert(value).ok_or_else(|| wrong(bytes, at, value))?;
            }
        }
        bytes.end_of_array()?;
        Ok(values)
    }

    /// Reads descriptors: bytes, or finite floats, which are rounded to 4 bytes.
    pub fn descriptors<R: Read>(&self, bytes: &mut Bytes<R>) -> Result<Values, Error> {
        let dim = self.shape[1] as usize;
        let wrong = |bytes: &Bytes<R>, at: usize, value: f64| {
            let expected = format!("a finite value (as a float of 4 bytes) in row {}", at / dim);
            bytes.error(expected, format!("{value:e}"))
        };
        let single = |x: f64| Some(x as f32).filter(|x| x.is_finite());
        Ok(match self.scalar {
            Scalar::U8 => Values::U8(self.read(bytes, |x| Some(x as u8), wrong)?),
            _ => Values::F32(self.read(bytes, single, wrong)?),
        })
    }

    /// Converts an index in the order of columns to one in the order of rows.
    fn row_major(&self, mut at: usize) -> usize {
        let mut stride = self.shape.iter().product::<u64>() as usize;
        let mut index = 0;
        for &side in &self.shape {
            stride /= side as usize;
            index += at % side as usize * stride;
            at /= side as usize;
        }
        index
    }
}

fn check_size<R: Read>(bytes: &Bytes<R>, rows: u64, row: Option<u64>) -> Result<(), Error> {
    if row.and_then(|row| rows.checked_mul(row)) == Some(bytes.remaining()) {
        return Ok(());
    }
    let row = row.map_or("too many".to_owned(), |row| row.to_string());
    let expected = format!("{rows} rows of {row} bytes");
    Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())))
}

/// Formats a shape like NumPy: `(128, 40)` or `(7,)`.
pub(crate) fn tuple<T: ToString>(sides: &[T]) -> String {
    let text: Vec<String> = sides.iter().map(T::to_string).collect();
    format!("({}{})", text.join(", "), if sides.len() == 1 { "," } else { "" })
}

/// The header of an array: a Python dictionary with three keys.
pub(crate) struct Header(String);

impl Header {
    pub fn read<R: Read>(bytes: &mut Bytes<R>) -> Result<Self, Error> {
        let magic: [u8; 8] = bytes.array("magic and version")?;
        if &magic[..6] != MAGIC {
            return Err(bytes.error("a NumPy file", quoted(&magic[..6])));
        }
        let len = match magic[6] {
            1 => bytes.array("header length").map(u16::from_le_bytes)?.into(),
            2 | 3 => bytes.u32("header length")?,
            version => return Err(bytes.error("NumPy format 1, 2 or 3", version)),
        };
        if u64::from(len) > bytes.remaining() {
            let expected = format!("a header of {len} bytes");
            return Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())));
        }
        let mut header = vec![0; len as usize];
        bytes.fill(&mut header, "header")?;
        Ok(Self(String::from_utf8_lossy(&header).into_owned()))
    }

    fn value(&self, key: &str) -> Option<&str> {
        let keys = [format!("'{key}'"), format!("\"{key}\"")];
        let (_, text) = keys.iter().find_map(|key| self.0.split_once(key))?;
        let text = text.trim_start().strip_prefix(':')?.trim_start();
        // A tuple or a list ends with its bracket, other values with a comma or the end of the dictionary.
        let end = match text.as_bytes().first()? {
            b'(' => text.find(')')? + 1,
            b'[' => text.find(']')? + 1,
            _ => text.find([',', '}'])?,
        };
        Some(text[..end].trim())
    }

    pub fn type_text(&self) -> &str {
        self.value("descr").unwrap_or_default().trim_matches(['\'', '"'])
    }

    fn scalar(&self) -> Option<(Scalar, bool)> {
        stored(self.type_text())
    }

    /// Returns true if this is an array of integers.
    pub fn is_whole(&self) -> bool {
        self.scalar().is_some_and(|(scalar, _)| scalar.is_whole())
    }

    /// Returns the number of points and the places of their coordinates, if the array can be points.
    fn points(&self) -> Option<(u64, Layout)> {
        if !self.type_text().starts_with('[') {
            let [rows, columns] = self.sides().filter(|_| self.scalar().is_some())?;
            let is_usual = (3..=MOST_COLUMNS).contains(&columns);
            return is_usual.then_some((rows, Layout::Matrix(columns)));
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
            let field = |at| Field { at, scalar, big };
            if n == 3 && PLACES.iter().any(|known| name.eq_ignore_ascii_case(known)) {
                places = Some(std::array::from_fn(|axis| field(at + axis * scalar.size)));
            } else if n == 1 {
                names.push(name.as_bytes());
                fields.push(field(at));
            }
        }
        let by_name = || axes(names.iter().copied()).map(|at| at.map(|at| fields[at]));
        let fields = places.or_else(by_name)?;
        Some((number(rows.trim().as_bytes())?, Layout::Rows { fields, size }))
    }

    pub fn shape_text(&self) -> String {
        quoted(self.value("shape").unwrap_or_default().as_bytes())
    }

    pub fn shape(&self) -> Option<Vec<u64>> {
        let inner = self.value("shape")?.strip_prefix('(')?.strip_suffix(')')?;
        let sides = inner.split(',').map(str::trim).filter(|side| !side.is_empty());
        sides.map(|side| number(side.as_bytes())).collect()
    }

    fn sides(&self) -> Option<[u64; 2]> {
        self.shape()?.try_into().ok()
    }

    /// Returns how the numbers are stored, or `None` if this is an array of something else.
    pub fn numbers<R: Read>(&self, bytes: &Bytes<R>) -> Result<Option<Numbers>, Error> {
        let Some(((scalar, big), shape)) = self.scalar().zip(self.shape()) else {
            return Ok(None);
        };
        let order = self.value("fortran_order").unwrap_or_default();
        if !["True", "False"].contains(&order) {
            return Err(bytes.error("fortran_order True or False", quoted(order.as_bytes())));
        }
        Ok(Some(Numbers { scalar, shape, big, fortran: order == "True" }))
    }
}
