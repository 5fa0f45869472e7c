//! The chance that a random listed record passes near a place.
//!
//! A line passes within `delta` of a place `x` with probability `density(x) * tube(delta)`: the expected length of lines per volume, as
//! often as each is listed, times the volume per length of a tube. A coarse grid suffices, because density varies over the size of a room.

use crate::RecordId;
use crate::geometry::vector::{along, dot, median, sub, widen};
use crate::neighbors::Neighborhoods;
use crate::parallel;
use crate::recover::map::grid::Grid;
use crate::recover::map::lines::{LineRow, MOST_CHANCE};
use crate::recover::map::places::{evenly, trimmed_box};

/// Largest number of cells of a grid: 32 per axis, because density varies over the size of a room.
pub(crate) const CELLS: usize = 1 << 15;
/// Least density, as a fraction of the mean: with chance near 0, a single vote would decide.
const FLOOR: f32 = 0.05;

pub(crate) struct ChanceField<const D: usize> {
    pub(crate) grid: Grid<D>,
}

impl<const D: usize> ChanceField<D> {
    /// Creates the field from sums of weighted length per cell; `weight` is the weight of all records.
    pub(crate) fn new(mut grid: Grid<D>, weight: f32) -> Self {
        grid.smooth(1);
        let scale = 1.0 / (weight * grid.volume()).max(f32::MIN_POSITIVE);
        let mean = grid.values.iter().sum::<f32>() / grid.values.len() as f32;
        for value in &mut grid.values {
            *value = (value.max(FLOOR * mean) * scale).max(f32::MIN_POSITIVE);
        }
        Self { grid }
    }

    /// Returns the density at a typical place: the mean over places weighted by density.
    pub(crate) fn typical(&self) -> f32 {
        let values = || self.grid.values.iter().map(|&x| f64::from(x));
        (values().map(|x| x * x).sum::<f64>() / values().sum::<f64>()) as f32
    }

    /// Returns the chance that a random record passes through a tube about `x`; `tube` is its volume per length.
    #[inline(always)]
    pub(crate) fn at(&self, x: &[f32; D], tube: f32) -> f32 {
        (self.grid.at(x) * tube).min(MOST_CHANCE)
    }

    /// Adds the chance, without its limit, at each `t` of a line to `chance`. `cells` is a buffer of the same length.
    #[inline(always)]
    pub(crate) fn add_along(
        &self,
        (through, direction): (&[f32; D], &[f32; D]),
        t: &[f32],
        tube: f32,
        (cells, chance): (&mut [u32], &mut [f32]),
    ) {
        self.grid.cells_along(through, direction, t, cells);
        for (chance, &cell) in chance.iter_mut().zip(cells.iter()) {
            *chance += self.grid.values[cell as usize] * tube;
        }
    }
}

/// Returns the volume per length of the tube of radius `delta` around a line.
pub(crate) fn tube(dimensions: usize, delta: f32) -> f32 {
    if dimensions == 2 { 2.0 * delta } else { std::f32::consts::PI * delta * delta }
}

/// Returns the fields of lines (one) or of rays (one per center, from the rays of the other centers).
pub(crate) fn of_lines<const D: usize>(
    rows: &[LineRow<D>],
    lists: &Neighborhoods,
    slots_per_record: usize,
) -> Vec<ChanceField<D>> {
    // The centers up to the last one that has a ray; none for lines.
    let rays = rows.iter().filter(|row| row.is_ray());
    let n_groups = rays.map(|row| row.group + 1).max();
    let crossings = |slot: usize| {
        let own = &rows[slot / slots_per_record];
        // Lists are in order of record, which is random, so any entries will do.
        let listed = lists.of(slot).iter().take(2);
        listed.filter_map(|record| own.crossing(&rows[record.index()]))
    };
    // Enough for a quantile of 3 %.
    let places: Vec<_> = evenly(lists.n_slots(), 1 << 12).flat_map(crossings).collect();
    let (low, high) = trimmed_box(&places);
    let counts = times_listed(lists, rows.len());
    let field = |own: u32| {
        let of_others = |&record: &usize| n_groups.is_none() || rows[record].group != own;
        // About one record per cell, spread over the file.
        let chosen: Vec<usize> = evenly(rows.len(), CELLS).filter(of_others).collect();
        let weight = chosen.iter().map(|&r| counts[r] as f32).sum();
        let mut total = Grid::over(low, high, CELLS);
        // Adds the lengths of some records, each as often as it is listed.
        let lengths = |records: &[usize]| {
            let mut grid = total.clone();
            for &record in records {
                let (row, weight) = (&rows[record], counts[record] as f32);
                let Some((from, to)) = grid.clip(row) else { continue };
                let steps = ((to - from) / grid.cell).ceil().max(1.0);
                let step = (to - from) / steps;
                for i in 0..steps as i32 {
                    let cell = grid.index(&row.at(from + (i as f32 + 0.5) * step));
                    grid.values[cell] += weight * step;
                }
            }
            grid
        };
        // Eight parts for any number of threads, so that the order of sums is fixed.
        let parts: Vec<_> = chosen.chunks(chosen.len().div_ceil(8).max(1)).collect();
        let parts = parallel::map(parts.len(), |at| lengths(parts[at]));
        for part in &parts {
            total.values.iter_mut().zip(&part.values).for_each(|(a, b)| *a += b);
        }
        ChanceField::new(total, weight)
    };
    (0..n_groups.unwrap_or(1)).map(field).collect()
}

