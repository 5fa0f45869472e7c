//! The sampling loop of the paper (section 4), for comparison.
//!
//! Each trial draws a few listed records and computes their least-squares position, Eq. (4). The position with the largest support
//! is refined by least squares over the supporting records. The number of trials follows the largest support so far (draws
//! without replacement, 99 % confidence) and is at most 10,000. The paper does not give the sample size: here it is two records per
//! unknown coordinate (for planes, one may be drawn twice).

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::consensus::{Scratch, gather_planes};
use crate::recover::map::families::{CandidateFamily, LineFamily, PlaneFamily};
use crate::recover::map::family::Family;
use crate::recover::map::lines::{NO_VOTE, Sections};
use crate::recover::result::{Estimate, MAX_TRIALS, Status};
use crate::seed::{Draws, Stage};
use crate::simd::{Kernel, dispatch};

/// The loop stops when a sample without outliers was drawn with this probability.
const CONFIDENCE: f64 = 0.99;
/// Records per sample and unknown coordinate.
const SAMPLE: u32 = 2;

/// How the loop samples records of a family.
pub(crate) trait Trials<const D: usize> {
    /// Returns the exchanged axis of every record; nothing for families without one.
    fn axes(&self, _lists: &Neighborhoods) -> Vec<u8> {
        Vec::new()
    }
    /// Returns the position of `slot` with the largest support and its support, and the number of trials.
    fn solve(
        &self,
        slot: usize,
        listed: (&[RecordId], &[u8]),
        delta: f32,
        draws: &mut Draws,
        scratch: &mut Scratch<D>,
    ) -> (Result<([f32; D], u32), Status>, u32);
}

/// Returns the estimates of all slots, and the number of trials of each; 0 if it was not tried.
pub(crate) fn solve<const D: usize, F: Family<D>>(
    family: &F,
    lists: &Neighborhoods,
    delta: f32,
    seed: u64,
) -> (Vec<Estimate<D>>, Vec<u32>) {
    let axes = &family.axes(lists);
    let solve = |scratch: &mut Scratch<D>, slot| {
        dispatch(Slot { family, lists, axes, delta, seed, slot, scratch })
    };
    (0..lists.n_slots()).into_par_iter().map_init(Scratch::default, solve).unzip()
}

struct Slot<'a, const D: usize, F> {
    family: &'a F,
    lists: &'a Neighborhoods,
    axes: &'a [u8],
    delta: f32,
    seed: u64,
    slot: usize,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, F: Family<D>> Kernel for Slot<'_, D, F> {
    type Output = (Estimate<D>, u32);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { family, lists, axes, delta, seed, slot, scratch } = self;
        let mut draws = Draws::new(seed, Stage::Ransac, slot as u64);
        let (solved, trials) =
            family.solve(slot, (lists.of(slot), axes), delta, &mut draws, scratch);
        let axis = axes.get(slot).copied().unwrap_or(0);
        let estimate = match solved {
            Ok((position, support)) => Estimate::at(position, support, axis.into(), 0.0),
            Err(status) => Estimate { axis, ..Estimate::lost(status) },
        };
        (estimate, trials)
    }
}

impl<const D: usize> Trials<D> for LineFamily<D> {
    #[inline(always)]
    fn solve(
        &self,
        slot: usize,
        (listed, _): (&[RecordId], &[u8]),
        delta: f32,
        draws: &mut Draws,
        scratch: &mut Scratch<D>,
    ) -> (Result<([f32; D], u32), Status>, u32) {
        let own = self.own(slot);
        scratch.lines.gather(&self.rows, listed);
        scratch.lines.sections(own, &mut scratch.sections);
        let may_vote = scratch.lines.n_that_may_vote(own);
        let (found, trials) = on_line(scratch, may_vote, delta, draws);
        (found.map(|(t, support)| (own.at(own.clamp(t)), support)), trials)
    }
}

impl<const D: usize> Trials<D> for CandidateFamily<'_, D> {
    fn axes(&self, lists: &Neighborhoods) -> Vec<u8> {
        vote(self.rows, lists)
    }

    #[inline(always)]
    fn solve(
        &self,
        slot: usize,
        (listed, axes): (&[RecordId], &[u8]),
        delta: f32,
        draws: &mut Draws,
        scratch: &mut Scratch<D>,
    ) -> (Result<([f32; D], u32), Status>, u32) {
        let (own, axis) = (&self.rows[slot], axes[slot]);
        sections_of_voted(self.rows, axes, listed, slot, &mut scratch.sections);
        let (found, trials) = on_line(scratch, listed.len(), delta, draws);
        let at = |t| std::array::from_fn(|c| if c == axis.into() { t } else { own[c] });
        (found.map(|(t, support)| (at(t), support)), trials)
    }
}

