//! How well records agree with estimates: the judge of iterations.
//!
//! Estimates that agree with each other prove nothing: they may have drifted together. Records cannot
//! drift. If fewer of them pass near the estimates of an iteration than before, beyond chance, the iteration
//! made things worse.

use rayon::prelude::*;

use super::input::Input;
use crate::recover::map::edges::record_of;
use crate::recover::map::pieces::Pieces;
use crate::recover::result::estimate::{Estimate, Status};

/// Slots looked at: the mean over so many is known better than the share by which it may fall.
const SLOTS: usize = 1 << 12;

/// The mean number of records at the other ends of a slot's edges that pass near its estimate, less
/// that expected by chance; over slots spread evenly.
pub(super) fn agreement<const D: usize, P: Pieces<D>>(
    input: &Input<'_, P>,
    estimates: &[Estimate<D>],
) -> f64 {
    let n = estimates.len();
    let slots: Vec<usize> = (0..n).step_by(n.div_ceil(SLOTS).max(1)).collect();
    let of_part =
        |part: &[usize]| part.iter().map(|&slot| of_slot(input, slot, &estimates[slot])).sum();
    let parts: Vec<f64> = slots.par_chunks(256).map(of_part).collect();
    parts.iter().sum::<f64>() / slots.len().max(1) as f64
}

fn of_slot<const D: usize, P: Pieces<D>>(
    input: &Input<'_, P>,
    slot: usize,
    estimate: &Estimate<D>,
) -> f64 {
    if estimate.status != Status::Ok {
        return 0.0;
    }
    let Input { pieces, graph, delta, .. } = input;
    let (mut near, mut all) = (0u32, 0u32);
    for &end in graph.of(slot).0 {
        let record = record_of(end as usize, pieces.slots_per_record());
        if pieces.may_vote(slot, record) {
            all += 1;
            near += u32::from(pieces.record_distance2(record, &estimate.position) <= delta * delta);
        }
    }
    let chance = pieces.record_chance(slot, &estimate.position);
    f64::from(near) - f64::from(all) * f64::from(chance)
}
