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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_and_the_whole_are_the_map_itself() {
        let base: Vec<[f64; 3]> = (0..50).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        assert!(tiled(&base, 20, 1).iter().all(|p| base.contains(p)));
        let mut whole = tiled(&base, 50, 1);
        whole.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        assert_eq!(whole, base);
        assert!(tiled(&[], 5, 1).is_empty());
    }

    #[test]
    fn copies_lie_side_by_side_and_differ() {
        let base = crate::synthetic::room(0, 400).points;
        let points = tiled(&base, 1600, 3);
        assert_eq!(points, tiled(&base, 1600, 3));
        let (first, others) = points.split_at(400);
        assert!(others.iter().all(|p| !first.contains(p)));
        let extent = |points: &[[f64; 3]], c: usize| {
            let mut column: Vec<f64> = points.iter().map(|p| p[c]).collect();
            column.sort_unstable_by(f64::total_cmp);
            quantile(&column, 0.95) - quantile(&column, 0.05)
        };
        let stretch: [f64; 3] = std::array::from_fn(|c| extent(&points, c) / extent(first, c));
        assert!(stretch[0] > 1.7 && stretch[1] > 1.7 && stretch[2] < 1.1, "{stretch:?}");
    }
}
