//! The paper's sampling loop (section 4), kept for comparison.
//!
//! A few listed records are drawn, the least-squares position of Eq. (4) is computed from them, the
//! listed records within delta of it are counted, and the position with the largest support is
//! refined by least squares over that support. The number of trials follows the largest support
//! found so far (draws without replacement, 99 % confidence) and ends at 10,000. What the paper
//! leaves open is fixed here: samples of two records per unknown coordinate (planes may draw one twice).

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::map::family::Family;
use crate::recover::map::lines::{LineColumns, NO_VOTE, Sections};
use crate::recover::map::lists::{Slots, solve_chunks};
use crate::recover::result::{Estimate, MAX_TRIALS, Status, TrialCounts, stored_support};
use crate::released::AxisPlanes;
use crate::seed::{Draws, Stage};
use crate::simd::{Kernel, dispatch};

/// The sampling loop over one map.
pub(crate) struct Ransac<'a, const D: usize> {
    pub(crate) family: &'a Family<'a, D>,
    pub(crate) lists: &'a Neighborhoods,
    /// The distance up to which a record supports a place, in the unit of the map.
    pub(crate) delta: f32,
    pub(crate) seed: u64,
    /// Where it is noted how many trials slots took.
    pub(crate) trials: &'a TrialCounts,
}

impl<const D: usize> Ransac<'_, D> {
    /// The estimates of `slots`, in order.
    pub(crate) fn solve(&self, slots: Range<usize>) -> Vec<Estimate<D>> {
        let Self { family, lists, delta, seed, .. } = *self;
        let axes = match family {
            Family::Candidates { rows, .. } => vote(rows, lists),
            Family::Lines { .. } | Family::Planes { .. } => Vec::new(),
        };
        let slots = Slots::Range(slots);
        solve_chunks(lists.n_slots(), slots, Scratch::default, |scratch, first, out| {
            for (at, estimate) in out.iter_mut().enumerate() {
                let slot = first + at;
                let draws = Draws::new(seed, Stage::Ransac, slot as u64);
                let trial = Trial { family, axes: &axes, lists, delta, slot, draws, scratch };
                let (solved, trials) = dispatch(trial);
                *estimate = solved;
                // Slots that could not be tried at all are lost with a reason, not solved in no time.
                if trials > 0 {
                    self.trials.note(trials);
                }
            }
        })
    }
}

#[derive(Default)]
struct Scratch<const D: usize> {
    lines: LineColumns<D>,
    voted: VotedColumns<D>,
    sections: Sections,
    line_loop: LineLoop,
    plane_loop: PlaneLoop,
}

struct Trial<'a, const D: usize> {
    family: &'a Family<'a, D>,
    axes: &'a [u8],
    lists: &'a Neighborhoods,
    delta: f32,
    slot: usize,
    draws: Draws,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize> Kernel for Trial<'_, D> {
    type Output = (Estimate<D>, u32);

    #[inline(always)]
    fn run(mut self) -> Self::Output {
        let listed = self.lists.of(self.slot);
        match self.family {
            Family::Lines { rows, slots_per_record, .. } => {
                let own = &rows[self.slot / slots_per_record];
                self.scratch.lines.gather(rows, listed);
                self.scratch.lines.sections(own, &mut self.scratch.sections);
                let may_vote = listed.iter().filter(|r| rows[r.index()].may_vote_for(own)).count();
                let (found, trials) = self.on_line(may_vote);
                (found.at(|t| own.at(own.clamp(t)), 0), trials)
            }
            Family::Candidates { rows, .. } => {
                let axis = self.axes[self.slot];
                let own = &rows[self.slot];
                self.scratch.voted.gather(rows, self.axes, listed);
                self.scratch.voted.sections(own, axis, &mut self.scratch.sections);
                let (found, trials) = self.on_line(listed.len());
                let place = |t| std::array::from_fn(|c| if c == axis.into() { t } else { own[c] });
                (found.at(place, axis), trials)
            }
            Family::Planes { planes, .. } => self.on_plane(planes),
        }
    }
}

