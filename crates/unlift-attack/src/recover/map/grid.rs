//! A dense grid over the box of a map, and the density of estimates on it.

use crate::parallel;
use crate::recover::map::graph::record_of;
use crate::recover::map::lines::LineRow;
use crate::recover::map::places::{sample, sorted, trimmed_box};
use crate::recover::result::Estimate;

/// Cubic cells over a box. Places outside belong to the nearest cell.
#[derive(Clone, Debug)]
pub(crate) struct Grid<const D: usize> {
    pub(crate) low: [f32; D],
    pub(crate) cell: f32,
    per_length: f32,
    pub(crate) dims: [usize; D],
    /// Index of the last cell along each axis, as a float.
    pub(crate) last: [f32; D],
    pub(crate) values: Vec<f32>,
}

/// Every `f32` from here on is an integer.
const ROUNDING: f32 = 8_388_608.0;

impl<const D: usize> Grid<D> {
    /// Creates cells of one value.
    pub(crate) fn even(low: [f32; D], cell: f32, dims: [usize; D], value: f32) -> Self {
        let last = dims.map(|n| (n - 1) as f32);
        let values = vec![value; dims.iter().product()];
        Self { low, cell, per_length: 1.0 / cell, dims, last, values }
    }

    /// Creates about `n_cells` empty cells over the box from `low` to `high`; an axis without extent gets one cell.
    pub(crate) fn over(low: [f32; D], high: [f32; D], n_cells: usize) -> Self {
        let extent: [f64; D] =
            std::array::from_fn(|c| (f64::from(high[c]) - f64::from(low[c])).max(0.0));
        // A flat box has no volume: only axes with extent are divided.
        let long: Vec<f64> = extent.into_iter().filter(|&e| e > 0.0).collect();
        let mean = long.iter().map(|e| libm::pow(*e, 1.0 / long.len() as f64)).product::<f64>();
        let per_axis = libm::pow(n_cells as f64, 1.0 / long.len().max(1) as f64);
        let mut cell = (mean / per_axis).max(f64::from(f32::MIN_POSITIVE));
        while long.iter().map(|e| (e / cell).ceil()).product::<f64>() > n_cells as f64 {
            cell *= 1.05;
        }
        Self::of_cells(low, high, cell as f32)
    }

    fn of_cells(low: [f32; D], high: [f32; D], cell: f32) -> Self {
        let side = |c: usize| (((high[c] - low[c]) / cell).ceil() as usize).clamp(1, 1 << 20);
        Self::even(low, cell, std::array::from_fn(side), 0.0)
    }

    /// Returns the sides of the box, in whole cells.
    pub(crate) fn sides(&self) -> [f32; D] {
        self.dims.map(|n| n as f32 * self.cell)
    }

    pub(crate) fn volume(&self) -> f32 {
        (0..D).map(|_| self.cell).product()
    }

    /// Returns the index of the cell of `place`. Places outside, even infinite ones, get border cells.
    #[inline(always)]
    pub(crate) fn index(&self, place: &[f32; D]) -> usize {
        self.number(|c| place[c]) as usize
    }

    #[inline(always)]
    pub(crate) fn at(&self, place: &[f32; D]) -> f32 {
        self.values[self.index(place)]
    }

    /// Returns the index of the cell of a place with these coordinates.
    #[inline(always)]
    fn number(&self, x: impl Fn(usize) -> f32) -> u32 {
        let mut number = 0;
        for c in 0..D {
            let at = ((x(c) - self.low[c]) * self.per_length - 0.5).max(0.0).min(self.last[c]);
            // Adding a large number rounds to an integer; a cast that handles infinities is no vector instruction.
            let whole = (at + ROUNDING).to_bits() - ROUNDING.to_bits();
            number = number * self.dims[c] as u32 + whole;
        }
        number
    }

    /// Computes the cells of the places `through + t direction`.
    #[inline(always)]
    pub(crate) fn cells_along(
        &self,
        through: &[f32; D],
        direction: &[f32; D],
        t: &[f32],
        cells: &mut [u32],
    ) {
        for (cell, t) in cells.iter_mut().zip(t) {
            *cell = self.number(|c| through[c] + t * direction[c]);
        }
    }

