//! The state of joint recovery: estimates, what is learned from them, and the rule that ends iterations.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use crate::recover::joint::neighbor_distribution::NeighborDistribution;
use crate::recover::joint::update::{Context, Scratch, TUBE};
use crate::recover::map::family::Family;
use crate::recover::map::graph::{either, record_of};
use crate::recover::map::grid::Density;
use crate::recover::map::lists::CHUNK;
use crate::recover::map::places::{Places, distance2};
use crate::recover::problem::Problem;
use crate::recover::result::{Estimate, Status};
use crate::simd::{Kernel, dispatch};

/// Least radius, as a fraction of the largest coordinate: estimates of the same place differ by rounding.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// Smoothing width of the density of estimates, in radii: wide, so that a few estimates at one place hardly change it.
const SMOOTH: f32 = 4.5;
/// A slot is updated again once its margin is below this many nats per jump of a neighbor. One jump can change the score by more,
/// but some jumps confirm the place.
const MARGIN_PER_JUMP: f32 = 2.0;
/// Iterations end when fewer than this fraction of the slots jump.
const SETTLED: f64 = 0.03;
/// Distribution and density are learned again after more than this fraction of the slots have jumped. Learning once per
/// iteration makes maps of paired lines and of planes worse.
const STALE: f64 = 0.02;
/// Iterations end when fewer than half of the slots jump, but more than this fraction of the number in the iteration before.
/// Both numbers count all jumps, whichever slots they are of.
const SLOW: f64 = 0.9;
/// Iterations end when agreement falls by more than this fraction of its best value; smaller changes are noise.
const WORSE: f64 = 0.08;
/// Number of slots on which agreement is measured.
const AGREEMENT_SLOTS: usize = 1 << 12;
/// Least number of jumps per parallel task.
const JUMPS_PER_THREAD: usize = 64;

pub(super) struct State<const D: usize> {
    /// Estimates of the last accepted iteration.
    accepted: Vec<Estimate<D>>,
    /// Estimates of the current iteration.
    estimates: Vec<Estimate<D>>,
    /// Places of `estimates`.
    places: Places<D>,
    /// `p_random`, and the distribution of true neighbors.
    density: Density<D>,
    neighbors: NeighborDistribution,
    least_radius: f32,
    /// Per slot, [`Update::margin`]; 0 if the slot must be updated again.
    margin: Vec<f32>,
    /// Per slot with a margin, the number of relevant jumps of neighbors since its last update.
    jumps_near: Vec<AtomicU32>,
    /// Number of jumps in this iteration, in the one before, and since the last learning.
    n_jumped: usize,
    n_jumped_before: usize,
    n_jumped_since_learning: usize,
    /// Largest agreement of an accepted iteration.
    best_agreement: f64,
}

/// The new estimate of a slot.
pub(super) struct Update<const D: usize> {
    slot: u32,
    /// Score of this place minus the score of the best candidate elsewhere, in nats; without such a candidate, the
    /// log-likelihood ratio of this place. 0 if the place must be updated again.
    margin: f32,
    estimate: Estimate<D>,
}

impl<const D: usize> State<D> {
    pub(super) fn new<F: Family<D>>(problem: &Problem<'_, D, F>, start: Vec<Estimate<D>>) -> Self {
        let n = start.len();
        let places = Places::new(&start);
        let least_radius = (ROUNDING * places.farthest()).max(f32::MIN_POSITIVE);
        let radius = F::MOST_RADIUS * problem.delta;
        let (density, neighbors) = learn(problem, &places, radius, least_radius);
        Self {
            accepted: start.clone(),
            estimates: start,
            places,
            density,
            neighbors,
            least_radius,
            margin: vec![0.0; n],
            jumps_near: (0..n).map(|_| AtomicU32::new(0)).collect(),
            n_jumped: 0,
            // As if all slots had jumped.
            n_jumped_before: n,
            n_jumped_since_learning: 0,
            best_agreement: f64::NEG_INFINITY,
        }
    }