/// The outcome of the loop along a line.
enum Found {
    Lost(Status),
    At { t: f32, support: u32 },
}

impl Found {
    #[inline(always)]
    fn at<const D: usize>(self, place: impl Fn(f32) -> [f32; D], axis: u8) -> Estimate<D> {
        match self {
            Found::Lost(status) => Estimate { axis, ..Estimate::lost(status) },
            Found::At { t, support } => Estimate {
                position: place(t),
                status: Status::Ok,
                support: stored_support(support),
                axis,
                evidence: 0.0,
            },
        }
    }
}

impl<const D: usize> Trial<'_, D> {
    #[inline(always)]
    fn on_line(&mut self, may_vote: usize) -> (Found, u32) {
        let sections = &self.scratch.sections;
        if sections.n_voting() < 2 {
            let few = may_vote < 2;
            return (
                Found::Lost(if few { Status::TooFewNeighbors } else { Status::Degenerate }),
                0,
            );
        }
        let (best, trials) = self.scratch.line_loop.run(sections, self.delta, &mut self.draws);
        match best {
            Some((t, support)) => (Found::At { t, support }, trials),
            None => (Found::Lost(Status::NoSupport), trials),
        }
    }

    #[inline(always)]
    fn on_plane(&mut self, planes: &AxisPlanes<D>) -> (Estimate<D>, u32) {
        let listed = self.lists.of(self.slot);
        let own = usize::from(planes.axis()[self.slot]);
        let free = |record: &&RecordId| usize::from(planes.axis()[record.index()]) != own;
        let votes = listed
            .iter()
            .filter(free)
            .map(|r| (planes.axis()[r.index()], planes.offset()[r.index()]));
        let scratch = &mut *self.scratch;
        if listed.len() < 2 {
            return (Estimate::lost(Status::TooFewNeighbors), 0);
        }
        let mut position = [0.0; D];
        position[own] = planes.offset()[self.slot];
        scratch.plane_loop.fill(votes);
        match scratch.plane_loop.run(&mut position, own, self.delta, &mut self.draws) {
            Err(status) => (Estimate::lost(status), 0),
            Ok((support, trials)) => {
                let support = stored_support(support);
                let status = Status::Ok;
                (Estimate { position, status, support, axis: 0, evidence: 0.0 }, trials)
            }
        }
    }
}

// The sampling loop itself: along a line, and on an axis plane.

/// Probability of having drawn a sample free of outliers at which the loop stops.
const CONFIDENCE: f64 = 0.99;

/// Trials after which a sample of `size` among `inliers` of `n` was drawn with [`CONFIDENCE`].
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

/// Votes along one line, without those that say nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct LineLoop {
    votes: Sections,
}

/// Records per sample along a line: twice what fixes a place, as the paper leaves it open.
const LINE_SAMPLE: u32 = 2;

impl LineLoop {
    /// The position with the largest support and that support, after the final least squares;
    /// `None` when no position has any. Also the number of trials.
    #[inline(always)]
    pub(super) fn run(
        &mut self,
        sections: &Sections,
        delta: f32,
        draws: &mut Draws,
    ) -> (Option<(f32, u32)>, u32) {
        let votes = &mut self.votes;
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
        let n = votes.len();
        let delta2 = delta * delta;
        let (mut best_t, mut best) = (0.0, 0);
        let (mut trials, mut needed) = (0, MAX_TRIALS);
        while trials < needed {
            trials += 1;
            let one = draws.below(n as u64) as usize;
            let mut other = draws.below(n as u64 - 1) as usize;
            other += usize::from(other >= one);
            let (a, b) = (votes.bend[one], votes.bend[other]);
            let t = (a * votes.at[one] + b * votes.at[other]) / (a + b);
            let support = count(votes, t, delta2);
            if support > best {
                (best_t, best) = (t, support);
                needed = trials_needed(support, n as u32, LINE_SAMPLE);
            }
        }
        if best == 0 {
            return (None, trials);
        }
        let (mut weight, mut sum) = (0.0f32, 0.0f32);
        for j in 0..n {
            if votes.squared_distance(j, best_t) <= delta2 {
                weight += votes.bend[j];
                sum += votes.bend[j] * (votes.at[j] - best_t);
            }
        }
        (Some((best_t + sum / weight, best)), trials)
    }
}

