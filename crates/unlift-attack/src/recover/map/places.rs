//! Places of all slots: estimates, their box, an order in which near ones come after each other, and steps that move each slot.

use std::ops::Range;

use crate::geometry::curve;
use crate::geometry::vector::widen;
use crate::parallel;
use crate::recover::result::Estimate;
use crate::simd::{Kernel, dispatch};

/// Slots per parallel task: fixed, so that results do not depend on the number of threads.
pub(crate) const CHUNK: usize = 64;

/// Returns at most `n_sampled` of the first `n` numbers, evenly spaced.
pub(crate) fn evenly(n: usize, n_sampled: usize) -> std::iter::StepBy<Range<usize>> {
    (0..n).step_by(n.div_ceil(n_sampled).max(1))
}

/// A step of an attack that treats each slot on its own. Its hot loops are `#[inline(always)]` where that pays, see [`Kernel`].
pub(crate) trait Step: Sync {
    type Scratch: Default;
    type Output: Send;

    fn solve(&self, slot: usize, scratch: &mut Self::Scratch) -> Self::Output;

    /// Loads what the next slot reads; changes no result.
    #[inline(always)]
    fn prefetch(&self, _slot: usize) {}
}

/// Runs `step` on all `slots`; returns what it returns for each.
pub(crate) fn solve_slots<S: Step>(step: &S, slots: &[usize]) -> Vec<S::Output> {
    let chunks: Vec<&[usize]> = slots.chunks(CHUNK).collect();
    let solve = |scratch: &mut S::Scratch, at| dispatch(Chunk { step, slots: chunks[at], scratch });
    let solved = parallel::map_with(chunks.len(), S::Scratch::default, solve);
    solved.into_iter().flatten().collect()
}

struct Chunk<'a, S: Step> {
    step: &'a S,
    slots: &'a [usize],
    scratch: &'a mut S::Scratch,
}

impl<S: Step> Kernel for Chunk<'_, S> {
    type Output = Vec<S::Output>;

    #[inline(always)]
    fn run(self) -> Vec<S::Output> {
        let mut solved = Vec::with_capacity(self.slots.len());
        for (number, &slot) in self.slots.iter().enumerate() {
            if let Some(&next) = self.slots.get(number + 1) {
                self.step.prefetch(next);
            }
            solved.push(self.step.solve(slot, self.scratch));
        }
        solved
    }
}

/// A possible place of a slot, on a piece of its feasible set.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate<const D: usize> {
    pub(crate) x: [f32; D],
    pub(crate) piece: usize,
    pub(crate) score: f32,
}

/// Returns a sample of the known places, evenly over the slots. Quantiles of so many have an error of about a percent.
pub(crate) fn sample<const D: usize>(estimates: &[Estimate<D>]) -> Vec<[f32; D]> {
    let sampled = evenly(estimates.len(), 1 << 14).map(|slot| &estimates[slot]);
    sampled.filter(|e| e.is_known()).map(|e| e.position).collect()
}

/// Returns the slots that have a place, and their places.
pub(crate) fn known<const D: usize>(estimates: &[Estimate<D>]) -> (Vec<u32>, Vec<[f64; D]>) {
    let known = (0u32..).zip(estimates).filter(|(_, estimate)| estimate.is_known());
    known.map(|(slot, estimate)| (slot, widen(&estimate.position))).unzip()
}

/// Returns the squared distance from `x` to the nearest estimate of some `slots`; infinite if all are lost.
#[inline(always)]
pub(crate) fn nearest2<const D: usize>(
    estimates: &[Estimate<D>],
    slots: Range<usize>,
    x: &[f32; D],
) -> f32 {
    // The least of a number and NaN is the number.
    estimates[slots].iter().map(|e| distance2(&e.position, x)).fold(f32::INFINITY, f32::min)
}

/// Returns the corners of a slightly widened box around most places, without 3 % at either end of each axis, which may be wrong.
pub(crate) fn trimmed_box<const D: usize>(places: &[[f32; D]]) -> ([f32; D], [f32; D]) {
    let Some(last) = places.len().checked_sub(1) else { return ([0.0; D], [0.0; D]) };
    let cut = (last as f64 * 0.03) as usize;
    let ends: [(f32, f32); D] = std::array::from_fn(|c| {
        let mut column: Vec<f32> = places.iter().map(|place| place[c]).collect();
        let mut at = |rank: usize| *column.select_nth_unstable_by(rank, f32::total_cmp).1;
        let (low, high) = (at(cut), at(last - cut));
        let margin = 0.1 * (high - low);
        (low - margin, high + margin)
    });
    (ends.map(|e| e.0), ends.map(|e| e.1))
}

/// Splits a column of ragged rows, which begin at `offsets`, into its rows.
pub(crate) fn rows_mut<'a>(mut column: &'a mut [f32], offsets: &[usize]) -> Vec<&'a mut [f32]> {
    let row = |ends: &[usize]| column.split_off_mut(..ends[1] - ends[0]).expect("ascending");
    offsets.windows(2).map(row).collect()
}

/// Returns the values in ascending order.
pub(crate) fn sorted(values: impl Iterator<Item = f32>) -> Vec<f32> {
    let mut sorted: Vec<f32> = values.collect();
    sorted.sort_unstable_by(f32::total_cmp);
    sorted
}

#[inline(always)]
pub(crate) fn distance2<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f32 {
    let mut sum = 0.0;
    for c in 0..D {
        sum += (a[c] - b[c]) * (a[c] - b[c]);
    }
    sum
}

#[inline(always)]
pub(crate) fn unit<const D: usize>(axis: usize) -> [f32; D] {
    std::array::from_fn(|c| if c == axis { 1.0 } else { 0.0 })
}

/// Bits per coordinate on the curve: the index on the curve and the slot share 64 bits.
const BITS: u32 = 10;

/// Returns all slots in order along a space-filling curve, so that neighbors are often cached; slots without a place are last.
pub(crate) fn along_curve<const D: usize>(estimates: &[Estimate<D>]) -> Vec<usize> {
    let (low, high) = trimmed_box(&sample(estimates));
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
    let mut keys: Vec<u64> = estimates.iter().enumerate().map(key).collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32 as usize).collect()
}
