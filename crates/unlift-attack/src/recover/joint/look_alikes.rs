//! Whether wrong entries of a list share places, as look-alike descriptors do.
//!
//! Where lists are wrong at random, a wrong entry stands alone. Where they are wrong together, whoever lists it
//! also lists others beside it, and a place that is merely named by look-alikes gathers as much
//! evidence as the right one. But those there do not list back, while at the right place as many list as are
//! listed. So where crowds are found, one side may be ahead of the other only so far.

use super::sample::{Learning, RANDOM, Sampled};
use crate::recover::map::edges::{Side, side};
use crate::recover::map::places::distance2;

/// Every so many slots of the sample are looked at, as one mean of all is asked for,
const EVERY: usize = 2;
/// and so many entries of each.
const ENTRIES: usize = 2;
/// An entry is elsewhere when it is farther from the estimate than this many times as far as true neighbors are looked for
/// about the entry.
const ELSEWHERE: f32 = 2.0;
/// Lists are wrong together if an entry that does not list back has so many others of its list beside it elsewhere, beyond
/// chance, in the mean; entries that are not elsewhere count with none. Of a pair one slot is looked at, so
/// pairs need more.
const CROWD: f64 = 0.25;
/// Evidence of one side counts at most so many nats beyond that of the other and of both.
const SURPLUS: f32 = 10.0;

/// How many nats one side may be ahead of the other beyond what both say; without bound where lists are not wrong together.
pub(super) fn surplus<const D: usize>(look: &Learning<'_, D>) -> f32 {
    let mut entries = 0.0;
    let mut beside = 0.0;
    let mut own = Vec::new();
    for Sampled { slot, random } in look.sample.rows.iter().step_by(EVERY) {
        let slot = *slot as usize;
        let (ends, class) = look.graph.of(slot);
        if !look.places.is_known(slot) {
            continue;
        }
        own.clear();
        let edges = ends.iter().zip(class);
        own.extend(edges.filter(|(_, class)| side(**class) == Side::Forward).map(|(end, _)| *end));
        let x = look.places.of(slot);
        for &entry in own.iter().step_by(own.len().div_ceil(ENTRIES).max(1)) {
            entries += 1.0;
            if !look.places.is_known(entry as usize) {
                continue;
            }
            let y = look.places.of(entry as usize);
            let reach = look.reach * look.density.width(look.density.at(&y));
            if distance2(&x, &y) <= ELSEWHERE * ELSEWHERE * reach * reach {
                continue;
            }
            let is_beside = |end: u32| distance2(&look.places.of(end as usize), &y) < reach * reach;
            let found = own.iter().filter(|&&end| end != entry && is_beside(end)).count();
            let by_chance = random.iter().filter(|(end, _)| is_beside(*end)).count();
            beside += found as f64 - (own.len() - 1) as f64 / RANDOM as f64 * by_chance as f64;
        }
    }
    if beside > CROWD * entries { SURPLUS } else { f32::INFINITY }
}
