//! Exact constraints: what a scheme's rule says about hidden coordinates beyond one record.
//!
//! Coordinates that were exchanged are still in the map, one in each of two records ([`exchanges`]). A center that follows from a
//! voxel grid leaves only every other voxel along a ray ([`parity`]).

mod exchanges;
mod parity;
mod partners;

use crate::recover::map::family::Settings;
use crate::recover::result::Estimate;
use crate::released::{Obfuscation, Released};

/// Whether the rule of the family of `released` says more than its records.
pub(crate) fn can_settle<const D: usize>(released: &Released<D>) -> bool {
    matches!(released.obfuscation(), Obfuscation::AxisCandidates(_) | Obfuscation::Rays(_))
}

/// How often joint recovery of `released` goes on from what was settled.
pub(crate) fn joint_reruns<const D: usize>(released: &Released<D>) -> usize {
    match released.obfuscation() {
        Obfuscation::AxisCandidates(_) => Settings::of_dimension::<D>().joint_reruns,
        _ => 0,
    }
}

/// Estimates of `released` moved to where the rule of their family allows them to be.
pub(crate) fn settle<const D: usize>(
    released: &Released<D>,
    estimates: Vec<Estimate<D>>,
    delta: f64,
) -> Vec<Estimate<D>> {
    let reach = (Settings::of_dimension::<D>().exact_reach * delta) as f32;
    match released.obfuscation() {
        Obfuscation::AxisCandidates(records) => {
            exchanges::settle(records.position(), estimates, reach)
        }
        Obfuscation::Rays(rays) => parity::settle(rays, estimates),
        Obfuscation::Lines(_) | Obfuscation::AxisPlanes(_) => estimates,
    }
}
