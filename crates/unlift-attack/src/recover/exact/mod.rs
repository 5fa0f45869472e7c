//! Exact constraints: an exchanged coordinate is published by another record ([`exchanges`]), which fixes it.

mod exchanges;
mod partners;

use crate::recover::result::Estimate;
use crate::released::{Obfuscation, Released};

/// Partners of exchanged coordinates are searched within this many deltas. In images, delta is narrow and values are few.
const fn reach<const D: usize>() -> f64 {
    if D == 2 { 4.0 } else { 1.0 }
}

/// Moves the estimates of `released` to where exact constraints allow them to be, if its family has any.
pub(crate) fn settle<const D: usize>(
    released: &Released<D>,
    estimates: Vec<Estimate<D>>,
    delta: f64,
) -> Vec<Estimate<D>> {
    let Obfuscation::AxisCandidates(records) = released.obfuscation() else { return estimates };
    exchanges::settle(records.position(), estimates, (reach::<D>() * delta) as f32)
}
