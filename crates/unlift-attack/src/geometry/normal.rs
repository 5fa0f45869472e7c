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
