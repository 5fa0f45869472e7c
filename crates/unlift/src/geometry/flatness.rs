//! How flat or thin points lie.

use nalgebra::{DMatrix, SymmetricEigen};

use super::vector::{dot, quantile};

/// The smallest extent of `points` as a share of the largest one: 0 on a plane or a line, 1 in a ball. Extents are those of
/// the middle nine tenths along the axes of the scatter, so that a few outliers make no map thick. Of fewer than two places 0.
pub fn flatness<const D: usize>(points: &[[f64; D]]) -> f64 {
    let n = points.len() as f64;
    let mean: [f64; D] = std::array::from_fn(|c| points.iter().map(|p| p[c]).sum::<f64>() / n);
    let mut scatter = DMatrix::<f64>::zeros(D, D);
    for p in points {
        for (a, b) in (0..D).flat_map(|a| (0..D).map(move |b| (a, b))) {
            scatter[(a, b)] += (p[a] - mean[a]) * (p[b] - mean[b]);
        }
    }
    if !scatter.iter().all(|x| x.is_finite()) {
        return 0.0;
    }
    // A tolerance of 0 is not always reached, and whether it is depends on rounding.
    let Some(eigen) = SymmetricEigen::try_new(scatter, f64::EPSILON, 100) else { return 0.0 };
    let extent = |axis: usize| {
        let axis: [f64; D] = std::array::from_fn(|c| eigen.eigenvectors[(c, axis)]);
        let mut along: Vec<f64> = points.iter().map(|p| dot(p, &axis)).collect();
        along.sort_unstable_by(f64::total_cmp);
        if along.is_empty() { 0.0 } else { quantile(&along, 0.95) - quantile(&along, 0.05) }
    };
    let extents: [f64; D] = std::array::from_fn(extent);
    let most = extents.into_iter().fold(0.0, f64::max);
    if most > 0.0 { extents.into_iter().fold(most, f64::min) / most } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    #[test]
    fn planes_and_lines_are_flat_and_a_few_outliers_make_them_no_thicker() {
        let mut draws = Draws::new(3, Stage::Synthetic, 0);
        let mut unit = || draws.unit();
        let mut tilted: Vec<[f64; 3]> =
            (0..500).map(|_| (unit(), unit())).map(|(a, b)| [2.0 * a, -a - b, b]).collect();
        assert!(flatness(&tilted) < 1e-9);
        tilted.extend((0..5).map(|_| std::array::from_fn(|_| unit())));
        assert!(flatness(&tilted) < 0.1);
        let cube: Vec<[f64; 3]> = (0..500).map(|_| std::array::from_fn(|_| unit())).collect();
        assert!(flatness(&cube) > 0.8);
        let line: Vec<[f64; 3]> = (0..500).map(|_| [unit(); 3]).collect();
        assert!(flatness(&line) < 1e-9);
        assert_eq!(flatness::<3>(&[]), 0.0);
        assert_eq!(flatness(&[[1.0, 2.0, 3.0]; 4]), 0.0);
    }
}
