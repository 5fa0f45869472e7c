//! Normal forms of records, which are idempotent.

use crate::Error;

/// Returns the rows `order[0], order[1], ...` of one column.
pub(super) fn rows<T: Copy>(column: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&row| column[row as usize]).collect()
}

/// Stored directions whose squared length differs from 1 by less than this stay unchanged, so that normalizing twice changes no bit. The
/// `f32` rounding of a unit vector stays below it.
const UNIT_SLACK: f64 = 6e-7;

/// Whether `v` may come from a stored file. Only then may a normal form keep it; otherwise its last bits would show a length near 1 or
/// a point near the foot.
pub(super) fn is_f32<const D: usize>(v: &[f64; D]) -> bool {
    v.iter().all(|&x| f64::from(x as f32) == x)
}

/// Returns the unit vector along `v`; `v` itself if it is a stored unit vector.
///
/// # Errors
/// When `v` is not finite or has no length.
pub(super) fn unit_direction<const D: usize>(v: [f64; D], row: usize) -> Result<[f64; D], Error> {
    let norm2: f64 = v.iter().map(|x| x * x).sum();
    if !norm2.is_finite() || norm2 <= 0.0 {
        let what = format!("direction of record {row}");
        return Err(Error::new(what, "a finite vector with length", format!("{v:?}")));
    }
    if is_f32(&v) && (norm2 - 1.0).abs() <= UNIT_SLACK {
        return Ok(v);
    }
    let norm = norm2.sqrt();
    Ok(v.map(|x| x / norm))
}

/// Rounds `v` to `f32`; the error names the row.
pub(super) fn finite_f32<const D: usize>(
    v: [f64; D],
    what: &str,
    row: usize,
) -> Result<[f32; D], Error> {
    let rounded = v.map(|x| x as f32);
    if rounded.iter().all(|x| x.is_finite()) {
        Ok(rounded)
    } else {
        let what = format!("{what} of record {row}");
        Err(Error::new(what, "coordinates in the range of f32", format!("{v:?}")))
    }
}
