//! What every solver does: estimates of a range of slots, and rounds that go on from them.
//!
//! A solver is a file or a folder beside this one that implements [`Solve`]; `task` makes it.

use std::ops::Range;

use super::result::estimate::Estimate;

/// A way to recover points from a map whose model is known.
pub(crate) trait Solve<'a, const D: usize> {
    /// The estimates of `slots`, in order. No estimate depends on which others are asked for.
    fn solve(&self, slots: Range<usize>) -> Vec<Estimate<D>>;

    /// What goes on from estimates of all slots; `None` where these are the last word.
    fn rounds(&self, _start: &[Estimate<D>]) -> Option<Box<dyn InRounds<D> + 'a>> {
        None
    }
}

/// Recovery in rounds over a whole map, each of which may be solved in parts.
pub(crate) trait InRounds<const D: usize> {
    /// Where the slots go whose turn it is; those of `slots` alone, in any order. None when all is done.
    fn solve(&self, slots: Range<usize>) -> Vec<Moved<D>>;

    /// Whether there is no further round.
    fn is_done(&self) -> bool;

    /// Whether it is the turn of `slot`.
    fn is_turn_of(&self, slot: usize) -> bool;

    /// Ends the round: all slots whose turn it was have `moved`.
    fn go_on(&mut self, moved: &[Moved<D>]);

    /// Where slots are believed to be.
    fn estimates(&self) -> &[Estimate<D>];
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
