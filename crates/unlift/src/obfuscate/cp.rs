//! Scheme `cp`: random pairs exchange one coordinate. In images it is `cp2d`, for each image separately.

use super::ppl::random_pairs;
use super::scheme::{Entry, Lift, Lifted};
use crate::Error;
use crate::released::{AxisCandidates, Obfuscation};
use crate::seed::{Key, Stage};

/// Registry entry.
pub const ENTRY: Entry = Entry {
    title: "Coordinate permutation",
    rule: "Two points swap one coordinate.",
    color: 6,
    source: "Pan et al., Privacy Preserving Localization via Coordinate Permutations, ICCV 2023",
    hidden: "which coordinate was exchanged, and its value",
    patents: "none found",
    ..Entry::new("cp", Lift::In3d(|points, key, _| lift(points.positions, key)))
};

/// Registry entry in images.
pub const CP2D: Entry = Entry {
    name: "cp2d",
    title: "Coordinate permutation in the image",
    rule: "Two keypoints swap one of their two coordinates.",
    lift: Lift::In2d(|points, key, _| lift(points.positions, key)),
    ..ENTRY
};

/// Coordinate permutation.
fn lift<const D: usize>(points: &[[f64; D]], key: &Key) -> Result<Lifted<D>, Error> {
    let key = key.stage(Stage::Scheme);
    let (pairs, dropped) = random_pairs(points.len(), &mut key.draws(0));
    let (mut positions, mut hidden) = (Vec::new(), Vec::new());
    let mut swapped_axis = Vec::new();
    for (at, pair) in pairs.iter().enumerate() {
        let axis = key.draws(1 + at as u64).below(D as u64) as usize;
        for (own, partner) in [(pair[0], pair[1]), (pair[1], pair[0])] {
            let mut position = points[own.index()];
            position[axis] = points[partner.index()][axis];
            positions.push(position);
            hidden.push(own);
            swapped_axis.push(axis as u8);
        }
    }
    let swapped_axis = Some(swapped_axis);
    let candidates = Obfuscation::AxisCandidates(AxisCandidates::try_new(&positions)?);
    Ok(Lifted { hidden, swapped_axis, dropped, ..Lifted::one_each(candidates) })
}
