//! Maps of any size made from a small one, for measurements of speed and memory.

use crate::geometry::vector::quantile;
use crate::seed::{Draws, Stage};

/// Jitter as a fraction of a tile's longest side: copies differ, neighborhoods do not.
const JITTER: f64 = 1e-3;
/// Share of points at each end that a tile's sides ignore as outliers.
const TAIL: f64 = 0.01;

/// Returns `n_points` points: a random part of `base`, or copies of it side by side on a square
/// along its two longest sides. Each copy has its own jitter. Density and distance to the K-th
/// neighbor equal those of `base`.
pub fn tiled(base: &[[f64; 3]], n_points: usize, seed: u64) -> Vec<[f64; 3]> {
    let n = base.len();
    if n == 0 {
        return Vec::new();
    }
    let order = Draws::new(seed, Stage::Tiling, 0).permutation(n);
    let sides: [f64; 3] = std::array::from_fn(|c| {
        let mut column: Vec<f64> = base.iter().map(|p| p[c]).collect();
        column.sort_unstable_by(f64::total_cmp);
        quantile(&column, 1.0 - TAIL) - quantile(&column, TAIL)
    });
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| sides[b].total_cmp(&sides[a]));
    let per_row = (1..).find(|side| side * side * n >= n_points).unwrap_or(1);
    let spread = JITTER * sides[axes[0]];
    (0..n_points)
        .map(|at| {
            let copy = at / n;
            let mut point = base[order[at % n] as usize];
            if copy > 0 {
                let mut draws = Draws::new(seed, Stage::Tiling, 1 + at as u64);
                point = point.map(|x| x + spread * draws.normal());
                point[axes[0]] += (copy % per_row) as f64 * sides[axes[0]];
                point[axes[1]] += (copy / per_row) as f64 * sides[axes[1]];
            }
            point
        })
        .collect()
}
