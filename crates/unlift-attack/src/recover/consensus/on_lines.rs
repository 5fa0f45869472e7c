//! Consensus for lines and rays: one unknown, sections with the listed lines.

use crate::RecordId;
use crate::recover::map::chance::{ChanceField, tube};
use crate::recover::map::lines::{Intervals, LineColumns, LineRow, Sections};
use crate::recover::map::lists::{Lists, Slots, solve_chunks};
use crate::recover::result::{Estimate, Status, stored_support};
use crate::simd::{Kernel, dispatch};

/// Estimates for `slots`.
pub(super) fn solve<const D: usize>(
    rows: &[LineRow<D>],
    slots_per_record: usize,
    chance: &[ChanceField<D>],
    lists: Lists<'_>,
    delta: f32,
    slots: Slots<'_>,
) -> Vec<Estimate<D>> {
    let problem = Problem {
        rows,
        slots_per_record,
        chance,
        lists,
        delta2: delta * delta,
        tube: tube(D, delta),
    };
    solve_chunks(lists.n_slots(), slots, Scratch::default, |scratch, first, out| {
        dispatch(Chunk { problem: &problem, first, out, scratch });
    })
}

struct Problem<'a, const D: usize> {
    rows: &'a [LineRow<D>],
    slots_per_record: usize,
    chance: &'a [ChanceField<D>],
    lists: Lists<'a>,
    delta2: f32,
    tube: f32,
}

#[derive(Default)]
struct Scratch<const D: usize> {
    listed: LineColumns<D>,
    sections: Sections,
    intervals: Intervals,
    buffer: Vec<RecordId>,
}

struct Chunk<'a, const D: usize> {
    problem: &'a Problem<'a, D>,
    first: usize,
    out: &'a mut [Estimate<D>],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize> Kernel for Chunk<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { problem, first, out, scratch } = self;
        for (at, estimate) in out.iter_mut().enumerate() {
            problem.lists.prefetch(first + at + 1, problem.rows);
            *estimate = solve_slot(problem, first + at, scratch);
        }
    }
}

#[inline(always)]
fn solve_slot<const D: usize>(
    problem: &Problem<'_, D>,
    slot: usize,
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Problem { rows, lists, delta2, .. } = problem;
    let own = &rows[slot / problem.slots_per_record];
    let listed = lists.of(slot, &mut scratch.buffer);
    scratch.listed.gather(rows, listed);
    scratch.listed.sections(own, &mut scratch.sections);
    let may_vote = scratch.listed.n_that_may_vote(own);
    if scratch.sections.n_voting() < 2 {
        let few = may_vote < 2;
        return Estimate::lost(if few { Status::TooFewNeighbors } else { Status::Degenerate });
    }
    scratch.intervals.fill(&scratch.sections, *delta2, own.floor(), own.to);
    let field = &problem.chance[if own.is_ray() { own.group as usize } else { 0 }];
    let Some(peak) = scratch.intervals.best_start(may_vote, |t, cells, chance| {
        field.add_along((&own.through, &own.direction), t, problem.tube, (cells, chance));
    }) else {
        return Estimate::lost(Status::NoSupport);
    };
    let (t, support) = refit(&scratch.sections, peak.t, *delta2);
    Estimate {
        position: own.at(own.clamp(t)),
        status: Status::Ok,
        support: stored_support(support),
        axis: 0,
        evidence: peak.evidence,
    }
}

// The last step of consensus along a line.

/// Least squares over the records within delta of `t` (Eq. (4) with squared distances: on a line a
/// weighted mean of the closest approaches), the support selected anew once. Returns the position
/// and its support.
#[inline(always)]
pub(crate) fn refit(sections: &Sections, t: f32, delta2: f32) -> (f32, u32) {
    // The start of an interval is at delta up to rounding, of delta and of t: it counts as within.
    let reach = delta2.sqrt() * (1.0 + 5e-5) + 4.0 * f32::EPSILON * t.abs();
    let reach2 = reach * reach;
    let (shift, _) = sections.least_squares_step(t, reach2);
    let t = t + shift;
    let (shift, support) = sections.least_squares_step(t, reach2);
    (t + shift, support)
}
