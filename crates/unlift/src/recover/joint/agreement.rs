//! How well records agree with estimates: the judge of rounds.
//!
//! Estimates that agree with each other prove nothing: they may have drifted together. Records cannot
//! drift. If fewer of them pass near the estimates of a round than before, beyond chance, the round
//! made things worse.

use rayon::prelude::*;

use crate::recover::map::graph::{Graph, record_of};
use crate::recover::map::pieces::Pieces;
use crate::recover::result::estimate::{Estimate, Status};

/// Slots looked at: the mean over so many is known better than the share by which it may fall.
const SLOTS: usize = 1 << 12;

/// The mean number of records at the other ends of a slot's edges that pass near its estimate, less
/// that expected by chance.
pub(crate) fn of<const D: usize, P: Pieces<D>>(
    pieces: &P,
    graph: &Graph,
    estimates: &[Estimate<D>],
    delta2: f32,
) -> f64 {
    let every = estimates.len().div_ceil(SLOTS).max(1);
    let slots: Vec<usize> = (0..estimates.len()).step_by(every).collect();
    let parts: Vec<f64> = slots
        .par_chunks(256)
        .map(|part| {
            part.iter().map(|&slot| of_slot(pieces, graph, slot, &estimates[slot], delta2)).sum()
        })
        .collect();
    parts.iter().sum::<f64>() / slots.len().max(1) as f64
}

fn of_slot<const D: usize, P: Pieces<D>>(
    pieces: &P,
    graph: &Graph,
    slot: usize,
    estimate: &Estimate<D>,
    delta2: f32,
) -> f64 {
    if estimate.status != Status::Ok {
        return 0.0;
    }
    let (mut near, mut all) = (0u32, 0u32);
    for &end in graph.of(slot).0 {
        let record = record_of(end as usize, pieces.slots_per_record());
        if pieces.may_vote(slot, record) {
            all += 1;
            near += u32::from(pieces.record_distance2(record, &estimate.position) <= delta2);
        }
    }
    let chance = pieces.record_chance(slot, &estimate.position);
    f64::from(near) - f64::from(all) * f64::from(chance)
}
