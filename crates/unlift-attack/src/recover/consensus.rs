//! Exact consensus: on each slot's own record, the position whose agreement with the listed records is least probable by chance.

use crate::neighbors::Neighborhoods;
use crate::recover::map::{Family, Scratch, Step, solve_slots};
use crate::recover::result::Estimate;

/// Returns the estimates of `slots`. Rays that meet only in their anchors have none (`anchors::start`).
pub(crate) fn solve<const D: usize, F: Family<D>>(
    family: &F,
    lists: &Neighborhoods,
    delta: f32,
    slots: &[usize],
) -> Vec<Estimate<D>> {
    let at_delta = family.at_delta(delta);
    solve_slots(&Consensus { family, lists, delta, at_delta }, slots)
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
