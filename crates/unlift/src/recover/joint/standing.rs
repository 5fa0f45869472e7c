//! What whoever moves slots in a round must know of all of them: where they are believed to be, and what was learned of it.

use rayon::prelude::*;

use super::jumps::Jumps;
use super::neighbor_law::Law;
use super::one_slot::{Round, Scratch, TUBE};
use crate::recover::map::chunks::CHUNK;
use crate::recover::map::crowding::Density;
use crate::recover::map::graph::EdgeRows;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{Places, distance2};
use crate::recover::result::estimate::Estimate;
use crate::recover::solve::Moved;
use crate::simd::{Kernel, dispatch};

/// Estimates enter the re-made position within this many radii of the law, less the farther they are.
const KERNEL: f32 = 3.75;
/// A slot that did not jump is looked at again if its place is ahead by at most this many nats per
/// neighbor that did in one sweep. One jump can weigh more than that, but some speak for the place, too.
const PER_JUMP: f32 = 2.0;

/// Where a round of joint recovery stands.
pub(crate) struct Standing<const D: usize> {
    /// The estimates of the sweep under way.
    pub(super) next: Vec<Estimate<D>>,
    /// Their places when the round began, and what was learned of them or of earlier ones.
    pub(super) places: Places<D>,
    pub(super) density: Density<D>,
    pub(super) law: Law,
    /// How many nats each place is ahead of the best one elsewhere; 0 where a slot is to be looked at in any case.
    pub(super) ahead: Vec<f32>,
    pub(super) jumps: Jumps,
    /// Rounds of this sweep, and those of them that are over.
    pub(super) turns: usize,
    pub(super) turn: usize,
    pub(super) done: bool,
}

impl<const D: usize> Standing<D> {
    /// Whether it is the turn of `slot`.
    pub(crate) fn is_turn_of(&self, slot: usize) -> bool {
        !self.done && slot % self.turns == self.turn
    }

    /// `slot` before it is looked at.
    pub(crate) fn unmoved(&self, slot: u32) -> Moved<D> {
        Moved { slot, ahead: 0.0, estimate: self.next[slot as usize] }
    }

    /// Where the slots go that are to be moved, whose edges are given.
    pub(crate) fn solve<P: Pieces<D>>(
        &self,
        (pieces, edges): (&P, &EdgeRows<'_>),
        delta2: f32,
        moved: &mut [Moved<D>],
    ) {
        let odds = self.law.odds_of_slot(pieces.slots_per_record());
        let round = Round {
            pieces,
            edges,
            places: &self.places,
            density: &self.density,
            law: &self.law,
            odds: &odds,
            kernel: KERNEL * self.law.radius,
            delta2,
        };
        moved.par_chunks_mut(CHUNK).for_each_init(Scratch::default, |scratch, moved| {
            let (ahead, jumps) = (&self.ahead[..], &self.jumps);
            dispatch(Chunk { round: &round, ahead, jumps, moved, scratch });
        });
    }

    /// How far from a piece whoever lies there may be told of a jump.
    pub(super) fn reach(&self) -> f32 {
        TUBE * self.law.radius
    }

    /// Notes where a slot went; whether it jumped.
    pub(super) fn take(&mut self, Moved { slot, ahead, estimate }: Moved<D>) -> bool {
        let at = slot as usize;
        let has_jumped = is_jump(&self.next[at], &estimate, self.law.radius);
        // Whoever jumped is looked at again in any case.
        (self.next[at], self.ahead[at]) = (estimate, if has_jumped { 0.0 } else { ahead });
        self.jumps.forget(at);
        has_jumped
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
