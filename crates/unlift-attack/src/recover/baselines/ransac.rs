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
use crate::recover::map::family::Family;
use crate::recover::map::lines::{LineColumns, NO_VOTE, Sections};
use crate::recover::map::lists::{Slots, found, solve_chunks};
use crate::recover::result::{Estimate, MAX_TRIALS, Status, TrialCounts};
use crate::released::AxisPlanes;
use crate::seed::{Draws, Stage};
use crate::simd::{Kernel, dispatch};

/// The loop stops when a sample without outliers was drawn with this probability.
const CONFIDENCE: f64 = 0.99;
/// Records per sample and unknown coordinate.
const SAMPLE: u32 = 2;

pub(crate) struct Ransac<'a, const D: usize> {
    pub(crate) family: &'a Family<'a, D>,
    pub(crate) lists: &'a Neighborhoods,
    pub(crate) delta: f32,
    pub(crate) seed: u64,
    pub(crate) trials: &'a TrialCounts,
}

impl<const D: usize> Ransac<'_, D> {
    pub(crate) fn solve(&self) -> Vec<Estimate<D>> {
        let axes = match self.family {
            Family::Candidates { rows, .. } => vote(rows, self.lists),
            Family::Lines { .. } | Family::Planes { .. } => Vec::new(),
        };
        solve_chunks(&Slots::all(self.lists.n_slots()), Scratch::default, |scratch, first, out| {
            for (at, estimate) in out.iter_mut().enumerate() {
                let slot = first + at;
                let (solved, trials) = dispatch(Slot { ransac: self, axes: &axes, slot, scratch });
                *estimate = solved;
                // A slot without trials is not a slot that was solved quickly.
                if trials > 0 {
                    self.trials.note(trials);
                }
            }
        })
    }
}

struct Scratch<const D: usize> {
    lines: LineColumns<D>,
    sections: Sections,
    /// The sections of records that may vote.
    votes: Sections,
    /// Listed offsets of planes, by axis.
    offsets: [Vec<f32>; D],
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        let offsets = std::array::from_fn(|_| Vec::new());
        let (sections, votes) = (Sections::default(), Sections::default());
        Self { lines: LineColumns::default(), sections, votes, offsets }
    }
}

struct Slot<'a, const D: usize> {
    ransac: &'a Ransac<'a, D>,
    axes: &'a [u8],
    slot: usize,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize> Kernel for Slot<'_, D> {
    type Output = (Estimate<D>, u32);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { ransac, axes, slot, scratch } = self;
        let listed = ransac.lists.of(slot);
        let mut draws = Draws::new(ransac.seed, Stage::Ransac, slot as u64);
        let (solved, trials, axis) = match ransac.family {
            Family::Lines { rows, slots_per_record, .. } => {
                let own = &rows[slot / slots_per_record];
                scratch.lines.gather(rows, listed);
                scratch.lines.sections(own, &mut scratch.sections);
                let may_vote = scratch.lines.n_that_may_vote(own);
                let (found, trials) = on_line(scratch, may_vote, ransac.delta, &mut draws);
                (found.map(|(t, support)| (own.at(own.clamp(t)), support)), trials, 0)
            }
            Family::Candidates { rows, .. } => {
                let (own, axis) = (&rows[slot], axes[slot]);
                sections_of_voted(rows, axes, listed, slot, &mut scratch.sections);
                let (found, trials) = on_line(scratch, listed.len(), ransac.delta, &mut draws);
                let at = |t| std::array::from_fn(|c| if c == axis.into() { t } else { own[c] });
                (found.map(|(t, support)| (at(t), support)), trials, axis)
            }
            Family::Planes { planes, .. } => {
                let offsets = &mut scratch.offsets;
                match on_plane(planes, slot, listed, offsets, ransac.delta, &mut draws) {
                    Ok((place, support, trials)) => (Ok((place, support)), trials, 0),
                    Err(status) => (Err(status), 0, 0),
                }
            }
        };
        let estimate = match solved {
            Ok((position, support)) => found(position, support, axis.into(), 0.0),
            Err(status) => Estimate { axis, ..Estimate::lost(status) },
        };
        (estimate, trials)
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
    let Scratch { sections, votes, .. } = scratch;
    if sections.n_voting() < 2 {
        let few = may_vote < 2;
        return (Err(if few { Status::TooFewNeighbors } else { Status::Degenerate }), 0);
    }
    votes.at.clear();
    votes.miss2.clear();
    votes.bend.clear();
    for j in 0..sections.len() {
        if sections.miss2[j] < NO_VOTE {
            votes.at.push(sections.at[j]);
            votes.miss2.push(sections.miss2[j]);
            votes.bend.push(sections.bend[j]);
        }
    }
    let (n, delta2) = (votes.len(), delta * delta);
    let (mut best_t, mut best) = (0.0, 0);
    let (mut trials, mut needed) = (0, MAX_TRIALS);
    while trials < needed {
        trials += 1;
        let one = draws.below(n as u64) as usize;
        let mut other = draws.below(n as u64 - 1) as usize;
        other += usize::from(other >= one);
        let (a, b) = (votes.bend[one], votes.bend[other]);
        let t = (a * votes.at[one] + b * votes.at[other]) / (a + b);
        let columns = votes.at.iter().zip(&votes.miss2).zip(&votes.bend);
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
    for j in 0..n {
        if votes.squared_distance(j, best_t) <= delta2 {
            weight += votes.bend[j];
            sum += votes.bend[j] * (votes.at[j] - best_t);
        }
    }
    (Ok((best_t + sum / weight, best)), trials)
}

