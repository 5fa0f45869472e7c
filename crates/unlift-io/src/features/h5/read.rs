//! Reading HDF5: the one place that names the library which does it.

use std::path::{Path, PathBuf};

use half::f16;
use hdf5_pure::{AttrValue, DType, Datatype, DatatypeByteOrder, File, Group};

use super::{Array, Numbers, shape_text};
use crate::error::Error;
use crate::read::lines::quoted;

/// Values of one array at most: a header can claim any size in a few bytes.
const MOST_VALUES: u64 = 1 << 28;
/// Groups of a file at most, and how deep they nest: links may lead in circles.
const MOST_GROUPS: usize = 1 << 24;
const DEEPEST: usize = 64;

/// An open HDF5 file: groups that hold arrays, and the arrays. Reads one array at a time.
pub(crate) struct FeatureStore {
    path: PathBuf,
    file: File,
}

impl FeatureStore {
    /// Opens `path`.
    ///
    /// # Errors
    /// When it cannot be read, is no HDF5 file, or is cut off.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open_streaming(path).map_err(|error| match error {
            hdf5_pure::Error::Io(source) => Error::read(path, source),
            other => Error::new(path, "", "a whole HDF5 file", other.to_string()),
        })?;
        let (whole, len) = (file.superblock().eof_address, file.file_size());
        if whole > len {
            let expected = format!("a whole HDF5 file of {whole} bytes");
            return Err(Error::new(path, "", expected, format!("{len} bytes")));
        }
        Ok(Self { path: path.to_owned(), file })
    }

    /// Paths of all groups that hold arrays directly, sorted by their bytes.
    pub fn groups(&self) -> Result<Vec<String>, Error> {
        let mut found = Vec::new();
        let mut waiting = vec![(String::new(), self.file.root(), 0)];
        let mut seen = 0;
        while let Some((path, group, depth)) = waiting.pop() {
            seen += 1;
            if depth > DEEPEST || seen > MOST_GROUPS {
                let place = format!("group {}", quoted(path.as_bytes()));
                let expected = format!("groups nested at most {DEEPEST} deep");
                return Err(Error::new(&self.path, place, expected, "deeper ones, or a circle"));
            }
            let refuse = |error| self.refuse(&path, "", error);
            if !path.is_empty() && !group.datasets().map_err(refuse)?.is_empty() {
                found.push(path.clone());
            }
            for name in group.groups().map_err(refuse)? {
                let inside = group.group(&name).map_err(refuse)?;
                let path = if path.is_empty() { name } else { format!("{path}/{name}") };
                waiting.push((path, inside, depth + 1));
            }
        }
        found.sort_unstable();
        Ok(found)
    }

    fn group(&self, path: &str) -> Result<Group, Error> {
        self.file.group(path).map_err(|error| self.refuse(path, "", error))
    }

    /// Names of the arrays of the group `path`, sorted.
    pub fn names(&self, path: &str) -> Result<Vec<String>, Error> {
        let names = self.group(path)?.datasets();
        let mut names = names.map_err(|error| self.refuse(path, "", error))?;
        names.sort_unstable();
        Ok(names)
    }

    /// The array `name` of the group `path`: floats of 16, 32 or 64 bits, or integers.
    ///
    /// # Errors
    /// When it is cut off, not an array of numbers, or larger than 2^28 values.
    pub fn array(&self, path: &str, name: &str) -> Result<Array, Error> {
        let refuse = |error| self.refuse(path, name, error);
        let dataset = self.group(path)?.dataset(name).map_err(refuse)?;
        let shape = dataset.shape().map_err(refuse)?;
        let values = shape.iter().try_fold(1u64, |n, &side| n.checked_mul(side));
        let Some(count) = values.filter(|&n| n <= MOST_VALUES) else {
            let expected = format!("at most {MOST_VALUES} values");
            return Err(self.error(path, name, expected, shape_text(&shape)));
        };
        let datatype = dataset.datatype().map_err(refuse)?;
        let values = match dataset.dtype().map_err(refuse)? {
            // Nothing is stored, so there is nothing to read.
            DType::U8 if count == 0 => Numbers::U8(Vec::new()),
            _ if count == 0 => Numbers::F32(Vec::new()),
            DType::F32 => Numbers::F32(dataset.read_f32().map_err(refuse)?),
            DType::F64 => Numbers::F64(dataset.read_f64().map_err(refuse)?),
            DType::U8 => Numbers::U8(dataset.read_u8().map_err(refuse)?),
            DType::I8 | DType::I16 | DType::I32 | DType::I64 => {
                Numbers::I64(dataset.read_i64().map_err(refuse)?)
            }
            DType::U16 | DType::U32 | DType::U64 => {
                Numbers::I64(dataset.read_i64().map_err(refuse)?)
            }
            _ => match half_order(&datatype) {
                Some(from_bytes) => {
                    let bytes = dataset.read_raw().map_err(refuse)?;
                    let halves = bytes.as_chunks::<2>().0.iter();
                    Numbers::F16(halves.map(|&half| from_bytes(half)).collect())
                }
                None => {
                    let expected = "floats of 16, 32 or 64 bits, or integers";
                    return Err(self.error(path, name, expected, "another type"));
                }
            },
        };
        if values.len() as u64 != count {
            let found = format!("{} values", values.len());
            return Err(self.error(path, name, format!("{count} values"), found));
        }
        Ok(Array { shape, values })
    }

    /// The attribute `key` of that array, if it is a number.
    pub fn number(&self, path: &str, name: &str, key: &str) -> Result<Option<f64>, Error> {
        let refuse = |error| self.refuse(path, name, error);
        let dataset = self.group(path)?.dataset(name).map_err(refuse)?;
        let attributes = dataset.attrs().map_err(refuse)?;
        Ok(attributes.get(key).and_then(AttrValue::as_f64))
    }

    fn refuse(&self, path: &str, name: &str, error: hdf5_pure::Error) -> Error {
        self.error(path, name, "readable HDF5", error.to_string())
    }

    /// An error about the image `path` and its array `name` (empty: the image as a whole).
    pub fn error(
        &self,
        path: &str,
        name: &str,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Error {
        let place = match (path, name) {
            ("", _) => String::new(),
            (_, "") => format!("image {}", quoted(path.as_bytes())),
            _ => format!("image {}, {name}", quoted(path.as_bytes())),
        };
        Error::new(&self.path, place, expected, found)
    }
}

/// How to read two bytes of `datatype` if it is IEEE's float of 16 bits.
fn half_order(datatype: &Datatype) -> Option<fn([u8; 2]) -> f16> {
    let Datatype::FloatingPoint { size: 2, byte_order, layout } = datatype else { return None };
    let bits = (layout.exponent_location, layout.exponent_size, layout.mantissa_size);
    if bits != (10, 5, 10) || layout.exponent_bias != 15 {
        return None;
    }
    match byte_order {
        DatatypeByteOrder::LittleEndian => Some(f16::from_le_bytes),
        DatatypeByteOrder::BigEndian => Some(f16::from_be_bytes),
        _ => None,
    }
}
