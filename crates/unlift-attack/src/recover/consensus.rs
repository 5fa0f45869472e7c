//! Exact consensus: on each slot's own record, the position whose agreement with the listed records is least probable by chance.

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::anchors;
use crate::recover::map::{Columns, Family, Intervals, LineColumns, Sections, Step, solve_slots};
use crate::recover::result::Estimate;

/// Returns the estimates of `slots`. For rays that meet only in their anchors (`dcl2d`), returns those of all slots.
pub(crate) fn solve<const D: usize, F: Family<D>>(
    family: &F,
    lists: &Neighborhoods,
    delta: f32,
    slots: &[usize],
) -> Vec<Estimate<D>> {
    match family.anchored() {
        Some(rays) => anchors::start::solve(rays, lists),
        None => {
            let at_delta = family.at_delta(delta);
            solve_slots(&Consensus { family, lists, delta, at_delta }, slots)
        }
    }
}

/// Buffers of one thread.
#[derive(Default)]
pub(crate) struct Scratch<const D: usize> {
    pub(crate) lines: LineColumns<D>,
    pub(crate) candidates: Columns<D>,
    pub(crate) sections: Sections,
    pub(crate) intervals: Intervals,
    /// Indices of the sections that vote.
    pub(crate) voting: Vec<usize>,
    /// Listed planes by axis, as (offset, record).
    pub(crate) by_axis: Vec<Vec<(f32, RecordId)>>,
}

struct Consensus<'a, const D: usize, F: Family<D>> {
    family: &'a F,
    lists: &'a Neighborhoods,
    delta: f32,
    at_delta: F::AtDelta,
}

impl<const D: usize, F: Family<D>> Step for Consensus<'_, D, F> {
    type Scratch = Scratch<D>;
    type Output = Estimate<D>;

    #[inline(always)]
    fn solve(&self, slot: usize, scratch: &mut Scratch<D>) -> Estimate<D> {
        self.family.consensus(slot, self.lists.of(slot), (self.delta, &self.at_delta), scratch)
    }

    #[inline(always)]
    fn prefetch(&self, slot: usize) {
        self.lists.of(slot).iter().for_each(|record| self.family.prefetch(record.index()));
    }
}
