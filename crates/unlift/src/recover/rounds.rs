//! Joint recovery one round at a time: positions in, positions out.

use std::ops::Range;

use super::kept::Headed;
use super::result::estimate::Estimate;
use super::solve::{InRounds, Moved};
use crate::Error;

/// The rounds of joint recovery over a whole map, made by [`Task::rounds`](crate::recover::Task::rounds). Each may be solved
/// in parts, here or elsewhere, by whoever went through the same rounds before.
///
/// ```
/// # use unlift::recover::{Estimate, Rounds};
/// # use unlift::Error;
/// fn in_two_parts<'a>(mut rounds: Rounds<'a, 3>) -> Result<Vec<Estimate<3>>, Error> {
///     while !rounds.is_done() {
///         let half = rounds.n_slots() / 2;
///         let mut moved = rounds.solve(0..half)?;
///         moved.extend(rounds.solve(half..rounds.n_slots())?);
///         rounds.go_on(&moved)?;
///     }
///     Ok(rounds.estimates().to_vec())
/// }
/// ```
pub struct Rounds<'a, const D: usize>(Box<dyn InRounds<D> + 'a>);

impl<'a, const D: usize> Rounds<'a, D> {
    pub(super) fn new(rounds: Box<dyn InRounds<D> + 'a>) -> Self {
        Self(rounds)
    }

    /// Whether all rounds are done.
    pub fn is_done(&self) -> bool {
        self.0.is_done()
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.0.estimates().len()
    }

    /// Where those of `slots` go whose turn it is in this round. Nothing changes before [`go_on`](Self::go_on).
    ///
    /// # Errors
    /// When lists are on a shelf and cannot be read.
    pub fn solve(&self, slots: Range<usize>) -> Result<Vec<Moved<D>>, Error> {
        self.0.solve(slots)
    }

    /// Ends the round: where all slots went whose turn it was, in any order.
    ///
    /// # Errors
    /// When a slot is missing, or is there twice or out of turn.
    pub fn go_on(&mut self, moved: &[Moved<D>]) -> Result<(), Error> {
        let mut open: Vec<bool> = (0..self.n_slots()).map(|slot| self.0.is_turn_of(slot)).collect();
        for Moved { slot, .. } in moved {
            match open.get_mut(*slot as usize) {
                Some(open) if *open => *open = false,
                _ => return Err(Error::new("round", "each slot in its turn", slot.to_string())),
            }
        }
        if let Some(slot) = open.iter().position(|&open| open) {
            return Err(Error::new("round", format!("slot {slot}"), "none"));
        }
        self.0.take(moved);
        self.0.end_round()
    }

    /// Where slots are believed to be after the rounds so far: per slot.
    pub fn estimates(&self) -> &[Estimate<D>] {
        self.0.estimates()
    }

    /// The estimates after all rounds that are left, each in the parts that the solver likes.
    ///
    /// # Errors
    /// When lists are on a shelf and cannot be read.
    pub(super) fn run(mut self, mut kept: Option<Headed<'_>>) -> Result<Vec<Estimate<D>>, Error> {
        while !self.is_done() {
            for part in self.0.parts() {
                let moved = self.0.solve(part)?;
                self.0.take(&moved);
            }
            self.0.end_round()?;
            if let Some(kept) = &mut kept {
                kept.keep(&|to| self.0.write(to));
            }
        }
        Ok(self.0.into_estimates())
    }
}

impl<const D: usize> std::fmt::Debug for Rounds<'_, D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rounds").field("is_done", &self.is_done()).finish_non_exhaustive()
    }
}
