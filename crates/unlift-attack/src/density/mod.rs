//! Attacks on the records alone, without neighborhoods and descriptors.
//!
//! Every record is a line (a half-line, one of three lines) that contains a hidden point, and points are dense on surfaces.
//! [`tomography`] uses that. Records relate to the density of hidden points as coincidence lines to the activity in positron emission
//! tomography. So the same iterations find the density that makes all records likeliest: maximum likelihood by expectation maximization
//! (Shepp and Vardi 1982) with smoothing (Silverman et al. 1990). Each point is placed where its record meets most of the
//! density. The published attacks read the same [`feasible`] lines (`recover/baselines/density.rs`).
//!
//! Two modules use the result: `neighbors` lists records whose points are close, and `recover` takes the positions as they are.
//! It works in three dimensions only: in a plane all lines meet.
//!
//! A round of expectation maximization has two halves. The expectation spreads each record's point over its feasible line, in
//! proportion to the density. The maximization sums these weights to the new density and smooths it. Grids go from coarse to
//! fine: a coarse one avoids local optima, a fine one starts from its result.
//!
//! A record must not confirm itself. So its own part of the density is subtracted before its point is spread again. Rays use
//! the density from rays of *other* centers, because rays of one center agree at any distance.
//!
//! The cost is the number of samples of all lines times rounds. It is linear in the records, with about 1 kB per line on the finest grid.

pub(crate) mod feasible;
mod grid;
pub(crate) mod peaks;
mod spread;

use crate::recover::map::Grid;
use crate::recover::result::Estimate;
use crate::released::Released;
use feasible::{Feasible, Hides};
use peaks::find;
use spread::Spread;

/// The result of an attack: one estimate per slot, if there is one. Its evidence is the logarithm of the likelihood ratio of the place to a
/// uniformly random one on the record. The two peaks of a paired line are in order along the line, because it is unknown which slot each belongs to.
#[derive(Clone, Debug)]
pub(crate) struct Peaks {
    pub(crate) of: Vec<Option<Estimate<3>>>,
    /// Smallest distance at which positions differ, in the unit of the map; 0 without peaks.
    pub(crate) resolution: f64,
}

impl Peaks {
    /// Creates a result without estimates.
    pub(crate) fn none(n_slots: usize) -> Self {
        Self { of: vec![None; n_slots], resolution: 0.0 }
    }
}

/// Voxels of the first box along each axis.
const FIRST_VOXELS: usize = 64;
/// Fraction of the points that may lie beyond each wall of the final box.
const BEYOND: f64 = 0.01;
/// Number of grids after the first. Each halves the voxels of the one before.
const GRIDS: u32 = 3;
/// Voxels along the longest side of the finest grid, for a map of one point, and their largest number. Points lie on surfaces, so the
/// number grows with the square root of the number of points. The limit keeps a grid below 150 MB.
const FINEST: (f64, f64) = (1.8, 320.0);

/// Returns the points of `released` from its records alone. It supports neither planes, nor rays of a single center, nor 2D maps.
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
    // Half the side of the first box in extents of the map. Centers of rays lie inside the map, at distances of the order of its size.
    let half = if feasible.hides == Hides::OnRay { 2.0 } else { 6.0 };
    let side = (2.0 * half * extent / FIRST_VOXELS as f64) as f32;
    let low = middle.map(|x| (x - half * extent) as f32);
    let mut spread = Spread::new(&feasible, Grid::even(low, side, [FIRST_VOXELS; 3], 1.0));
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
