//! Possible partners of an exchange: pairs of records that explain each other's estimates.

use std::ops::Range;

use rayon::prelude::*;

use crate::geometry::curve;
use crate::recover::map::{evenly, rows_mut};

/// Records per parallel task: fixed, so that sums do not depend on the number of threads.
const PART: usize = 1 << 10;
/// Largest mean number of partners per record. A shorter reach enforces it, so that time and memory are linear in the map.
const MOST: f64 = 16.0;
/// Largest number of partners of one record where many have equal coordinates (a floor at 0), so that no reach helps.
const MOST_OF_TIES: usize = 64;

/// A record, on the axis that it is believed to have exchanged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub(super) axis: usize,
    pub(super) published: f32,
    pub(super) estimate: f32,
}

/// The axis of a record that was not recovered.
pub(super) const LOST: usize = usize::MAX;

/// Possible partners of every record. Each pair is in the rows of both records.
pub(super) struct Partners {
    offsets: Vec<usize>,
    pub(super) of: Vec<u32>,
    /// Index of the same pair in the row of the partner.
    pub(super) back: Vec<u32>,
    /// Largest distance between an estimate and the value that a partner published.
    pub(super) reach: f32,
}

impl Partners {
    /// Finds pairs on one axis whose estimates lie within `reach`, or less if they are too many, of each other's published values.
    pub(super) fn find(sides: &[Side], reach: f32) -> Option<Self> {
        let mut strips = Strips::new(sides, reach);
        let mean = strips.mean();
        let mut has_ties = false;
        if mean > MOST {
            // The number of partners is proportional to the square of the reach.
            strips = Strips::new(sides, reach * (MOST / mean).sqrt() as f32);
            has_ties = strips.mean() > MOST_OF_TIES as f64;
        }
        let (offsets, of) = if has_ties { strips.some_rows() } else { strips.rows() };
        if of.is_empty() || of.len() > u32::MAX as usize {
            return None;
        }
        // Rows ascend, so the pairs of record j come in the order of its entries.
        let mut next = offsets.clone();
        let back = |&j: &u32| {
            next[j as usize] += 1;
            next[j as usize] as u32 - 1
        };
        let back = of.iter().map(back).collect();
        Some(Self { offsets, of, back, reach: strips.reach as f32 })
    }

    /// Returns a value per entry; `of` writes those of one record.
    pub(super) fn column(&self, of: impl Fn(usize, &mut [f32]) + Sync) -> Vec<f32> {
        let mut column = vec![0.0; self.of.len()];
        let rows = rows_mut(&mut column, &self.offsets);
        rows.into_par_iter().enumerate().for_each(|(i, row)| of(i, row));
        column
    }

    pub(super) fn entries(&self, i: usize) -> Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }
}

/// Returns a result for each part of `n` records, in order.
pub(super) fn by_part<T: Send>(n: usize, of: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let part = |part: usize| of(part * PART..n.min((part + 1) * PART));
    (0..n.div_ceil(PART)).into_par_iter().map(part).collect()
}

/// Records sorted by axis, by published value in steps of about the reach, and by estimate within a step.
struct Strips<'a> {
    sides: &'a [Side],
    /// (axis and step, estimate, record), sorted.
    sorted: Vec<(u64, f32, u32)>,
    low: f64,
    reach: f64,
    /// Slightly more than the reach, so that rounding treats both records of a pair alike.
    step: f64,
}

/// Largest number of steps along one axis, so that axis and step fit into a sorting key.
const MOST_STEPS: f64 = (1u64 << 40) as f64;

