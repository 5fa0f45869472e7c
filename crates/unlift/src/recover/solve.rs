//! What every solver does: estimates of a range of slots, and rounds that go on from them.
//!
//! A solver is a file or a folder beside this one that implements [`Solve`]; `task` makes it. What it is given, by the example
//! of `consensus` (which also says in `on_planes` how little a solver may be):
//!
//! - `Family`: the records as rows, by kind. Slot `s` lies on record `s / slots_per_record`; places are about the released
//!   origin, in f32.
//! - Lists of records per slot (`map::lists`), never the slot's own. Rays of one center meet in it whatever they hide:
//!   `may_vote_for` says who counts.
//! - `delta`, the distance up to which a record supports a place, learned before (by consensus) whether it is used or not.
//! - `map::chunks::solve_chunks` runs over slots on all threads, the same bytes on any number of them.
//!
//! What comes out is moved afterwards to where rules of the scheme allow it to be (`exact`), unless the solver is a baseline
//! that stays as published (`Task::is_settled`). Where it is known which points are whose center's (`Family::has_regions`,
//! `dcl2d`), rays of two centers meet nowhere that both points may lie: `consensus::anchors` looks at bearings instead.

use std::io;
use std::ops::Range;

use super::result::estimate::Estimate;
use crate::Error;

/// A way to recover points from a map whose model is known.
pub(crate) trait Solve<'a, const D: usize> {
    /// The estimates of `slots`, in order. No estimate depends on which others are asked for.
    ///
    /// # Errors
    /// When lists cannot be read, which are on a shelf.
    fn solve(&self, slots: Range<usize>) -> Result<Vec<Estimate<D>>, Error>;

    /// What goes on from there; `None` where estimates of all slots are the last word.
    ///
    /// # Errors
    /// As of [`solve`](Self::solve), and when rounds were not written by this solver about this map.
    fn rounds(&self, _begin: Begin<'_, D>) -> Result<Option<Box<dyn InRounds<D> + 'a>>, Error> {
        Ok(None)
    }
}

/// Where rounds go on from.
#[derive(Clone, Copy)]
pub(crate) enum Begin<'a, const D: usize> {
    /// Estimates of all slots.
    At(&'a [Estimate<D>]),
    /// What [`InRounds::write`] wrote between two rounds.
    Written(&'a [u8]),
}

/// Recovery in rounds over a whole map, each of which may be solved in parts.
pub(crate) trait InRounds<const D: usize> {
    /// Slots that are best solved together, one range after the other.
    fn parts(&self) -> Vec<Range<usize>>;

    /// Where the slots go whose turn it is; those of `slots` alone, in any order. None when all is done.
    ///
    /// # Errors
    /// When edges cannot be read, which are on a shelf.
    fn solve(&self, slots: Range<usize>) -> Result<Vec<Moved<D>>, Error>;

    /// Whether there is no further round.
    fn is_done(&self) -> bool;

    /// Whether it is the turn of `slot`.
    fn is_turn_of(&self, slot: usize) -> bool;

    /// Some slots whose turn it is have `moved`. Others that are solved in this round do not see it.
    fn take(&mut self, moved: &[Moved<D>]);

    /// Ends the round: all slots whose turn it was have moved.
    ///
    /// # Errors
    /// As of [`solve`](Self::solve).
    fn end_round(&mut self) -> Result<(), Error>;

    /// Writes where all stands between two rounds, some 45 bytes a slot and what the density takes, the same on every machine: what others go
    /// on from, to the same bits.
    ///
    /// # Errors
    /// When it cannot be written.
    fn write(&self, to: &mut dyn io::Write) -> io::Result<()>;

    /// Where slots are believed to be.
    fn estimates(&self) -> &[Estimate<D>];

    /// The same, the last time that they are asked for.
    fn into_estimates(self: Box<Self>) -> Vec<Estimate<D>>;
}

/// Where a slot goes in one round of joint recovery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved<const D: usize> {
    /// The slot.
    pub slot: u32,
    /// How far this place is ahead of the best one elsewhere, in nats; 0 where none is known elsewhere to compare with.
    pub ahead: f32,
    /// Where it is believed to be now.
    pub estimate: Estimate<D>,
}
