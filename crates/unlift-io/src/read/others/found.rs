//! What is read of a map: points, and where cameras stand.

use std::path::PathBuf;

/// Points and cameras of a file.
#[derive(Debug, Default)]
pub struct Found {
    pub positions: Vec<[f64; 3]>,
    pub cameras: Vec<[f64; 3]>,
    /// What is up in each photo, in the world.
    pub up: Vec<[f64; 3]>,
    pub notes: Vec<String>,
    /// Why figures of the points may be too small, one line each.
    pub doubts: Vec<String>,
    /// Read beside the file itself.
    pub more: Vec<PathBuf>,
}

/// The center `-R^T t` of a camera whose pose is `x_cam = R x + t`, and the direction that `up_cam` of its own frame has in the
/// world; `None` when a number is not finite.
pub fn camera(
    rotation: &[[f64; 3]; 3],
    translation: &[f64; 3],
    up_cam: [f64; 3],
) -> Option<([f64; 3], [f64; 3])> {
    let transposed = |v: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| (0..3).map(|row| rotation[row][c] * v[row]).sum())
    };
    let (center, up) = (transposed(translation).map(|x| -x), transposed(&up_cam));
    (center.iter().chain(&up).all(|x| x.is_finite())).then_some((center, up))
}

/// What is up in a photo whose y grows downward.
pub const DOWNWARD: [f64; 3] = [0.0, -1.0, 0.0];
/// The same where y grows upward.
pub const UPWARD: [f64; 3] = [0.0, 1.0, 0.0];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_center_is_where_the_pose_maps_to_zero() {
        let quarter = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let (center, up) = camera(&quarter, &[1.0, 2.0, 3.0], DOWNWARD).unwrap();
        assert_eq!((center, up), ([-2.0, 1.0, -3.0], [-1.0, 0.0, 0.0]));
        assert!(camera(&quarter, &[f64::NAN, 0.0, 0.0], UPWARD).is_none());
    }
}
