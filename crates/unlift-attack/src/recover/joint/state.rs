//! What changes from iteration to iteration: estimates, and what is learned from them.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use crate::recover::joint::input::Input;
use crate::recover::joint::neighbor_distribution::NeighborDistribution;
use crate::recover::joint::update::{Context, Scratch, TUBE};
use crate::recover::map::graph::{either, record_of};
use crate::recover::map::grid::Density;
use crate::recover::map::lists::CHUNK;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{Places, distance2};
use crate::recover::result::{Estimate, Status};
use crate::simd::{Kernel, dispatch};

/// The radius is at least this share of the largest coordinate: estimates of one place differ by rounding.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// The density of estimates is smoothed over this many radii, so that it does not follow the crowds that it judges.
const SMOOTH: f32 = 4.5;
/// A slot that did not jump is updated again if its place is margin by at most this many nats per
/// neighbor that did in one iteration. One jump can weigh more than that, but some speak for the place, too.
const MARGIN_PER_JUMP: f32 = 2.0;
/// Iterations end when fewer than this share of the slots jump farther than a radius: so few hardly change anything.
const SETTLED: f64 = 0.03;
/// Distribution and density are learned again when more than this share of the slots jumped since. Learned once per
/// iteration, maps of paired lines and of planes come back worse.
const STALE: f64 = 0.02;
/// Iterations end when this share of those that moved before move again: estimates go to and fro.
const SLOW: f64 = 0.9;
/// Iterations end when records agree by this share less than they did at best: a little less is noise.
const WORSE: f64 = 0.08;
/// Slots on which agreement is measured: the mean over so many is known better than the share by which it may fall.
const AGREEMENT_SLOTS: usize = 1 << 12;
/// Slots whose jumps one thread tells at a time: enough that sharing them out costs nothing.
const JUMPS_PER_THREAD: usize = 64;

/// The state of joint recovery.
pub(super) struct State<const D: usize> {
    /// The best estimates of whole iterations.
    accepted: Vec<Estimate<D>>,
    /// The estimates of the iteration under way.
    estimates: Vec<Estimate<D>>,
    /// Their places, in the form that updates read.
    places: Places<D>,
    /// The density of estimates `p_random`, and the distribution of true neighbors about a slot.
    density: Density<D>,
    neighbors: NeighborDistribution,
    least_radius: f32,
    /// How many nats each place is margin of the best one elsewhere; 0 where a slot is to be updated in any case.
    margin: Vec<f32>,
    /// Per slot that is margin, how many jumps of neighbors concern it since it was last its turn.
    jumps_near: Vec<AtomicU32>,
    /// Slots that jumped in this iteration, in the one before, and since density and distribution were learned.
    n_jumped: usize,
    n_jumped_before: usize,
    n_jumped_since_learning: usize,
    /// How well records agreed at best.
    best_agreement: f64,
}

/// Where a slot goes.
pub(super) struct Update<const D: usize> {
    slot: u32,
    /// How far this place is margin of the best one elsewhere, in nats; 0 where none is known elsewhere to compare with.
    margin: f32,
    estimate: Estimate<D>,
}

