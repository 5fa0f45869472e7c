//! The order in which records are looked at: possible partners one after the other.

use rayon::prelude::*;

use super::side::Side;
use crate::geometry::curve;

/// Cells per value, as a power of two: two of them and the axis make a key.
const BITS: u32 = 20;

/// All records, so that those that may have exchanged a coordinate stand side by side: the estimate of each is
/// near what the other published, so both have about the same two values. Results do not depend on it,
/// but a partner that is in the cache costs a tenth.
pub(super) fn side_by_side(sides: &[Side], reach: f32) -> Vec<u32> {
    let low = sides.iter().map(|side| side.published.min(side.estimate)).fold(f32::MAX, f32::min);
    let cell = |value: f32| ((value - low) / reach) as u32 & ((1 << BITS) - 1);
    let place = |side: &Side| {
        let (a, b) = (cell(side.published), cell(side.estimate));
        curve::along(&[a.min(b), a.max(b)], BITS)
    };
    let mut keys: Vec<(usize, u64, u32)> = sides
        .par_iter()
        .enumerate()
        .map(|(record, side)| (side.axis, place(side), record as u32))
        .collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key.2).collect()
}
