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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recover::map::LineFamily;
    use crate::released::{Lines, Obfuscation, Released};
    use crate::seed::{Draws, Stage};
    use crate::{RecordId, Unit};

    #[test]
    fn instruction_sets_change_no_bit() {
        let (n, k) = (400, 60);
        let mut draws = Draws::new(5, Stage::Synthetic, 5);
        let mut vectors = || -> Vec<[f64; 3]> { (0..n).map(|_| draws.direction()).collect() };
        let lines = Lines::through(&vectors(), &vectors()).unwrap();
        let lines = Obfuscation::Lines(lines);
        let map = Released::try_new(lines, 1, [0.0; 3], Unit::Meter, None).unwrap();
        let list = |slot: usize| (1..=k).map(move |at| RecordId::from_index((slot + at) % n));
        let offsets = (0..=n).map(|slot| (slot * k) as u64).collect();
        let records = (0..n).flat_map(list).collect();
        let lists = &Neighborhoods::try_new(offsets, records, None, n, 1).unwrap();
        let family = &LineFamily::new(&map, lists);
        let step = Consensus { family, lists, delta: 0.1, at_delta: family.at_delta(0.1) };
        let slots: Vec<usize> = (0..n).collect();
        // Outside of a kernel, code is compiled for the portable baseline.
        let mut scratch = Scratch::default();
        let portable = slots.iter().map(|&slot| step.solve(slot, &mut scratch));
        let bits = |e: Estimate<3>| (e.position.map(f32::to_bits), e.support, e.evidence.to_bits());
        let portable: Vec<_> = portable.map(bits).collect();
        assert!(portable.iter().any(|slot| slot.1 > 2));
        assert!(solve_slots(&step, &slots).into_iter().map(bits).eq(portable));
    }
}
