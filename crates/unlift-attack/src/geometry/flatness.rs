//! Flatness of a set of points.

use nalgebra::{DMatrix, SymmetricEigen};

use super::vector::{dot, quantile, quantile_of};

/// Fraction of the points that decide the thickness; the rest may be outliers.
const KEPT: f64 = 0.9;
const STEPS: usize = 8;

/// Returns the smallest extent of `points` divided by the largest one: 0 on a plane or a line, near 1 in a ball. Extents are those of the
/// middle 90 % of the points nearest to the best plane (least trimmed squares by concentration steps: Rousseeuw and Van Driessen 1999).
pub fn flatness<const D: usize>(points: &[[f64; D]]) -> f64 {
    let mut kept: Vec<[f64; D]> = points.to_vec();
    let mut flattest = 1.0;
    for _ in 0..STEPS {
        let Some(axes) = axes(&kept) else { return 0.0 };
        let mut along = axes.map(|axis| (extent(&kept, &axis), axis));
        along.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (least, thin) = along[0];
        if least <= 0.0 {
            return 0.0;
        }
        let flat = least / along[D - 1].0;
        if flat >= flattest {
            break;
        }
        flattest = flat;
        // The points nearest to the plane across this axis, in their order.
        let middle = quantile_of(kept.iter().map(|p| dot(p, &thin)), 0.5);
        let away = |p: &[f64; D]| (dot(p, &thin) - middle).abs();
        let limit = quantile_of(points.iter().map(away), KEPT);
        kept = points.iter().filter(|p| away(p) <= limit).copied().collect();
    }
    flattest
}

/// Returns the principal axes of the points; `None` if lengths overflow.
fn axes<const D: usize>(points: &[[f64; D]]) -> Option<[[f64; D]; D]> {
    let n = points.len() as f64;
    let mean: [f64; D] = std::array::from_fn(|c| points.iter().map(|p| p[c]).sum::<f64>() / n);
    let mut scatter = DMatrix::<f64>::zeros(D, D);
    for p in points {
        for (a, b) in (0..D).flat_map(|a| (0..D).map(move |b| (a, b))) {
            scatter[(a, b)] += (p[a] - mean[a]) * (p[b] - mean[b]);
        }
    }
    if !scatter.iter().all(|x| x.is_finite()) {
        return None;
    }
    // A tolerance of 0 is not always reached, depending on rounding.
    let eigen = SymmetricEigen::try_new(scatter, f64::EPSILON, 100)?;
    Some(std::array::from_fn(|axis| std::array::from_fn(|c| eigen.eigenvectors[(c, axis)])))
}

/// Returns the length from the 5th to the 95th percentile of `points` along `axis`.
fn extent<const D: usize>(points: &[[f64; D]], axis: &[f64; D]) -> f64 {
    let mut along: Vec<f64> = points.iter().map(|p| dot(p, axis)).collect();
    along.sort_unstable_by(f64::total_cmp);
    if along.is_empty() { 0.0 } else { quantile(&along, 0.95) - quantile(&along, 0.05) }
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
        let outliers = (0..40).map(|_| std::array::from_fn(|_| 6.0 * unit() - 3.0));
        tilted.extend(outliers);
        assert!(flatness(&tilted) < 1e-6, "{}", flatness(&tilted));
        let cube: Vec<[f64; 3]> = (0..500).map(|_| std::array::from_fn(|_| unit())).collect();
        // 0.72, because a tenth is cut off along the thinnest direction.
        assert!(flatness(&cube) > 0.7, "{}", flatness(&cube));
        let line: Vec<[f64; 3]> = (0..500).map(|_| [unit(); 3]).collect();
        assert!(flatness(&line) < 1e-9);
        assert_eq!(flatness::<3>(&[]), 0.0);
        assert_eq!(flatness(&[[1.0, 2.0, 3.0]; 4]), 0.0);
    }
}
