//! Recovery from the records alone: the attacks of `density` as solvers.

use rayon::prelude::*;

use super::line_rows::{LineRow, from_lines, from_rays};
use super::{Estimate, Recovered, Status, stored_support};
use crate::Error;
use crate::density::{Peak, Peaks};
use crate::neighbors::Neighborhoods;
use crate::released::{Obfuscation, Released};

/// The positions at which `peaks` puts the hidden points of `released`.
///
/// Lists do not move a position. For paired lines they decide which of the two positions belongs to
/// which slot, by the cheaper of the two bijections (cost: Eq. (4), distances to the listed records);
/// with empty lists the order is that along the line.
pub(super) fn place<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    peaks: &Peaks,
    descriptor_row: Option<Vec<u32>>,
) -> Result<Recovered<D>, Error> {
    let rows = match released.obfuscation() {
        Obfuscation::Lines(lines) => from_lines(lines, None),
        Obfuscation::Rays(rays) => from_rays(rays, None),
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => Vec::new(),
    };
    let delta = if peaks.resolution > 0.0 { peaks.resolution } else { 1.0 };
    let mut estimates: Vec<Estimate<D>> = (0..released.n_slots())
        .into_par_iter()
        .map(|slot| match peaks.of[slot] {
            Some(peak) => estimate(&peak),
            None => Estimate::lost(Status::NoSupport),
        })
        .collect();
    if released.slots_per_record() == 2 {
        estimates.par_chunks_mut(2).enumerate().for_each(|(record, pair)| {
            let cost = |at: usize, slot: usize| {
                let x = &pair[at].position;
                lists.of(slot).iter().map(|r| distance(&rows[r.index()], x)).sum::<f32>()
            };
            let (a, b) = (2 * record, 2 * record + 1);
            if cost(0, a) + cost(1, b) > cost(1, a) + cost(0, b) {
                pair.swap(0, 1);
            }
        });
    }
    if !rows.is_empty() {
        let reach = delta as f32;
        estimates.par_iter_mut().enumerate().for_each(|(slot, estimate)| {
            let near = |row: &LineRow<D>| distance(row, &estimate.position) <= reach;
            let support = lists.of(slot).iter().filter(|r| near(&rows[r.index()])).count();
            estimate.support = stored_support(support as u32);
        });
    }
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    Recovered::try_new(&estimates, with_axis, descriptor_row, origin, unit, delta)
}

fn estimate<const D: usize>(peak: &Peak) -> Estimate<D> {
    Estimate {
        // The attacks answer in three dimensions only.
        position: std::array::from_fn(|c| peak.position[c % 3]),
        status: Status::Ok,
        support: 0,
        axis: peak.axis,
        evidence: peak.evidence,
    }
}

fn distance<const D: usize>(row: &LineRow<D>, x: &[f32; D]) -> f32 {
    let away: [f32; D] = std::array::from_fn(|c| x[c] - row.through[c]);
    let along: f32 = (0..D).map(|c| away[c] * row.direction[c]).sum();
    let across = |c: usize| away[c] - along * row.direction[c];
    (0..D).map(|c| across(c) * across(c)).sum::<f32>().sqrt()
}
