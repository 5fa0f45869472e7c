//! The order in which slots are looked at: neighbors one after the other.
//!
//! Records lie in random order, so each look at a neighbor is a cache miss on a large map. Slots that are
//! near each other share neighbors: looked at in turn, they find them in the cache. Results do not
//! depend on the order.

use rayon::prelude::*;

use super::places::Places;
use crate::geometry::curve;

/// Cells per axis, as a power of two: place on the curve and slot share 64 bits.
const BITS: u32 = 10;

/// All slots, along a curve that fills space; lost ones last.
pub(crate) fn along_curve<const D: usize>(places: &Places<D>) -> Vec<u32> {
    let n = places.len();
    let (low, high) = places.trimmed_box();
    let cells = (1u32 << BITS) as f32;
    let key = |slot: usize| {
        if !places.is_known(slot) {
            return u64::MAX << u32::BITS | slot as u64;
        }
        let x = places.of(slot);
        let cell: [u32; D] = std::array::from_fn(|c| {
            (((x[c] - low[c]) / (high[c] - low[c]) * cells) as u32).min((1 << BITS) - 1)
        });
        curve::along(&cell, BITS) << u32::BITS | slot as u64
    };
    let mut keys: Vec<u64> = (0..n).into_par_iter().map(key).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}
