//! Gradients of a level, computed row by row on demand.

use std::f32::consts::FRAC_1_PI;
use std::ops::Range;

use unlift::simd::{Kernel, dispatch};

use super::scale_space::{BLOCK, Plane, lanes};

/// Eighths in a full turn: angles are in units of descriptor bins, `0..=8`.
pub(crate) const TURN: f32 = 8.0;

#[derive(Default)]
pub(crate) struct Gradients {
    /// Length of the gradient, gray values per pixel.
    pub(crate) length: Plane,
    /// Direction of the gradient in eighths of a turn, from x to y.
    pub(crate) angle: Plane,
    ready: Vec<bool>,
}

impl Gradients {
    /// Discards all rows, for a new level.
    pub(crate) fn reset(&mut self, level: &Plane) {
        self.length.reshape(level.width, level.height);
        self.angle.reshape(level.width, level.height);
        self.ready.clear();
        self.ready.resize(level.height, false);
    }

    /// Computes the missing rows of `rows`.
    pub(crate) fn prepare(&mut self, level: &Plane, rows: Range<usize>) {
        dispatch(Prepare { gradients: self, level, rows });
    }
}

struct Prepare<'a> {
    gradients: &'a mut Gradients,
    level: &'a Plane,
    rows: Range<usize>,
}

impl Kernel for Prepare<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { gradients, level, rows } = self;
        let last = (level.width - 1, level.height - 1);
        for y in rows {
            if std::mem::replace(&mut gradients.ready[y], true) {
                continue;
            }
            let here = level.row(y);
            let (above, below) = (y.saturating_sub(1), (y + 1).min(last.1));
            let (up, down) = (level.row(above), level.row(below));
            // One-sided at a border, where the two rows differ by one.
            let per_row = if below - above == 2 { 0.5 } else { 1.0 };
            let length = gradients.length.row_mut(y);
            let angle = gradients.angle.row_mut(y);
            for at in (1..last.0).step_by(BLOCK) {
                let (left, right) = (lanes::<BLOCK>(here, at - 1), lanes::<BLOCK>(here, at + 1));
                let (up, down) = (lanes::<BLOCK>(up, at), lanes::<BLOCK>(down, at));
                let mut lengths = [0.0; BLOCK];
                let mut angles = [0.0; BLOCK];
                for i in 0..BLOCK {
                    let x = 0.5 * (right[i] - left[i]);
                    let y = per_row * (down[i] - up[i]);
                    (lengths[i], angles[i]) = polar(x, y);
                }
                length[at..at + BLOCK].copy_from_slice(&lengths);
                angle[at..at + BLOCK].copy_from_slice(&angles);
            }
            for x in [0, last.0] {
                let (left, right) = (x.saturating_sub(1), (x + 1).min(last.0));
                let dy = per_row * (down[x] - up[x]);
                (length[x], angle[x]) = polar(here[right] - here[left], dy);
            }
        }
    }
}

/// Returns length and direction, the latter in eighths of a turn within `0..=8`.
///
/// The arc tangent is a cubic in `(|y| - |x|) / (|y| + |x|)`, with an error of at most 0.6 degrees.
/// VLFeat documents this one, so histograms agree with it. It has no branch.
#[inline(always)]
fn polar(x: f32, y: f32) -> (f32, f32) {
    const CUBIC: f32 = 0.1821 * 4.0 * FRAC_1_PI;
    const LINEAR: f32 = 0.9675 * 4.0 * FRAC_1_PI;
    let length = (x * x + y * y).sqrt();
    let (ax, ay) = (x.abs(), y.abs());
    // A small term gives zero gradients a direction, too.
    let r = (ax - ay) / (ax + ay + 1e-12);
    // In the first quadrant: 1 eighth at 45 degrees. The cubic ends slightly below zero.
    let angle = (1.0 + (CUBIC * r * r - LINEAR) * r).max(0.0);
    let angle = if x < 0.0 { 4.0 - angle } else { angle };
    let angle = if y < 0.0 { TURN - angle } else { angle };
    (length, angle)
}
