//! Reads descriptors of the points of a map.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;

use crate::error::Error;
use crate::input;
use crate::read::bytes::Bytes;
use crate::read::lines::quoted;
use crate::read::map_input::Input;
use crate::read::scalar::Scalar;
use crate::read::{database, npy};

const MAGIC: &[u8; 8] = b"P3DESC01";
const SQLITE: &[u8; 8] = b"SQLite f";
const HDF5: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

/// Reads the descriptors of the points of `input`, one row each in the same order.
///
/// `path` is one of
///
/// - a file of the format `P3DESC01` (joined by point id), with bytes or floats;
/// - an `.npy` array `(n, dim)` with a row per point: by ascending point id for a COLMAP model,
///   else in the order of the file;
/// - a COLMAP `database.db`, or hloc's `features.h5`: a row is the mean of the descriptors in the
///   point's track, with images joined by name. Bytes are scaled to L2 norm 512, rounded and
///   clipped to 0..=255; floats are scaled to norm 1.
///
/// # Errors
/// When the file cannot be read, is malformed or of another format, lacks a point or an observation
/// (the error names the first), or contains placeholders (all zero, or every row the same).
pub fn descriptors(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let mut magic = [0; 8];
    let (mut file, len) = input::open(path)?;
    if len >= 8 {
        File::read_exact(&mut file, &mut magic).map_err(|e| Error::read(path, e))?;
    }
    match &magic {
        MAGIC => binary(path, input),
        SQLITE => database::of_database(path, input),
        HDF5 => database::of_features(path, input),
        _ if magic.starts_with(npy::MAGIC) => {
            // Rows either exclude or include points without finite coordinates.
            let (values, dim) = npy::descriptors(path, [input.ids.len(), input.n_rows()])?;
            let all = Descriptors::try_new(values, dim).map_err(|e| Error::core(path, e))?;
            if all.len() == input.ids.len() {
                return Ok(all);
            }
            let left_out = |row: &u32| input.left_out.binary_search(&u64::from(*row)).is_err();
            Ok(all.select(&(0..all.len() as u32).filter(left_out).collect::<Vec<_>>()))
        }
        _ => {
            let expected = "a file that begins with P3DESC01, a NumPy array (.npy), a COLMAP database (SQLite) or hloc's features (HDF5)";
            let found = match len {
                0 => "an empty file".to_owned(),
                1..8 => format!("a file of {len} bytes"),
                _ => quoted(&magic),
            };
            Err(Error::new(path, "", expected, found))
        }
    }
}

fn binary(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let mut bytes = Bytes::open(path)?;
    bytes.skip(8, "magic")?;
    let n = bytes.count("descriptors", 8)?;
    let dim = bytes.u32("dimension")?;
    let scalar = match bytes.u32("type")? {
        1 => Scalar::U8,
        2 => Scalar::F16,
        3 => Scalar::F32,
        other => {
            let expected = "type 1 (u8), 2 (float16) or 3 (float32)";
            return Err(bytes.error(expected, other.to_string()));
        }
    };
    let row_bytes = u64::from(dim) * scalar.size() as u64;
    if dim == 0 || n.checked_mul(8 + row_bytes) != Some(bytes.remaining()) {
        let expected = format!("{n} ids and rows of {row_bytes} bytes");
        return Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())));
    }
    let mut row_of_id = HashMap::with_capacity(n as usize);
    for row in 0..n {
        bytes.record(row + 1);
        let id = bytes.u64("point id")?;
        if row_of_id.insert(id, row as usize).is_some() {
            return Err(bytes.error("each id once", format!("id {id} again")));
        }
    }
    let (dim, row_bytes) = (dim as usize, row_bytes as usize);
    let mut all = vec![0; n as usize * row_bytes];
    bytes.fill(&mut all, "values")?;
    let row = |id: &u64| match row_of_id.get(id) {
        Some(&row) => Ok(&all[row * row_bytes..(row + 1) * row_bytes]),
        None => {
            let found = format!("none among {n}");
            Err(Error::new(path, format!("point {id}"), "a descriptor", found))
        }
    };
    // With more points than rows, the loop ends with an error, so the file limits the memory.
    let n_values = input.ids.len().min(n as usize) * dim;
    let values = if scalar == Scalar::U8 {
        let mut values = Vec::with_capacity(n_values);
        for id in &input.ids {
            values.extend_from_slice(row(id)?);
        }
        Values::U8(values)
    } else {
        let mut values = Vec::with_capacity(n_values);
        for id in &input.ids {
            for (at, stored) in row(id)?.chunks_exact(scalar.size()).enumerate() {
                let value = scalar.read(stored, false);
                if !value.is_finite() {
                    let place = format!("point {id}, value {at}");
                    return Err(Error::new(path, place, "a finite value", value.to_string()));
                }
                values.push(value as f32);
            }
        }
        Values::F32(values)
    };
    Descriptors::try_new(values, dim).map_err(|e| Error::core(path, e))
}
