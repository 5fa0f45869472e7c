//! Consensus for axis planes: each free coordinate on its own.

use crate::RecordId;
use crate::recover::map::lists::{Lists, Slots, solve_chunks};
use crate::recover::map::planes::{SortedPlanes, WindowChance, best_window};
use crate::recover::result::{Estimate, Status, stored_support};
use crate::released::AxisPlanes;

/// Estimates for `slots`.
pub(super) fn solve<const D: usize>(
    planes: &AxisPlanes<D>,
    sorted: &SortedPlanes,
    lists: Lists<'_>,
    delta: f32,
    slots: Slots<'_>,
) -> Vec<Estimate<D>> {
    let chance = WindowChance::new(planes, sorted, delta);
    let scratch = || Scratch { by_axis: std::array::from_fn(|_| Vec::new()), buffer: Vec::new() };
    solve_chunks(lists.n_slots(), slots, scratch, |scratch, first, out| {
        for (at, estimate) in out.iter_mut().enumerate() {
            *estimate = solve_slot(planes, first + at, lists, &chance, delta, scratch);
        }
    })
}

/// Listed planes as (offset, record), per axis.
type ByAxis<const D: usize> = [Vec<(f32, RecordId)>; D];

struct Scratch<const D: usize> {
    by_axis: ByAxis<D>,
    buffer: Vec<RecordId>,
}

fn solve_slot<const D: usize>(
    planes: &AxisPlanes<D>,
    slot: usize,
    lists: Lists<'_>,
    chance: &WindowChance,
    delta: f32,
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Scratch { by_axis, buffer } = scratch;
    by_axis.iter_mut().for_each(Vec::clear);
    let listed = lists.of(slot, buffer);
    for &record in listed {
        let axis = usize::from(planes.axis()[record.index()]);
        by_axis[axis].push((planes.offset()[record.index()], record));
    }
    let own = usize::from(planes.axis()[slot]);
    let few = listed.len() < 2;
    let mut estimate =
        Estimate { position: [0.0; D], status: Status::Ok, support: 0, axis: 0, evidence: 0.0 };
    for (axis, listed) in by_axis.iter_mut().enumerate() {
        if axis == own {
            estimate.position[axis] = planes.offset()[slot];
        } else if let Some(window) = best_window(listed, chance, delta) {
            estimate.position[axis] = window.offset;
            estimate.support = estimate.support.saturating_add(stored_support(window.count));
            estimate.evidence += window.evidence;
        } else {
            return Estimate::lost(if few { Status::TooFewNeighbors } else { Status::Degenerate });
        }
    }
    estimate
}
