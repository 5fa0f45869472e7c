//! Descriptors of the points of a map: from our binary form, or from a COLMAP database.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;

use crate::error::Error;
use crate::read::bytes::{Bytes, open_file};
use crate::read::lines::quoted;
use crate::read::{Input, database};

const MAGIC: &[u8; 8] = b"P3DESC01";
const SQLITE: &[u8; 8] = b"SQLite f";

/// The descriptors of the points of `input`, one row each in its order.
///
/// `path` is a file of the form `P3DESC01` (joined by point id), or a COLMAP `database.db`: then a
/// point's row is the mean of the descriptors of its observations, found through the model's tracks,
/// with images joined by name. Bytes are brought to L2 norm 512, rounded and clipped to 0..=255;
/// floats to norm 1.
///
/// # Errors
/// When the file cannot be read, is neither form, is malformed, lacks a point or an observation (the
/// error names the first), or holds dummies (all zero, or every row the same).
pub fn descriptors(path: &Path, input: &Input) -> Result<Descriptors, Error> {
    let mut magic = [0; 8];
    let (mut file, len) = open_file(path)?;
    if len >= 8 {
        File::read_exact(&mut file, &mut magic).map_err(|e| Error::read(path, e))?;
    }
    match &magic {
        MAGIC => binary(path, input),
        SQLITE => database::descriptors(path, input),
        _ => {
            let expected = "a file that begins with P3DESC01, or a COLMAP database (SQLite)";
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
    let dtype = bytes.u32("type")?;
    if dtype != 1 {
        return Err(bytes.error("type 1 (bytes)", dtype.to_string()));
    }
    let row_bytes = 8 + u64::from(dim);
    if dim == 0 || n.checked_mul(row_bytes) != Some(bytes.remaining()) {
        let expected = format!("{n} ids and rows of {dim} bytes");
        return Err(bytes.error_ahead(expected, format!("{} bytes", bytes.remaining())));
    }
    let dim = dim as usize;
    let mut row_of_id = HashMap::with_capacity(n as usize);
    for row in 0..n {
        bytes.record(row + 1);
        let id = bytes.u64("point id")?;
        if row_of_id.insert(id, row as usize).is_some() {
            return Err(bytes.error("each id once", format!("id {id} again")));
        }
    }
    let mut all = vec![0; n as usize * dim];
    bytes.fill(&mut all, "values")?;
    let mut values = Vec::with_capacity(input.ids.len() * dim);
    for id in &input.ids {
        let Some(&row) = row_of_id.get(id) else {
            let found = format!("none among {n}");
            return Err(Error::new(path, format!("point {id}"), "a descriptor", found));
        };
        values.extend_from_slice(&all[row * dim..(row + 1) * dim]);
    }
    Descriptors::try_new(Values::U8(values), dim).map_err(|e| Error::core(path, e))
}
