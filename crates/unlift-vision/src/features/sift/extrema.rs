//! Extrema of a difference of levels among their 26 neighbors, refined between pixels and levels.

use unlift::geometry::vector::dot;
use unlift::simd::{Kernel, dispatch};

use super::LEVELS;
use super::orientation::Place;
use super::scale_space::{BLOCK, Plane, lanes, sigma};

/// Minimum contrast of a keypoint, as a difference of gray values in `0..1`.
const MIN_CONTRAST: f64 = 0.02 / 3.0;
/// Contrast that a sample needs: less than its refined peak.
const MIN_SAMPLE: f32 = (0.8 * MIN_CONTRAST) as f32;
/// Maximum ratio of principal curvatures; keypoints above it are on edges.
const MAX_EDGE_RATIO: f64 = 10.0;

/// Three differences of four levels, computed on demand: cheaper than memory.
#[derive(Clone, Copy)]
pub(crate) struct Differences<'a>(pub(crate) &'a [Plane; 4]);

impl Differences<'_> {
    /// Returns difference `level` (0, 1 or 2) at column `x` of row `y`.
    #[inline(always)]
    pub(crate) fn at(self, level: usize, x: usize, y: usize) -> f32 {
        self.0[level + 1].at(x, y) - self.0[level].at(x, y)
    }

    /// Returns the extrema `(x, y)` of the middle difference, row by row, with a contrast of at
    /// least [`MIN_SAMPLE`]. Border pixels are excluded. Lowe 2004, Sec. 3.1.
    pub(crate) fn extrema(self) -> Vec<(usize, usize)> {
        dispatch(self)
    }

    /// Returns true if the middle difference at `(x, y)` is farther from 0 than all 26 neighbors.
    #[inline(always)]
    fn extreme(self, x: usize, y: usize) -> bool {
        let sign = self.at(1, x, y).signum();
        let here = sign * self.at(1, x, y);
        (0..3).all(|level| {
            (y - 1..=y + 1).all(|row| {
                (x - 1..=x + 1).all(|column| {
                    (level, row, column) == (1, y, x) || here > sign * self.at(level, column, row)
                })
            })
        })
    }
}

/// The scan for extrema.
impl Kernel for Differences<'_> {
    type Output = Vec<(usize, usize)>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut extrema = Vec::new();
        let levels = self.0;
        let (width, height) = (levels[0].width, levels[0].height);
        for y in 1..height.saturating_sub(1) {
            let rows = [levels[0].row(y), levels[1].row(y), levels[2].row(y), levels[3].row(y)];
            let across = [(1, y - 1), (2, y - 1), (1, y + 1), (2, y + 1)];
            let across = across.map(|(level, y)| levels[level].row(y));
            for start in (1..width.saturating_sub(1)).step_by(BLOCK) {
                if !strong(rows[1], rows[2], start) {
                    continue;
                }
                let mut peaks = peaks(&rows, &across, start);
                while peaks != 0 {
                    let x = start + peaks.trailing_zeros() as usize;
                    peaks &= peaks - 1;
                    if x < width - 1 && self.extreme(x, y) {
                        extrema.push((x, y));
                    }
                }
            }
        }
        extrema
    }
}

#[inline(always)]
fn difference(below: &[f32], above: &[f32], at: usize) -> [f32; BLOCK] {
    let mut values = lanes::<BLOCK>(above, at);
    for (value, below) in values.iter_mut().zip(lanes::<BLOCK>(below, at)) {
        *value -= below;
    }
    values
}

#[inline(always)]
fn strong(below: &[f32], above: &[f32], at: usize) -> bool {
    let mut any = 0;
    for value in difference(below, above, at) {
        any |= u32::from(value.abs() >= MIN_SAMPLE);
    }
    any != 0
}

/// Returns as bits the pixels of a block that have the contrast and exceed six neighbors: four in
/// their level, one in each other. One in hundreds does, and needs the full test.
#[inline(always)]
fn peaks(levels: &[&[f32]; 4], across: &[&[f32]; 4], at: usize) -> u32 {
    let here = difference(levels[1], levels[2], at);
    let left = difference(levels[1], levels[2], at - 1);
    let right = difference(levels[1], levels[2], at + 1);
    let up = difference(across[0], across[1], at);
    let down = difference(across[2], across[3], at);
    let finer = difference(levels[0], levels[1], at);
    let coarser = difference(levels[2], levels[3], at);
    let mut peaks = 0;
    for i in 0..BLOCK {
        let highest = left[i].max(right[i]).max(up[i]).max(down[i]).max(finer[i]).max(coarser[i]);
        let lowest = left[i].min(right[i]).min(up[i]).min(down[i]).min(finer[i]).min(coarser[i]);
        let value = here[i];
        let high = (value >= MIN_SAMPLE) & (value > highest);
        let low = (value <= -MIN_SAMPLE) & (value < lowest);
        peaks |= u32::from(high | low) << i;
    }
    peaks
}

/// Number of fits at most, each at the pixel that the previous one moved to.
const MOVES: usize = 5;
/// An offset beyond this moves to the neighbor.
const FAR: f64 = 0.6;
/// An offset beyond this belongs to another extremum.
const TOO_FAR: f64 = 1.5;

