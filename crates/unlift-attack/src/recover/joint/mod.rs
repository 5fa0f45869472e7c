//! Joint recovery: estimates of neighbors improve the estimate of every slot.
//!
//! Joint recovery starts from the estimates of consensus and iterates. In an iteration every slot
//!
//! 1. proposes candidates on its own record: its old estimate, and projections of the estimates at the other ends of its edges,
//!    at most 16 per piece of its feasible set. An edge leads to a record that the slot lists or that lists the slot's record;
//! 2. scores each candidate `x` in nats by
//!    `sum over edges j of ln(1 + odds_j * p_true(|x - x_j|) / p_random(x)) + 0.5 ln p_random(x) + ln p_range(x)`, see below. If the best candidate
//!    elsewhere is nearly as good, the records that pass near the two decide;
//! 3. refines the best candidate by weighted least squares (`least_squares`). Each nearby neighbor's estimate counts fully
//!    across its own record and less along it.
//!
//! `odds_j` are the odds that edge `j` leads to a true neighbor, `p_true` is the density of true neighbors at a distance, and
//! `p_random` is the density of the estimates of all slots. `p_range` is the prior over ranges of rays whose center has an image
//! region of its own; it is 1 for other records. Where wrong entries form clusters, the sums of forward and of reverse
//! edges may differ only up to a bound (`votes`).
//!
//! A slot *jumps* if it moves farther than one radius, which holds half of the true neighbors, or if its status changes. A slot whose
//! best candidate leads by a clear margin is updated again only after enough neighbors have jumped nearby. `odds`,
//! `p_true` and `p_random` are learned from the current estimates (`neighbor_distribution`, `map::grid`), and again after
//! enough slots have jumped. Iterations end when few slots jump, when the number of jumps hardly falls, when fewer records pass
//! near the estimates than before, or after 16 iterations (`state`).
//!
//! All slots of a turn read the old estimates, so the result depends neither on order nor on threads. If all slots moved in one
//! turn, two neighbors could exchange places forever. So even and odd slots take turns. Only the first iteration moves all
//! slots in one turn, because it starts from estimates that depend on records alone.

mod least_squares;
mod neighbor_distribution;
mod state;
mod update;
mod votes;

use crate::recover::joint::state::State;
use crate::recover::map::family::Family;
use crate::recover::map::places::along_curve;
use crate::recover::problem::Problem;
use crate::recover::result::Estimate;

const ITERATIONS: usize = 16;

/// Returns the estimates of all slots after joint recovery from `start`.
pub(super) fn recover<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    start: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    let mut state = State::new(problem, start);
    let order = along_curve(state.places());
    for iteration in 0..ITERATIONS {
        let groups = if iteration == 0 { 1 } else { 2 };
        for group in 0..groups {
            state.learn_if_stale(problem);
            let is_moving = |slot: &u32| *slot as usize % groups == group;
            let slots = order.iter().copied().filter(is_moving);
            let updates = state.propose_score_refine(problem, slots);
            state.apply(problem, &updates);
        }
        if state.has_converged(problem) {
            break;
        }
    }
    state.into_accepted()
}