impl<const D: usize> State<D> {
    /// The state before the first iteration, at `start`.
    pub(super) fn new<P: Pieces<D>>(input: &Input<'_, P>, start: Vec<Estimate<D>>) -> Self {
        let n = start.len();
        let places = Places::new(&start);
        let least_radius = (ROUNDING * places.farthest()).max(f32::MIN_POSITIVE);
        let radius = P::MOST_RADIUS * input.delta;
        let (density, neighbors) = learn(input, &places, radius, least_radius);
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
            // Nothing is settled yet.
            n_jumped_before: n,
            n_jumped_since_learning: 0,
            best_agreement: f64::NEG_INFINITY,
        }
    }

    /// The present places of all slots.
    pub(super) fn places(&self) -> &Places<D> {
        &self.places
    }

    /// The best estimates of whole iterations.
    pub(super) fn into_accepted(self) -> Vec<Estimate<D>> {
        self.accepted
    }

    /// Learns density and distribution of the present places, if enough slots jumped since.
    pub(super) fn learn_if_stale<P: Pieces<D>>(&mut self, input: &Input<'_, P>) {
        if self.n_jumped_since_learning as f64 <= STALE * self.estimates.len() as f64 {
            return;
        }
        let before = self.neighbors.most_imbalance;
        (self.density, self.neighbors) =
            learn(input, &self.places, self.neighbors.radius, self.least_radius);
        if self.neighbors.most_imbalance != before {
            // Leads found under another rule say nothing.
            self.margin.fill(0.0);
        }
        self.n_jumped_since_learning = 0;
    }

    /// Where `slots` go: the best of their candidates, refined.
    pub(super) fn propose_score_refine<P: Pieces<D>>(
        &self,
        input: &Input<'_, P>,
        slots: impl Iterator<Item = u32>,
    ) -> Vec<Update<D>> {
        let of_slot =
            |slot: u32| Update { slot, margin: 0.0, estimate: self.estimates[slot as usize] };
        let mut updates: Vec<Update<D>> = slots.map(of_slot).collect();
        let Self { places, density, neighbors, .. } = self;
        let odds = neighbors.odds_of_slot(input.pieces.slots_per_record());
        let context = Context { input, places, density, neighbors, odds };
        updates.par_chunks_mut(CHUNK).for_each_init(Scratch::default, |scratch, updates| {
            dispatch(Chunk { context: &context, state: self, updates, scratch });
        });
        updates
    }

    /// Moves slots to where they go, and counts for each slot the jumps that concern it: those from or to places near which it may
    /// lie, of the slots whose edges lead to it.
    pub(super) fn apply<P: Pieces<D>>(&mut self, input: &Input<'_, P>, updates: &[Update<D>]) {
        let Input { pieces, graph, .. } = input;
        let (radius, slots_per_record) = (self.neighbors.radius, pieces.slots_per_record());
        let mut jumped = Vec::new();
        for Update { slot, margin, estimate } in updates {
            let at = *slot as usize;
            let has_jumped = is_jump(&self.estimates[at], estimate, radius);
            self.estimates[at] = *estimate;
            // Whoever jumped is updated again in any case.
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
            let near = |piece| distance2(&pieces.piece(slot, piece).project(x), x) < reach2;
            (0..P::PER_SLOT).any(near)
        };
        jumped.par_iter().with_min_len(JUMPS_PER_THREAD).for_each(|&slot| {
            let (from, to) = (before.of(slot), self.places.of(slot));
            let (ends, class) = graph.of(slot);
            for (&end, &class) in ends.iter().zip(class) {
                let end = end as usize;
                let slots = end..=end + usize::from(either(class, slots_per_record));
                // Both slots of a record lie on one piece. A slot that is not margin is updated in any case.
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

    /// Judges an iteration: whether it was the last one.
    pub(super) fn has_converged<P: Pieces<D>>(&mut self, input: &Input<'_, P>) -> bool {
        let n = self.estimates.len();
        if (self.n_jumped as f64) < SETTLED * n as f64 {
            // So few hardly made it worse.
            self.accepted.clone_from(&self.estimates);
            return true;
        }
        let agreement = agreement(input, &self.estimates);
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

/// Density and distribution of `places`, with neighbors looked for as if `radius` were that of the distribution.
fn learn<const D: usize, P: Pieces<D>>(
    input: &Input<'_, P>,
    places: &Places<D>,
    radius: f32,
    least_radius: f32,
) -> (Density<D>, NeighborDistribution) {
    let density = Density::new(places, &input.listed, SMOOTH * radius);
    let neighbors = NeighborDistribution::learn(input, places, &density, radius, least_radius);
    (density, neighbors)
}

/// Whether a slot is elsewhere, farther than neighbors lie.
fn is_jump<const D: usize>(a: &Estimate<D>, b: &Estimate<D>, radius: f32) -> bool {
    a.status != b.status || distance2(&a.position, &b.position) > radius * radius
}

struct Chunk<'a, 'b, const D: usize, P> {
    context: &'a Context<'b, D, P>,
    state: &'a State<D>,
    /// Slots with their old estimates, which become the new ones.
    updates: &'a mut [Update<D>],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, P: Pieces<D>> Kernel for Chunk<'_, '_, D, P> {
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

/// The mean number of records at the other ends of a slot's edges that pass near its estimate, less
/// that expected by chance; over slots spread evenly.
///
/// Estimates that agree with each other prove nothing: they may have drifted together. Records cannot drift.
fn agreement<const D: usize, P: Pieces<D>>(input: &Input<'_, P>, estimates: &[Estimate<D>]) -> f64 {
    let Input { pieces, graph, delta, .. } = input;
    let of_slot = |&slot: &usize| {
        let estimate = &estimates[slot];
        if estimate.status != Status::Ok {
            return 0.0;
        }
        let (mut near, mut all) = (0u32, 0u32);
        for &end in graph.of(slot).0 {
            let record = record_of(end as usize, pieces.slots_per_record());
            if pieces.may_vote(slot, record) {
                let d2 = pieces.record_distance2(record, &estimate.position);
                all += 1;
                near += u32::from(d2 <= delta * delta);
            }
        }
        let chance = pieces.record_chance(slot, &estimate.position);
        f64::from(near) - f64::from(all) * f64::from(chance)
    };
    let n = estimates.len();
    let slots: Vec<usize> = (0..n).step_by(n.div_ceil(AGREEMENT_SLOTS).max(1)).collect();
    let parts: Vec<f64> =
        slots.par_chunks(256).map(|part| part.iter().map(of_slot).sum()).collect();
    parts.iter().sum::<f64>() / slots.len().max(1) as f64
}
