//! Exact consensus: on each slot's own record, the position whose agreement with the listed records
//! is least probable by chance. One file per record family.

mod anchors;
mod on_candidates;
mod on_lines;
mod on_planes;

use crate::recover::map::family::Family;
use crate::recover::map::lists::{Lists, Slots};
use crate::recover::result::Estimate;

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
