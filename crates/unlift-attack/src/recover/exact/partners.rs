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
        for axis in 0..axes {
            let on_axis = |&record: &u32| sides[record as usize].axis == axis;
            let records: Vec<u32> = (0..sides.len() as u32).filter(on_axis).collect();
            let place = |&record: &u32| {
                let Side { published, estimate, .. } = sides[record as usize];
                [f64::from(published), f64::from(estimate)]
            };
            let places: Vec<[f64; 2]> = records.iter().map(place).collect();
            let Ok(tree) = Knn::new(&places) else { continue };
            let near = |found: &mut Vec<(f64, u32)>, (&record, &[a, b]): (&u32, &[f64; 2])| {
                tree.nearest_to([b, a], FOUND, found);
                let far = found.get(FOUND - 1).map_or(f64::INFINITY, |last| last.0.sqrt());
                let others = found.iter().map(|&(far2, row)| (far2, records[row as usize]));
                let others = others.filter(|&(_, other)| other != record);
                let pairs = others.map(|(far2, other)| (far2.sqrt(), record, other));
                (far, pairs.collect::<Vec<_>>())
            };
            let found = records.par_iter().zip(&places).map_init(Vec::new, near);
            for (far, found) in found.collect::<Vec<_>>() {
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
