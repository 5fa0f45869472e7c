//! The sampling loop of the paper (section 4), for comparison.
//!
//! Each trial draws two listed records per unknown coordinate and computes their least-squares position, Eq. (4). The number of trials
//! follows the largest support so far (draws without replacement, 99 % confidence).

use std::sync::atomic::{AtomicU32, Ordering};

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::parallel;
use crate::recover::map::{
    CandidateFamily, Family, LineFamily, NO_VOTE, PlaneFamily, Scratch, Step, solve_slots,
};
use crate::recover::result::{Estimate, Status};
use crate::seed::{Draws, Stage};

/// The loop stops when a sample without outliers was drawn with this probability.
const CONFIDENCE: f64 = 0.99;
/// Largest number of trials, as in the paper's timings.
const MAX_TRIALS: u32 = 10_000;
/// Largest number of trials in each bin of the histogram.
const UP_TO: [u32; 9] = [1, 3, 10, 30, 100, 300, 1_000, 3_000, MAX_TRIALS];
/// Records per sample and unknown coordinate.
const SAMPLE: u32 = 2;

/// A slot, its listed records, and what the loop needs to sample them.
pub(crate) struct Task<'a> {
    slot: usize,
    listed: &'a [RecordId],
    /// Exchanged axis of every record; empty for families without one.
    axes: &'a [u8],
    delta: f32,
    draws: Draws,
}

/// A position with the largest support and this support, or why there is none; and the number of trials.
type Solved<X> = (Result<(X, u32), Status>, u32);

/// How the loop samples records of a family.
pub(crate) trait Trials<const D: usize> {
    /// Returns the exchanged axis of every record; nothing for families without one.
    fn axes(&self, _lists: &Neighborhoods) -> Vec<u8> {
        Vec::new()
    }
    fn sample(&self, task: Task<'_>, scratch: &mut Scratch<D>) -> Solved<[f32; D]>;
}

/// Returns the estimates of some `slots`, and the histogram of their numbers of trials, see [`Recovered::trials`].
///
/// [`Recovered::trials`]: crate::recover::Recovered::trials
pub(crate) fn solve<const D: usize, F: Family<D> + Trials<D>>(
    family: &F,
    lists: &Neighborhoods,
    delta: f32,
    slots: &[usize],
    seed: u64,
) -> (Vec<Estimate<D>>, Vec<(u32, u64)>) {
    let sampling = Sampling { family, lists, axes: family.axes(lists), delta, seed };
    let (estimates, trials): (_, Vec<u32>) = solve_slots(&sampling, slots).into_iter().unzip();
    let mut histogram = UP_TO.map(|up_to| (up_to, 0)).to_vec();
    // A slot without trials is not a slot that was solved quickly, and does not count.
    for n in trials.into_iter().filter(|&n| n > 0) {
        histogram[UP_TO.partition_point(|&up_to| up_to < n)].1 += 1;
    }
    (estimates, histogram)
}

struct Sampling<'a, const D: usize, F> {
    family: &'a F,
    lists: &'a Neighborhoods,
    axes: Vec<u8>,
    delta: f32,
    seed: u64,
}

impl<const D: usize, F: Family<D> + Trials<D>> Step for Sampling<'_, D, F> {
    type Scratch = Scratch<D>;
    type Output = (Estimate<D>, u32);

    #[inline(always)]
    fn solve(&self, slot: usize, scratch: &mut Scratch<D>) -> (Estimate<D>, u32) {
        let Self { family, lists, axes, delta, seed } = self;
        let draws = Draws::new(*seed, Stage::Ransac, slot as u64);
        let task = Task { slot, listed: lists.of(slot), axes, delta: *delta, draws };
        let (solved, trials) = family.sample(task, scratch);
        let axis = axes.get(slot).copied().unwrap_or(0);
        let estimate = match solved {
            Ok((position, support)) => Estimate::at(position, support, axis.into(), 0.0),
            Err(status) => Estimate { axis, ..Estimate::lost(status) },
        };
        (estimate, trials)
    }
}

