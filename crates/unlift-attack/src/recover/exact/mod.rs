//! Exact constraints: rules of a scheme that restrict hidden coordinates beyond their own record.
//!
//! An exchanged coordinate is published by another record ([`exchanges`]). If the center of a ray follows from a voxel grid, the point
//! lies in every other voxel along the ray ([`parity`]).

mod exchanges;
mod parity;
mod partners;

use crate::recover::map::family::Settings;
use crate::recover::result::Estimate;
use crate::released::{Obfuscation, Released};

/// Whether the family of `released` has exact constraints.
pub(crate) fn can_settle<const D: usize>(released: &Released<D>) -> bool {
    matches!(released.obfuscation(), Obfuscation::AxisCandidates(_) | Obfuscation::Rays(_))
}

/// Returns how often joint recovery of `released` runs again after exact constraints moved its estimates.
pub(crate) fn joint_reruns<const D: usize>(released: &Released<D>) -> usize {
    match released.obfuscation() {
        Obfuscation::AxisCandidates(_) => Settings::of_dimension::<D>().joint_reruns,
        _ => 0,
    }
}

/// Moves the estimates of `released` to where exact constraints allow them to be.
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
