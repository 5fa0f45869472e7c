//! Consensus for axis candidates: axis and position are chosen together.

use super::refit;
use crate::RecordId;
use crate::recover::candidate_rows::CandidateColumns;
use crate::recover::chance::Chance;
use crate::recover::chunks::{Chunks, solve_chunks};
use crate::recover::lists::Lists;
use crate::recover::null_sample::{NULL_RECORDS, draw};
use crate::recover::sections::{Intervals, Sections, Starts};
use crate::recover::{Estimate, Status, stored_support};
use crate::simd::{Kernel, dispatch};

/// Estimates for the slots of `chunks`.
pub(super) fn solve<const D: usize>(
    rows: &[[f32; D]],
    lists: Lists<'_>,
    delta: f32,
    seed: u64,
    chunks: Chunks<'_>,
) -> Vec<Estimate<D>> {
    let chance = Chance::new(lists.longest(), NULL_RECORDS);
    let problem = Problem { rows, lists, delta2: delta * delta, chance };
    solve_chunks(lists.n_slots(), chunks, Scratch::default, |scratch, first, out| {
        scratch.null.gather(rows, &draw(lists, first, seed, |_| true));
        dispatch(Chunk { problem: &problem, first, out, scratch });
    })
}

struct Problem<'a, const D: usize> {
    rows: &'a [[f32; D]],
    lists: Lists<'a>,
    delta2: f32,
    chance: Chance,
}

#[derive(Default)]
struct Scratch<const D: usize> {
    listed: CandidateColumns<D>,
    null: CandidateColumns<D>,
    sections: Sections,
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
        for (at, estimate) in out.iter_mut().enumerate() {
            *estimate = solve_slot(problem, first + at, scratch);
        }
    }
}

/// Sweeps each own axis. Chance decides between them too: counts alone would favor the long axis of
/// an elongated map, along which more records agree with anything.
#[inline(always)]
fn solve_slot<const D: usize>(
    problem: &Problem<'_, D>,
    slot: usize,
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Problem { rows, lists, delta2, chance } = problem;
    let own = &rows[slot];
    let listed = lists.of(slot, &mut scratch.buffer);
    if listed.len() < 2 {
        return Estimate::lost(Status::TooFewNeighbors);
    }
    scratch.listed.gather(rows, listed);
    let mut best = Estimate::lost(Status::NoSupport);
    let mut best_score = f32::NEG_INFINITY;
    for axis in 0..D {
        scratch.null.sections(own, axis, *delta2, &mut scratch.sections);
        scratch.null_intervals.fill(&scratch.sections, *delta2, f32::NEG_INFINITY);
        scratch.listed.sections(own, axis, *delta2, &mut scratch.sections);
        scratch.intervals.fill(&scratch.sections, *delta2, f32::NEG_INFINITY);
        let (listed_intervals, null) = (&scratch.intervals, &scratch.null_intervals);
        let Some(peak) = scratch.starts.best(listed_intervals, null, listed.len(), chance) else {
            continue;
        };
        if peak.score > best_score {
            best_score = peak.score;
            let (t, support) = refit(&scratch.sections, peak.t, *delta2);
            let mut position = *own;
            position[axis] = t;
            best = Estimate {
                position,
                status: Status::Ok,
                support: stored_support(support),
                axis: axis as u8,
                evidence: peak.evidence,
            };
        }
    }
    best
}