/// Draws samples until one without outliers was likely drawn; returns the one with most support, if any, and the number of trials.
#[inline(always)]
fn best_sample<T>(
    (n, size): (u32, u32),
    mut draw: impl FnMut() -> T,
    support: impl Fn(&T) -> u32,
) -> (Option<(T, u32)>, u32) {
    let (mut best, mut best_support) = (None, 0);
    let (mut trials, mut needed) = (0, MAX_TRIALS);
    while trials < needed {
        trials += 1;
        let sample = draw();
        let support = support(&sample);
        if support > best_support {
            (best, best_support) = (Some((sample, support)), support);
            needed = trials_needed(support, n, size);
        }
    }
    (best, trials)
}

/// Returns the number of trials that draw a sample of `size` inliers, of `inliers` among `n`, with probability [`CONFIDENCE`].
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

/// Returns the parameter along the line of the gathered sections, refined by least squares. `may_vote` listed records may vote.
#[inline(always)]
fn on_line<const D: usize>(
    Task { delta, mut draws, .. }: Task<'_>,
    may_vote: usize,
    Scratch { sections, voting, .. }: &mut Scratch<D>,
) -> Solved<f32> {
    voting.clear();
    voting.extend((0..sections.len()).filter(|&j| sections.miss2[j] < NO_VOTE));
    let (n, delta2) = (voting.len(), delta * delta);
    if n < 2 {
        return (Err(Status::not_fixed(may_vote)), 0);
    }
    let draw = || {
        let first = draws.below(n as u64) as usize;
        let mut second = draws.below(n as u64 - 1) as usize;
        second += usize::from(second >= first);
        let [first, second] = [first, second].map(|at| voting[at]);
        let (a, b) = (sections.bend[first], sections.bend[second]);
        (a * sections.at[first] + b * sections.at[second]) / (a + b)
    };
    let support = |t: &f32| {
        let columns = sections.at.iter().zip(&sections.miss2).zip(&sections.bend);
        let is_near = |((at, miss2), bend): ((&f32, &f32), &f32)| {
            u32::from(miss2 + bend * (t - at) * (t - at) <= delta2)
        };
        columns.map(is_near).sum()
    };
    let (best, trials) = best_sample((n as u32, SAMPLE), draw, support);
    let Some((t, support)) = best else { return (Err(Status::NoSupport), trials) };
    let (mut weight, mut sum) = (0.0f32, 0.0f32);
    for &j in voting.iter().filter(|&&j| sections.squared_distance(j, t) <= delta2) {
        weight += sections.bend[j];
        sum += sections.bend[j] * (sections.at[j] - t);
    }
    (Ok((t + sum / weight, support)), trials)
}

impl<const D: usize> Trials<D> for LineFamily<D> {
    #[inline(always)]
    fn sample(&self, task: Task<'_>, scratch: &mut Scratch<D>) -> Solved<[f32; D]> {
        let own = self.own(task.slot);
        let Scratch { lines, sections, .. } = scratch;
        let may_vote = lines.sections(&self.rows, task.listed, own, sections);
        let (solved, trials) = on_line(task, may_vote, scratch);
        (solved.map(|(t, support)| (own.at(own.clamp(t)), support)), trials)
    }
}

