//! Rounds of joint recovery: whose turn it is, what is learned anew, and when it is enough.

use std::ops::Range;

use rayon::prelude::*;

use super::agreement::{self, Judges};
use super::jumps::Jumps;
use super::look::{Look, Sample};
use super::neighbor_law::Law;
use super::one_slot::{Round, Scratch, TUBE};
use crate::Error;
use crate::recover::map::along_curve::along_curve_in;
use crate::recover::map::chunks::CHUNK;
use crate::recover::map::crowding::Density;
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{Places, distance2};
use crate::recover::result::estimate::Estimate;
use crate::recover::solve::{InRounds, Moved};
use crate::simd::{Kernel, dispatch};

/// Sweeps over all slots at most: a bound for maps that never settle.
const SWEEPS: usize = 16;
/// Rounds of a sweep: in each, every so many-th slot moves. In the first sweep all move at once: its
/// estimates come from records alone, no slot has followed another yet.
const TURNS: usize = 2;
/// True neighbors are looked for within this many radii of the law: nearly all of its mass.
const REACH: f32 = 4.0;
/// Estimates enter the re-made position within this many radii of the law, less the farther they are.
const KERNEL: f32 = 3.75;
/// The radius of the law is at least this share of the largest coordinate: estimates of one place differ by rounding.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// The density of estimates is smooth over this many radii of the law: it must not follow the very crowds that it judges.
const SMOOTH: f32 = 4.5;
/// Sweeps end when fewer than this share of the slots jump farther than a radius of the law: so few hardly change anything.
const SETTLED: f64 = 0.03;
/// Law and density are learned again when more than this share of the slots jumped since. Learned once per sweep,
/// maps of paired lines and of planes come back worse.
const STALE: f64 = 0.02;
/// Sweeps end when as many as this share of those that moved before move again: estimates go to and fro.
const SLOW: f64 = 0.9;
/// A slot that did not jump is looked at again if its place is ahead by at most this many nats per
/// neighbor that did in one sweep. One jump can weigh more than that, but some speak for the place, too.
const PER_JUMP: f32 = 2.0;
/// Sweeps end when records agree by this share less than they did at best: a little less is noise.
const WORSE: f64 = 0.08;

/// Sweeps over the slots of a map, each in rounds.
pub(super) struct Sweeps<'a, const D: usize, P> {
    pieces: P,
    graph: &'a Graph,
    delta2: f32,
    /// What never changes: slots as neighbors follow each other, how often each record is listed, and the sample that the
    /// law is learned from.
    order: Vec<u32>,
    /// Slots whose edges are read together, and how many of `order` are before the end of each.
    windows: Vec<Range<usize>>,
    ends: Vec<usize>,
    listed: Vec<u32>,
    sample: Sample,
    judges: Judges,
    least_radius: f32,
    most_radius: f32,
    /// The best estimates of whole sweeps, and those of the sweep under way.
    now: Vec<Estimate<D>>,
    next: Vec<Estimate<D>>,
    /// The places of `next`, and what was learned of them or of earlier ones.
    places: Places<D>,
    density: Density<D>,
    law: Law,
    /// How many nats each place is ahead of the best one elsewhere; 0 where a slot is to be looked at in any case.
    ahead: Vec<f32>,
    jumps: Jumps,
    /// Slots that jumped in the round under way.
    jumpers: Vec<u32>,
    sweep: usize,
    turn: usize,
    /// Slots that jumped in this sweep, in the one before, and since law and density were learned.
    n_jumped: usize,
    n_jumped_before: usize,
    n_jumped_since: usize,
    /// How well records agreed at best.
    most: f64,
    done: bool,
}

