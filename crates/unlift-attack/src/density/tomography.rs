//! The density of hidden points that makes the records likeliest, and the points where they meet it.
//!
//! A round has two halves. Given a density, each record spreads its point over its feasible line in
//! proportion to the density there (expectation); given all records' spreads, the density is their sum
//! (maximization), smoothed so that a voxel speaks for its surroundings. Grids go from coarse to fine:
//! a coarse one cannot get lost in details, a fine one starts where the coarse one ended.
//!
//! Two things keep a record from believing itself. The share of the density that a record brought itself is
//! taken out before it is spread again, and rays are spread over what rays of *other* centers
//! brought: rays of one center agree at any distance.
//!
//! Cost: samples of all lines times rounds, linear in the records; about 1 kB per line on the finest grid.

use super::Peaks;
use super::feasible::{Feasible, Hides};
use super::grid::Grid;
use super::peaks::find;
use super::spread::Spread;
use crate::released::Released;

/// Half the side of the first box, in extents of the map, and its voxels along each axis.
const FIRST_BOX: (f64, usize) = (6.0, 64);
/// The same for rays: the centers lie inside the map, and their distance is of the order of its size.
const FIRST_BOX_OF_RAYS: (f64, usize) = (2.0, 64);
/// Share of the points that may lie beyond each wall of the box that is looked at closely.
const BEYOND: f64 = 0.01;
/// Grids from the coarsest to the finest; each halves the voxels of the one before.
const GRIDS: u32 = 3;
/// Voxels along the longest side of the finest grid, for a map of a single point; points lie on surfaces,
/// so it grows with their square root, up to a limit that keeps a grid below 150 MB.
const FINEST: (f64, f64) = (1.8, 320.0);

/// Where the points of `released` are, from its records alone. No answer for planes, rays of a single
/// center, and maps that are not in three dimensions.
pub(crate) fn tomography<const D: usize>(released: &Released<D>) -> Peaks {
    let n_slots = released.n_slots();
    let Some(feasible) = Feasible::new(released) else {
        return Peaks::none(n_slots);
    };
    let Some((middle, extent)) = feasible.middle() else {
        return Peaks::none(n_slots);
    };
    if feasible.hides == Hides::OnRay && feasible.n_groups < 2 {
        return Peaks::none(n_slots);
    }
    let feasible = feasible.counted_from(&middle);
    let rays = feasible.hides == Hides::OnRay;
    let (half, voxels) = if rays { FIRST_BOX_OF_RAYS } else { FIRST_BOX };
    let side = (2.0 * half * extent / voxels as f64) as f32;
    let low = middle.map(|x| (x - half * extent) as f32);
    let mut spread = Spread::new(&feasible, Grid::even(low, side, [voxels; 3]));
    spread.rounds();
    let (low, high) = spread.grid.bounds(BEYOND);
    let sides: [f32; 3] = std::array::from_fn(|c| high[c] - low[c]);
    let longest = sides.iter().fold(0.0, |a: f32, &b| a.max(b));
    let finest = (FINEST.0 * (n_slots as f64).sqrt()).clamp(8.0, FINEST.1);
    for grid in 0..GRIDS {
        let voxels = finest / f64::from(1 << (GRIDS - 1 - grid));
        let side = longest / voxels as f32;
        let n = sides.map(|x| ((x / side).ceil() as usize).max(1));
        let resampled = spread.grid.resampled(low, side, n);
        spread = Spread::new(&feasible, resampled);
        spread.rounds();
    }
    find(&spread)
}