    /// Adds `weight` at `place`, distributed linearly over the cells around it.
    pub(crate) fn spread(&mut self, place: &[f32; D], weight: f32) {
        let lower = std::array::from_fn(|c| self.lower(c, place[c]));
        for corner in 0..1 << D {
            let (index, share) = self.corner(corner, &lower, weight);
            self.values[index] += share;
        }
    }

    /// Returns the lower of the two cells around coordinate `x` of axis `c`, and the share of the upper one.
    pub(crate) fn lower(&self, c: usize, x: f32) -> (usize, f32) {
        let at = ((x - self.low[c]) / self.cell - 0.5).clamp(0.0, self.last[c]);
        (at as usize, at - at.floor())
    }

    /// Returns the index of one of the `2^D` cells around a place, and its share of `weight`; `lower` is that of each axis.
    pub(crate) fn corner(
        &self,
        corner: usize,
        lower: &[(usize, f32); D],
        mut weight: f32,
    ) -> (usize, f32) {
        let mut index = 0;
        for (c, &(low, share)) in lower.iter().enumerate() {
            let up = corner >> c & 1;
            index = index * self.dims[c] + (low + up).min(self.dims[c] - 1);
            weight *= if up == 1 { share } else { 1.0 - share };
        }
        (index, weight)
    }

    /// Returns the part `[from, to]` of a row inside the box, if any.
    pub(crate) fn clip(&self, row: &LineRow<D>) -> Option<(f32, f32)> {
        let (LineRow { through, direction, .. }, mut from, mut to) = (row, row.floor(), row.to);
        for c in 0..D {
            let (low, high) = (self.low[c], self.low[c] + self.cell * self.dims[c] as f32);
            if direction[c].abs() < 1e-12 {
                if through[c] < low || through[c] > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - through[c]) / direction[c], (high - through[c]) / direction[c]);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
        (from < to).then_some((from, to))
    }

    /// Smooths with weights 1 2 1 along each axis, with neighbors `apart` cells away; at the walls, values stay inside.
    pub(crate) fn smooth(&mut self, apart: usize) {
        let mut out = vec![0.0; self.values.len()];
        let mut stride = 1;
        for n in self.dims.into_iter().rev() {
            let values = &self.values;
            // Cells of one row have the same place along this axis, except along the last axis.
            let row = if stride == 1 { n } else { stride };
            let smooth = |(): &mut (), number: usize, out: &mut &mut [f32]| {
                let start = number * row;
                for (x, out) in out.iter_mut().enumerate() {
                    let (at, i) = (start + x, if stride == 1 { x } else { number % n });
                    let before = values[at - i.min(apart) * stride];
                    let after = values[at + (n - 1 - i).min(apart) * stride];
                    *out = 0.25 * (before + after) + 0.5 * values[at];
                }
            };
            let mut rows: Vec<&mut [f32]> = out.chunks_mut(row).collect();
            parallel::for_each_mut(&mut rows, || (), smooth);
            std::mem::swap(&mut self.values, &mut out);
            stride *= n;
        }
    }
}

// The density of estimates: `p_random` of joint recovery.

/// Density of estimates as a fraction of all per volume. Each estimate is weighted by the number of edges to its record.
pub(crate) struct Density<const D: usize> {
    grid: Grid<D>,
    typical: f32,
}

/// Least density of a cell, as a fraction of that of one widely smoothed estimate, so that chance is never 0.
const LEAST: f32 = 0.5;
/// Cells with less than this many estimates take their density from a wider neighborhood.
const ENOUGH: f32 = 0.25;
/// Number of times that the neighborhood doubles.
const WIDER: usize = 3;
/// Largest local stretch, because the farthest points hardly have true neighbors.
const LARGEST_STRETCH: f32 = 2.5;

