//! The density of hidden points on a grid, and samples of it along lines.

use rayon::prelude::*;

use super::feasible::FeasibleLine;

/// Mass per cubic voxel in a box.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) low: [f32; 3],
    /// Side of a voxel, and distance between samples on a line.
    pub(super) side: f32,
    /// Number of voxels along x, y, z; x varies fastest.
    pub(super) n: [usize; 3],
    pub(super) mass: Vec<f32>,
}

/// The samples of a line within a grid: steps `first..end`. Step `k` is at parameter `(k + 1/2) side`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Span {
    pub(super) first: i32,
    pub(super) end: i32,
}

impl Span {
    /// Number of samples.
    pub(super) fn len(self) -> usize {
        usize::try_from(self.end - self.first).unwrap_or(0)
    }
}

/// Fraction that smoothing moves to each of the two neighbors along an axis.
pub(super) const SMOOTHING: f32 = 0.25;

impl Grid {
    /// Creates a box of uniform density.
    pub(super) fn even(low: [f32; 3], side: f32, n: [usize; 3]) -> Self {
        Self { low, side, n, mass: vec![1.0; n[0] * n[1] * n[2]] }
    }

    /// Returns the same box with other mass.
    pub(super) fn with(&self, mass: Vec<f32>) -> Self {
        Self { low: self.low, side: self.side, n: self.n, mass }
    }

    /// Number of voxels in one layer of z.
    pub(super) fn layer(&self) -> usize {
        self.n[0] * self.n[1]
    }

    /// Returns the parameter of step `k`.
    #[inline(always)]
    pub(super) fn parameter(&self, k: i32) -> f32 {
        (k as f32 + 0.5) * self.side
    }

    /// Returns the samples of `line` in the box. A few at its ends may lie just outside.
    pub(super) fn span(&self, line: &FeasibleLine) -> Span {
        let (mut from, mut to) = (f64::from(line.from), f64::INFINITY);
        for c in 0..3 {
            let low = f64::from(self.low[c]);
            let high = low + self.n[c] as f64 * f64::from(self.side);
            let (at, slope) = (f64::from(line.through[c]), f64::from(line.direction[c]));
            if slope.abs() < 1e-9 {
                if at < low || at >= high {
                    return Span::default();
                }
                continue;
            }
            let (one, other) = ((low - at) / slope, (high - at) / slope);
            from = from.max(one.min(other));
            to = to.min(one.max(other));
        }
        self.steps(from, to)
    }

    fn steps(&self, from: f64, to: f64) -> Span {
        // Farther away, f32 parameters of neighboring steps are equal.
        let far = f64::from(1 << 22) * f64::from(self.side);
        let inside = from < to && from.abs() < far && to.abs() < far;
        if !inside {
            return Span::default();
        }
        let side = f64::from(self.side);
        let first = (from / side - 0.5).ceil() as i32;
        Span { first, end: ((to / side - 0.5).floor() as i32 + 1).max(first) }
    }

    /// Returns the part of `span` that may lie in the layers `from..to`, slightly extended.
    pub(super) fn span_in_layers(
        &self,
        line: &FeasibleLine,
        span: Span,
        from: usize,
        to: usize,
    ) -> Span {
        let side = f64::from(self.side);
        let low = f64::from(self.low[2]) + from as f64 * side;
        let high = f64::from(self.low[2]) + to as f64 * side;
        let (at, slope) = (f64::from(line.through[2]), f64::from(line.direction[2]));
        if slope.abs() < 1e-9 {
            let near = at >= low - side && at < high + side;
            return if near { span } else { Span::default() };
        }
        let (one, other) = ((low - at) / slope, (high - at) / slope);
        let first = (one.min(other) / side - 0.5).ceil() as i32;
        let end = (one.max(other) / side - 0.5).floor() as i32;
        let first = span.first.max(first.saturating_sub(1));
        Span { first, end: span.end.min(end.saturating_add(2)).max(first) }
    }

    /// Returns the voxel of step `k` of `line`; `None` outside the box.
    #[inline(always)]
    pub(super) fn voxel(&self, line: &FeasibleLine, k: i32) -> Option<usize> {
        let t = self.parameter(k);
        let x: [f32; 3] = std::array::from_fn(|c| {
            (line.through[c] + t * line.direction[c] - self.low[c]) / self.side
        });
        let at = x.map(|x| x as usize);
        if !(0..3).all(|c| x[c] >= 0.0 && at[c] < self.n[c]) {
            return None;
        }
        Some((at[2] * self.n[1] + at[1]) * self.n[0] + at[0])
    }

