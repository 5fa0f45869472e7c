//! Poses of cameras, whatever the format.

/// The center `-R^T t` of a camera whose pose is `x_cam = R x + t`, and the direction that `up_cam` of its own frame has in the
/// world.
pub fn camera(
    rotation: &[[f64; 3]; 3],
    translation: &[f64; 3],
    up_cam: [f64; 3],
) -> ([f64; 3], [f64; 3]) {
    let transposed = |v: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| (0..3).map(|row| rotation[row][c] * v[row]).sum())
    };
    (transposed(translation).map(|x| -x), transposed(&up_cam))
}

/// The rotation of a quaternion (w, x, y, z) of any length, times the square of that length, and this square.
pub fn scaled_rotation([w, x, y, z]: [f64; 4]) -> ([[f64; 3]; 3], f64) {
    let rows = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ];
    (rows, w * w + x * x + y * y + z * z)
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
        let (center, up) = camera(&quarter, &[1.0, 2.0, 3.0], DOWNWARD);
        assert_eq!((center, up), ([-2.0, 1.0, -3.0], [-1.0, 0.0, 0.0]));
    }
}
