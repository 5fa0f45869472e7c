//! Attacks on the records alone, without neighborhoods and descriptors.
//!
//! Every record is a line (a half-line, one of three lines) that contains a hidden point, as a coincidence line of positron emission
//! tomography contains a decay. So the same iterations find the likeliest density of hidden points (expectation maximization, Shepp and
//! Vardi 1982, with smoothing, Silverman et al. 1990). It works in three dimensions only: in a plane all lines meet.
//!
//! The expectation spreads each record's point over its feasible line, in proportion to the density. The maximization sums these weights
//! to the new density and smooths it. Grids go from coarse to fine: a coarse one avoids local optima, a fine one starts from its result.
//!
//! A record's own part of the density is subtracted before its point is spread again. Rays use the density from *other* centers.
//!
//! The cost is the number of samples of all lines times rounds. It is linear in the records, with about 1 kB per line on the finest grid.

pub(crate) mod feasible;
pub(crate) mod peaks;
mod spread;

use crate::recover::map::Grid;
use crate::recover::result::Estimate;
use crate::released::Released;
use feasible::{Feasible, Hides};
use peaks::find;
use spread::Spread;

/// The estimate of every slot that has one; by default of none. Evidence is against a uniformly random place. Pairs ascend along the line.
#[derive(Clone, Debug, Default)]
pub(crate) struct Peaks {
    pub(crate) of: Vec<Option<Estimate<3>>>,
    /// Smallest distance at which positions differ, in the unit of the map.
    pub(crate) resolution: f64,
}

/// Voxels of the first box along each axis.
const FIRST_VOXELS: usize = 64;
/// Fraction of the points that may lie beyond each wall of the final box.
const BEYOND: f64 = 0.01;
/// Number of grids after the first. Each halves the voxels of the one before.
const GRIDS: u32 = 3;
/// Voxels along the longest side of the finest grid, times the root of the number of points (on surfaces), and their largest number.
const FINEST: (f64, f64) = (1.8, 320.0);

/// Returns the points of `released` from its records alone; `None` for planes, rays of a single center, 2D maps, and maps without extent.
pub(crate) fn tomography<const D: usize>(released: &Released<D>) -> Option<Peaks> {
    let feasible = Feasible::new(released)?;
    let (middle, extent) = feasible.middle()?;
    if feasible.hides == Hides::OnRay && feasible.n_groups < 2 {
        return None;
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
    let finest = (FINEST.0 * (released.n_slots() as f64).sqrt()).clamp(8.0, FINEST.1);
    for grid in 0..GRIDS {
        let voxels = finest / f64::from(1 << (GRIDS - 1 - grid));
        let side = longest / voxels as f32;
        let n = sides.map(|x| ((x / side).ceil() as usize).max(1));
        let resampled = spread.grid.resampled(low, side, n);
        spread = Spread::new(&feasible, resampled);
        spread.rounds();
    }
    Some(find(&spread))
}
