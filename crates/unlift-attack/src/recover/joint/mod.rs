//! Joint recovery: estimates of neighbors improve the estimate of every slot (docs/decisions/attack.md).
//!
//! In an iteration every slot
//!
//! 1. proposes candidates on its own record: its old estimate, and projections of the estimates at the other ends of its edges;
//! 2. scores each candidate `x` in nats by
//!    `sum over edges j of ln(1 + odds_j * p_true(|x - x_j|) / p_random(x)) + 0.5 ln p_random(x) + ln p_range(x)`. If the best candidate
//!    elsewhere is nearly as good, the records that pass near the two decide;
//! 3. refines the best candidate by weighted least squares.
//!
//! `odds_j` are the odds that edge `j` leads to a true neighbor, `p_true` and `p_random` the densities of true neighbors and of all
//! estimates. `p_range` is the prior over ranges of rays whose center has an image region of its own; else 1.
//!
//! A slot *jumps* if it moves farther than one radius, which holds half of the true neighbors, or if its status changes. A slot whose
//! best candidate leads by a clear margin is updated again only if enough neighbors have jumped nearby since the last turn.
//!
//! All slots of a turn read the old estimates, so the result depends neither on order nor on threads. If all slots moved in one
//! turn, two neighbors could exchange places forever. So even and odd slots take turns after the first iteration.

mod neighbor_distribution;
mod update;
mod votes;

use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel;
use crate::recover::joint::neighbor_distribution::{Learning, REACH};
use crate::recover::joint::update::Context;
use crate::recover::joint::votes::TUBE;
use crate::recover::map::{
    Density, Family, along_curve, distance2, evenly, record_of, solve_slots,
};
use crate::recover::problem::Problem;
use crate::recover::result::Estimate;

const ITERATIONS: usize = 16;
/// Least radius, as a fraction of the largest coordinate: estimates of the same place differ by rounding.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// Smoothing width of the density of estimates, in radii: wide, so that a few estimates at one place hardly change it.
const SMOOTH: f32 = 4.5;
/// A slot is updated again once its margin is at most this many nats per jump of a neighbor: some jumps confirm the place.
const MARGIN_PER_JUMP: f32 = 2.0;
/// Iterations end when fewer than this fraction of the slots jump.
const SETTLED: f64 = 0.03;
/// Distribution and density are learned again after more than this fraction of slots have jumped; once per iteration is too rare.
const STALE: f64 = 0.02;
/// Iterations end when fewer than half of the slots jump, but more than this fraction of the number before.
const SLOW: f64 = 0.9;
/// Iterations end when agreement falls by more than this fraction of its best value; smaller changes are noise.
const WORSE: f64 = 0.08;