    pub(super) fn places(&self) -> &Places<D> {
        &self.places
    }

    /// Returns the estimates of the last accepted iteration.
    pub(super) fn into_accepted(self) -> Vec<Estimate<D>> {
        self.accepted
    }

    /// Learns density and distribution from the current places if enough slots have jumped.
    pub(super) fn learn_if_stale<F: Family<D>>(&mut self, problem: &Problem<'_, D, F>) {
        if self.n_jumped_since_learning as f64 <= STALE * self.estimates.len() as f64 {
            return;
        }
        let before = self.neighbors.most_imbalance;
        (self.density, self.neighbors) =
            learn(problem, &self.places, self.neighbors.radius, self.least_radius);
        if self.neighbors.most_imbalance != before {
            // Margins under another bound are not comparable.
            self.margin.fill(0.0);
        }
        self.n_jumped_since_learning = 0;
    }

    /// Computes the new estimates of `slots`: the best of their candidates, refined.
    pub(super) fn propose_score_refine<F: Family<D>>(
        &self,
        problem: &Problem<'_, D, F>,
        slots: impl Iterator<Item = u32>,
    ) -> Vec<Update<D>> {
        let of_slot =
            |slot: u32| Update { slot, margin: 0.0, estimate: self.estimates[slot as usize] };
        let mut updates: Vec<Update<D>> = slots.map(of_slot).collect();
        let Self { places, density, neighbors, .. } = self;
        let odds = neighbors.odds_of_slot(problem.family.slots_per_record());
        let context = Context { problem, places, density, neighbors, odds };
        updates.par_chunks_mut(CHUNK).for_each_init(Scratch::default, |scratch, updates| {
            dispatch(Chunk { context: &context, state: self, updates, scratch });
        });
        updates
    }

    /// Applies `updates`, and counts for each slot the relevant jumps of its neighbors: those from or to a place near the slot's
    /// feasible set.
    pub(super) fn apply<F: Family<D>>(
        &mut self,
        problem: &Problem<'_, D, F>,
        updates: &[Update<D>],
    ) {
        let Problem { family, graph, .. } = problem;
        let (radius, slots_per_record) = (self.neighbors.radius, family.slots_per_record());
        let mut jumped = Vec::new();
        for Update { slot, margin, estimate } in updates {
            let at = *slot as usize;
            let has_jumped = is_jump(&self.estimates[at], estimate, radius);
            self.estimates[at] = *estimate;
            // A slot that jumped is updated again in any case.
            self.margin[at] = if has_jumped { 0.0 } else { *margin };
            *self.jumps_near[at].get_mut() = 0;
            if has_jumped {
                jumped.push(at);
            }
        }
        self.n_jumped += jumped.len();
        self.n_jumped_since_learning += jumped.len();
        let before = std::mem::replace(&mut self.places, Places::new(&self.estimates));
        let reach2 = (TUBE * radius) * (TUBE * radius);
        let may_lie_near = |slot: usize, x: &[f32; D]| {
            let near = |piece| distance2(&family.piece(slot, piece).project(x), x) < reach2;
            (0..F::PIECES).any(near)
        };
        jumped.par_iter().with_min_len(JUMPS_PER_THREAD).for_each(|&slot| {
            let (from, to) = (before.of(slot), self.places.of(slot));
            let (ends, class) = graph.of(slot);
            for (&end, &class) in ends.iter().zip(class) {
                let end = end as usize;
                let slots = end..=end + usize::from(either(class, slots_per_record));
                // Both slots of a record lie on one piece. A slot without a margin is updated in any case.
                let concerns = slots.clone().any(|slot| self.margin[slot] > 0.0)
                    && (may_lie_near(end, &from) || may_lie_near(end, &to));
                if concerns {
                    slots.for_each(|slot| {
                        self.jumps_near[slot].fetch_add(1, Ordering::Relaxed);
                    });
                }
            }
        });
    }

