//! Possible partners of an exchange: pairs of records that explain each other's estimates.

use std::ops::Range;

use crate::geometry::knn::Knn;
use crate::geometry::vector::median;
use crate::parallel;
use crate::recover::map::rows_mut;

/// Number of nearest places in which each record looks for its partner.
const NEAREST: usize = 16;

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
    /// its own values in exchanged order. Distances are at most `reach`, and at most those at which half of the records of an axis have
    /// [`NEAREST`] of them.
    pub(super) fn find(sides: &[Side], reach: f32) -> Option<Self> {
        let (mut pairs, mut typical) = (Vec::new(), 0.0f64);
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
            records.sort_by(by_place);
            // Of records at one place (on a floor at 0), some are enough: a search visits all that coincide.
            let equal = records.chunk_by(|a, b| place(a) == place(b));
            let searched: Vec<u32> =
                equal.flat_map(|equal| equal.iter().take(NEAREST)).copied().collect();
            let places: Vec<[f64; 2]> = searched.iter().map(place).collect();
            let Ok(tree) = Knn::new(&places) else { continue };
            let near = |nearest: &mut Vec<(f64, u32)>, at: usize| {
                let record = records[at];
                let [published, estimate] = place(&record);
                tree.nearest_to([estimate, published], NEAREST, nearest);
                let radius = nearest.get(NEAREST - 1).map_or(f64::INFINITY, |last| last.0.sqrt());
                let pair =
                    |&(squared, row): &(f64, u32)| (squared.sqrt(), record, searched[row as usize]);
                let pairs = nearest.iter().map(pair).filter(|&(_, own, partner)| own != partner);
                (radius, pairs.collect::<Vec<_>>())
            };
            let rows = parallel::map_with(records.len(), Vec::new, near).into_iter();
            let (mut radii, rows): (Vec<f64>, Vec<Vec<_>>) = rows.unzip();
            // The largest median: on a flat map, places of one axis coincide, and those of the others do not.
            typical = typical.max(median(&mut radii));
            pairs.extend(rows.into_iter().flatten());
        }
        let reach = reach.min(typical as f32);
        pairs.retain(|&(distance, ..)| distance <= f64::from(reach));
        let both = pairs.into_iter().flat_map(|(_, i, j)| [(i, j), (j, i)]);
        let mut pairs: Vec<(u32, u32)> = both.collect();
        pairs.sort_unstable();
        pairs.dedup();
        // Where all places of all axes coincide, no exact value would move a point.
        if reach <= 0.0 || pairs.is_empty() || u32::try_from(pairs.len()).is_err() {
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
        Some(Self { offsets, of, back, reach })
    }

    /// Returns a value per entry; `of` writes those of one record.
    pub(super) fn column(&self, of: impl Fn(usize, &mut [f32]) + Sync) -> Vec<f32> {
        let mut column = vec![0.0; self.of.len()];
        let mut rows = rows_mut(&mut column, &self.offsets);
        parallel::for_each_mut(&mut rows, || (), |(), i, row| of(i, row));
        column
    }

    pub(super) fn entries(&self, i: usize) -> Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a flat map, all records of one axis coincide. Those of the others still have their partners.
    #[test]
    fn partners_are_near_also_where_all_records_of_an_axis_coincide() {
        let mut sides = vec![Side { axis: 2, published: 0.0, estimate: 0.0 }; 200_000];
        let flat = sides.len();
        let value = |i: usize| (i as f32 * 0.618_034).fract();
        for pair in 0..1000 {
            let [a, b] = [value(2 * pair), value(2 * pair + 1)];
            sides.push(Side { axis: 0, published: a, estimate: b + 0.001 });
            sides.push(Side { axis: 0, published: b, estimate: a - 0.001 });
        }
        let partners = Partners::find(&sides, 0.1).unwrap();
        assert!(partners.reach > 0.01, "{}", partners.reach);
        assert!(partners.of.len() < 3 * NEAREST * sides.len());
        for i in [flat, flat + 1, flat + 1998, flat + 1999] {
            let partner = (i ^ 1) as u32;
            assert!(partners.of[partners.entries(i)].contains(&partner), "{i}");
        }
        for i in [0, 777, flat - 1, flat] {
            let entry = partners.entries(i).start;
            let (j, back) = (partners.of[entry] as usize, partners.back[entry] as usize);
            assert!(partners.entries(j).contains(&back) && partners.of[back] as usize == i);
        }
    }
}