impl<const D: usize> Density<D> {
    /// Computes the density of `estimates`, smoothed over about `radius`; `listed` is the number of edges to each target.
    pub(crate) fn new(estimates: &[Estimate<D>], listed: &[u32], radius: f32) -> Self {
        let n = estimates.len();
        let places = sample(estimates);
        let (low, high) = trimmed_box(&places);
        let (cell, most) = (radius * CELL, (4 * n).max(1 << 16));
        let side = |c: usize| f64::from((high[c] - low[c]) / cell).ceil().max(1.0);
        let fits = (0..D).map(side).product::<f64>() <= most as f64;
        let mut grid =
            if fits { Grid::of_cells(low, high, cell) } else { Grid::over(low, high, most) };
        let slots_per_target = n / listed.len().max(1);
        let mut weight = 0.0f64;
        for (slot, estimate) in estimates.iter().enumerate() {
            let times = listed[record_of(slot, slots_per_target)] as f32;
            weight += f64::from(times);
            if estimate.is_known() {
                grid.spread(&estimate.position, times);
            }
        }
        grid.smooth(1);
        let mean_times = (weight / n.max(1) as f64) as f32;
        // Linear distribution and smoothing leave about 1 / 2^D of an estimate in its own cell.
        let least = LEAST * mean_times / (1 << (D * (1 + WIDER))) as f32;
        look_wider(&mut grid, ENOUGH * mean_times);
        let scale = 1.0 / (weight.max(1.0) as f32 * grid.volume());
        for value in &mut grid.values {
            *value = value.max(least) * scale;
        }
        let densities = sorted(places.iter().map(|x| grid.at(x)));
        let typical = densities.get(densities.len() / 2).copied().unwrap_or(scale);
        Self { grid, typical }
    }

    #[inline(always)]
    pub(crate) fn at(&self, x: &[f32; D]) -> f32 {
        self.grid.at(x)
    }

    /// Returns how many times larger the distance to neighbors is than at a typical place (the cube root, also in 2D). Dense places get 1.
    #[inline(always)]
    pub(crate) fn stretch(&self, density: f32) -> f32 {
        let ratio = self.typical / density;
        if ratio > 1.0 { cube_root(ratio).min(LARGEST_STRETCH) } else { 1.0 }
    }
}

/// In cells of `grid` with less than `enough`, replaces the value by that of the narrowest wider smoothing that has enough.
fn look_wider<const D: usize>(grid: &mut Grid<D>, enough: f32) {
    let mut wide = grid.clone();
    let mut open: Vec<u32> =
        (0..grid.values.len() as u32).filter(|&i| grid.values[i as usize] < enough).collect();
    for wider in 1..=WIDER {
        wide.smooth(1 << wider);
        let enough = enough / (1 << (D * wider)) as f32;
        open.retain(|&i| {
            grid.values[i as usize] = wide.values[i as usize];
            wide.values[i as usize] < enough
        });
    }
}

/// Edge of a cell in radii: distribution, smoothing and lookup have the variance of the kernel `1 - r^2 / radius^2` in 3D.
const CELL: f32 = 0.436;

/// Returns the cube root of a number above 1, to 1e-3: two Newton steps from an exponent divided by three.
#[inline(always)]
fn cube_root(x: f32) -> f32 {
    let mut y = f32::from_bits(x.to_bits() / 3 + 709_921_077);
    for _ in 0..2 {
        y = (2.0 * y + x / (y * y)) / 3.0;
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    #[test]
    fn places_fall_into_their_cells_however_they_are_asked_for() {
        let grid = Grid::over([-3.0, 0.0, 2.0], [4.0, 5.0, 2.0], 4096);
        assert_eq!(grid.dims[2], 1);
        let mut draws = Draws::new(3, Stage::Synthetic, 0);
        let mut places: Vec<[f32; 3]> =
            (0..5000).map(|_| std::array::from_fn(|_| draws.between(-6.0, 8.0) as f32)).collect();
        places.extend([
            [f32::INFINITY, 1.0, f32::NEG_INFINITY],
            [1e30, -1e30, 2.0],
            [f32::NAN, 1.0, 2.0],
            [f32::MAX, f32::MIN, 0.0],
        ]);
        for place in &places {
            let counted = (0..3).fold(0, |number, c| {
                let at = f64::from(place[c] - grid.low[c]) / f64::from(grid.cell);
                // NaN belongs to the first cell.
                let whole = if at.is_nan() { 0.0 } else { at.floor() };
                number * grid.dims[c] + whole.clamp(0.0, (grid.dims[c] - 1) as f64) as usize
            });
            let mut along = [0; 1];
            grid.cells_along(place, &[0.0; 3], &[0.0], &mut along);
            assert_eq!([along[0] as usize, grid.index(place)], [counted; 2], "{place:?}");
        }
    }
}
