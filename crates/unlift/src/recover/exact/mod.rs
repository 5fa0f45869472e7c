//! Exact constraints: what a scheme's rule says about hidden coordinates beyond one record.
//!
//! A feasible set is what one record says. The rule that made the records says more: coordinates that
//! were exchanged are still in the map, one in each of two records ([`swaps`]), and a center that follows
//! from a voxel grid leaves only every other voxel along a ray ([`parity`]).

mod candidates;
mod law;
mod matching;
mod order;
mod parity;
mod swaps;

use super::Estimate;
use crate::released::{Obfuscation, Released};

/// Whether the rule of the family of `released` says more than its records.
pub(crate) fn can_settle<const D: usize>(released: &Released<D>) -> bool {
    matches!(released.obfuscation(), Obfuscation::AxisCandidates(_) | Obfuscation::Rays(_))
}

/// How often joint recovery of `released` goes on from what was settled. In an image exact coordinates place
/// their neighbors better, whose partners are then found. In a map they hardly do, and it costs as
/// much time again.
pub(crate) fn feeds<const D: usize>(released: &Released<D>) -> usize {
    match released.obfuscation() {
        Obfuscation::AxisCandidates(_) if D == 2 => FEEDS,
        _ => 0,
    }
}

const FEEDS: usize = 2;

/// Estimates of `released` moved to where the rule of their family allows them to be. `delta` is the
/// distance that decided support.
pub(crate) fn settle<const D: usize>(
    released: &Released<D>,
    estimates: Vec<Estimate<D>>,
    delta: f32,
) -> Vec<Estimate<D>> {
    match released.obfuscation() {
        Obfuscation::AxisCandidates(records) => swaps::settle(records.position(), estimates, delta),
        Obfuscation::Rays(rays) => parity::settle(rays, estimates),
        Obfuscation::Lines(_) | Obfuscation::AxisPlanes(_) => estimates,
    }
}