#[inline(always)]
fn count(votes: &Sections, t: f32, delta2: f32) -> u32 {
    let n = votes.len();
    let (at, miss2, bend) = (&votes.at[..n], &votes.miss2[..n], &votes.bend[..n]);
    let mut support = 0;
    for j in 0..n {
        let d = t - at[j];
        support += u32::from(miss2[j] + bend[j] * d * d <= delta2);
    }
    support
}

/// Votes on the free axes of one plane.
#[derive(Clone, Debug, Default)]
pub(super) struct PlaneLoop {
    /// Offsets by axis.
    offsets: Vec<Vec<f32>>,
}

/// Records per sample and free axis of a plane: the same.
const PLANE_SAMPLE: u32 = 2;

impl PlaneLoop {
    /// Takes the votes of one slot, as (axis, offset).
    #[inline(always)]
    pub(super) fn fill(&mut self, votes: impl Iterator<Item = (u8, f32)>) {
        self.offsets.iter_mut().for_each(Vec::clear);
        for (axis, offset) in votes {
            let axis = usize::from(axis);
            if self.offsets.len() <= axis {
                self.offsets.resize_with(axis + 1, Vec::new);
            }
            self.offsets[axis].push(offset);
        }
    }

    /// Fills the free coordinates of `position`; returns (support, trials).
    ///
    /// # Errors
    /// `Degenerate` when a free axis has no vote.
    #[inline(always)]
    pub(super) fn run<const D: usize>(
        &self,
        position: &mut [f32; D],
        own: usize,
        delta: f32,
        draws: &mut Draws,
    ) -> Result<(u32, u32), Status> {
        let of = |axis: usize| self.offsets.get(axis).map_or(&[][..], Vec::as_slice);
        let free = (0..D).filter(|&axis| axis != own);
        if free.clone().any(|axis| of(axis).is_empty()) {
            return Err(Status::Degenerate);
        }
        let n: u32 = free.clone().map(|axis| of(axis).len() as u32).sum();
        let (mut best_place, mut best) = (*position, 0);
        let (mut trials, mut needed) = (0, MAX_TRIALS);
        while trials < needed {
            trials += 1;
            let mut place = *position;
            for axis in free.clone() {
                let offsets = of(axis);
                let mut draw = || offsets[draws.below(offsets.len() as u64) as usize];
                let sum: f32 = (0..PLANE_SAMPLE).map(|_| draw()).sum();
                place[axis] = sum / PLANE_SAMPLE as f32;
            }
            let support = free.clone().map(|a| count_within(of(a), place[a], delta)).sum();
            if support > best {
                (best_place, best) = (place, support);
                needed = trials_needed(support, n, PLANE_SAMPLE * (D as u32 - 1));
            }
        }
        if best == 0 {
            return Err(Status::NoSupport);
        }
        for axis in free {
            let near = of(axis).iter().filter(|x| (*x - best_place[axis]).abs() <= delta);
            let (sum, count) =
                near.fold((0.0, 0), |(sum, n), x| (sum + (x - best_place[axis]), n + 1));
            position[axis] = best_place[axis] + if count > 0 { sum / count as f32 } else { 0.0 };
        }
        Ok((best, trials))
    }
}

#[inline(always)]
fn count_within(offsets: &[f32], place: f32, delta: f32) -> u32 {
    offsets.iter().map(|x| u32::from((x - place).abs() <= delta)).sum()
}

// Which coordinate of a permuted point was exchanged: the vote of supplement A.

