//! Exact consensus: on each slot's own record, the position whose agreement with the listed records
//! is least probable by chance. One file per record family.

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
    seed: u64,
    chunks: Chunks<'_>,
) -> Vec<Estimate<D>> {
    match family {
        Family::Lines { rows, slots_per_record } => {
            lines::solve(rows, *slots_per_record, lists, delta, seed, chunks)
        }
        Family::Planes { planes, sorted } => planes::solve(planes, sorted, lists, delta, chunks),
        Family::Candidates { rows } => candidates::solve(rows, lists, delta, seed, chunks),
    }
}

/// Least squares over the records within delta of `t` (Eq. (4) with squared distances: on a line a
/// weighted mean of the closest approaches), the support selected anew once. Returns the position
/// and its support.
#[inline(always)]
pub(crate) fn refit(sections: &Sections, t: f32, delta2: f32) -> (f32, u32) {
    let mut t = t;
    let mut support = 0;
    for _ in 0..2 {
        let (mut weight, mut sum, mut n) = (0.0f32, 0.0f32, 0);
        for j in 0..sections.len() {
            // The start of an interval is at delta up to rounding: it counts as within.
            if sections.squared_distance(j, t) <= delta2 * (1.0 + 1e-4) {
                weight += sections.bend[j];
                sum += sections.bend[j] * (sections.at[j] - t);
                n += 1;
            }
        }
        if weight > 0.0 {
            t += sum / weight;
            support = n;
        }
    }
    (t, support)
}

#[cfg(test)]
mod twin;