    /// Applies binomial smoothing along every axis once; mass at the walls stays inside.
    pub(super) fn smooth(&mut self) {
        let (nx, ny, nz, layer) = (self.n[0], self.n[1], self.n[2], self.layer());
        let mut out = vec![0.0f32; self.mass.len()];
        for axis in 0..3 {
            let mass = &self.mass;
            out.par_chunks_mut(layer.max(1)).enumerate().for_each(|(z, out)| {
                for y in 0..ny {
                    let row = z * layer + y * nx;
                    let (here, to) = (&mass[row..row + nx], &mut out[y * nx..(y + 1) * nx]);
                    let (before, after) = match axis {
                        0 => {
                            smooth_row(here, to);
                            continue;
                        }
                        1 => (row - nx * usize::from(y > 0), row + nx * usize::from(y + 1 < ny)),
                        _ => (
                            row - layer * usize::from(z > 0),
                            row + layer * usize::from(z + 1 < nz),
                        ),
                    };
                    let (before, after) = (&mass[before..before + nx], &mass[after..after + nx]);
                    for x in 0..nx {
                        to[x] =
                            here[x] * (1.0 - 2.0 * SMOOTHING) + (before[x] + after[x]) * SMOOTHING;
                    }
                }
            });
            std::mem::swap(&mut self.mass, &mut out);
        }
    }

    /// Returns the density in another box, linearly interpolated, up to a common factor.
    pub(super) fn resampled(&self, low: [f32; 3], side: f32, n: [usize; 3]) -> Self {
        let mut finer = Self::even(low, side, n);
        let layer = finer.layer();
        // Per axis and voxel: the lower of the two coarse voxels, and the weight of the upper one.
        let places: [Vec<(usize, f32)>; 3] = std::array::from_fn(|c| {
            let last = (self.n[c] - 1) as f32;
            let place = |i: usize| {
                let x = (low[c] + (i as f32 + 0.5) * side - self.low[c]) / self.side - 0.5;
                let x = x.clamp(0.0, last);
                (x as usize, x - x.floor())
            };
            (0..n[c]).map(place).collect()
        });
        finer.mass.par_chunks_mut(layer.max(1)).enumerate().for_each(|(z, out)| {
            for y in 0..n[1] {
                for x in 0..n[0] {
                    let corner = [places[0][x], places[1][y], places[2][z]];
                    out[y * n[0] + x] = self.interpolate(corner);
                }
            }
        });
        finer
    }

    fn interpolate(&self, corner: [(usize, f32); 3]) -> f32 {
        let mut sum = 0.0;
        for choice in 0..8 {
            let (mut weight, mut at) = (1.0, [0usize; 3]);
            for c in 0..3 {
                let (low, share) = corner[c];
                let upper = choice >> c & 1 == 1;
                weight *= if upper { share } else { 1.0 - share };
                at[c] = (low + usize::from(upper)).min(self.n[c] - 1);
            }
            sum += weight * self.mass[(at[2] * self.n[1] + at[1]) * self.n[0] + at[0]];
        }
        sum
    }

    /// Returns the box that leaves the fraction `q` of the mass beyond each wall, extended by a voxel.
    pub(super) fn bounds(&self, q: f64) -> ([f32; 3], [f32; 3]) {
        let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
        for c in 0..3 {
            let mut profile = vec![0.0f64; self.n[c]];
            for (at, &mass) in self.mass.iter().enumerate() {
                let place = [at % self.n[0], at / self.n[0] % self.n[1], at / self.layer()];
                profile[place[c]] += f64::from(mass);
            }
            let beyond = q * profile.iter().sum::<f64>();
            let below = count_below(profile.iter(), beyond);
            let above = self.n[c] - count_below(profile.iter().rev(), beyond);
            low[c] = self.low[c] + (below as f32 - 1.0) * self.side;
            high[c] = self.low[c] + (above.max(below + 1) as f32 + 1.0) * self.side;
        }
        (low, high)
    }
}

fn smooth_row(here: &[f32], to: &mut [f32]) {
    let last = here.len() - 1;
    for x in 0..=last {
        let (before, after) = (here[x.saturating_sub(1)], here[(x + 1).min(last)]);
        to[x] = here[x] * (1.0 - 2.0 * SMOOTHING) + (before + after) * SMOOTHING;
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