/// Returns the number of trials after which a sample of `size` inliers, of `inliers` among `n`, was drawn with probability
/// [`CONFIDENCE`].
#[inline(always)]
fn trials_needed(inliers: u32, n: u32, size: u32) -> u32 {
    let mut all_inliers = 1.0;
    for drawn in 0..size.min(n) {
        all_inliers *= f64::from(inliers.saturating_sub(drawn)) / f64::from(n - drawn);
    }
    if all_inliers <= 0.0 {
        return MAX_TRIALS;
    }
    let trials = libm::log(1.0 - CONFIDENCE) / libm::log1p(-all_inliers.min(1.0 - 1e-12));
    (trials.ceil() as u32).clamp(1, MAX_TRIALS)
}

/// Returns the parameter along a line with the largest support, refined by least squares, its support, and the number of trials.
/// `may_vote` is the number of listed records that may vote.
#[inline(always)]
fn on_line<const D: usize>(
    scratch: &mut Scratch<D>,
    may_vote: usize,
    delta: f32,
    draws: &mut Draws,
) -> (Result<(f32, u32), Status>, u32) {
    let Scratch { sections, voting, .. } = scratch;
    if sections.n_voting() < 2 {
        let few = may_vote < 2;
        return (Err(if few { Status::TooFewNeighbors } else { Status::Degenerate }), 0);
    }
    voting.clear();
    voting.extend((0..sections.len()).filter(|&j| sections.miss2[j] < NO_VOTE));
    let (n, delta2) = (voting.len(), delta * delta);
    let (mut best_t, mut best) = (0.0, 0);
    let (mut trials, mut needed) = (0, MAX_TRIALS);
    while trials < needed {
        trials += 1;
        let one = draws.below(n as u64) as usize;
        let mut other = draws.below(n as u64 - 1) as usize;
        other += usize::from(other >= one);
        let [one, other] = [one, other].map(|at| voting[at]);
        let (a, b) = (sections.bend[one], sections.bend[other]);
        let t = (a * sections.at[one] + b * sections.at[other]) / (a + b);
        let columns = sections.at.iter().zip(&sections.miss2).zip(&sections.bend);
        let is_near = |((at, miss2), bend): ((&f32, &f32), &f32)| {
            u32::from(miss2 + bend * (t - at) * (t - at) <= delta2)
        };
        let support = columns.map(is_near).sum();
        if support > best {
            (best_t, best) = (t, support);
            needed = trials_needed(support, n as u32, SAMPLE);
        }
    }
    if best == 0 {
        return (Err(Status::NoSupport), trials);
    }
    let (mut weight, mut sum) = (0.0f32, 0.0f32);
    for &j in voting.iter() {
        if sections.squared_distance(j, best_t) <= delta2 {
            weight += sections.bend[j];
            sum += sections.bend[j] * (sections.at[j] - best_t);
        }
    }
    (Ok((best_t + sum / weight, best)), trials)
}

impl<const D: usize> Trials<D> for PlaneFamily<'_, D> {
    #[inline(always)]
    fn solve(
        &self,
        slot: usize,
        (listed, _): (&[RecordId], &[u8]),
        delta: f32,
        draws: &mut Draws,
        scratch: &mut Scratch<D>,
    ) -> (Result<([f32; D], u32), Status>, u32) {
        if listed.len() < 2 {
            return (Err(Status::TooFewNeighbors), 0);
        }
        let by_axis = &mut scratch.by_axis;
        gather_planes(self.planes, listed, by_axis);
        let own = usize::from(self.planes.axis()[slot]);
        let free = (0..D).filter(|&axis| axis != own);
        if free.clone().any(|axis| by_axis[axis].is_empty()) {
            return (Err(Status::Degenerate), 0);
        }
        let n: u32 = free.clone().map(|axis| by_axis[axis].len() as u32).sum();
        let mut place = [0.0; D];
        place[own] = self.planes.offset()[slot];
        let (mut best_place, mut best) = (place, 0);
        let (mut trials, mut needed) = (0, MAX_TRIALS);
        while trials < needed {
            trials += 1;
            for axis in free.clone() {
                let offsets = &by_axis[axis];
                let mut draw = || offsets[draws.below(offsets.len() as u64) as usize].0;
                place[axis] = (0..SAMPLE).map(|_| draw()).sum::<f32>() / SAMPLE as f32;
            }
            let is_near = |axis: usize, x: f32| u32::from((x - place[axis]).abs() <= delta);
            let of_axis =
                |axis: usize| by_axis[axis].iter().map(|x| is_near(axis, x.0)).sum::<u32>();
            let support = free.clone().map(of_axis).sum();
            if support > best {
                (best_place, best) = (place, support);
                needed = trials_needed(support, n, SAMPLE * (D as u32 - 1));
            }
        }
        if best == 0 {
            return (Err(Status::NoSupport), 0);
        }
        for axis in free {
            let away = by_axis[axis].iter().map(|x| x.0 - best_place[axis]);
            let near = away.filter(|away| away.abs() <= delta);
            let (sum, count) = near.fold((0.0, 0), |(sum, n), away| (sum + away, n + 1));
            place[axis] = best_place[axis] + if count > 0 { sum / count as f32 } else { 0.0 };
        }
        (Ok((place, best)), trials)
    }
}

