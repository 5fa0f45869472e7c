//! Exact constraints: an exchanged coordinate is published by another record ([`exchanges`]), which fixes it.

mod exchanges;
mod partners;

use crate::recover::map::family::Settings;
use crate::recover::result::Estimate;
use crate::released::{Obfuscation, Released};

/// Moves the estimates of `released` to where exact constraints allow them to be; `None` if its family has none.
pub(crate) fn settle<const D: usize>(
    released: &Released<D>,
    estimates: &[Estimate<D>],
    delta: f64,
) -> Option<Vec<Estimate<D>>> {
    let Obfuscation::AxisCandidates(records) = released.obfuscation() else { return None };
    let reach = (Settings::of_dimension::<D>().exact_reach * delta) as f32;
    Some(exchanges::settle(records.position(), estimates.to_vec(), reach))
}
