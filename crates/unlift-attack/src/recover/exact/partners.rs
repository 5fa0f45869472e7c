//! Possible partners of an exchange: pairs of records that explain each other's estimates.

use std::ops::Range;

use rayon::prelude::*;

use crate::geometry::curve;
use crate::geometry::knn::Knn;

/// Records per parallel task: fixed, so that sums do not depend on the number of threads.
const PART: usize = 1 << 10;
/// Number of partners that each record looks for, so that time and memory are linear in the map.
const MOST: usize = 24;

/// A record, on the axis that it is believed to have exchanged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// The axis; [`LOST`] if the record was not recovered.
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
}

impl Partners {
    /// Finds pairs of `sides` on one axis, each of whose estimates lies within `reach` of the value that the other published: for every
    /// record, those that fit it best. `None` if there are none.
    pub(super) fn find(sides: &[Side], reach: f32) -> Option<Self> {
        // A record and its partner have published value and estimate exchanged. Records of other axes are far away. Many may have equal
        // coordinates (a floor at 0): a last coordinate, which hardly counts, spreads them.
        let known: Vec<u32> =
            (0..sides.len() as u32).filter(|&i| sides[i as usize].axis != LOST).collect();
        let reach = f64::from(reach);
        let spread =
            |i: u32| 1e-3 * reach * f64::from(i.wrapping_mul(0x9e37_79b9)) / f64::from(u32::MAX);
        let far = |side: &Side| 1e6 * reach * side.axis as f64;
        let place = |i: u32, a: f32, b: f32| {
            [f64::from(a), f64::from(b), far(&sides[i as usize]) + spread(i)]
        };
        let point = |&i: &u32| place(i, sides[i as usize].published, sides[i as usize].estimate);
        let points: Vec<[f64; 3]> = known.iter().map(point).collect();
        let tree = Knn::new(&points).ok()?;
        let pairs = |found: &mut Vec<(f64, u32)>, &i: &u32| {
            let own = &sides[i as usize];
            tree.nearest_to(place(i, own.estimate, own.published), MOST, found);
            let near = |a: f32, b: f32| (f64::from(a) - f64::from(b)).abs() <= reach;
            let fits = |&j: &u32| {
                let other = &sides[j as usize];
                near(other.published, own.estimate)
                    && near(other.estimate, own.published)
                    && (j != i && other.axis == own.axis)
            };
            let partners = found.iter().map(|&(_, row)| known[row as usize]).filter(fits);
            partners.flat_map(|j| [(i, j), (j, i)]).collect::<Vec<_>>()
        };
        let mut pairs: Vec<(u32, u32)> =
            known.par_iter().map_init(Vec::new, pairs).flatten_iter().collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        if pairs.is_empty() || pairs.len() > u32::MAX as usize {
            return None;
        }
        let mut offsets = vec![0; sides.len() + 1];
        pairs.iter().for_each(|pair| offsets[pair.0 as usize + 1] += 1);
        (0..sides.len()).for_each(|i| offsets[i + 1] += offsets[i]);
        // Rows ascend, so the pairs of record j come in the order of its entries.
        let mut next = offsets.clone();
        let back = |&(_, j): &(u32, u32)| {
            next[j as usize] += 1;
            next[j as usize] as u32 - 1
        };
        let back = pairs.iter().map(back).collect();
        Some(Self { offsets, of: pairs.into_iter().map(|pair| pair.1).collect(), back })
    }

    /// Returns a value per entry; `of` writes those of one record.
    pub(super) fn column(&self, of: impl Fn(usize, &mut [f32]) + Sync) -> Vec<f32> {
        let (n, mut column) = (self.offsets.len() - 1, vec![0.0; self.of.len()]);
        let (mut parts, mut rest) = (Vec::new(), &mut column[..]);
        for first in (0..n).step_by(PART) {
            let last = n.min(first + PART);
            let part;
            (part, rest) = rest.split_at_mut(self.offsets[last] - self.offsets[first]);
            parts.push((first..last, part));
        }
        parts.into_par_iter().for_each(|(records, mut part)| {
            for i in records {
                let row;
                (row, part) = part.split_at_mut(self.entries(i).len());
                of(i, row);
            }
        });
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

/// Bits per value: two values and the axis make a key.
const BITS: u32 = 20;

/// Returns all records in an order in which possible partners are close in memory: two values of partners are nearly equal. A partner
/// in the cache is read in a tenth of the time; results do not depend on the order.
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
        assert!((24..=48).contains(&n), "{n} partners a record");
        for (i, entry) in [0, 777, 49_999].map(|i| (i, partners.entries(i).start)) {
            let (j, back) = (partners.of[entry] as usize, partners.back[entry] as usize);
            assert!(partners.entries(j).contains(&back) && partners.of[back] as usize == i);
        }
    }
}
