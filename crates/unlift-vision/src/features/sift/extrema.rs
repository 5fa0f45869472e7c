//! Extrema of a difference of levels among their 26 neighbors.

use unlift::simd::{Kernel, dispatch};

use super::plane::{Plane, lanes};

/// Pixels compared together.
const BLOCK: usize = 16;
/// Contrast that a sample needs, as a share of the threshold of its refined peak.
const SAMPLED: f64 = 0.8;

/// Three differences of four consecutive levels, computed on demand: subtracting again is cheaper
/// than memory.
#[derive(Clone, Copy)]
pub(crate) struct Differences<'a>(pub(crate) &'a [Plane; 4]);

impl Differences<'_> {
    /// Returns difference `level` (0, 1 or 2) at column `x` of row `y`.
    #[inline(always)]
    pub(crate) fn at(self, level: usize, x: usize, y: usize) -> f32 {
        self.0[level + 1].at(x, y) - self.0[level].at(x, y)
    }

    /// Replaces `found` by the extrema `(x, y)` of the middle difference, row by row, with a
    /// contrast of at least [`SAMPLED`] times `peak`. Border pixels are excluded. Lowe 2004, Sec.
    /// 3.1.
    pub(crate) fn extrema(self, peak: f64, found: &mut Vec<(u32, u32)>) {
        found.clear();
        dispatch(Scan { differences: self, least: (SAMPLED * peak) as f32, found });
    }

    /// Returns true if the middle difference at `(x, y)` is larger than all 26 neighbors (smaller
    /// if it is negative).
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

struct Scan<'a> {
    differences: Differences<'a>,
    least: f32,
    found: &'a mut Vec<(u32, u32)>,
}

impl Kernel for Scan<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { differences, least, found } = self;
        let levels = differences.0;
        let (width, height) = (levels[0].width, levels[0].height);
        for y in 1..height.saturating_sub(1) {
            let rows = [levels[0].row(y), levels[1].row(y), levels[2].row(y), levels[3].row(y)];
            let across = [
                levels[1].row(y - 1),
                levels[2].row(y - 1),
                levels[1].row(y + 1),
                levels[2].row(y + 1),
            ];
            for start in (1..width.saturating_sub(1)).step_by(BLOCK) {
                if !strong(rows[1], rows[2], start, least) {
                    continue;
                }
                let mut peaks = peaks(&rows, &across, start, least);
                while peaks != 0 {
                    let x = start + peaks.trailing_zeros() as usize;
                    peaks &= peaks - 1;
                    if x < width - 1 && differences.extreme(x, y) {
                        found.push((x as u32, y as u32));
                    }
                }
            }
        }
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
fn strong(below: &[f32], above: &[f32], at: usize, least: f32) -> bool {
    let mut any = 0;
    for value in difference(below, above, at) {
        any |= u32::from(value.abs() >= least);
    }
    any != 0
}

/// Returns as bits the pixels of a block that have the contrast and exceed six neighbors: four in
/// their level, one in each other. One in hundreds does, and needs the full test.
#[inline(always)]
fn peaks(levels: &[&[f32]; 4], across: &[&[f32]; 4], at: usize, least: f32) -> u32 {
    let here = difference(levels[1], levels[2], at);
    let left = difference(levels[1], levels[2], at - 1);
    let right = difference(levels[1], levels[2], at + 1);
    let up = difference(across[0], across[1], at);
    let down = difference(across[2], across[3], at);
    let finer = difference(levels[0], levels[1], at);
    let coarser = difference(levels[2], levels[3], at);
    let mut peaks = 0;
    for i in 0..BLOCK {
        let most = left[i].max(right[i]).max(up[i]).max(down[i]).max(finer[i]).max(coarser[i]);
        let fewest = left[i].min(right[i]).min(up[i]).min(down[i]).min(finer[i]).min(coarser[i]);
        let value = here[i];
        let high = (value >= least) & (value > most);
        let low = (value <= -least) & (value < fewest);
        peaks |= u32::from(high | low) << i;
    }
    peaks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::image::GrayImage;

    /// Creates four levels whose middle difference is `middle`, and whose other differences are
    /// flat.
    fn levels(width: usize, height: usize, middle: impl Fn(usize, usize) -> f32) -> [Plane; 4] {
        let mut levels: [Plane; 4] = Default::default();
        for (at, level) in levels.iter_mut().enumerate() {
            let value = |i: usize| if at < 2 { 0.0 } else { middle(i % width, i / width) };
            let pixels = (0..width * height).map(value).collect();
            level.copy(&GrayImage::try_new(width, height, pixels).unwrap());
        }
        levels
    }

    #[test]
    fn extrema_of_both_signs_are_found_inside_only() {
        let spots =
            [(1, 1, 1.0), (17, 5, -1.0), (38, 8, 0.5), (0, 4, 1.0), (39, 6, 1.0), (20, 9, 1.0)];
        let value =
            |x, y| spots.iter().find(|spot| (spot.0, spot.1) == (x, y)).map_or(0.0, |spot| spot.2);
        let levels = levels(40, 10, value);
        let mut found = vec![(9, 9)];
        Differences(&levels).extrema(0.1, &mut found);
        assert_eq!(found, [(1, 1), (17, 5), (38, 8)]);
        Differences(&levels).extrema(0.7, &mut found);
        assert_eq!(found, [(1, 1), (17, 5)]);
    }

    #[test]
    fn equal_neighbors_are_no_extremum() {
        let levels = levels(20, 9, |x, y| if (8..10).contains(&x) && y == 4 { 1.0 } else { 0.0 });
        let mut found = Vec::new();
        Differences(&levels).extrema(0.1, &mut found);
        assert!(found.is_empty());
    }
}
