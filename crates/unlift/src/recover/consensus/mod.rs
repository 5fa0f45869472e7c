//! Exact consensus: on each slot's own record, the position whose agreement with the listed records
//! is least probable by chance. One file per record family.

mod anchors;
mod candidates;
mod lines;
mod planes;

use super::Estimate;
use super::chunks::Chunks;
use super::family::Family;
use super::lists::Lists;
use super::sections::Sections;

/// Estimates for the slots of `chunks` at a given `delta`.
pub(crate) fn solve<const D: usize>(
    family: &Family<'_, D>,
    lists: Lists<'_>,
    delta: f32,
    chunks: Chunks<'_>,
) -> Vec<Estimate<D>> {
    match family {
        Family::Lines { rows, .. } if family.has_regions() => anchors::solve(rows, lists, chunks),
        Family::Lines { rows, slots_per_record, chance } => {
            lines::solve(rows, *slots_per_record, chance, lists, delta, chunks)
        }
        Family::Planes { planes, sorted } => planes::solve(planes, sorted, lists, delta, chunks),
        Family::Candidates { rows, chance } => {
            candidates::solve(rows, chance, lists, delta, chunks)
        }
    }
}

/// Least squares over the records within delta of `t` (Eq. (4) with squared distances: on a line a
/// weighted mean of the closest approaches), the support selected anew once. Returns the position
/// and its support.
#[inline(always)]
pub(crate) fn refit(sections: &Sections, t: f32, delta2: f32) -> (f32, u32) {
    // The start of an interval is at delta up to rounding, of delta and of t: it counts as within.
    let reach = delta2.sqrt() * (1.0 + 5e-5) + 4.0 * f32::EPSILON * t.abs();
    let reach2 = reach * reach;
    let (shift, _) = sections.least_squares_step(t, reach2);
    let t = t + shift;
    let (shift, support) = sections.least_squares_step(t, reach2);
    (t + shift, support)
}

#[cfg(test)]
mod twin;
