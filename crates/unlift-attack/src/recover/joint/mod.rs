//! Joint recovery: the estimates of neighbors vote, too.
//!
//! Consensus asks of every listed record whether its line or plane passes near. Joint recovery starts there and
//! iterates. In an iteration every slot
//!
//! 1. proposes candidates `x` on its own record: where the estimates of its listed neighbors project to (`update`);
//! 2. scores them by the log-likelihood ratio (nats)
//!    `sum over neighbors j of ln(1 + odds_j * p_true(|x - x_j|) / p_random(x)) + 0.5 ln p_random(x)`, where `odds_j` are the
//!    odds that edge j leads to a true neighbor, `p_true` is the density of true neighbors at a distance and
//!    `p_random` the density of estimates of all slots (`votes`);
//! 3. refines the best one by weighted least squares to the records of the neighbors found near (`refine`).
//!
//! `odds`, `p_true` and `p_random` are learned from the present estimates (`neighbor_distribution`, `map::grid`) and again
//! whenever enough slots jumped. Iterations end when few slots jump, or when fewer records pass near the estimates (`state`).
//!
//! Slots move from the old estimates, so that neither order nor threads matter. If all of them moved at once, two neighbors
//! could change places for ever. So half of the slots hold still while the others move. Only the first iteration moves all:
//! its start comes from records alone.

mod input;
mod least_squares;
mod neighbor_distribution;
mod state;
mod update;
mod votes;

use crate::recover::joint::input::Input;
use crate::recover::joint::state::State;
use crate::recover::map::family::Family;
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, Pieces, PlanePieces};
use crate::recover::map::places::along_curve;
use crate::recover::result::Estimate;

/// Iterations at most: a bound for maps that never settle.
const ITERATIONS: usize = 16;

/// Rays from anchors are left where they are if their evidence is less than this in the mean, in nats: where
/// bearings say hardly more than chance does, neighbors' estimates are those of chance, too.
const LEAST_EVIDENCE: f64 = 1.5;

/// The estimates of all slots after the last iteration from `start`.
pub(crate) fn recover<const D: usize>(
    family: &Family<'_, D>,
    graph: &Graph,
    delta: f32,
    seed: u64,
    start: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    if family.has_regions() && mean_evidence(&start) < LEAST_EVIDENCE {
        return start;
    }
    match family {
        Family::Lines { rows, slots_per_record, chance } => {
            let pieces = LinePieces::new(rows, *slots_per_record, chance, delta);
            iterate(&Input::new(pieces, graph, delta, seed), start)
        }
        Family::Planes { planes, sorted } => {
            let pieces = PlanePieces::new(planes, sorted, delta);
            iterate(&Input::new(pieces, graph, delta, seed), start)
        }
        Family::Candidates { rows, chance } => {
            let pieces = CandidatePieces::new(rows, chance, delta);
            iterate(&Input::new(pieces, graph, delta, seed), start)
        }
    }
}

fn iterate<const D: usize, P: Pieces<D>>(
    input: &Input<'_, P>,
    start: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    let mut state = State::new(input, start);
    let order = along_curve(state.places());
    for iteration in 0..ITERATIONS {
        let groups = if iteration == 0 { 1 } else { 2 };
        for group in 0..groups {
            state.learn_if_stale(input);
            let is_moving = |slot: &u32| *slot as usize % groups == group;
            let slots = order.iter().copied().filter(is_moving);
            let updates = state.propose_score_refine(input, slots);
            state.apply(input, &updates);
        }
        if state.has_converged(input) {
            break;
        }
    }
    state.into_accepted()
}

fn mean_evidence<const D: usize>(estimates: &[Estimate<D>]) -> f64 {
    let sum: f64 = estimates.iter().map(|e| f64::from(e.evidence)).sum();
    sum / estimates.len().max(1) as f64
}
