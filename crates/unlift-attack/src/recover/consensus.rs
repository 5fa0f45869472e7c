//! Exact consensus: on each slot's own record, the position whose agreement with the listed records is least probable by chance.

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::anchors;
use crate::recover::map::chance::{CandidateField, ChanceField, tube};
use crate::recover::map::family::Family;
use crate::recover::map::lines::{CandidateColumns, Intervals, LineColumns, LineRow, Sections};
use crate::recover::map::lists::{Slots, found, not_fixed, solve_chunks};
use crate::recover::map::planes::{best_window, window_chance};
use crate::recover::result::{Estimate, Status, stored_support};
use crate::released::AxisPlanes;
use crate::simd::{Kernel, dispatch, prefetch};

pub(crate) fn solve<const D: usize>(
    family: &Family<'_, D>,
    lists: &Neighborhoods,
    delta: f32,
    slots: &Slots,
) -> Vec<Estimate<D>> {
    match family {
        Family::Lines { rows, .. } if family.has_regions() => {
            anchors::start::solve(rows, lists, slots)
        }
        Family::Planes { planes, sorted } => {
            let chance = window_chance(planes, sorted, delta);
            let scratch = || std::array::from_fn(|_| Vec::new());
            solve_chunks(slots, scratch, |by_axis, first, out| {
                for (at, estimate) in out.iter_mut().enumerate() {
                    *estimate = on_plane(planes, first + at, lists, &chance, delta, by_axis);
                }
            })
        }
        Family::Lines { .. } | Family::Candidates { .. } => {
            solve_chunks(slots, Scratch::default, |scratch, first, out| {
                dispatch(Chunk { family, lists, delta, first, out, scratch });
            })
        }
    }
}

#[derive(Default)]
struct Scratch<const D: usize> {
    lines: LineColumns<D>,
    candidates: CandidateColumns<D>,
    sections: Sections,
    intervals: Intervals,
}

/// Consecutive slots on lines or on axis candidates, which have one unknown.
struct Chunk<'a, const D: usize> {
    family: &'a Family<'a, D>,
    lists: &'a Neighborhoods,
    delta: f32,
    first: usize,
    out: &'a mut [Estimate<D>],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize> Kernel for Chunk<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { family, lists, delta, first, out, scratch } = self;
        let tubes = match family {
            Family::Candidates { chance, .. } => chance.tubes(delta),
            Family::Lines { .. } | Family::Planes { .. } => [0.0; D],
        };
        for (at, estimate) in out.iter_mut().enumerate() {
            let slot = first + at;
            match family {
                Family::Lines { rows, slots_per_record, chance, .. } => {
                    prefetch_listed(lists, slot + 1, rows);
                    let own = &rows[slot / slots_per_record];
                    scratch.lines.gather(rows, lists.of(slot));
                    *estimate = on_line(own, chance, delta, scratch);
                }
                Family::Candidates { rows, chance } => {
                    prefetch_listed(lists, slot + 1, rows);
                    scratch.candidates.gather(rows, lists.of(slot));
                    *estimate = on_candidates(&rows[slot], (chance, &tubes), delta, scratch);
                }
                Family::Planes { .. } => {}
            }
        }
    }
}

#[inline(always)]
fn prefetch_listed<T>(lists: &Neighborhoods, slot: usize, rows: &[T]) {
    if slot < lists.n_slots() {
        lists.of(slot).iter().for_each(|record| prefetch(rows, record.index()));
    }
}

/// Returns the estimate on a line or ray from the gathered records.
#[inline(always)]
fn on_line<const D: usize>(
    own: &LineRow<D>,
    chance: &[ChanceField<D>],
    delta: f32,
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Scratch { lines, sections, intervals, .. } = scratch;
    let delta2 = delta * delta;
    lines.sections(own, sections);
    let may_vote = lines.n_that_may_vote(own);
    if sections.n_voting() < 2 {
        return not_fixed(may_vote);
    }
    let field = &chance[if own.is_ray() { own.group as usize } else { 0 }];
    let Some(peak) =
        intervals.peak(sections, (delta2, own.floor(), own.to), may_vote, |t, cells, chance| {
            field.add_along((&own.through, &own.direction), t, tube(D, delta), (cells, chance));
        })
    else {
        return Estimate::lost(Status::NoSupport);
    };
    let (t, support) = refit(sections, peak.t, delta2);
    found(own.at(own.clamp(t)), support, 0, peak.evidence)
}

/// Returns the best estimate on any axis line of a slot from the gathered records. Axes are compared by evidence, not by counts: along
/// the long axis of an elongated map more records agree by chance.
#[inline(always)]
fn on_candidates<const D: usize>(
    own: &[f32; D],
    (chance, tubes): (&CandidateField<D>, &[f32; D]),
    delta: f32,
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Scratch { candidates, sections, intervals, .. } = scratch;
    let delta2 = delta * delta;
    if candidates.len() < 2 {
        return Estimate::lost(Status::TooFewNeighbors);
    }
    let mut best = Estimate::lost(Status::NoSupport);
    let mut best_score = f32::NEG_INFINITY;
    for axis in 0..D {
        candidates.sections(own, axis, delta2, sections);
        let limits = (delta2, f32::NEG_INFINITY, f32::INFINITY);
        let Some(peak) = intervals.peak(sections, limits, candidates.len(), |t, cells, chances| {
            chance.add_along((own, axis), t, tubes, (cells, chances));
        }) else {
            continue;
        };
        if peak.score > best_score {
            best_score = peak.score;
            let (t, support) = refit(sections, peak.t, delta2);
            let mut position = *own;
            position[axis] = t;
            best = found(position, support, axis, peak.evidence);
        }
    }
    best
}

/// Returns `t` after two least-squares steps over the records within delta, and its support. The step is Eq. (4) with squared
/// distances: on a line, a weighted mean of the closest approaches.
#[inline(always)]
fn refit(sections: &Sections, t: f32, delta2: f32) -> (f32, u32) {
    // The start of an interval is at distance delta up to rounding, and must count as within.
    let reach = delta2.sqrt() * (1.0 + 5e-5) + 4.0 * f32::EPSILON * t.abs();
    let reach2 = reach * reach;
    let (shift, _) = sections.least_squares_step(t, reach2);
    let t = t + shift;
    let (shift, support) = sections.least_squares_step(t, reach2);
    (t + shift, support)
}

/// Returns the estimate on a plane; free coordinates are independent. `by_axis` is a buffer for the listed planes, as (offset, record).
fn on_plane<const D: usize>(
    planes: &AxisPlanes<D>,
    slot: usize,
    lists: &Neighborhoods,
    chance: &[f32],
    delta: f32,
    by_axis: &mut [Vec<(f32, RecordId)>; D],
) -> Estimate<D> {
    by_axis.iter_mut().for_each(Vec::clear);
    let listed = lists.of(slot);
    for &record in listed {
        let axis = usize::from(planes.axis()[record.index()]);
        by_axis[axis].push((planes.offset()[record.index()], record));
    }
    let own = usize::from(planes.axis()[slot]);
    let n = listed.len();
    let mut estimate = found([0.0; D], 0, 0, 0.0);
    for (axis, listed) in by_axis.iter_mut().enumerate() {
        if axis == own {
            estimate.position[axis] = planes.offset()[slot];
        } else if let Some(window) = best_window(listed, chance, delta) {
            estimate.position[axis] = window.offset;
            estimate.support = estimate.support.saturating_add(stored_support(window.count));
            estimate.evidence += window.evidence;
        } else {
            return not_fixed(n);
        }
    }
    estimate
}
