//! Sorts rows that state their slot or point.

use crate::Error;
use std::path::Path;

/// Returns the row of each key from 0 to `n - 1`, where row `r` has key `keys[r]` below `n`, or
/// `None` for a key without a row. Two rows with the same key are an error, which names `column`.
pub(super) fn rows_by_key(
    path: &Path,
    column: &str,
    keys: &[u32],
    n: usize,
) -> Result<Vec<Option<u32>>, Error> {
    let mut rows = vec![None; n];
    for (row, &key) in keys.iter().enumerate() {
        let place = &mut rows[key as usize];
        if let Some(earlier) = place {
            let place = format!("column {column}, row {row}");
            let expected = format!("each {column} once");
            let found = format!("{key} as in row {earlier}");
            return Err(Error::new(path, place, expected, found));
        }
        *place = Some(row as u32);
    }
    Ok(rows)
}

/// Returns the row of each key, where each of the keys 0 to `keys.len() - 1` has one row.
pub(super) fn permutation(path: &Path, column: &str, keys: &[u32]) -> Result<Vec<u32>, Error> {
    let rows = rows_by_key(path, column, keys, keys.len())?;
    Ok(rows.into_iter().flatten().collect())
}
