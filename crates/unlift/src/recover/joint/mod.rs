//! Joint recovery: the estimates of neighbors vote too.
//!
//! Consensus asks of every listed record whether its line or plane passes near. Joint recovery goes on
//! from there in rounds: every slot looks at where its neighbors are believed to be, moves to the place
//! where that is likeliest, and is re-made there from the records of the neighbors found near. What
//! makes a vote count is how much likelier it is about a true neighbor than by chance; both sides of that
//! ratio, and how far to look, are learned from the map, again whenever enough slots moved.
//!
//! Slots move from the old estimates, so that neither order nor threads matter. But if all of them moved at
//! once, neighbors that are far from each other could change places for ever, each going where the
//! other was. So every other slot holds still while the rest moves.

mod agreement;
mod crowds;
mod density;
mod graph;
mod jumps;
mod law;
mod named_by;
mod near;
mod order;
mod pieces;
mod places;
mod remake;
mod slot;
mod small;

pub(crate) use density::Density;
pub(crate) use graph::{Graph, Side, either, record_of, side};
pub(crate) use order::along_curve;
pub(crate) use pieces::{CandidatePieces, LinePieces, Pieces, PlanePieces};
pub(crate) use places::{Places, distance2};

use rayon::prelude::*;

use self::jumps::Jumps;
use self::law::{Law, Look, Sample};
use self::slot::{Round, Scratch, TUBE};
use super::chunks::CHUNK;
use super::family::Family;
use super::{Estimate, Status};
use crate::simd::{Kernel, dispatch};

/// Estimates made better than `start` along `graph`.
pub(crate) fn solve<const D: usize>(
    family: &Family<'_, D>,
    graph: &Graph,
    start: Vec<Estimate<D>>,
    delta: f32,
    seed: u64,
) -> Vec<Estimate<D>> {
    match family {
        // Where bearings say hardly more than chance does, neighbors' estimates are those of chance, too.
        _ if family.has_regions() && mean_evidence(&start) < LEAST_EVIDENCE => start,
        Family::Lines { rows, slots_per_record, chance } => rounds(
            &LinePieces::new(rows, *slots_per_record, chance, delta),
            graph,
            start,
            delta,
            seed,
        ),
        Family::Planes { planes, sorted } => {
            rounds(&PlanePieces::new(planes, sorted, delta), graph, start, delta, seed)
        }
        Family::Candidates { rows, chance } => {
            rounds(&CandidatePieces::new(rows, chance, delta), graph, start, delta, seed)
        }
    }
}

/// Rays from anchors are left where they are if their evidence is less than this in the mean, in nats.
const LEAST_EVIDENCE: f64 = 1.5;

fn mean_evidence<const D: usize>(estimates: &[Estimate<D>]) -> f64 {
    let sum: f64 = estimates.iter().map(|e| f64::from(e.evidence)).sum();
    sum / estimates.len().max(1) as f64
}

/// The next slot whose turn it is is looked for among so many.
const MOST_AHEAD: usize = 8;
/// Sweeps over all slots at most.
const SWEEPS: usize = 16;
/// Rounds of a sweep: in each, every so many-th slot moves. In the first sweep all move at once: its
/// estimates come from records alone, no slot has followed another yet.
const TURNS: usize = 2;
/// True neighbors are looked for within this many radii of the law.
const REACH: f32 = 4.0;
/// Estimates enter the re-made position within this many radii of the law.
const KERNEL: f32 = 3.75;
/// The radius of the law is at least this share of the largest coordinate: estimates of one place differ by rounding.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// The density of estimates is smooth over this many radii of the law.
const SMOOTH: f32 = 4.5;
/// Sweeps end when fewer than this share of the slots jump farther than a radius of the law.
const SETTLED: f64 = 0.03;
/// Law and density are learned again when more than this share of the slots jumped since.
const STALE: f64 = 0.02;
/// Sweeps end when as many as this share of those that moved before move again.
const SLOW: f64 = 0.9;
/// A slot that did not jump is looked at again if its place is ahead by at most this many nats per
/// neighbor that did in one sweep. One jump can weigh more than that, but some speak for the place, too.
const PER_JUMP: f32 = 2.0;
/// Sweeps end when records agree by this share less than they did at best.
const WORSE: f64 = 0.08;