// The exchanged coordinate of permuted points (supplement A).

/// Returns the exchanged axis of every record, by majority vote over all neighborhoods that contain it.
///
/// In a neighborhood (a slot's record and its listed records), each member votes for the axis with the largest sum of distances
/// to the others. The paper does not define "relatively larger". Here sums are divided by their mean over the neighborhood;
/// otherwise every record votes for the long axis of an elongated map. Ties go to the lower axis.
fn vote<const D: usize>(rows: &[[f32; D]], lists: &Neighborhoods) -> Vec<u8> {
    let votes: Vec<[AtomicU32; D]> =
        rows.iter().map(|_| std::array::from_fn(|_| AtomicU32::new(0))).collect();
    (0..lists.n_slots()).into_par_iter().for_each(|slot| {
        let mut members = vec![RecordId::from_index(slot)];
        members.extend_from_slice(lists.of(slot));
        let distances: [Vec<f32>; D] =
            std::array::from_fn(|axis| relative_distances(rows, &members, axis));
        for (at, member) in members.iter().enumerate() {
            let guess = largest::<D>(|axis| distances[axis][at]);
            votes[member.index()][usize::from(guess)].fetch_add(1, Ordering::Relaxed);
        }
    });
    let of = |votes: [AtomicU32; D]| {
        let votes = votes.map(|n| n.into_inner() as f32);
        largest::<D>(|axis| votes[axis])
    };
    votes.into_iter().map(of).collect()
}

/// Returns the axis with the largest value, the lowest of equal ones.
fn largest<const D: usize>(value: impl Fn(usize) -> f32) -> u8 {
    (1..D).fold(0, |best, axis| if value(axis) > value(best) { axis } else { best }) as u8
}

/// Returns, per member, the sum of distances to the others along `axis`, divided by the mean of these sums.
fn relative_distances<const D: usize>(
    rows: &[[f32; D]],
    members: &[RecordId],
    axis: usize,
) -> Vec<f32> {
    let values: Vec<f32> = members.iter().map(|member| rows[member.index()][axis]).collect();
    let sum = |one: &f32| values.iter().map(|other| (one - other).abs()).sum::<f32>();
    let sums: Vec<f32> = values.iter().map(sum).collect();
    let mean = sums.iter().sum::<f32>() / sums.len() as f32;
    if mean > 0.0 { sums.iter().map(|sum| sum / mean).collect() } else { sums }
}

/// Computes the sections of listed records with the line of `slot`. Each record is its line along its voted axis: perpendicular, or
/// parallel, which does not vote.
#[inline(always)]
fn sections_of_voted<const D: usize>(
    rows: &[[f32; D]],
    axes: &[u8],
    listed: &[RecordId],
    slot: usize,
    out: &mut Sections,
) {
    let (own, axis) = (&rows[slot], axes[slot]);
    out.resize(listed.len());
    for (j, record) in listed.iter().enumerate() {
        let (position, other) = (&rows[record.index()], axes[record.index()]);
        let mut miss2 = 0.0;
        for c in 0..D {
            let d = position[c] - own[c];
            miss2 += if c == axis.into() || c == other.into() { 0.0 } else { d * d };
        }
        out.at[j] = position[usize::from(axis)];
        out.bend[j] = 1.0;
        out.miss2[j] = if other == axis { NO_VOTE } else { miss2 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_follow_the_hypergeometric_law() {
        // All inliers need one trial. Pairs from 5 inliers of 50: ln 0.01 / ln(1 - 20/2450) = 562.
        assert_eq!(trials_needed(50, 50, 2), 1);
        assert_eq!(trials_needed(5, 50, 2), 562);
        assert_eq!(trials_needed(1, 50, 2), MAX_TRIALS);
    }
}