/// The exchanged axis of every record, by majority over all neighborhoods it appears in.
///
/// In a neighborhood (a slot's record and those listed for it), each member guesses the axis along
/// which its summed distance to the others is largest. "Relatively larger" in the paper is undefined;
/// sums are divided by their mean over the neighborhood, else every record votes for the long axis
/// of an elongated map. Ties go to the lower axis.
pub(super) fn vote<const D: usize>(rows: &[[f32; D]], lists: &Neighborhoods) -> Vec<u8> {
    let votes: Vec<[AtomicU32; D]> =
        rows.iter().map(|_| std::array::from_fn(|_| AtomicU32::new(0))).collect();
    (0..lists.n_slots()).into_par_iter().for_each_init(
        || (Vec::new(), std::array::from_fn::<Vec<f32>, D, _>(|_| Vec::new())),
        |(members, sums), slot| {
            members.clear();
            members.push(RecordId::from_index(slot));
            members.extend_from_slice(lists.of(slot));
            for (axis, sums) in sums.iter_mut().enumerate() {
                relative_distances(rows, members, axis, sums);
            }
            for (at, member) in members.iter().enumerate() {
                let guess = largest::<D>(|axis| sums[axis][at]);
                votes[member.index()][usize::from(guess)].fetch_add(1, Ordering::Relaxed);
            }
        },
    );
    votes
        .iter()
        .map(|votes| largest::<D>(|axis| votes[axis].load(Ordering::Relaxed) as f32))
        .collect()
}

/// The axis with the largest value, the lowest of equals.
fn largest<const D: usize>(value: impl Fn(usize) -> f32) -> u8 {
    let mut best = 0;
    for axis in 1..D {
        if value(axis) > value(best) {
            best = axis;
        }
    }
    best as u8
}

/// Per member the sum of distances to the others along `axis`, divided by its mean.
fn relative_distances<const D: usize>(
    rows: &[[f32; D]],
    members: &[RecordId],
    axis: usize,
    sums: &mut Vec<f32>,
) {
    let value = |member: &RecordId| rows[member.index()][axis];
    sums.clear();
    sums.extend(
        members
            .iter()
            .map(|one| members.iter().map(|other| (value(one) - value(other)).abs()).sum::<f32>()),
    );
    let mean = sums.iter().sum::<f32>() / sums.len() as f32;
    if mean > 0.0 {
        sums.iter_mut().for_each(|sum| *sum /= mean);
    }
}

/// Listed records, each reduced to the one line its vote left.
#[derive(Clone, Debug)]
pub(super) struct VotedColumns<const D: usize> {
    position: Vec<[f32; D]>,
    axis: Vec<u8>,
}

impl<const D: usize> Default for VotedColumns<D> {
    fn default() -> Self {
        Self { position: Vec::new(), axis: Vec::new() }
    }
}

impl<const D: usize> VotedColumns<D> {
    /// Gathers `records` and their axes.
    #[inline(always)]
    pub(super) fn gather(&mut self, rows: &[[f32; D]], axes: &[u8], records: &[RecordId]) {
        self.position.clear();
        self.position.extend(records.iter().map(|record| rows[record.index()]));
        self.axis.clear();
        self.axis.extend(records.iter().map(|record| axes[record.index()]));
    }

    /// Sections with the line through `own` along `axis`: perpendicular, or parallel and silent.
    #[inline(always)]
    pub(super) fn sections(&self, own: &[f32; D], axis: u8, out: &mut Sections) {
        out.resize(self.position.len());
        for (j, (position, &other)) in self.position.iter().zip(&self.axis).enumerate() {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_follow_the_hypergeometric_law() {
        // All inliers: one trial. 5 of 50, pairs: ln 0.01 / ln(1 - 20/2450) = 562.
        assert_eq!(trials_needed(50, 50, 2), 1);
        assert_eq!(trials_needed(5, 50, 2), 562);
        assert_eq!(trials_needed(1, 50, 2), MAX_TRIALS);
    }
}