impl<'a> Strips<'a> {
    fn new(sides: &'a [Side], reach: f32) -> Self {
        let known = || sides.iter().enumerate().filter(|(_, side)| side.axis != LOST);
        let lower = known().map(|(_, side)| side.published.min(side.estimate));
        let (low, reach) = (f64::from(lower.fold(f32::MAX, f32::min)), f64::from(reach));
        let mut strips = Self { sides, sorted: Vec::new(), low, reach, step: 1.01 * reach };
        let row = |(i, side): (usize, &Side)| {
            (strips.strip(side, side.published), side.estimate, i as u32)
        };
        strips.sorted = known().map(row).collect();
        strips.sorted.par_sort_unstable_by(|a, b| {
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2))
        });
        strips
    }

    fn strip(&self, side: &Side, value: f32) -> u64 {
        let steps = ((f64::from(value) - self.low) / self.step).min(MOST_STEPS);
        // Step 0 stays empty, because the step below the lowest one is searched, too.
        (side.axis as u64) << 48 | (steps as u64 + 1)
    }

    fn mean(&self) -> f64 {
        let sample: Vec<usize> = evenly(self.sides.len(), 1 << 12).collect();
        let count: usize = sample.par_iter().map(|&i| self.of(i).count()).sum();
        count as f64 / sample.len().max(1) as f64
    }

    /// Returns, for each of the three steps around the estimate of record `i`, the records whose estimates are near its published value.
    fn about(&self, i: usize) -> impl Iterator<Item = &[(u64, f32, u32)]> {
        let own = &self.sides[i];
        let middle = (own.axis != LOST).then(|| self.strip(own, own.estimate));
        let published = f64::from(own.published);
        let (low, high) = (published - self.step, published + self.step);
        let strips = middle.into_iter().flat_map(|middle| middle - 1..=middle + 1);
        strips.map(move |strip| {
            let is_below = |row: &(u64, f32, u32)| row.0 == strip && f64::from(row.1) < low;
            let from = self.sorted.partition_point(|row| row.0 < strip || is_below(row));
            let rows = &self.sorted[from..];
            &rows[..rows.partition_point(|row| row.0 == strip && f64::from(row.1) <= high)]
        })
    }

    fn fit(&self, i: usize, j: usize) -> bool {
        let near = |a: f32, b: f32| (f64::from(a) - f64::from(b)).abs() <= self.reach;
        let (own, other) = (&self.sides[i], &self.sides[j]);
        near(other.published, own.estimate) && near(other.estimate, own.published) && j != i
    }

    fn of(&self, i: usize) -> impl Iterator<Item = u32> {
        let records = self.about(i).flatten().map(|row| row.2);
        records.filter(move |&j| self.fit(i, j as usize))
    }

    /// Returns all possible partners of all records: offsets of the rows, and the partners in ascending order.
    fn rows(&self) -> (Vec<usize>, Vec<u32>) {
        let row = |i: usize| {
            let mut row: Vec<u32> = self.of(i).collect();
            row.sort_unstable();
            row
        };
        let rows: Vec<Vec<u32>> = (0..self.sides.len()).into_par_iter().map(row).collect();
        let mut offsets = vec![0];
        offsets.extend(rows.iter().scan(0, |end, row| {
            *end += row.len();
            Some(*end)
        }));
        (offsets, rows.concat())
    }

    /// Returns [`rows`](Self::rows) with some of the possible partners only.
    fn some_rows(&self) -> (Vec<usize>, Vec<u32>) {
        let both = |i: usize| self.some_of(i).flat_map(move |j| [(i as u32, j), (j, i as u32)]);
        let part = |records: Range<usize>| records.flat_map(both).collect::<Vec<_>>();
        let mut pairs = by_part(self.sides.len(), part).concat();
        pairs.par_sort_unstable();
        pairs.dedup();
        let start = |i: usize| pairs.partition_point(|pair| (pair.0 as usize) < i);
        let offsets = (0..=self.sides.len()).map(start).collect();
        (offsets, pairs.into_iter().map(|(_, j)| j).collect())
    }

    /// Returns some of the possible partners of record `i`: a few from each step, different ones for each record.
    fn some_of(&self, i: usize) -> impl Iterator<Item = u32> {
        let some = self.about(i).flat_map(move |rows| {
            let n = rows.len().min(MOST_OF_TIES / 2);
            // Evenly spaced, from a start that differs by record: an odd multiplier reaches every remainder.
            let start = i.wrapping_mul(0x9e37_79b9) % rows.len().max(1);
            (0..n).map(move |at| rows[(start + at * rows.len() / n) % rows.len()].2)
        });
        some.filter(move |&j| self.fit(i, j as usize))
    }
}

/// Bits per value: two values and the axis make a key.
const BITS: u32 = 20;

/// Returns all records in an order in which possible partners are close in memory, where they are read ten times as fast.
pub(super) fn side_by_side(sides: &[Side], reach: f32) -> Vec<u32> {
    let low = sides.iter().map(|side| side.published.min(side.estimate)).fold(f32::MAX, f32::min);
    let cell = |value: f32| ((value - low) / reach) as u32 & ((1 << BITS) - 1);
    let key = |(record, side): (usize, &Side)| {
        let (a, b) = (cell(side.published), cell(side.estimate));
        (side.axis, curve::along(&[a.min(b), a.max(b)], BITS), record as u32)
    };
    let mut keys: Vec<(usize, u64, u32)> = sides.par_iter().enumerate().map(key).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key.2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All records lie on a floor at exactly 0, so each is a possible partner of all others.
    #[test]
    fn equal_coordinates_have_as_many_partners_as_there_is_room_for() {
        let side = Side { axis: 2, published: 0.0, estimate: 0.0 };
        let sides = vec![side; 50_000];
        let partners = Partners::find(&sides, 0.1).unwrap();
        let n = partners.of.len() / sides.len();
        assert!((32..=256).contains(&n), "{n} partners a record");
        for (i, entry) in [0, 777, 49_999].map(|i| (i, partners.entries(i).start)) {
            let (j, back) = (partners.of[entry] as usize, partners.back[entry] as usize);
            assert!(partners.entries(j).contains(&back) && partners.of[back] as usize == i);
        }
    }
}
