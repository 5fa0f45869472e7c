//! Vectors of three, and rotations about `z`, with exact arithmetic and square roots only.

/// Cosine and sine of a rotation about `z`.
pub(super) type Turn = [f64; 2];

/// Returns the rotation whose half angle has the tangent `t`. `sin` and `cos` differ between
/// platforms, this does not.
pub(super) fn turn(t: f64) -> Turn {
    let norm = 1.0 + t * t;
    [(1.0 - t * t) / norm, 2.0 * t / norm]
}

pub(super) fn rotate([cos, sin]: Turn, v: [f64; 3]) -> [f64; 3] {
    [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]]
}

/// Returns a + b.
pub(super) fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + b[c])
}

/// Returns a - b.
pub(super) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] - b[c])
}

/// Returns s a.
pub(super) fn scale(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|x| x * s)
}

/// Returns the dot product.
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the length.
pub(super) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// Returns a x b.
pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
