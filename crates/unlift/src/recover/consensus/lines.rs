//! Consensus for lines and rays: one unknown, sections with the listed lines.

use super::refit;
use crate::RecordId;
use crate::recover::chance::Chance;
use crate::recover::chunks::{Chunks, solve_chunks};
use crate::recover::line_rows::{LineColumns, LineRow};
use crate::recover::lists::Lists;
use crate::recover::null_sample::{NULL_RECORDS, draw};
use crate::recover::sections::{Intervals, Sections, Starts};
use crate::recover::{Estimate, Status, stored_support};
use crate::simd::{Kernel, dispatch};

/// Estimates for the slots of `chunks`.
pub(super) fn solve<const D: usize>(
    rows: &[LineRow<D>],
    slots_per_record: usize,
    lists: Lists<'_>,
    delta: f32,
    seed: u64,
    chunks: Chunks<'_>,
) -> Vec<Estimate<D>> {
    let problem = Problem {
        rows,
        slots_per_record,
        lists,
        delta2: delta * delta,
        seed,
        chance: Chance::new(lists.longest(), NULL_RECORDS),
    };
    solve_chunks(lists.n_slots(), chunks, Scratch::default, |scratch, first, out| {
        dispatch(Chunk { problem: &problem, first, out, scratch });
    })
}

struct Problem<'a, const D: usize> {
    rows: &'a [LineRow<D>],
    slots_per_record: usize,
    lists: Lists<'a>,
    delta2: f32,
    seed: u64,
    chance: Chance,
}

#[derive(Default)]
struct Scratch<const D: usize> {
    listed: LineColumns<D>,
    /// The chunk's null sample per own group (rays of one center are no evidence for each other).
    null: Vec<(u32, LineColumns<D>)>,
    sections: Sections,
    null_sections: Sections,
    intervals: Intervals,
    null_intervals: Intervals,
    starts: Starts,
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
        scratch.null.clear();
        for (at, estimate) in out.iter_mut().enumerate() {
            *estimate = solve_slot(problem, first, first + at, scratch);
        }
    }
}

#[inline(always)]
fn solve_slot<const D: usize>(
    problem: &Problem<'_, D>,
    first: usize,
    slot: usize,
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Problem { rows, lists, delta2, chance, .. } = problem;
    let own = &rows[slot / problem.slots_per_record];
    let listed = lists.of(slot, &mut scratch.buffer);
    scratch.listed.gather(rows, listed);
    scratch.listed.sections(own, &mut scratch.sections);
    let may_vote = listed.iter().filter(|r| rows[r.index()].may_vote_for(own)).count();
    if scratch.sections.n_voting() < 2 {
        let few = may_vote < 2;
        return Estimate::lost(if few { Status::TooFewNeighbors } else { Status::Degenerate });
    }
    let sample = null_sample(problem, first, own, &mut scratch.null);
    scratch.null[sample].1.sections(own, &mut scratch.null_sections);
    scratch.intervals.fill(&scratch.sections, *delta2, own.floor());
    scratch.null_intervals.fill(&scratch.null_sections, *delta2, own.floor());
    let peak = scratch.starts.best(&scratch.intervals, &scratch.null_intervals, may_vote, chance);
    let Some(peak) = peak else {
        return Estimate::lost(Status::NoSupport);
    };
    let (t, support) = refit(&scratch.sections, peak.t, *delta2);
    Estimate {
        position: own.at(t.max(own.floor())),
        status: Status::Ok,
        support: stored_support(support),
        axis: 0,
        evidence: peak.evidence,
    }
}

/// The index of the chunk's null sample for slots of `own`'s group, drawn when first needed.
#[inline(always)]
fn null_sample<const D: usize>(
    problem: &Problem<'_, D>,
    first: usize,
    own: &LineRow<D>,
    null: &mut Vec<(u32, LineColumns<D>)>,
) -> usize {
    if let Some(known) = null.iter().position(|(group, _)| *group == own.group) {
        return known;
    }
    let rows = problem.rows;
    let sample = draw(problem.lists, first, problem.seed, |r| rows[r.index()].may_vote_for(own));
    let mut columns = LineColumns::default();
    columns.gather(rows, &sample);
    null.push((own.group, columns));
    null.len() - 1
}
