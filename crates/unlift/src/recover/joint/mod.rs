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
mod course;
mod crowds;
mod equations;
mod jumps;
mod look;
mod near;
mod neighbor_law;
mod one_slot;
mod outline;
mod remake;
mod standing;
mod sweeps;
mod wire;

use std::ops::Range;

use crate::Error;
use crate::recover::consensus::Consensus;
use crate::recover::map::family::Family;
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, PlanePieces};
use crate::recover::result::estimate::Estimate;
use crate::recover::solve::{Begin, InRounds, Solve};
pub(crate) use agreement::Agree;
pub(crate) use course::{Course, Kind};
pub use outline::Outline;
pub(crate) use standing::Standing;
use sweeps::Sweeps;
pub(crate) use wire::{News, check_estimates, read_estimates, write_estimates};

/// Joint recovery of one map.
pub(crate) struct Joint<'a, const D: usize> {
    /// The pass that the rounds start from.
    pub(crate) start: Consensus<'a, D>,
    pub(crate) family: &'a Family<'a, D>,
    pub(crate) graph: &'a Graph,
    /// The distance up to which a record supports a place, in the unit of the map.
    pub(crate) delta: f32,
    pub(crate) seed: u64,
}

/// Rays from anchors are left where they are if their evidence is less than this in the mean, in nats: where
/// bearings say hardly more than chance does, neighbors' estimates are those of chance, too.
const LEAST_EVIDENCE: f64 = 1.5;

impl<'a, const D: usize> Solve<'a, D> for Joint<'a, D> {
    fn solve(&self, slots: Range<usize>) -> Result<Vec<Estimate<D>>, Error> {
        self.start.solve(slots)
    }

    fn rounds(&self, begin: Begin<'_, D>) -> Result<Option<Box<dyn InRounds<D> + 'a>>, Error> {
        let Self { family, graph, delta, seed, .. } = *self;
        if let Begin::At(start) = begin
            && family.has_regions()
            && mean_evidence(start) < LEAST_EVIDENCE
        {
            return Ok(None);
        }
        Ok(Some(match family {
            Family::Lines { rows, slots_per_record, chance } => {
                let pieces = LinePieces::new(rows, *slots_per_record, chance, delta);
                Box::new(Sweeps::new(pieces, graph, begin, (delta, seed))?)
            }
            Family::Planes { planes, sorted } => {
                let pieces = PlanePieces::new(planes, sorted, delta);
                Box::new(Sweeps::new(pieces, graph, begin, (delta, seed))?)
            }
            Family::Candidates { rows, chance } => {
                let pieces = CandidatePieces::new(rows, chance, delta);
                Box::new(Sweeps::new(pieces, graph, begin, (delta, seed))?)
            }
        }))
    }
}

fn mean_evidence<const D: usize>(estimates: &[Estimate<D>]) -> f64 {
    let sum: f64 = estimates.iter().map(|e| f64::from(e.evidence)).sum();
    sum / estimates.len().max(1) as f64
}