    /// Accepts or rejects an iteration; returns whether it was the last one.
    pub(super) fn has_converged<F: Family<D>>(&mut self, problem: &Problem<'_, D, F>) -> bool {
        let n = self.estimates.len();
        if (self.n_jumped as f64) < SETTLED * n as f64 {
            // So few jumps hardly change agreement.
            self.accepted.clone_from(&self.estimates);
            return true;
        }
        let agreement = agreement(problem, &self.estimates);
        if agreement < (1.0 - WORSE) * self.best_agreement {
            return true;
        }
        self.best_agreement = self.best_agreement.max(agreement);
        self.accepted.clone_from(&self.estimates);
        let is_slow = self.n_jumped as f64 > SLOW * self.n_jumped_before as f64;
        if 2 * self.n_jumped < n && is_slow {
            return true;
        }
        self.n_jumped_before = std::mem::take(&mut self.n_jumped);
        false
    }
}

/// Learns density and distribution from `places`; neighbors are counted within a multiple of `radius`.
fn learn<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    places: &Places<D>,
    radius: f32,
    least_radius: f32,
) -> (Density<D>, NeighborDistribution) {
    let density = Density::new(places, &problem.listed, SMOOTH * radius);
    let neighbors = NeighborDistribution::learn(problem, places, &density, radius, least_radius);
    (density, neighbors)
}

/// Whether the move from `a` to `b` is a jump: farther than `radius`, or another status.
fn is_jump<const D: usize>(a: &Estimate<D>, b: &Estimate<D>, radius: f32) -> bool {
    a.status != b.status || distance2(&a.position, &b.position) > radius * radius
}

struct Chunk<'a, 'b, const D: usize, F: Family<D>> {
    context: &'a Context<'b, D, F>,
    state: &'a State<D>,
    /// Slots with their old estimates, which are replaced by new ones.
    updates: &'a mut [Update<D>],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, F: Family<D>> Kernel for Chunk<'_, '_, D, F> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for at in 0..self.updates.len() {
            if let Some(next) = self.updates.get(at + 1) {
                self.context.prefetch(next.slot as usize);
            }
            let update = &mut self.updates[at];
            let slot = update.slot as usize;
            let margin = self.state.margin[slot];
            let n_jumps = self.state.jumps_near[slot].load(Ordering::Relaxed) as f32;
            if margin > 0.0 && n_jumps <= margin / MARGIN_PER_JUMP {
                update.margin = margin;
            } else {
                (update.estimate, update.margin) =
                    self.context.solve(slot, &update.estimate, self.scratch);
            }
        }
    }
}

/// Returns the mean number of records at the ends of a slot's edges that pass within delta of its estimate, minus the number
/// expected by chance.
///
/// Agreement is measured on records, because neighboring estimates can drift together and still agree with each other.
fn agreement<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    estimates: &[Estimate<D>],
) -> f64 {
    let Problem { family, graph, delta, .. } = problem;
    let of_slot = |&slot: &usize| {
        let estimate = &estimates[slot];
        if estimate.status != Status::Ok {
            return 0.0;
        }
        let (mut near, mut all) = (0u32, 0u32);
        for &end in graph.of(slot).0 {
            let record = record_of(end as usize, family.slots_per_record());
            if family.may_vote(slot, record) {
                let d2 = family.record_distance2(record, &estimate.position);
                all += 1;
                near += u32::from(d2 <= delta * delta);
            }
        }
        let chance = family.record_chance(slot, &estimate.position, &problem.at_delta);
        f64::from(near) - f64::from(all) * f64::from(chance)
    };
    let n = estimates.len();
    let slots: Vec<usize> = (0..n).step_by(n.div_ceil(AGREEMENT_SLOTS).max(1)).collect();
    let parts: Vec<f64> =
        slots.par_chunks(256).map(|part| part.iter().map(of_slot).sum()).collect();
    parts.iter().sum::<f64>() / slots.len().max(1) as f64
}
