//! Consensus for axis candidates: axis and position are chosen together.

use crate::RecordId;
use crate::recover::consensus::on_lines::refit;
use crate::recover::map::chance::CandidateField;
use crate::recover::map::lines::{CandidateColumns, Intervals, Sections};
use crate::recover::map::lists::{Lists, Slots, solve_chunks};
use crate::recover::result::{Estimate, Status, stored_support};
use crate::simd::{Kernel, dispatch};

/// Estimates for `slots`.
pub(super) fn solve<const D: usize>(
    rows: &[[f32; D]],
    chance: &CandidateField<D>,
    lists: Lists<'_>,
    delta: f32,
    slots: Slots<'_>,
) -> Vec<Estimate<D>> {
    let tubes = chance.tubes(delta);
    let problem = Problem { rows, chance, lists, delta2: delta * delta, tubes };
    solve_chunks(lists.n_slots(), slots, Scratch::default, |scratch, first, out| {
        dispatch(Chunk { problem: &problem, first, out, scratch });
    })
}

struct Problem<'a, const D: usize> {
    rows: &'a [[f32; D]],
    chance: &'a CandidateField<D>,
    lists: Lists<'a>,
    delta2: f32,
    tubes: [f32; D],
}

#[derive(Default)]
struct Scratch<const D: usize> {
    listed: CandidateColumns<D>,
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

/// Sweeps each own axis. Chance decides between them too: counts alone would favor the long axis of
/// an elongated map, along which more records agree with anything.
#[inline(always)]
fn solve_slot<const D: usize>(
    problem: &Problem<'_, D>,
    slot: usize,
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Problem { rows, chance, lists, delta2, tubes } = problem;
    let own = &rows[slot];
    let listed = lists.of(slot, &mut scratch.buffer);
    if listed.len() < 2 {
        return Estimate::lost(Status::TooFewNeighbors);
    }
    scratch.listed.gather(rows, listed);
    let mut best = Estimate::lost(Status::NoSupport);
    let mut best_score = f32::NEG_INFINITY;
    for axis in 0..D {
        scratch.listed.sections(own, axis, *delta2, &mut scratch.sections);
        scratch.intervals.fill(&scratch.sections, *delta2, f32::NEG_INFINITY, f32::INFINITY);
        let Some(peak) = scratch.intervals.best_start(listed.len(), |t, cells, chances| {
            chance.add_along((own, axis), t, tubes, (cells, chances));
        }) else {
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
