//! The pieces of a family for a while: what is done with them is the same for all families.

use super::family::Family;
use super::pieces::{CandidatePieces, LinePieces, Pieces, PlanePieces};

/// Something to be done with pieces, whatever their family.
pub(crate) trait WithPieces<const D: usize> {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<P: Pieces<D>>(self, pieces: &P) -> Self::Output;
}

impl<const D: usize> Family<'_, D> {
    /// Does something with the pieces of these records at `delta`.
    pub(crate) fn with_pieces<W: WithPieces<D>>(&self, delta: f32, with: W) -> W::Output {
        match self {
            Self::Lines { rows, slots_per_record, chance } => {
                with.run(&LinePieces::new(rows, *slots_per_record, chance, delta))
            }
            Self::Planes { planes, sorted } => with.run(&PlanePieces::new(planes, sorted, delta)),
            Self::Candidates { rows, chance } => {
                with.run(&CandidatePieces::new(rows, chance, delta))
            }
        }
    }
}
