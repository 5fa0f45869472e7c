//! The second baseline: what the released records alone tell, without neighborhoods and descriptors.

use super::plan::Plan;
use super::row::Alone;
use super::threshold::Threshold;
use crate::Error;
use crate::density::tomography;
use crate::evaluate::{Accuracy, evaluate};
use crate::neighbors::{Geometric, geometric_by};
use crate::recover::{RecoverOptions, Solver, published, recover_at, recover_with_start};
use crate::released::{Obfuscation, Released};
use crate::truth::{Original, Secret};

/// Our attacks on the records alone that place any point of `hidden`; none of planes, of which the records
/// alone tell nothing.
///
/// The whole map is attacked: a sample of its records would make a sparser map, of which less comes back,
/// and a baseline that is too low hides what a scheme gives away by itself. The published density attack is tried
/// on rays only: of lines it brought back less than tomography on every map and within every distance
/// (docs/benchmarks.md), at four times the cost.
pub(super) fn records_alone<const D: usize>(
    (released, secret): &(Released<D>, Secret),
    original: &Original<D>,
    plan: &Plan<D>,
    seed: u64,
) -> Result<Vec<Alone>, Error> {
    let mut attacks = Vec::new();
    if matches!(released.obfuscation(), Obfuscation::Rays(_)) {
        attacks.push((Solver::Density.name(), recover_at(released, &published(released))?));
    }
    let peaks = tomography(released);
    attacks.push((Solver::Tomography.name(), recover_at(released, &peaks)?));
    // A map of planes, or of rays from one center, has no such lists.
    if let Ok(lists) = geometric_by(released, Geometric::K, &peaks) {
        let options = RecoverOptions {
            seed,
            exact_constraints: plan.exact_constraints,
            confidence: false,
            ..RecoverOptions::default()
        };
        let (joint, start) = recover_with_start(released, &lists, &options)?;
        attacks.push(("geometric, joint", joint));
        attacks.push(("geometric, joint-start", start));
    }
    let mut found = Vec::new();
    for (name, recovered) in attacks {
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