fn rounds<const D: usize, P: Pieces<D>>(
    pieces: &P,
    graph: &Graph,
    start: Vec<Estimate<D>>,
    delta: f32,
    seed: u64,
) -> Vec<Estimate<D>> {
    let n = start.len();
    let slots_per_record = pieces.slots_per_record();
    let listed = graph.times_listed(n / slots_per_record, slots_per_record);
    let (most_radius, delta2) = (P::MOST_RADIUS * delta, delta * delta);
    let mut now = start;
    let mut places = Places::new(&now);
    let least_radius = (ROUNDING * places.farthest()).max(f32::MIN_POSITIVE);
    let order = along_curve(&places);
    let sample = Sample::new(graph, seed);
    let learn = |places: &Places<D>, radius: f32| {
        let density = Density::new(places, &listed, SMOOTH * radius);
        let law = Law::learn(&Look {
            places,
            graph,
            density: &density,
            slots_per_record,
            reach: REACH * radius,
            tells_region: P::TELLS_REGION,
            least_radius,
            most_radius,
            sample: &sample,
        });
        (density, law)
    };
    // Nothing is settled yet.
    let (mut n_jumped, mut ahead) = (n, vec![0.0; n]);
    let jumps = Jumps::new(n);
    let mut jumpers = Vec::new();
    let mut fresh = vec![(Estimate::lost(Status::NoSupport), 0.0); n];
    let (mut learned, mut n_jumped_since) = (learn(&places, most_radius), 0);
    let mut most = f64::NEG_INFINITY;
    for sweep in 0..SWEEPS {
        let turns = if sweep == 0 { 1 } else { TURNS };
        let earlier = std::mem::take(&mut n_jumped);
        let mut next = now.clone();
        for turn in 0..turns {
            if n_jumped_since as f64 > STALE * n as f64 {
                let again = learn(&places, learned.1.radius);
                if again.1.surplus != learned.1.surplus {
                    // Leads found under another rule say nothing.
                    ahead.fill(0.0);
                }
                (learned, n_jumped_since) = (again, 0);
            }
            let (density, law) = (&learned.0, &learned.1);
            let radius = law.radius;
            let odds = law.odds_of_slot(slots_per_record);
            let round = Round {
                pieces,
                graph,
                places: &places,
                turn: (turn, turns),
                density,
                law,
                odds: &odds,
                kernel: KERNEL * radius,
                delta2,
            };
            fresh.par_chunks_mut(CHUNK).zip(order.par_chunks(CHUNK)).for_each_init(
                Scratch::default,
                |scratch, (fresh, slots)| {
                    let old = Old { estimates: &next, ahead: &ahead, jumps: &jumps };
                    dispatch(Chunk { round: &round, slots, old, fresh, scratch });
                },
            );
            let is_turn_of = round.is_turn_of();
            jumpers.clear();
            for (&slot, &(estimate, by)) in order.iter().zip(&fresh) {
                let slot = slot as usize;
                if !is_turn_of(slot) {
                    continue;
                }
                let has_jumped = is_jump(&next[slot], &estimate, radius);
                if has_jumped {
                    jumpers.push(slot as u32);
                }
                // Whoever jumped is looked at again in any case.
                (next[slot], ahead[slot]) = (estimate, if has_jumped { 0.0 } else { by });
            }
            n_jumped += jumpers.len();
            n_jumped_since += jumpers.len();
            let after = Places::new(&next);
            jumps.tell(&jumpers, (pieces, graph), (&places, &after), TUBE * radius, &ahead);
            places = after;
        }
        if (n_jumped as f64) < SETTLED * n as f64 {
            // So few hardly made it worse.
            return next;
        }
        let agreement = agreement::of(pieces, graph, &next, delta2);
        if agreement < (1.0 - WORSE) * most {
            break;
        }
        most = most.max(agreement);
        now = next;
        if 2 * n_jumped < n && n_jumped as f64 > SLOW * earlier as f64 {
            break;
        }
    }
    now
}

/// Whether a slot is elsewhere, farther than the law looks.
fn is_jump<const D: usize>(a: &Estimate<D>, b: &Estimate<D>, radius: f32) -> bool {
    a.status != b.status || distance2(&a.position, &b.position) > radius * radius
}

/// What the rounds before found.
struct Old<'a, const D: usize> {
    estimates: &'a [Estimate<D>],
    /// How many nats each place is ahead of the best one elsewhere; 0 where a slot is to be looked at in any case.
    ahead: &'a [f32],
    jumps: &'a Jumps,
}

struct Chunk<'a, 'b, const D: usize, P> {
    round: &'a Round<'b, D, P>,
    slots: &'a [u32],
    old: Old<'a, D>,
    /// Estimates of `slots` after the round, and how far they are ahead.
    fresh: &'a mut [(Estimate<D>, f32)],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, P: Pieces<D>> Kernel for Chunk<'_, '_, D, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let is_turn_of = self.round.is_turn_of();
        for (at, (fresh, &slot)) in self.fresh.iter_mut().zip(self.slots).enumerate() {
            let slot = slot as usize;
            if !is_turn_of(slot) {
                continue;
            }
            let next = self.slots[at + 1..].iter().map(|&slot| slot as usize);
            if let Some(next) = next.take(MOST_AHEAD).find(|&slot| is_turn_of(slot)) {
                self.round.prefetch(next);
            }
            let (now, ahead) = (&self.old.estimates[slot], self.old.ahead[slot]);
            let n_jumps = self.old.jumps.take(slot) as f32;
            let is_settled = ahead > 0.0 && n_jumps <= ahead / PER_JUMP;
            *fresh =
                if is_settled { (*now, ahead) } else { self.round.solve(slot, now, self.scratch) };
        }
    }
}
