//! How dense estimates of listed records lie: the votes a place gets by chance.

use super::cells::Grid;
use super::edges::record_of;
use super::places::Places;

/// Estimates per volume, as a share of all, each counted as often as its record is listed.
pub(crate) struct Density<const D: usize> {
    grid: Grid<D>,
    typical: f32,
}

/// A cell has at least the density of this part of one estimate: no place is without chance.
const LEAST: f32 = 0.5;
/// Cells with less than this many estimates, which is noise, take their density from a wider neighborhood,
const ENOUGH: f32 = 0.25;
/// twice as wide at most this many times over.
const WIDER: usize = 3;
/// Sparse places are taken as so much wider at most: the farthest points have no neighbors worth the name.
const WIDEST: f32 = 2.5;

impl<const D: usize> Density<D> {
    /// The density of `places`, weighted by how often each slot's record is `listed`, smooth over
    /// about `radius`.
    pub(crate) fn new(places: &Places<D>, listed: &[u32], radius: f32) -> Self {
        let n = places.len();
        let (low, high) = places.trimmed_box();
        let mut grid = Grid::with_cell(low, high, radius * CELL, most_cells(n));
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
        let least = LEAST * mean_times / (1 << (D * (1 + WIDER))) as f32;
        look_wider(&mut grid, ENOUGH * mean_times);
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

/// Cells at most, for so many slots.
fn most_cells(n_slots: usize) -> usize {
    (4 * n_slots).max(1 << 16)
}

/// Where a cell of `grid` holds less than `enough`, its value becomes that of a wider smoothing, the first of several
/// under which as many estimates stand behind it.
fn look_wider<const D: usize>(grid: &mut Grid<D>, enough: f32) {
    let mut wide = grid.clone();
    let mut open: Vec<u32> =
        (0..grid.values.len() as u32).filter(|&i| grid.values[i as usize] < enough).collect();
    for wider in 1..=WIDER {
        wide.smooth_apart(1 << wider);
        let enough = enough / (1 << (D * wider)) as f32;
        open.retain(|&i| {
            grid.values[i as usize] = wide.values[i as usize];
            wide.values[i as usize] < enough
        });
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sparse_cells_look_wider_and_dense_ones_do_not() {
        let mut grid = Grid::<2>::over([0.0; 2], [64.0; 2], 64 * 64);
        // A dense corner, and one estimate far from it.
        for x in 0..8 {
            for y in 0..8 {
                grid.spread(&[x as f32 + 0.5, y as f32 + 0.5], 1.0);
            }
        }
        grid.spread(&[40.5, 40.5], 1.0);
        grid.smooth();
        let before = grid.clone();
        look_wider(&mut grid, ENOUGH);
        let (dense, lone, beside) =
            (grid.index(&[4.5, 4.5]), grid.index(&[40.5, 40.5]), grid.index(&[44.5, 40.5]));
        assert_eq!(grid.values[dense], before.values[dense]);
        assert!(before.values[beside] == 0.0 && grid.values[beside] > 0.0);
        assert!(grid.values[lone] >= grid.values[beside]);
        assert!(grid.values[lone] < grid.values[dense]);
    }
}
