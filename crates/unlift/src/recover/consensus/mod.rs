//! Exact consensus: on each slot's own record, the position whose agreement with the listed records
//! is least probable by chance. One file per record family.

mod anchors;
mod on_candidates;
mod on_lines;
mod on_planes;
mod refit;

use std::ops::Range;

use crate::Error;
use crate::recover::map::chunks::Slots;
use crate::recover::map::family::Family;
use crate::recover::map::lists::{Listed, Lists};
use crate::recover::result::estimate::Estimate;
use crate::recover::solve::Solve;

/// Consensus over one map.
pub(crate) struct Consensus<'a, const D: usize> {
    pub(crate) family: &'a Family<'a, D>,
    pub(crate) lists: Listed<'a>,
    /// The distance up to which a record supports a place, in the unit of the map.
    pub(crate) delta: f32,
}

impl<'a, const D: usize> Solve<'a, D> for Consensus<'a, D> {
    fn solve(&self, slots: Range<usize>) -> Result<Vec<Estimate<D>>, Error> {
        let mut estimates = Vec::with_capacity(slots.len());
        for window in self.lists.windows() {
            let part = slots.start.max(window.start)..slots.end.min(window.end);
            if part.start < part.end {
                let rows = self.lists.rows(&window)?;
                let (lists, slots) = (Lists::given(&rows), Slots::Range(part));
                estimates.extend(solve(self.family, lists, self.delta, slots));
            }
        }
        Ok(estimates)
    }
}

/// Estimates for `slots` at a given `delta`.
pub(crate) fn solve<const D: usize>(
    family: &Family<'_, D>,
    lists: Lists<'_>,
    delta: f32,
    slots: Slots<'_>,
) -> Vec<Estimate<D>> {
    match family {
        Family::Lines { rows, .. } if family.has_regions() => anchors::solve(rows, lists, slots),
        Family::Lines { rows, slots_per_record, chance } => {
            on_lines::solve(rows, *slots_per_record, chance, lists, delta, slots)
        }
        Family::Planes { planes, sorted } => on_planes::solve(planes, sorted, lists, delta, slots),
        Family::Candidates { rows, chance } => {
            on_candidates::solve(rows, chance, lists, delta, slots)
        }
    }
}
