//! Joint recovery: the estimates of neighbors vote too.
//!
//! Consensus asks of every listed record whether its line or plane passes near. Joint recovery goes on
//! from there in rounds: every slot looks at where its neighbors are believed to be, moves to the place
//! where that is likeliest, and is re-made there from the records of the neighbors found near. What
//! makes a vote count is how much likelier it is about a true neighbor than by chance; both sides of that
//! ratio, and how far to look, are learned from the map between rounds. All slots move at once, from
//! the old estimates, so that neither order nor threads matter.

mod agreement;
mod density;
mod graph;
mod law;
mod near;
mod pieces;
mod places;
mod slot;
mod small;

pub(crate) use density::Density;
pub(crate) use graph::{Graph, either};
pub(crate) use pieces::{CandidatePieces, LinePieces, Pieces, PlanePieces};
pub(crate) use places::{Places, distance2};

use rayon::prelude::*;

use self::law::{Law, Look};
use self::slot::{Round, Scratch};
use super::Estimate;
use super::chunks::CHUNK;
use super::family::Family;
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

/// Rounds at most.
const ROUNDS: usize = 16;
/// The radius of the law is at most this many deltas: where most estimates are wrong, those that are
/// near by accident would widen it without end.
const MOST_RADIUS: f32 = 0.95;
/// True neighbors are looked for within this many radii of the law.
const REACH: f32 = 4.0;
/// Estimates enter the re-made position within this many radii of the law.
const KERNEL: f32 = 4.0;
/// The density of estimates is smooth over this many radii of the law.
const SMOOTH: f32 = 4.5;
/// Rounds end when fewer than this share of the slots jump farther than a radius of the law.
const SETTLED: f64 = 0.03;
/// Rounds end when as many as this share of those that moved before move again.
const SLOW: f64 = 0.9;
/// Rounds end when records agree by this share less than they did at best.
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
    let mut now = start;
    let most_radius = MOST_RADIUS * delta;
    let mut radius = most_radius;
    let mut most = f64::NEG_INFINITY;
    let mut before = n;
    for _ in 0..ROUNDS {
        let places = Places::new(&now);
        let density = Density::new(&places, &listed, SMOOTH * radius);
        let law = Law::learn(&Look {
            places: &places,
            graph,
            density: &density,
            slots_per_record,
            reach: REACH * radius,
            most_radius,
            seed,
        });
        let kernel = KERNEL * law.radius;
        let delta2 = delta * delta;
        let round_of =
            Round { pieces, graph, places: &places, density: &density, law: &law, kernel, delta2 };
        let mut next = now.clone();
        next.par_chunks_mut(CHUNK).zip(now.par_chunks(CHUNK)).enumerate().for_each_init(
            Scratch::default,
            |scratch, (chunk, (next, now))| {
                dispatch(Chunk { round: &round_of, first: chunk * CHUNK, now, next, scratch });
            },
        );
        let still = law.radius * law.radius;
        let has_moved = |(a, b): &(&Estimate<D>, &Estimate<D>)| {
            a.status != b.status || places::distance2(&a.position, &b.position) > still
        };
        let moved = now.iter().zip(&next).filter(has_moved).count();
        let agreement = agreement::of(pieces, graph, &next, delta2);
        if agreement < (1.0 - WORSE) * most {
            break;
        }
        most = most.max(agreement);
        now = next;
        radius = law.radius;
        let slow = 2 * moved < n && moved as f64 > SLOW * before as f64;
        if slow || (moved as f64) < SETTLED * n as f64 {
            break;
        }
        before = moved;
    }
    now
}

struct Chunk<'a, 'b, const D: usize, P> {
    round: &'a Round<'b, D, P>,
    first: usize,
    now: &'a [Estimate<D>],
    next: &'a mut [Estimate<D>],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, P: Pieces<D>> Kernel for Chunk<'_, '_, D, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (at, (next, now)) in self.next.iter_mut().zip(self.now).enumerate() {
            *next = self.round.solve(self.first + at, now, self.scratch);
        }
    }
}