impl<'a, const D: usize, P: Pieces<D>> Sweeps<'a, D, P> {
    /// Before the first round, at `start`.
    pub(super) fn new(
        pieces: P,
        graph: &'a Graph,
        start: &[Estimate<D>],
        delta: f32,
        seed: u64,
    ) -> Result<Self, Error> {
        let n = start.len();
        let listed = graph.times_listed()?;
        let most_radius = P::MOST_RADIUS * delta;
        let places = Places::new(start);
        let least_radius = (ROUNDING * places.farthest()).max(f32::MIN_POSITIVE);
        let sample = Sample::new(graph, seed)?;
        let limits = (least_radius, most_radius);
        let (density, law) = learned(&pieces, &places, (&listed, &sample), most_radius, limits);
        let windows = graph.windows();
        let order = along_curve_in(&windows, &places);
        let mut end = 0;
        let ends = windows.iter().map(|window| {
            end += window.len();
            end
        });
        Ok(Self {
            pieces,
            graph,
            delta2: delta * delta,
            order,
            ends: ends.collect(),
            windows,
            listed,
            sample,
            judges: Judges::new(graph)?,
            least_radius,
            most_radius,
            now: start.to_vec(),
            next: start.to_vec(),
            places,
            density,
            law,
            ahead: vec![0.0; n],
            jumps: Jumps::new(n),
            jumpers: Vec::new(),
            sweep: 0,
            turn: 0,
            n_jumped: 0,
            // Nothing is settled yet.
            n_jumped_before: n,
            n_jumped_since: 0,
            most: f64::NEG_INFINITY,
            done: false,
        })
    }

    /// Where the slots of one window go that are to be moved.
    fn solve_in(&self, window: &Range<usize>, moved: &mut [Moved<D>]) -> Result<(), Error> {
        let odds = self.law.odds_of_slot(self.pieces.slots_per_record());
        let round = Round {
            pieces: &self.pieces,
            edges: &self.graph.rows(window)?,
            places: &self.places,
            density: &self.density,
            law: &self.law,
            odds: &odds,
            kernel: KERNEL * self.law.radius,
            delta2: self.delta2,
        };
        moved.par_chunks_mut(CHUNK).for_each_init(Scratch::default, |scratch, moved| {
            let (ahead, jumps) = (&self.ahead[..], &self.jumps);
            dispatch(Chunk { round: &round, ahead, jumps, moved, scratch });
        });
        Ok(())
    }

    /// Tells whom it concerns where `jumpers` are `after` this round.
    fn tell(&self, jumpers: &mut [u32], after: &Places<D>) -> Result<(), Error> {
        let window_of = |slot: u32| self.windows.partition_point(|w| w.end <= slot as usize);
        // Whoever solved parts of the round may have handed them back in any order.
        if !jumpers.is_sorted_by_key(|&slot| window_of(slot)) {
            jumpers.sort_by_key(|&slot| window_of(slot));
        }
        let (places, reach) = ((&self.places, after), TUBE * self.law.radius);
        for jumpers in jumpers.chunk_by(|&a, &b| window_of(a) == window_of(b)) {
            let edges = self.graph.rows(&self.windows[window_of(jumpers[0])])?;
            self.jumps.tell(jumpers, (&self.pieces, &edges), places, reach, &self.ahead);
        }
        Ok(())
    }

    /// Rounds of the sweep under way.
    fn turns(&self) -> usize {
        if self.sweep == 0 { 1 } else { TURNS }
    }

    /// Judges a sweep and begins the next one, if there is one.
    fn end_sweep(&mut self) {
        let n = self.now.len();
        self.done = true;
        if (self.n_jumped as f64) < SETTLED * n as f64 {
            // So few hardly made it worse.
            self.now.clone_from(&self.next);
            return;
        }
        let agreement = agreement::of(&self.pieces, &self.judges, &self.next, self.delta2);
        if agreement < (1.0 - WORSE) * self.most {
            return;
        }
        self.most = self.most.max(agreement);
        self.now.clone_from(&self.next);
        let slow = self.n_jumped as f64 > SLOW * self.n_jumped_before as f64;
        if 2 * self.n_jumped < n && slow || self.sweep + 1 == SWEEPS {
            return;
        }
        self.done = false;
        self.sweep += 1;
        self.turn = 0;
        self.n_jumped_before = std::mem::take(&mut self.n_jumped);
    }

    /// Learns law and density of the present places, if enough slots jumped since.
    fn learn_again(&mut self) {
        if self.n_jumped_since as f64 <= STALE * self.next.len() as f64 {
            return;
        }
        let limits = (self.least_radius, self.most_radius);
        let from = (&self.listed[..], &self.sample);
        let (density, law) = learned(&self.pieces, &self.places, from, self.law.radius, limits);
        if law.surplus != self.law.surplus {
            // Leads found under another rule say nothing.
            self.ahead.fill(0.0);
        }
        (self.density, self.law) = (density, law);
        self.n_jumped_since = 0;
    }
}

