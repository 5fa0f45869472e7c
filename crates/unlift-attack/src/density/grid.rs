//! Samples of the density of hidden points along lines, and other boxes of it.

use std::ops::Range;

use rayon::prelude::*;

use crate::recover::map::{Grid, LineRow};

impl Grid<3> {
    /// Returns the steps of `line` in the box. Step `k` is at parameter `(k + 1/2) cell`. A few at its ends may lie just outside.
    pub(super) fn span(&self, line: &LineRow<3>) -> Range<i32> {
        let inside = self.clip(&line.through, &line.direction, line.floor(), line.to);
        let (from, to) = inside.unwrap_or_default();
        // Farther away, parameters of neighboring steps are equal.
        let far = (1 << 22) as f32 * self.cell;
        if !(from < to && from.abs() < far && to.abs() < far) {
            return 0..0;
        }
        let first = (from / self.cell - 0.5).ceil() as i32;
        first..((to / self.cell - 0.5).floor() as i32 + 1).max(first)
    }

    /// Returns the parameter of step `k`.
    #[inline(always)]
    pub(super) fn parameter(&self, k: i32) -> f32 {
        (k as f32 + 0.5) * self.cell
    }

    /// Returns the voxel of step `k` of `line`; `None` outside the box.
    #[inline(always)]
    pub(super) fn voxel(&self, line: &LineRow<3>, k: i32) -> Option<usize> {
        let t = self.parameter(k);
        let x: [f32; 3] = std::array::from_fn(|c| {
            (line.through[c] + t * line.direction[c] - self.low[c]) / self.cell
        });
        let at = x.map(|x| x as usize);
        if !(0..3).all(|c| x[c] >= 0.0 && at[c] < self.dims[c]) {
            return None;
        }
        Some((at[0] * self.dims[1] + at[1]) * self.dims[2] + at[2])
    }

    /// Returns the density in another box, linearly interpolated, up to a common factor.
    pub(super) fn resampled(&self, low: [f32; 3], cell: f32, dims: [usize; 3]) -> Self {
        let mut finer = Self::even(low, cell, dims, 0.0);
        // Per axis and voxel: the lower of the two coarse voxels, and the weight of the upper one.
        let places: [Vec<(usize, f32)>; 3] = std::array::from_fn(|c| {
            let place = |i: usize| self.lower(c, low[c] + (i as f32 + 0.5) * cell);
            (0..dims[c]).map(place).collect()
        });
        finer.values.par_chunks_mut(dims[2]).enumerate().for_each(|(row, out)| {
            let [x, y] = [places[0][row / dims[1]], places[1][row % dims[1]]];
            for (out, &z) in out.iter_mut().zip(&places[2]) {
                for corner in 0..8 {
                    let (at, share) = self.corner(corner, &[x, y, z], 1.0);
                    *out += share * self.values[at];
                }
            }
        });
        finer
    }

    /// Returns the box that leaves the fraction `q` of the mass beyond each wall, extended by a voxel.
    pub(super) fn bounds(&self, q: f64) -> ([f32; 3], [f32; 3]) {
        let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
        let layer = self.dims[1] * self.dims[2];
        for c in 0..3 {
            let mut profile = vec![0.0f64; self.dims[c]];
            for (at, &mass) in self.values.iter().enumerate() {
                let place = [at / layer, at / self.dims[2] % self.dims[1], at % self.dims[2]];
                profile[place[c]] += f64::from(mass);
            }
            let beyond = q * profile.iter().sum::<f64>();
            let below = count_below(profile.iter(), beyond);
            let above = self.dims[c] - count_below(profile.iter().rev(), beyond);
            low[c] = self.low[c] + (below as f32 - 1.0) * self.cell;
            high[c] = self.low[c] + (above.max(below + 1) as f32 + 1.0) * self.cell;
        }
        (low, high)
    }
}

/// Returns how many leading entries have a sum of at most `most`.
fn count_below<'a>(entries: impl Iterator<Item = &'a f64>, most: f64) -> usize {
    let mut sum = 0.0;
    entries
        .take_while(|&&mass| {
            sum += mass;
            sum <= most
        })
        .count()
}
