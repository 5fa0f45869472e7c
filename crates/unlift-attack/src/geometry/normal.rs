//! The normal of a local surface.

use nalgebra::{Matrix3, SymmetricEigen};

/// Returns the unit normal of the plane through `center` that fits `neighbors` best: the direction of least variance of their
/// offsets from `center`. `None` with fewer than two different offsets.
pub fn local_normal(
    center: &[f64; 3],
    neighbors: impl Iterator<Item = [f64; 3]>,
) -> Option<[f64; 3]> {
    let mut spread = Matrix3::<f64>::zeros();
    for neighbor in neighbors {
        let offset = nalgebra::Vector3::from_fn(|c, _| neighbor[c] - center[c]);
        spread += offset * offset.transpose();
    }
    // A tolerance of 0 is not always reached, depending on rounding.
    let eigen = SymmetricEigen::try_new(spread, f64::EPSILON, 100)?;
    let order = |a: &usize, b: &usize| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]);
    let least = (0..3).min_by(order)?;
    let most = (0..3).max_by(order)?;
    // Points on a line or at one place have no normal.
    let second = 3 - least - most;
    if least == most || eigen.eigenvalues[second] <= eigen.eigenvalues[most] * 1e-12 {
        return None;
    }
    let column = eigen.eigenvectors.column(least);
    Some([column[0], column[1], column[2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_tilted_plane_give_its_normal() {
        // x + 2 y + 2 z = 0, unit normal (1, 2, 2) / 3.
        let on_plane = |a: f64, b: f64| [2.0 * a, -a - b, b];
        let neighbors = (0..20).map(|i| on_plane(f64::from(i % 5) - 2.0, f64::from(i / 5) - 1.5));
        let normal = local_normal(&[0.0; 3], neighbors).unwrap();
        let along = (normal[0] + 2.0 * normal[1] + 2.0 * normal[2]) / 3.0;
        assert!((along.abs() - 1.0).abs() < 1e-12, "{normal:?}");
    }

    #[test]
    fn collinear_points_have_no_normal() {
        let neighbors = (1..9).map(|i| [f64::from(i), 2.0 * f64::from(i), 0.0]);
        assert_eq!(local_normal(&[0.0; 3], neighbors), None);
    }
}
