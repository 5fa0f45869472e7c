//! The paper's sampling loop (section 4), kept for comparison.
//!
//! A few listed records are drawn, the least-squares position of Eq. (4) is computed from them, the
//! listed records within delta of it are counted, and the position with the largest support is
//! refined by least squares over that support. The number of trials follows the largest support
//! found so far (draws without replacement, 99 % confidence) and ends at 10,000. What the paper
//! leaves open is fixed here: samples of two records per unknown coordinate (planes may draw one twice).

mod axis_vote;
mod loops;

use std::ops::Range;

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::map::chunks::{Slots, solve_chunks};
use crate::recover::map::family::Family;
use crate::recover::map::line_rows::LineColumns;
use crate::recover::map::sections::Sections;
use crate::recover::result::estimate::{Estimate, Status, stored_support};
use crate::recover::result::trials::TrialCounts;
use crate::released::AxisPlanes;
use crate::seed::{Draws, Stage};
use crate::simd::{Kernel, dispatch};
use axis_vote::VotedColumns;
use loops::{LineLoop, PlaneLoop};

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
            Family::Candidates { rows, .. } => axis_vote::vote(rows, lists),
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