/// Returns the place on the plane of `slot` with the largest support, its support, and the number of trials. `offsets` is a buffer.
#[inline(always)]
fn on_plane<const D: usize>(
    planes: &AxisPlanes<D>,
    slot: usize,
    listed: &[RecordId],
    offsets: &mut [Vec<f32>; D],
    delta: f32,
    draws: &mut Draws,
) -> Result<([f32; D], u32, u32), Status> {
    if listed.len() < 2 {
        return Err(Status::TooFewNeighbors);
    }
    let own = usize::from(planes.axis()[slot]);
    offsets.iter_mut().for_each(Vec::clear);
    for record in listed {
        offsets[usize::from(planes.axis()[record.index()])].push(planes.offset()[record.index()]);
    }
    let free = (0..D).filter(|&axis| axis != own);
    if free.clone().any(|axis| offsets[axis].is_empty()) {
        return Err(Status::Degenerate);
    }
    let n: u32 = free.clone().map(|axis| offsets[axis].len() as u32).sum();
    let mut place = [0.0; D];
    place[own] = planes.offset()[slot];
    let (mut best_place, mut best) = (place, 0);
    let (mut trials, mut needed) = (0, MAX_TRIALS);
    while trials < needed {
        trials += 1;
        for axis in free.clone() {
            let mut draw = || offsets[axis][draws.below(offsets[axis].len() as u64) as usize];
            place[axis] = (0..SAMPLE).map(|_| draw()).sum::<f32>() / SAMPLE as f32;
        }
        let is_near = |axis: usize, x: &f32| u32::from((x - place[axis]).abs() <= delta);
        let of_axis = |axis: usize| offsets[axis].iter().map(|x| is_near(axis, x)).sum::<u32>();
        let support = free.clone().map(of_axis).sum();
        if support > best {
            (best_place, best) = (place, support);
            needed = trials_needed(support, n, SAMPLE * (D as u32 - 1));
        }
    }
    if best == 0 {
        return Err(Status::NoSupport);
    }
    for axis in free {
        let away = offsets[axis].iter().map(|x| x - best_place[axis]);
        let near = away.filter(|away| away.abs() <= delta);
        let (sum, count) = near.fold((0.0, 0), |(sum, n), away| (sum + away, n + 1));
        place[axis] = best_place[axis] + if count > 0 { sum / count as f32 } else { 0.0 };
    }
    Ok((place, best, trials))
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