/// Returns the extremum of the quadratic around `(x, y)` in the middle difference, `level`.
///
/// `None` if its contrast is too low, its principal curvatures have too large a ratio or opposite
/// signs, or it is too far away. Lowe 2004, Sec. 4; moves and limits as VLFeat documents them.
pub(crate) fn refine(
    differences: Differences<'_>,
    (mut x, mut y): (usize, usize),
    level: usize,
) -> Option<Place> {
    let (width, height) = (differences.0[0].width, differences.0[0].height);
    let mut shape = Shape::at(differences, x, y);
    let mut offset = shape.offset();
    for _ in 1..MOVES {
        let (to_x, to_y) = (moved(x, offset[0], width), moved(y, offset[1], height));
        if (to_x, to_y) == (x, y) {
            break;
        }
        (x, y) = (to_x, to_y);
        shape = Shape::at(differences, x, y);
        offset = shape.offset();
    }
    let [dx, dy, ds] = offset;
    let (x, y, level) = (x as f64 + dx, y as f64 + dy, level as f64 + ds);
    let value = shape.value + 0.5 * dot(&shape.slope, &offset);
    let inside = (0.0..=(width - 1) as f64).contains(&x)
        && (0.0..=(height - 1) as f64).contains(&y)
        && (0.0..=(LEVELS + 2) as f64).contains(&level);
    let near = offset.iter().all(|offset| offset.abs() < TOO_FAR);
    let roundness = shape.roundness();
    let max_roundness = (MAX_EDGE_RATIO + 1.0) * (MAX_EDGE_RATIO + 1.0) / MAX_EDGE_RATIO;
    let round = roundness >= 0.0 && roundness < max_roundness;
    let is_peak = value.abs() > MIN_CONTRAST && round && near && inside;
    is_peak.then(|| Place { x, y, sigma: sigma(level) })
}

/// Returns the pixel where the refinement continues; border pixels are excluded.
fn moved(at: usize, offset: f64, length: usize) -> usize {
    if offset > FAR && at + 2 < length {
        at + 1
    } else if offset < -FAR && at > 1 {
        at - 1
    } else {
        at
    }
}

/// Value and derivatives along x, y and level, by central differences.
struct Shape {
    value: f64,
    slope: [f64; 3],
    curvature: [[f64; 3]; 3],
}

impl Shape {
    fn at(differences: Differences<'_>, x: usize, y: usize) -> Self {
        let at = |dx: isize, dy: isize, ds: isize| {
            let (x, y) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
            f64::from(differences.at(1_usize.wrapping_add_signed(ds), x, y))
        };
        let value = at(0, 0, 0);
        let twice = |a: f64, b: f64| a + b - 2.0 * value;
        let mixed = |a: f64, b: f64, c: f64, d: f64| 0.25 * (a + b - c - d);
        let xx = twice(at(1, 0, 0), at(-1, 0, 0));
        let yy = twice(at(0, 1, 0), at(0, -1, 0));
        let ss = twice(at(0, 0, 1), at(0, 0, -1));
        let xy = mixed(at(1, 1, 0), at(-1, -1, 0), at(-1, 1, 0), at(1, -1, 0));
        let xs = mixed(at(1, 0, 1), at(-1, 0, -1), at(-1, 0, 1), at(1, 0, -1));
        let ys = mixed(at(0, 1, 1), at(0, -1, -1), at(0, -1, 1), at(0, 1, -1));
        Self {
            value,
            slope: [
                0.5 * (at(1, 0, 0) - at(-1, 0, 0)),
                0.5 * (at(0, 1, 0) - at(0, -1, 0)),
                0.5 * (at(0, 0, 1) - at(0, 0, -1)),
            ],
            curvature: [[xx, xy, xs], [xy, yy, ys], [xs, ys, ss]],
        }
    }

    /// Returns where the slope vanishes; no offset if the curvature is singular.
    fn offset(&self) -> [f64; 3] {
        solve(self.curvature, self.slope.map(|slope| -slope)).unwrap_or([0.0; 3])
    }

    /// Returns `(r + 1)^2 / r` for a ratio `r` of principal curvatures, negative for opposite signs.
    fn roundness(&self) -> f64 {
        let [[xx, xy, _], [_, yy, _], _] = self.curvature;
        (xx + yy) * (xx + yy) / (xx * yy - xy * xy)
    }
}

/// Pivots below this count as zero.
const SINGULAR: f64 = 1e-10;

fn solve(mut a: [[f64; 3]; 3], mut b: [f64; 3]) -> Option<[f64; 3]> {
    for j in 0..3 {
        let pivot =
            (j..3).fold(j, |best, i| if a[i][j].abs() > a[best][j].abs() { i } else { best });
        if a[pivot][j].abs() < SINGULAR {
            return None;
        }
        a.swap(j, pivot);
        b.swap(j, pivot);
        let row = a[j];
        for i in j + 1..3 {
            let factor = a[i][j] / row[j];
            for (value, from) in a[i].iter_mut().zip(row) {
                *value -= factor * from;
            }
            b[i] -= factor * b[j];
        }
    }
    for j in (0..3).rev() {
        for k in j + 1..3 {
            b[j] -= a[j][k] * b[k];
        }
        b[j] /= a[j][j];
    }
    Some(b)
}