impl<const D: usize> Trials<D> for CandidateFamily<'_, D> {
    /// Returns the axes by majority vote over all neighborhoods that contain a record (supplement A).
    ///
    /// In a neighborhood (a slot's record and its list), each member votes for the axis with the largest sum of distances to the others.
    /// Sums are divided by their mean: otherwise every record votes for the long axis of an elongated map. Ties go to the lower axis.
    fn axes(&self, lists: &Neighborhoods) -> Vec<u8> {
        let rows = self.rows;
        let votes: Vec<AtomicU32> = (0..D * rows.len()).map(|_| AtomicU32::new(0)).collect();
        parallel::for_each(lists.n_slots(), &|slot| {
            let mut members = vec![RecordId::from_index(slot)];
            members.extend_from_slice(lists.of(slot));
            // Per axis, the sum of the distances of each member to the others, divided by the mean of these sums.
            let distances: [Vec<f32>; D] = std::array::from_fn(|axis| {
                let values: Vec<f32> =
                    members.iter().map(|member| rows[member.index()][axis]).collect();
                let sum = |own: &f32| values.iter().map(|x| (own - x).abs()).sum::<f32>();
                let sums: Vec<f32> = values.iter().map(sum).collect();
                let mean = sums.iter().sum::<f32>() / sums.len() as f32;
                if mean > 0.0 { sums.iter().map(|sum| sum / mean).collect() } else { sums }
            });
            for (at, member) in members.iter().enumerate() {
                let guess = largest::<D>(|axis| distances[axis][at]);
                votes[D * member.index() + usize::from(guess)].fetch_add(1, Ordering::Relaxed);
            }
        });
        let of = |of: &[AtomicU32]| largest::<D>(|axis| of[axis].load(Ordering::Relaxed) as f32);
        votes.chunks_exact(D).map(of).collect()
    }

    #[inline(always)]
    fn sample(&self, task: Task<'_>, scratch: &mut Scratch<D>) -> Solved<[f32; D]> {
        let (own, axis) = (self.rows[task.slot], usize::from(task.axes[task.slot]));
        let (sections, may_vote) = (&mut scratch.sections, task.listed.len());
        sections.resize(may_vote);
        // Each listed record is its line along its voted axis: perpendicular to the own line, or parallel, which does not vote.
        for (j, record) in task.listed.iter().enumerate() {
            let (position, voted) = (self.rows[record.index()], task.axes[record.index()].into());
            let mut miss2 = 0.0;
            for c in 0..D {
                let d = position[c] - own[c];
                miss2 += if c == axis || c == voted { 0.0 } else { d * d };
            }
            sections.at[j] = position[axis];
            sections.bend[j] = 1.0;
            sections.miss2[j] = if voted == axis { NO_VOTE } else { miss2 };
        }
        let (solved, trials) = on_line(task, may_vote, scratch);
        let at = |t| std::array::from_fn(|c| if c == axis { t } else { own[c] });
        (solved.map(|(t, support)| (at(t), support)), trials)
    }
}

impl<const D: usize> Trials<D> for PlaneFamily<'_, D> {
    #[inline(always)]
    fn sample(&self, task: Task<'_>, scratch: &mut Scratch<D>) -> Solved<[f32; D]> {
        let Task { slot, listed, delta, mut draws, .. } = task;
        self.gather(listed, &mut scratch.by_axis);
        let by_axis = &scratch.by_axis;
        let free = (0..D).filter(|&axis| axis != self.axis(slot));
        if listed.len() < 2 || free.clone().any(|axis| by_axis[axis].is_empty()) {
            return (Err(Status::not_fixed(listed.len())), 0);
        }
        let n: u32 = free.clone().map(|axis| by_axis[axis].len() as u32).sum();
        let own = [self.planes.offset()[slot]; D];
        let draw = || {
            let mut place = own;
            for axis in free.clone() {
                let offsets = &by_axis[axis];
                let mut draw = || offsets[draws.below(offsets.len() as u64) as usize].0;
                place[axis] = (0..SAMPLE).map(|_| draw()).sum::<f32>() / SAMPLE as f32;
            }
            place
        };
        let support = |place: &[f32; D]| {
            let is_near = |axis: usize, x: f32| u32::from((x - place[axis]).abs() <= delta);
            let of_axis =
                |axis: usize| -> u32 { by_axis[axis].iter().map(|x| is_near(axis, x.0)).sum() };
            free.clone().map(of_axis).sum()
        };
        let (best, trials) = best_sample((n, SAMPLE * (D as u32 - 1)), draw, support);
        let Some((best, support)) = best else { return (Err(Status::NoSupport), trials) };
        let mut place = own;
        for axis in free {
            let away = by_axis[axis].iter().map(|x| x.0 - best[axis]);
            let near = away.filter(|away| away.abs() <= delta);
            let (sum, count) = near.fold((0.0, 0), |(sum, n), away| (sum + away, n + 1));
            place[axis] = best[axis] + if count > 0 { sum / count as f32 } else { 0.0 };
        }
        (Ok((place, support)), trials)
    }
}

/// Returns the axis with the largest value, the lowest of equal ones.
fn largest<const D: usize>(value: impl Fn(usize) -> f32) -> u8 {
    (1..D).fold(0, |best, axis| if value(axis) > value(best) { axis } else { best }) as u8
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
