//! Camera poses.

/// Returns the center `-R^T t` of a camera with the pose `x_cam = R x + t`, and the direction
/// `up_cam` of its frame in the world.
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

/// Returns the rotation of a quaternion (w, x, y, z) times its squared norm, and the squared norm.
pub fn scaled_rotation([w, x, y, z]: [f64; 4]) -> ([[f64; 3]; 3], f64) {
    let rows = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ];
    (rows, w * w + x * x + y * y + z * z)
}

/// Up in the frame of a camera whose y axis points down.
pub const DOWNWARD: [f64; 3] = [0.0, -1.0, 0.0];
/// Up in the frame of a camera whose y axis points up.
pub const UPWARD: [f64; 3] = [0.0, 1.0, 0.0];
