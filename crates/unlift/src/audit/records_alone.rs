//! The second baseline: attacks on the released records alone, without neighborhoods or
//! descriptors.

use super::plan::Plan;
use super::row::Alone;
use super::threshold::Threshold;
use crate::Error;
use crate::evaluate::{Accuracy, evaluate};
use crate::recover::{self, RecoverOptions};
use crate::released::Released;
use crate::truth::{Original, Secret};

/// Runs and measures all attacks on the records alone. Omits those that place no point of `hidden`.
///
/// # Errors
/// When the arguments do not belong together.
pub fn records_alone<const D: usize>(
    (released, secret): &(Released<D>, Secret),
    original: &Original<D>,
    plan: &Plan<D>,
    seed: u64,
) -> Result<Vec<Alone>, Error> {
    let options = RecoverOptions { seed, ..RecoverOptions::default() };
    let mut found = Vec::new();
    for (name, recovered) in recover::records_alone(released, &options)? {
        if (0..recovered.n_slots()).any(|slot| recovered.position(slot).is_some()) {
            let accuracy = evaluate(&recovered, original, secret)?;
            found.push(Alone { name, percent: within(&accuracy, &plan.thresholds) });
        }
    }
    Ok(found)
}

fn within(accuracy: &Accuracy, thresholds: &[Threshold]) -> Vec<f64> {
    thresholds.iter().map(|t| accuracy.percent_within(t.value)).collect()
}