/// Density and law of `places`, with neighbors looked for as if `radius` were that of the law.
fn learned<const D: usize, P: Pieces<D>>(
    pieces: &P,
    places: &Places<D>,
    (listed, sample): (&[u32], &Sample),
    radius: f32,
    (least_radius, most_radius): (f32, f32),
) -> (Density<D>, Law) {
    let density = Density::new(places, listed, SMOOTH * radius);
    let law = Law::learn(&Look {
        places,
        density: &density,
        slots_per_record: pieces.slots_per_record(),
        reach: REACH * radius,
        tells_region: P::TELLS_REGION,
        least_radius,
        most_radius,
        sample,
    });
    (density, law)
}

impl<const D: usize, P: Pieces<D>> InRounds<D> for Sweeps<'_, D, P> {
    fn parts(&self) -> Vec<Range<usize>> {
        self.windows.clone()
    }

    fn solve(&self, slots: Range<usize>) -> Result<Vec<Moved<D>>, Error> {
        let mut all = Vec::new();
        let mut start = 0;
        for (window, &end) in self.windows.iter().zip(&self.ends) {
            let order = &self.order[start..end];
            start = end;
            let is_asked = |slot: usize| self.is_turn_of(slot) && slots.contains(&slot);
            let mut moved: Vec<Moved<D>> = order
                .iter()
                .filter(|&&slot| is_asked(slot as usize))
                .map(|&slot| Moved { slot, ahead: 0.0, estimate: self.next[slot as usize] })
                .collect();
            if moved.is_empty() {
                continue;
            }
            self.solve_in(window, &mut moved)?;
            if all.is_empty() { all = moved } else { all.append(&mut moved) }
        }
        Ok(all)
    }

    fn is_done(&self) -> bool {
        self.done
    }

    fn is_turn_of(&self, slot: usize) -> bool {
        !self.done && slot % self.turns() == self.turn
    }

    fn take(&mut self, moved: &[Moved<D>]) {
        let radius = self.law.radius;
        for &Moved { slot, ahead, estimate } in moved {
            let at = slot as usize;
            let has_jumped = is_jump(&self.next[at], &estimate, radius);
            if has_jumped {
                self.jumpers.push(slot);
            }
            // Whoever jumped is looked at again in any case.
            (self.next[at], self.ahead[at]) = (estimate, if has_jumped { 0.0 } else { ahead });
            self.jumps.forget(at);
        }
    }

    fn end_round(&mut self) -> Result<(), Error> {
        let mut jumpers = std::mem::take(&mut self.jumpers);
        self.n_jumped += jumpers.len();
        self.n_jumped_since += jumpers.len();
        let after = Places::new(&self.next);
        self.tell(&mut jumpers, &after)?;
        self.places = after;
        self.turn += 1;
        if self.turn == self.turns() {
            self.end_sweep();
        }
        if !self.done {
            self.learn_again();
        }
        Ok(())
    }

    fn estimates(&self) -> &[Estimate<D>] {
        if self.done { &self.now } else { &self.next }
    }

    fn into_estimates(self: Box<Self>) -> Vec<Estimate<D>> {
        if self.done { self.now } else { self.next }
    }
}

/// Whether a slot is elsewhere, farther than the law looks.
fn is_jump<const D: usize>(a: &Estimate<D>, b: &Estimate<D>, radius: f32) -> bool {
    a.status != b.status || distance2(&a.position, &b.position) > radius * radius
}

struct Chunk<'a, 'b, const D: usize, P> {
    round: &'a Round<'b, D, P>,
    ahead: &'a [f32],
    jumps: &'a Jumps,
    /// Slots with their old estimates, which become the new ones.
    moved: &'a mut [Moved<D>],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, P: Pieces<D>> Kernel for Chunk<'_, '_, D, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for at in 0..self.moved.len() {
            if let Some(next) = self.moved.get(at + 1) {
                self.round.prefetch(next.slot as usize);
            }
            let moved = &mut self.moved[at];
            let slot = moved.slot as usize;
            let (ahead, n_jumps) = (self.ahead[slot], self.jumps.of(slot) as f32);
            let is_settled = ahead > 0.0 && n_jumps <= ahead / PER_JUMP;
            (moved.estimate, moved.ahead) = if is_settled {
                (moved.estimate, ahead)
            } else {
                self.round.solve(slot, &moved.estimate, self.scratch)
            };
        }
    }
}
