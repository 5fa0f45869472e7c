//! The paper's sampling loop (section 4), kept for comparison.
//!
//! A few listed records are drawn, the least-squares position of Eq. (4) is computed from them, the
//! listed records within delta of it are counted, and the position with the largest support is
//! refined by least squares over that support. The number of trials follows the largest support
//! found so far (draws without replacement, 99 % confidence) and ends at 10,000. What the paper
//! leaves open is fixed here: samples of two records per unknown coordinate (planes may draw one twice).

mod axis_vote;
mod loops;

use std::sync::atomic::{AtomicU64, Ordering};

use super::chunks::{Chunks, solve_chunks};
use super::family::Family;
use super::line_rows::LineColumns;
use super::sections::Sections;
use super::{Estimate, Status, stored_support};
use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::released::AxisPlanes;
use crate::seed::{Draws, Stage};
use crate::simd::{Kernel, dispatch};
use axis_vote::VotedColumns;
use loops::{LineLoop, PlaneLoop};

/// Trials at most, as in the paper's timings.
pub(crate) const MAX_TRIALS: u32 = 10_000;

/// How many slots took how many trials.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrialHistogram {
    counts: [u64; TrialHistogram::UP_TO.len()],
}

impl TrialHistogram {
    /// Upper ends (inclusive) of the bins.
    pub const UP_TO: [u32; 9] = [1, 3, 10, 30, 100, 300, 1_000, 3_000, MAX_TRIALS];

    /// (upper end, slots) per bin.
    pub fn bins(&self) -> impl Iterator<Item = (u32, u64)> {
        Self::UP_TO.into_iter().zip(self.counts)
    }
}

/// Estimates for all slots, and how many trials they took.
pub(crate) fn solve<const D: usize>(
    family: &Family<'_, D>,
    lists: &Neighborhoods,
    delta: f32,
    seed: u64,
) -> (Vec<Estimate<D>>, TrialHistogram) {
    let bins: [AtomicU64; TrialHistogram::UP_TO.len()] = Default::default();
    // Sums of integers: the order in which threads add does not matter.
    let note = |trials: u32| {
        let bin = TrialHistogram::UP_TO.partition_point(|&up_to| up_to < trials);
        bins[bin.min(bins.len() - 1)].fetch_add(1, Ordering::Relaxed);
    };
    let n = lists.n_slots();
    let axes = match family {
        Family::Candidates { rows, .. } => axis_vote::vote(rows, lists),
        _ => Vec::new(),
    };
    let estimates = solve_chunks(n, Chunks::All, Scratch::default, |scratch, first, out| {
        for (at, estimate) in out.iter_mut().enumerate() {
            let slot = first + at;
            let draws = Draws::new(seed, Stage::Ransac, slot as u64);
            let trial = Trial { family, axes: &axes, lists, delta, slot, draws, scratch };
            let (solved, trials) = dispatch(trial);
            *estimate = solved;
            // Slots that could not be tried at all are lost with a reason, not solved in no time.
            if trials > 0 {
                note(trials);
            }
        }
    });
    (estimates, TrialHistogram { counts: bins.map(AtomicU64::into_inner) })
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
