//! Estimates at the peaks of a density.

use rayon::prelude::*;

use crate::Error;
use crate::density::Peaks;
use crate::neighbors::Neighborhoods;
use crate::recover::map::lines::{LineRow, rows_of};
use crate::recover::map::lists::found;
use crate::recover::result::{Estimate, Recovered, Status, Unknown, stored_support};
use crate::released::Released;

/// A solver that places each hidden point at its peak.
///
/// Lists do not change positions. For paired lines they decide which of the two positions belongs to which slot: the cheaper
/// assignment wins, with the distances to the listed records (Eq. (4)) as cost. With empty lists the order is that along the line.
pub(super) struct Placement<'a, const D: usize> {
    rows: Vec<LineRow<D>>,
    slots_per_record: usize,
    lists: &'a Neighborhoods,
    peaks: &'a Peaks,
}

/// Returns the delta that decides support: the resolution of `peaks`, or 1 if there are no peaks.
pub(super) fn delta(peaks: &Peaks) -> f64 {
    if peaks.resolution > 0.0 { peaks.resolution } else { 1.0 }
}

/// Returns the points at `peaks`.
pub(super) fn recover<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    peaks: &Peaks,
) -> Result<Recovered<D>, Error> {
    let estimates = Placement::new(released, lists, peaks).solve();
    let recovered = Recovered::new(released, lists, &estimates, delta(peaks))?;
    Ok(recovered.without_confidence(Unknown::OtherSolver))
}

impl<'a, const D: usize> Placement<'a, D> {
    pub(super) fn new(released: &Released<D>, lists: &'a Neighborhoods, peaks: &'a Peaks) -> Self {
        Self {
            rows: rows_of(released, None),
            slots_per_record: released.slots_per_record(),
            lists,
            peaks,
        }
    }

    pub(super) fn solve(&self) -> Vec<Estimate<D>> {
        let reach = delta(self.peaks) as f32;
        let place = |slot: usize| {
            let is_crossed = self.slots_per_record == 2 && self.is_crossed(slot);
            let mut estimate = self.peak(if is_crossed { slot ^ 1 } else { slot });
            if !self.rows.is_empty() {
                let distances = self.distances(slot, &estimate.position);
                let support = distances.filter(|&distance| distance <= reach).count();
                estimate.support = stored_support(support as u32);
            }
            estimate
        };
        (0..self.lists.n_slots()).into_par_iter().map(place).collect()
    }

    fn peak(&self, slot: usize) -> Estimate<D> {
        let Some(peak) = self.peaks.of[slot] else {
            return Estimate::lost(Status::NoSupport);
        };
        // These attacks return positions in three dimensions only.
        let position = std::array::from_fn(|c| peak.position[c % 3]);
        found(position, 0, peak.axis.into(), peak.evidence)
    }

    /// Whether exchanging the two peaks of the record of `slot` lowers the cost.
    fn is_crossed(&self, slot: usize) -> bool {
        let (a, b) = (slot & !1, slot | 1);
        let cost =
            |peak: usize, slot: usize| self.distances(slot, &self.peak(peak).position).sum::<f32>();
        cost(a, a) + cost(b, b) > cost(b, a) + cost(a, b)
    }

    fn distances(&self, slot: usize, x: &[f32; D]) -> impl Iterator<Item = f32> {
        self.lists.of(slot).iter().map(move |record| {
            let row = &self.rows[record.index()];
            let away: [f32; D] = std::array::from_fn(|c| x[c] - row.through[c]);
            let along: f32 = (0..D).map(|c| away[c] * row.direction[c]).sum();
            let across = |c: usize| away[c] - along * row.direction[c];
            (0..D).map(|c| across(c) * across(c)).sum::<f32>().sqrt()
        })
    }
}
