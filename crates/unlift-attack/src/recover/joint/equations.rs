//! Systems of two or three equations.

/// Solves `a x = b` for a symmetric positive `a`; `b` becomes `x`. `false` when it is singular.
#[inline(always)]
pub(crate) fn solve_symmetric<const D: usize>(a: &mut [[f32; D]; D], b: &mut [f32; D]) -> bool {
    for i in 0..D {
        if a[i][i] <= 0.0 || a[i][i].is_nan() {
            return false;
        }
        for r in i + 1..D {
            let f = a[r][i] / a[i][i];
            let pivot = a[i];
            for (value, p) in a[r].iter_mut().zip(&pivot).skip(i) {
                *value -= f * p;
            }
            b[r] -= f * b[i];
        }
    }
    for i in (0..D).rev() {
        for c in i + 1..D {
            b[i] -= a[i][c] * b[c];
        }
        b[i] /= a[i][i];
    }
    true
}
