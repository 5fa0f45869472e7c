//! The reference attacker: has the positions of the three true nearest neighbors of every point.
//!
//! It is neither a real attack nor a bound (an exchanged coordinate can be recovered exactly). It
//! shows how much of the missing points is due to the map, where points have no near neighbor.

use std::collections::BTreeMap;

use super::Accuracy;
use crate::geometry::knn::Knn;
use crate::geometry::vector::{along, distance, dot, sub, widen};
use crate::released::{Obfuscation, Released};
use crate::truth::{Original, Secret};

/// Number of neighbors whose mean is the guess.
const NEAREST: usize = 3;

/// Returns the errors of this guess: the mean of the three nearest originals, projected onto the
/// record. `knn` is a search over the originals.
pub fn reference<const D: usize>(
    released: &Released<D>,
    original: &Original<D>,
    secret: &Secret,
    knn: &Knn<'_, D>,
) -> Accuracy {
    let points = original.reveal().positions();
    let origin = released.origin();
    let mut found = Vec::new();
    let errors = secret
        .hidden()
        .iter()
        .enumerate()
        .map(|(slot, hidden)| {
            knn.nearest(hidden.index(), NEAREST, &mut found);
            let n = found.len() as f64;
            let mean: [f64; D] = std::array::from_fn(|c| {
                found.iter().map(|&(_, at)| points[at as usize][c]).sum::<f64>() / n
            });
            let guess = onto_record(released, secret, slot, &sub(&mean, &origin));
            distance(&guess, &sub(&points[hidden.index()], &origin))
        })
        .collect();
    Accuracy::new(errors, BTreeMap::new(), None, None)
}

/// Projects `x` onto the record of `slot` (axis candidates: onto the true axis).
fn onto_record<const D: usize>(
    released: &Released<D>,
    secret: &Secret,
    slot: usize,
    x: &[f64; D],
) -> [f64; D] {
    let record = slot / released.slots_per_record();
    let on_line = |through: [f64; D], direction: [f64; D], from: f64| {
        along(&through, dot(&sub(x, &through), &direction).max(from), &direction)
    };
    match released.obfuscation() {
        Obfuscation::Lines(lines) => {
            let (foot, direction) = (lines.foot()[record], lines.direction()[record]);
            on_line(widen(&foot), widen(&direction), f64::NEG_INFINITY)
        }
        Obfuscation::Rays(rays) => {
            let center = rays.centers()[usize::from(rays.center()[record])];
            on_line(widen(&center), widen(&rays.direction()[record]), 0.0)
        }
        Obfuscation::AxisPlanes(planes) => {
            let mut guess = *x;
            guess[usize::from(planes.axis()[record])] = f64::from(planes.offset()[record]);
            guess
        }
        Obfuscation::AxisCandidates(candidates) => {
            let mut guess = widen(&candidates.position()[record]);
            if let Some(axes) = secret.swapped_axis() {
                let axis = usize::from(axes[slot]);
                guess[axis] = x[axis];
            }
            guess
        }
    }
}
