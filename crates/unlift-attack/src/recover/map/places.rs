//! Current places of all slots.

use rayon::prelude::*;

use crate::geometry::curve;
use crate::recover::result::{Estimate, Status};
use crate::simd::prefetch;

/// The place of a slot; it costs one memory access.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
struct Place<const D: usize> {
    x: [f32; D],
    piece: u32,
}

/// Coordinate of slots without a place: far from everything, and finite when squared.
pub(crate) const UNKNOWN_COORDINATE: f32 = 1e18;

/// Number of places in samples: quantiles of so many have an error of about a percent.
const SAMPLE: usize = 1 << 14;

#[derive(Clone, Debug)]
pub(crate) struct Places<const D: usize> {
    rows: Vec<Place<D>>,
}

impl<const D: usize> Places<D> {
    pub(crate) fn new(estimates: &[Estimate<D>]) -> Self {
        let place = |e: &Estimate<D>| match e.status {
            Status::Ok => Place { x: e.position, piece: u32::from(e.axis) },
            _ => Place { x: [UNKNOWN_COORDINATE; D], piece: 0 },
        };
        Self { rows: estimates.iter().map(place).collect() }
    }

    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    #[inline(always)]
    pub(crate) fn is_known(&self, slot: usize) -> bool {
        self.rows[slot].x[0] != UNKNOWN_COORDINATE
    }

    /// Returns the place of `slot`; [`UNKNOWN_COORDINATE`] if it has none.
    #[inline(always)]
    pub(crate) fn of(&self, slot: usize) -> [f32; D] {
        self.rows[slot].x
    }

    #[inline(always)]
    pub(crate) fn prefetch(&self, slot: usize) {
        prefetch(&self.rows, slot);
    }

    /// Returns the largest absolute coordinate of a known place.
    pub(crate) fn farthest(&self) -> f32 {
        let known = (0..self.len()).filter(|&slot| self.is_known(slot));
        known.flat_map(|slot| self.of(slot)).fold(0.0, |most, x| most.max(x.abs()))
    }

    /// Returns a sample of the known places, evenly over the slots.
    pub(crate) fn sample(&self) -> impl Iterator<Item = [f32; D]> + '_ {
        let every = self.len().div_ceil(SAMPLE).max(1);
        (0..self.len()).step_by(every).filter(|&slot| self.is_known(slot)).map(|slot| self.of(slot))
    }

    /// Returns the corners of a box around most known places.
    pub(crate) fn trimmed_box(&self) -> ([f32; D], [f32; D]) {
        trimmed_box(|c| self.sample().map(|x| x[c]).collect())
    }

    /// Returns the piece of its feasible set on which `slot` lies.
    #[inline(always)]
    pub(crate) fn piece(&self, slot: usize) -> usize {
        self.rows[slot].piece as usize
    }

    /// Returns the squared distance from `x` to the end of an edge, and that slot: `end`, or with `either` the nearer of `end` and the
    /// next slot.
    #[inline(always)]
    pub(crate) fn nearest(&self, end: u32, either: bool, x: &[f32; D]) -> (f32, usize) {
        let end = end as usize;
        let one = distance2(&self.of(end), x);
        let other = if either { distance2(&self.of(end + 1), x) } else { f32::INFINITY };
        if other < one { (other, end + 1) } else { (one, end) }
    }
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
