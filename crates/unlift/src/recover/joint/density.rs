//! How dense estimates of listed records lie: the votes a place gets by chance.

use super::graph::record_of;
use super::places::Places;
use crate::recover::grid::Grid;

/// Estimates per volume, as a share of all, each counted as often as its record is listed.
pub(crate) struct Density<const D: usize> {
    grid: Grid<D>,
    typical: f32,
}

/// A cell has at least the density of this part of one estimate.
const LEAST: f32 = 0.5;
/// Sparse places are taken as so much wider at most.
const WIDEST: f32 = 2.5;

impl<const D: usize> Density<D> {
    /// The density of `places`, weighted by how often each slot's record is `listed`, smooth over
    /// about `radius`.
    pub(crate) fn new(places: &Places<D>, listed: &[u32], radius: f32) -> Self {
        let n = places.len();
        let (low, high) = places.trimmed_box();
        let most = (4 * n).max(1 << 16);
        let mut grid = Grid::with_cell(low, high, radius * CELL, most);
        let slots_per_record = n / listed.len().max(1);
        let mut weight = 0.0f64;
        for slot in 0..n {
            let times = listed[record_of(slot, slots_per_record)] as f32;
            weight += f64::from(times);
            if places.is_known(slot) {
                grid.spread(&places.of(slot), times);
            }
        }
        grid.smooth();
        let volume: f32 = (0..D).map(|_| grid.cell()).product();
        let mean_times = (weight / n.max(1) as f64) as f32;
        // Linear spreading and smoothing leave about 1 / 2^D of an estimate in its own cell.
        let least = LEAST * mean_times / (1 << D) as f32;
        let scale = 1.0 / (weight.max(1.0) as f32 * volume);
        for value in &mut grid.values {
            *value = value.max(least) * scale;
        }
        let mut sample: Vec<f32> = places.sample().map(|x| grid.values[grid.index(&x)]).collect();
        let middle = sample.len() / 2;
        let typical = match sample.is_empty() {
            true => scale,
            false => *sample.select_nth_unstable_by(middle, f32::total_cmp).1,
        };
        Self { grid, typical }
    }

    /// The density at `x`.
    #[inline(always)]
    pub(crate) fn at(&self, x: &[f32; D]) -> f32 {
        self.grid.values[self.grid.index(x)]
    }

    /// The densities at places in columns, with room for a cell each.
    #[inline(always)]
    pub(crate) fn at_each(&self, x: &[&[f32]; D], cells: &mut [u32], densities: &mut [f32]) {
        self.grid.cells_of(x, cells);
        for (density, &cell) in densities.iter_mut().zip(cells.iter()) {
            *density = self.grid.values[cell as usize];
        }
    }

    /// The logarithm of how much sparser estimates are where the density is `density` than at a
    /// typical place.
    pub(crate) fn sparsity(&self, density: f32) -> f32 {
        libm::logf(self.typical / density)
    }

    /// How much wider neighbors lie where the density is `density` than at a typical place: lists have
    /// one length, so neighbors lie farther apart where points are sparse. Dense places count as
    /// typical: how narrow they are is beyond what the grid resolves.
    #[inline(always)]
    pub(crate) fn width(&self, density: f32) -> f32 {
        let ratio = self.typical / density;
        if ratio > 1.0 { cube_root(ratio).min(WIDEST) } else { 1.0 }
    }
}

/// Cells per radius: linear spreading, smoothing and lookup by cell together spread an estimate as far
/// (in variance) as the kernel `1 - r^2 / radius^2` in three dimensions.
const CELL: f32 = 0.436;

/// The cube root of a number above 1, to 1e-3: two Newton steps from an exponent divided by three.
#[inline(always)]
fn cube_root(x: f32) -> f32 {
    let mut y = f32::from_bits(x.to_bits() / 3 + 709_921_077);
    for _ in 0..2 {
        y = (2.0 * y + x / (y * y)) / 3.0;
    }
    y
}