/// Returns the estimates of all slots after joint recovery from `start`.
pub(super) fn recover<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    start: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    let Problem { family, graph, .. } = *problem;
    let n = start.len();
    let order = along_curve(&start);
    let known = start.iter().filter(|estimate| estimate.is_known());
    let farthest = known.flat_map(|e| e.position).fold(0.0, |most: f32, x| most.max(x.abs()));
    let least_radius = (ROUNDING * farthest).max(f32::MIN_POSITIVE);
    let learn = |estimates: &[Estimate<D>], radius: f32| {
        let density = Density::new(estimates, &problem.listed, SMOOTH * radius);
        let learning = Learning { problem, estimates, density: &density, reach: REACH * radius };
        let neighbors = learning.distribution(least_radius);
        (density, neighbors)
    };
    let (mut density, mut neighbors) = learn(&start, F::MOST_RADIUS * problem.delta);
    let (mut accepted, mut estimates) = (start.clone(), start);
    // Per slot, the lead of its place over others in nats, or 0 if it must be updated again, and the number of jumps near it since the last turn of its group.
    let mut margin = vec![0.0f32; n];
    let mut jumps_near: Vec<AtomicU32> = (0..n).map(|_| AtomicU32::new(0)).collect();
    // As if all slots had jumped before.
    let (mut n_before, mut n_since_learning, mut best_agreement) = (n, 0, f64::NEG_INFINITY);
    for iteration in 0..ITERATIONS {
        let groups = if iteration == 0 { 1 } else { 2 };
        let mut n_jumped = 0;
        for group in 0..groups {
            if n_since_learning as f64 > STALE * n as f64 {
                let before = neighbors.most_imbalance;
                (density, neighbors) = learn(&estimates, neighbors.radius);
                n_since_learning = 0;
                if neighbors.most_imbalance != before {
                    // Margins under another bound are not comparable.
                    margin.fill(0.0);
                }
            }
            let moves = |&slot: &usize| {
                let n_jumps = jumps_near[slot].load(Ordering::Relaxed) as f32;
                let is_settled = margin[slot] > 0.0 && n_jumps <= margin[slot] / MARGIN_PER_JUMP;
                slot % groups == group && !is_settled
            };
            let slots: Vec<usize> = order.iter().copied().filter(moves).collect();
            let context = Context {
                problem,
                estimates: &estimates,
                density: &density,
                neighbors: &neighbors,
                odds: neighbors.odds_per_end(problem.graph),
            };
            let moved = solve_slots(&context, &slots);
            (group..n).step_by(groups).for_each(|slot| *jumps_near[slot].get_mut() = 0);
            let mut jumped = Vec::new();
            for (slot, (new, lead)) in slots.into_iter().zip(moved) {
                let old = std::mem::replace(&mut estimates[slot], new);
                let is_far = distance2(&old.position, &new.position) > neighbors.radius.powi(2);
                let jumps = is_far || old.status != new.status;
                // A slot that jumped is updated again in any case.
                margin[slot] = if jumps { 0.0 } else { lead };
                if jumps {
                    jumped.push((slot, [old.position, new.position]));
                }
            }
            n_jumped += jumped.len();
            n_since_learning += jumped.len();
            // A jump from or to a place near the record of a neighbor may concern the neighbor.
            let reach2 = (TUBE * neighbors.radius).powi(2);
            parallel::for_each(jumped.len(), &|at| {
                let (slot, places) = &jumped[at];
                for edge in graph.of(*slot) {
                    // Both slots of a record lie on one piece.
                    if graph.slots_at(edge).any(|slot| margin[slot] > 0.0)
                        && places.iter().any(|x| family.is_near(edge.0, x, reach2))
                    {
                        graph.slots_at(edge).for_each(|slot| {
                            jumps_near[slot].fetch_add(1, Ordering::Relaxed);
                        });
                    }
                }
            });
        }
        if (n_jumped as f64) < SETTLED * n as f64 {
            // So few jumps hardly change agreement.
            return estimates;
        }
        let agreement = agreement(problem, &estimates);
        if agreement < (1.0 - WORSE) * best_agreement {
            break;
        }
        best_agreement = best_agreement.max(agreement);
        accepted.clone_from(&estimates);
        if 2 * n_jumped < n && n_jumped as f64 > SLOW * n_before as f64 {
            break;
        }
        n_before = n_jumped;
    }
    accepted
}

/// Returns the mean number of records at the ends of a slot's edges within delta of its estimate, beyond chance.
///
/// Agreement is measured on records, because neighboring estimates can drift together and still agree with each other.
fn agreement<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    estimates: &[Estimate<D>],
) -> f64 {
    let Problem { family, graph, delta, .. } = problem;
    let of_slot = |&slot: &usize| {
        let estimate = &estimates[slot];
        if !estimate.is_known() {
            return 0.0;
        }
        let (mut near, mut all) = (0u32, 0u32);
        for (end, _) in graph.of(slot) {
            let record = record_of(end, graph.slots_per_record);
            if family.may_vote(slot, record) {
                let d2 = family.record_distance2(record, &estimate.position);
                all += 1;
                near += u32::from(d2 <= delta * delta);
            }
        }
        let chance = family.record_chance(slot, &estimate.position, &problem.at_delta);
        f64::from(near) - f64::from(all) * f64::from(chance)
    };
    let slots: Vec<usize> = evenly(estimates.len(), 1 << 12).collect();
    let of_slots = parallel::map(slots.len(), |at| of_slot(&slots[at]));
    of_slots.chunks(256).map(|part| part.iter().sum::<f64>()).sum::<f64>()
        / slots.len().max(1) as f64
}
