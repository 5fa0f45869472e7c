//! Where slots are believed to be, in the form that joint recovery reads.

use rayon::prelude::*;

use crate::geometry::curve;
use crate::recover::result::{Estimate, Status};
use crate::simd::prefetch;

/// A slot's estimate: one memory access.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
struct Place<const D: usize> {
    x: [f32; D],
    piece: u32,
}

/// Lost slots lie this far away: near nothing, and still a number when squared.
pub(crate) const UNKNOWN_COORDINATE: f32 = 1e18;

/// Places that stand for all: quantiles and medians of so many are known to a percent.
const SAMPLE: usize = 1 << 14;

/// One place per slot.
#[derive(Clone, Debug)]
pub(crate) struct Places<const D: usize> {
    rows: Vec<Place<D>>,
}

impl<const D: usize> Places<D> {
    /// From estimates in slot order.
    pub(crate) fn new(estimates: &[Estimate<D>]) -> Self {
        let place = |e: &Estimate<D>| match e.status {
            Status::Ok => Place { x: e.position, piece: u32::from(e.axis) },
            _ => Place { x: [UNKNOWN_COORDINATE; D], piece: 0 },
        };
        Self { rows: estimates.iter().map(place).collect() }
    }

    /// Number of slots.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether `slot` has a place.
    #[inline(always)]
    pub(crate) fn is_known(&self, slot: usize) -> bool {
        self.rows[slot].x[0] != UNKNOWN_COORDINATE
    }

    /// The place of `slot`; far away if it has none.
    #[inline(always)]
    pub(crate) fn of(&self, slot: usize) -> [f32; D] {
        self.rows[slot].x
    }

    /// Brings the place of `slot` near.
    #[inline(always)]
    pub(crate) fn prefetch(&self, slot: usize) {
        prefetch(&self.rows, slot);
    }

    /// The largest coordinate of a known place, without its sign.
    pub(crate) fn farthest(&self) -> f32 {
        let known = (0..self.len()).filter(|&slot| self.is_known(slot));
        known.flat_map(|slot| self.of(slot)).fold(0.0, |most, x| most.max(x.abs()))
    }

    /// Some of the known places, evenly over the slots.
    pub(crate) fn sample(&self) -> impl Iterator<Item = [f32; D]> + '_ {
        let every = self.len().div_ceil(SAMPLE).max(1);
        (0..self.len()).step_by(every).filter(|&slot| self.is_known(slot)).map(|slot| self.of(slot))
    }

    /// The corners of a box around the known places, without the farthest.
    pub(crate) fn trimmed_box(&self) -> ([f32; D], [f32; D]) {
        trimmed_box(|c| self.sample().map(|x| x[c]).collect())
    }

    /// The piece of its feasible set that `slot` lies on.
    #[inline(always)]
    pub(crate) fn piece(&self, slot: usize) -> usize {
        self.rows[slot].piece as usize
    }

    /// The squared distance from `x` to the slot at the other end of an edge, and that slot: `end`, or
    /// with `either` the nearer of it and the next.
    #[inline(always)]
    pub(crate) fn nearest(&self, end: u32, either: bool, x: &[f32; D]) -> (f32, usize) {
        let end = end as usize;
        let one = distance2(&self.of(end), x);
        let other = if either { distance2(&self.of(end + 1), x) } else { f32::INFINITY };
        if other < one { (other, end + 1) } else { (one, end) }
    }
}

/// The share of values left out at either end of a range: those of wrong entries may lie anywhere.
const TRIM: f64 = 0.03;

/// The range of a column without its ends, widened a little.
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

/// The corners of a box around most places, given as the column of each coordinate.
pub(crate) fn trimmed_box<const D: usize>(
    column: impl Fn(usize) -> Vec<f32>,
) -> ([f32; D], [f32; D]) {
    let ends: [(f32, f32); D] = std::array::from_fn(|c| trimmed(&mut column(c)));
    (ends.map(|e| e.0), ends.map(|e| e.1))
}

/// The squared distance.
#[inline(always)]
pub(crate) fn distance2<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f32 {
    let mut sum = 0.0;
    for c in 0..D {
        sum += (a[c] - b[c]) * (a[c] - b[c]);
    }
    sum
}

/// Cells per axis, as a power of two: place on the curve and slot share 64 bits.
const BITS: u32 = 10;

/// All slots, along a curve that fills space; lost ones last. Records lie in random order, so that each look at a neighbor is a
/// cache miss on a large map. Slots near each other share neighbors: in this order they find them in the cache. Results do
/// not depend on it.
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