pub(crate) fn times_listed(lists: &Neighborhoods, n_records: usize) -> Vec<u32> {
    let mut counts = vec![0; n_records];
    lists.records().iter().for_each(|record| counts[record.index()] += 1);
    counts
}

// Lists without information.

/// Distance between the entries of a mixed list, as a fraction of all entries: the golden section spreads them evenly.
const SPREAD: f64 = 0.618_033_988_749_895;
/// Entries tried per entry of a mixed list.
const TRIES: usize = 8;

/// Returns lists without information for some `slots` (ascending): as long as their own lists, but with entries of other lists.
pub(crate) fn mixed(
    lists: &Neighborhoods,
    slots: &[usize],
    slots_per_record: usize,
) -> Neighborhoods {
    let step = (lists.records().len() as f64 * SPREAD) as usize;
    let (mut offsets, mut records) = (vec![0], Vec::<RecordId>::new());
    for &slot in slots {
        let first = records.len();
        offsets.resize(slot + 1, first as u64);
        let len = lists.of(slot).len();
        let own = (slot / slots_per_record) as u32;
        // If lists hold a large part of all records, own entries are allowed.
        let few = 4 * len * slots_per_record > lists.n_slots();
        let mut at = lists.offsets()[slot] as usize;
        for _ in 0..TRIES * len {
            at = (at + step) % lists.records().len();
            let entry = lists.records()[at];
            // A record in a list twice would agree with itself.
            if few || (entry.0 != own && !records[first..].contains(&entry)) {
                records.push(entry);
            }
            if records.len() == first + len {
                break;
            }
        }
        offsets.push(records.len() as u64);
    }
    offsets.resize(lists.n_slots() + 1, records.len() as u64);
    Neighborhoods::unchecked(offsets, records)
}

// The extent of a map, from the records alone.

pub(crate) fn interquartile_range(sorted: &[f32]) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    f64::from(sorted[last - last / 4]) - f64::from(sorted[last / 4])
}

/// Whether sorted values have separate parts: quartiles four times as far apart as the width of an eighth of the values tells.
pub(crate) fn are_in_parts(sorted: &[f32]) -> bool {
    let many = sorted.len() / 8;
    if many == 0 {
        return false;
    }
    let width = |at: usize| f64::from(sorted[at + many]) - f64::from(sorted[at]);
    let mut widths: Vec<f64> = (0..sorted.len() - many).map(width).collect();
    16.0 * median(&mut widths) < interquartile_range(sorted)
}

/// Returns the median distance of the lines from their middle; that from the origin would depend on its rounding.
pub(crate) fn line_extent<const D: usize>(rows: &[LineRow<D>]) -> f64 {
    // Spread over the file: a given map need not be in random order.
    let rows: Vec<&LineRow<D>> = evenly(rows.len(), 1000).map(|row| &rows[row]).collect();
    let offset = |row: &LineRow<D>, from: &[f64; D]| {
        let (away, direction) = (sub(&widen(&row.through), from), widen(&row.direction));
        along(&away, -dot(&away, &direction), &direction)
    };
    // Each iteration moves to the mean of the lines' nearest points, and the error shrinks to about a third.
    let mut middle = [0.0; D];
    for _ in 0..60 {
        let mut step = [0.0; D];
        for row in &rows {
            step = along(&step, 1.0 / rows.len() as f64, &offset(row, &middle));
        }
        middle = along(&middle, 1.0, &step);
    }
    let length = |v: [f64; D]| dot(&v, &v).sqrt();
    median(&mut rows.iter().map(|row| length(offset(row, &middle))).collect::<Vec<f64>>())
}

pub(crate) fn ray_extent<const D: usize>(rows: &[LineRow<D>]) -> f64 {
    let mut centers: Vec<&LineRow<D>> = Vec::new();
    for row in rows {
        if !centers.iter().any(|center| center.group == row.group) {
            centers.push(row);
        }
    }
    let apart = |a: &LineRow<D>, b: &LineRow<D>| {
        let apart: [f64; D] = std::array::from_fn(|c| f64::from(a.through[c] - b.through[c]));
        dot(&apart, &apart).sqrt()
    };
    centers.iter().flat_map(|a| centers.iter().map(|b| apart(a, b))).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use crate::recover::map::lines::{MOST_CHANCE, evidence, ln};

    #[test]
    fn evidence_is_near_the_exact_bound() {
        for k in [1, 2, 7, 20, 50, 100, 400] {
            for n in 0..=k {
                for p in [1e-6, 1e-4, 0.005, 0.03, 0.2, f64::from(MOST_CHANCE)] {
                    let share = n as f64 / k as f64;
                    let term = |x: f64, y: f64| if x > 0.0 { x * (x / y).ln() } else { 0.0 };
                    let exact = k as f64 * (term(share, p) + term(1.0 - share, 1.0 - p));
                    let exact = if share <= p { 0.0 } else { exact };
                    let found = f64::from(evidence(n as f32, k as f32, p as f32));
                    assert!((found - exact).abs() <= 2e-3, "{n} of {k} at {p}: {found}, {exact}");
                }
            }
        }
    }

    #[test]
    fn logarithm_is_near_the_exact_one() {
        // All exponents, with mantissas over the whole range.
        for exponent in -126..127 {
            for step in 0..1000 {
                let y = (exponent as f32).exp2() * (1.0 + step as f32 / 1000.0);
                let exact = f64::from(y).ln();
                let off = (f64::from(ln(y)) - exact).abs();
                assert!(off <= 2.5e-6 + 1e-7 * exact.abs(), "ln {y}: off by {off}");
            }
        }
        assert_eq!(ln(1.0), 0.0);
    }
}
