//! Possible partners of an exchange: pairs of records that explain each other's estimates.

use std::ops::Range;

use rayon::prelude::*;

use crate::geometry::knn::Knn;
use crate::geometry::vector::median;
use crate::recover::map::rows_mut;

/// Number of possible partners that each record finds; others may find it, too.
const FOUND: usize = 16;

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
    /// Finds, for each record, the records of its axis that explain it best: in the plane of published values and estimates, those near
    /// its own values in exchanged order. Distances are at most `reach`, and at most what half of the records need to find [`FOUND`].
    pub(super) fn find(sides: &[Side], reach: f32) -> Option<Self> {
        let (mut pairs, mut farthest) = (Vec::new(), Vec::new());
        let axes = sides.iter().map(|side| side.axis).filter(|&axis| axis != LOST).max()? + 1;
        let place = |&record: &u32| {
            let Side { published, estimate, .. } = sides[record as usize];
            [f64::from(published), f64::from(estimate)]
        };
        for axis in 0..axes {
            let on_axis = |&record: &u32| sides[record as usize].axis == axis;
            let mut records: Vec<u32> = (0..sides.len() as u32).filter(on_axis).collect();
            let by_place = |a: &u32, b: &u32| {
                let ([a, a2], [b, b2]) = (place(a), place(b));
                a.total_cmp(&b).then(a2.total_cmp(&b2))
            };
            records.par_sort_by(by_place);
            // Of records at one place (on a floor at 0), some are enough: a search visits all that coincide.
            let equal = records.chunk_by(|a, b| place(a) == place(b));
            let searched: Vec<u32> =
                equal.flat_map(|equal| equal.iter().take(FOUND)).copied().collect();
            let places: Vec<[f64; 2]> = searched.iter().map(place).collect();
            let Ok(tree) = Knn::new(&places) else { continue };
            let near = |found: &mut Vec<(f64, u32)>, record: &u32| {
                let [published, estimate] = place(record);
                tree.nearest_to([estimate, published], FOUND, found);
                let far = found.get(FOUND - 1).map_or(f64::INFINITY, |last| last.0.sqrt());
                let others = found.iter().map(|&(far2, row)| (far2, searched[row as usize]));
                let others = others.filter(|(_, other)| other != record);
                let pairs = others.map(|(far2, other)| (far2.sqrt(), *record, other));
                (far, pairs.collect::<Vec<_>>())
            };
            for (far, found) in records.par_iter().map_init(Vec::new, near).collect::<Vec<_>>() {
                farthest.push(far);
                pairs.extend(found);
            }
        }
        let reach = f64::from(reach).min(median(&mut farthest));
        pairs.retain(|&(far, ..)| far <= reach);
        let both = pairs.into_iter().flat_map(|(_, i, j)| [(i, j), (j, i)]);
        let mut pairs: Vec<(u32, u32)> = both.collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        if pairs.is_empty() || u32::try_from(pairs.len()).is_err() {
            return None;
        }
        let start = |i: usize| pairs.partition_point(|pair| (pair.0 as usize) < i);
        let offsets: Vec<usize> = (0..=sides.len()).map(start).collect();
        // Rows ascend, so the pairs of record j come in the order of its entries.
        let mut next = offsets.clone();
        let back = |&(_, j): &(u32, u32)| {
            next[j as usize] += 1;
            next[j as usize] as u32 - 1
        };
        let back = pairs.iter().map(back).collect();
        let of = pairs.into_iter().map(|(_, j)| j).collect();
        Some(Self { offsets, of, back, reach: reach as f32 })
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

#[cfg(test)]
mod tests {
    use super::*;

    /// All records lie on a floor at exactly 0, so each is a possible partner of all others.
    #[test]
    fn equal_coordinates_have_as_many_partners_as_are_found() {
        let sides = vec![Side { axis: 2, published: 0.0, estimate: 0.0 }; 200_000];
        let partners = Partners::find(&sides, 0.1).unwrap();
        let n = partners.of.len() / sides.len();
        assert!((FOUND..=2 * FOUND).contains(&n), "{n} partners a record");
        for i in [0, 777, 199_999] {
            let entry = partners.entries(i).start;
            let (j, back) = (partners.of[entry] as usize, partners.back[entry] as usize);
            assert!(partners.entries(j).contains(&back) && partners.of[back] as usize == i);
        }
    }
}
