//! Places of all slots: estimates, their box, and an order in which near ones come after each other.

use rayon::prelude::*;

use crate::geometry::curve;
use crate::geometry::vector::widen;
use crate::recover::result::Estimate;

/// Slots per parallel task: fixed, so that results do not depend on the number of threads.
pub(crate) const CHUNK: usize = 64;

/// Number of places in samples: quantiles of so many have an error of about a percent.
const SAMPLE: usize = 1 << 14;

/// A possible place of a slot, on a piece of its feasible set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate<const D: usize> {
    pub(crate) x: [f32; D],
    pub(crate) piece: usize,
    pub(crate) score: f32,
}

/// Returns a sample of the known places, evenly over the slots.
pub(crate) fn sample<const D: usize>(
    estimates: &[Estimate<D>],
) -> impl Iterator<Item = [f32; D]> + '_ {
    let every = estimates.len().div_ceil(SAMPLE).max(1);
    estimates.iter().step_by(every).filter(|e| e.is_known()).map(|e| e.position)
}

/// Returns the slots that have a place, and their places.
pub(crate) fn known<const D: usize>(estimates: &[Estimate<D>]) -> (Vec<u32>, Vec<[f64; D]>) {
    let known = (0u32..).zip(estimates).filter(|(_, estimate)| estimate.is_known());
    known.map(|(slot, estimate)| (slot, widen(&estimate.position))).unzip()
}

/// Returns the corners of a box around most known places.
pub(crate) fn box_of_most<const D: usize>(estimates: &[Estimate<D>]) -> ([f32; D], [f32; D]) {
    trimmed_box(|c| sample(estimates).map(|x| x[c]).collect())
}

/// Returns the squared distance from `x` to the end of an edge: `end`, or with `either` the nearer of `end` and the next slot; infinite if
/// that is lost.
#[inline(always)]
pub(crate) fn nearest2<const D: usize>(
    estimates: &[Estimate<D>],
    end: u32,
    either: bool,
    x: &[f32; D],
) -> f32 {
    let end = end as usize;
    // The least of a number and NaN is the number.
    let d2 = distance2(&estimates[end].position, x).min(f32::INFINITY);
    if either { d2.min(distance2(&estimates[end + 1].position, x)) } else { d2 }
}

/// Fraction of values dropped at either end of a range, which may be those of wrong entries.
const TRIM: f64 = 0.03;

/// Returns the range of a column without its ends, slightly widened.
pub(crate) fn trimmed(column: &mut [f32]) -> (f32, f32) {
    if column.is_empty() {
        return (0.0, 0.0);
    }
    let last = column.len() - 1;
    let cut = (last as f64 * TRIM) as usize;
    let mut at = |rank: usize| *column.select_nth_unstable_by(rank, f32::total_cmp).1;
    let (low, high) = (at(cut), at(last - cut));
    let margin = 0.1 * (high - low);
    (low - margin, high + margin)
}

/// Returns the corners of a box around most places; `column` returns all values of a coordinate.
pub(crate) fn trimmed_box<const D: usize>(
    column: impl Fn(usize) -> Vec<f32>,
) -> ([f32; D], [f32; D]) {
    let ends: [(f32, f32); D] = std::array::from_fn(|c| trimmed(&mut column(c)));
    (ends.map(|e| e.0), ends.map(|e| e.1))
}

#[inline(always)]
pub(crate) fn distance2<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f32 {
    let mut sum = 0.0;
    for c in 0..D {
        sum += (a[c] - b[c]) * (a[c] - b[c]);
    }
    sum
}

/// Bits per coordinate on the curve: the index on the curve and the slot share 64 bits.
const BITS: u32 = 10;

/// Returns all slots in order along a space-filling curve; slots without a place are last. Records are in random order, so that
/// each access to a neighbor misses the cache on a large map. Nearby slots share neighbors, so in this order they are often cached.
/// Results do not depend on the order.
pub(crate) fn along_curve<const D: usize>(estimates: &[Estimate<D>]) -> Vec<u32> {
    let (low, high) = box_of_most(estimates);
    let cells = (1u32 << BITS) as f32;
    let key = |(slot, estimate): (usize, &Estimate<D>)| {
        if !estimate.is_known() {
            return u64::MAX << u32::BITS | slot as u64;
        }
        let x = estimate.position;
        let cell: [u32; D] = std::array::from_fn(|c| {
            (((x[c] - low[c]) / (high[c] - low[c]) * cells) as u32).min((1 << BITS) - 1)
        });
        curve::along(&cell, BITS) << u32::BITS | slot as u64
    };
    let mut keys: Vec<u64> = estimates.par_iter().enumerate().map(key).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}
