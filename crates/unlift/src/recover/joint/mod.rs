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
mod order;
mod pieces;
mod places;
mod slot;
mod small;

pub(crate) use density::Density;
pub(crate) use graph::{Graph, either};
pub(crate) use order::along_curve;
pub(crate) use pieces::{CandidatePieces, LinePieces, Pieces, PlanePieces};
pub(crate) use places::{Places, distance2};

use rayon::prelude::*;

use self::law::{Law, Look};
use self::slot::{Round, Scratch};
use super::chunks::CHUNK;
use super::family::Family;
use super::line_rows::LineRow;
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
        // Where bearings say hardly more than chance does, estimates would drift to their anchors.
        _ if family.has_regions() && mean_evidence(&start) < LEAST_EVIDENCE => start,
        Family::Lines { rows, slots_per_record, chance } if family.has_regions() => {
            let pieces = LinePieces::new(rows, *slots_per_record, chance, delta);
            let joint = rounds(&pieces, graph, start.clone(), delta, seed);
            // Points are spread over a region; estimates that are not have drifted.
            if unevenness(rows, &joint) > MOST_UNEVEN { start } else { joint }
        }
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

/// Estimates on rays from anchors may lie that unevenly.
const MOST_UNEVEN: f64 = 0.16;

/// How far the shares of their regions that lie before estimates are from evenly spread: the largest
/// difference of the two distributions.
fn unevenness<const D: usize>(rows: &[LineRow<D>], estimates: &[Estimate<D>]) -> f64 {
    let share = |(row, estimate): (&LineRow<D>, &Estimate<D>)| {
        let along = |c: usize| (estimate.position[c] - row.through[c]) * row.direction[c];
        let t = (0..D).map(along).sum::<f32>() / row.to;
        (estimate.status == Status::Ok).then(|| t.clamp(0.0, 1.0).powi(D as i32))
    };
    let mut shares: Vec<f32> = rows.iter().zip(estimates).filter_map(share).collect();
    shares.sort_unstable_by(f32::total_cmp);
    let n = shares.len().max(1) as f64;
    let off = |(at, share): (usize, &f32)| ((at as f64 + 0.5) / n - f64::from(*share)).abs();
    shares.iter().enumerate().map(off).fold(0.0, f64::max)
}

/// Rays from anchors are left where they are if their evidence is less than this in the mean, in nats.
const LEAST_EVIDENCE: f64 = 1.0;

fn mean_evidence<const D: usize>(estimates: &[Estimate<D>]) -> f64 {
    let sum: f64 = estimates.iter().map(|e| f64::from(e.evidence)).sum();
    sum / estimates.len().max(1) as f64
}

/// Rounds at most.
const ROUNDS: usize = 16;
/// True neighbors are looked for within this many radii of the law.
const REACH: f32 = 4.0;
/// Estimates enter the re-made position within this many radii of the law.
const KERNEL: f32 = 3.75;
/// The density of estimates is smooth over this many radii of the law.
const SMOOTH: f32 = 4.5;
/// Rounds end when fewer than this share of the slots jump farther than a radius of the law.
const SETTLED: f64 = 0.03;
/// Rounds end when as many as this share of those that moved before move again.
const SLOW: f64 = 0.9;
/// A slot that did not jump is looked at again if its place is ahead by at most this many nats per
/// neighbor that did: jumps of others cannot overturn it.
const PER_MOVE: f32 = 3.0;
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
    let (most_radius, delta2) = (P::MOST_RADIUS * delta, delta * delta);
    let mut now = start;
    let mut places = Places::new(&now);
    let order = along_curve(&places);
    // Nothing is settled yet.
    let (mut moves, mut n_moves, mut ahead) = (vec![true; n], n, vec![0.0; n]);
    let mut before = places.clone();
    let mut fresh = vec![(Estimate::lost(Status::NoSupport), 0.0); n];
    let (mut radius, mut most) = (most_radius, f64::NEG_INFINITY);
    for _ in 0..ROUNDS {
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
        let round = Round {
            pieces,
            graph,
            places: &places,
            before: &before,
            moves: &moves,
            density: &density,
            law: &law,
            kernel: KERNEL * law.radius,
            delta2,
        };
        fresh.par_chunks_mut(CHUNK).zip(order.par_chunks(CHUNK)).for_each_init(
            Scratch::default,
            |scratch, (fresh, slots)| {
                dispatch(Chunk { round: &round, slots, now: &now, ahead: &ahead, fresh, scratch });
            },
        );
        let mut next = now.clone();
        for (&slot, fresh) in order.iter().zip(&fresh) {
            (next[slot as usize], ahead[slot as usize]) = *fresh;
        }
        let agreement = agreement::of(pieces, graph, &next, delta2);
        if agreement < (1.0 - WORSE) * most {
            break;
        }
        most = most.max(agreement);
        radius = law.radius;
        let has_moved = |(a, b): (&Estimate<D>, &Estimate<D>)| {
            a.status != b.status || distance2(&a.position, &b.position) > radius * radius
        };
        moves = now.iter().zip(&next).map(has_moved).collect();
        let earlier = n_moves;
        n_moves = moves.iter().filter(|&&moves| moves).count();
        now = next;
        let slow = 2 * n_moves < n && n_moves as f64 > SLOW * earlier as f64;
        if slow || (n_moves as f64) < SETTLED * n as f64 {
            break;
        }
        before = places;
        places = Places::new(&now);
    }
    now
}

struct Chunk<'a, 'b, const D: usize, P> {
    round: &'a Round<'b, D, P>,
    slots: &'a [u32],
    now: &'a [Estimate<D>],
    /// How many nats each place is ahead of the best one elsewhere.
    ahead: &'a [f32],
    /// Estimates of `slots` after the round, and how far they are ahead.
    fresh: &'a mut [(Estimate<D>, f32)],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, P: Pieces<D>> Kernel for Chunk<'_, '_, D, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (fresh, &slot) in self.fresh.iter_mut().zip(self.slots) {
            let slot = slot as usize;
            let (now, ahead) = (&self.now[slot], self.ahead[slot]);
            let is_settled =
                !self.round.moves[slot] && ahead > PER_MOVE * self.round.moves_near(slot) as f32;
            *fresh =
                if is_settled { (*now, ahead) } else { self.round.solve(slot, now, self.scratch) };
        }
    }
}
