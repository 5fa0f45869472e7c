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
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let [least, second, most] = axes;
    // Points on a line or at one place have no normal.
    if eigen.eigenvalues[second] <= eigen.eigenvalues[most] * 1e-12 {
        return None;
    }
    let column = eigen.eigenvectors.column(least);
    Some([column[0], column[1], column[2]])
}
