//! Exact consensus: on each slot's own record, the position whose agreement with the listed records is least probable by chance.

use rayon::prelude::*;

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::anchors;
use crate::recover::map::chance::CandidateField;
use crate::recover::map::families::LineFamily;
use crate::recover::map::family::Family;
use crate::recover::map::lines::{Columns, Intervals, LineColumns, Sections};
use crate::recover::map::places::CHUNK;
use crate::recover::map::planes::best_window;
use crate::recover::result::{Estimate, Status, stored_support};
use crate::released::AxisPlanes;
use crate::simd::{Kernel, dispatch};

pub(crate) fn solve<const D: usize, F: Family<D>>(
    family: &F,
    lists: &Neighborhoods,
    delta: f32,
    slots: &[usize],
) -> Vec<Estimate<D>> {
    if let Some(rays) = family.anchored() {
        return anchors::start::solve(rays, lists, slots);
    }
    let at = &family.at_delta(delta);
    let solve = |scratch: &mut Scratch<D>, slots| {
        dispatch(Chunk { family, lists, at: (delta, at), slots, scratch })
    };
    slots.par_chunks(CHUNK).map_init(Scratch::default, solve).flatten_iter().collect()
}

/// Creates the estimate of a slot whose neighbors do not fix a point; `n` of them may vote.
fn not_fixed<const D: usize>(n: usize) -> Estimate<D> {
    Estimate::lost(if n < 2 { Status::TooFewNeighbors } else { Status::Degenerate })
}

/// Buffers of one thread.
pub(crate) struct Scratch<const D: usize> {
    pub(crate) lines: LineColumns<D>,
    pub(crate) candidates: Columns<D>,
    pub(crate) sections: Sections,
    intervals: Intervals,
    /// Indices of the sections that vote.
    pub(crate) voting: Vec<usize>,
    /// Listed planes by axis, as (offset, record).
    pub(crate) by_axis: [Vec<(f32, RecordId)>; D],
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        Self {
            lines: LineColumns::default(),
            candidates: Columns::default(),
            sections: Sections::default(),
            intervals: Intervals::default(),
            voting: Vec::new(),
            by_axis: std::array::from_fn(|_| Vec::new()),
        }
    }
}

struct Chunk<'a, const D: usize, F: Family<D>> {
    family: &'a F,
    lists: &'a Neighborhoods,
    at: (f32, &'a F::AtDelta),
    slots: &'a [usize],
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, F: Family<D>> Kernel for Chunk<'_, D, F> {
    type Output = Vec<Estimate<D>>;

    #[inline(always)]
    fn run(self) -> Vec<Estimate<D>> {
        let Self { family, lists, at, slots, scratch } = self;
        let mut estimates = Vec::with_capacity(slots.len());
        for (number, &slot) in slots.iter().enumerate() {
            if let Some(&next) = slots.get(number + 1) {
                lists.of(next).iter().for_each(|record| family.prefetch(record.index()));
            }
            estimates.push(family.consensus(slot, lists.of(slot), at, scratch));
        }
        estimates
    }
}

/// Returns the estimate on the line or ray of `slot` from the gathered records.
#[inline(always)]
pub(crate) fn on_line<const D: usize>(
    family: &LineFamily<D>,
    slot: usize,
    (delta, &tube): (f32, &f32),
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Scratch { lines, sections, intervals, .. } = scratch;
    let (own, delta2) = (family.own(slot), delta * delta);
    lines.sections(own, sections);
    let may_vote = lines.n_that_may_vote(own);
    if sections.n_voting() < 2 {
        return not_fixed(may_vote);
    }
    let limits = (delta2, own.floor(), own.to);
    let Some(peak) = intervals.peak(sections, limits, may_vote, |t, cells, chance| {
        family.field(own).add_along((&own.through, &own.direction), t, tube, (cells, chance));
    }) else {
        return Estimate::lost(Status::NoSupport);
    };
    let (t, support) = refit(sections, peak.t, delta2);
    Estimate::at(own.at(own.clamp(t)), support, 0, peak.evidence)
}

/// Returns the best estimate on any axis line of a slot from the gathered records. Axes are compared by evidence, not by counts: along
/// the long axis of an elongated map more records agree by chance.
#[inline(always)]
pub(crate) fn on_candidates<const D: usize>(
    own: &[f32; D],
    chance: &CandidateField<D>,
    (delta, tubes): (f32, &[f32; D]),
    scratch: &mut Scratch<D>,
) -> Estimate<D> {
    let Scratch { candidates, sections, intervals, .. } = scratch;
    let delta2 = delta * delta;
    let n = candidates.0[0].len();
    if n < 2 {
        return Estimate::lost(Status::TooFewNeighbors);
    }
    let mut best = Estimate::lost(Status::NoSupport);
    let mut best_score = f32::NEG_INFINITY;
    for axis in 0..D {
        candidates.sections(own, axis, delta2, sections);
        let limits = (delta2, f32::NEG_INFINITY, f32::INFINITY);
        let Some(peak) = intervals.peak(sections, limits, n, |t, cells, chances| {
            chance.add_along((own, axis), t, tubes, (cells, chances));
        }) else {
            continue;
        };
        if peak.score > best_score {
            best_score = peak.score;
            let (t, support) = refit(sections, peak.t, delta2);
            let mut position = *own;
            position[axis] = t;
            best = Estimate::at(position, support, axis, peak.evidence);
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

/// Returns the estimate on a plane; free coordinates are independent. `by_axis` is a buffer.
#[inline(always)]
pub(crate) fn on_plane<const D: usize>(
    planes: &AxisPlanes<D>,
    slot: usize,
    listed: &[RecordId],
    (delta, chance): (f32, &[f32]),
    by_axis: &mut [Vec<(f32, RecordId)>; D],
) -> Estimate<D> {
    gather_planes(planes, listed, by_axis);
    let own = usize::from(planes.axis()[slot]);
    let mut estimate = Estimate::at([0.0; D], 0, 0, 0.0);
    for (axis, of_axis) in by_axis.iter_mut().enumerate() {
        if axis == own {
            estimate.position[axis] = planes.offset()[slot];
        } else if let Some(window) = best_window(of_axis, chance, delta) {
            estimate.position[axis] = window.offset;
            estimate.support = estimate.support.saturating_add(stored_support(window.count));
            estimate.evidence += window.evidence;
        } else {
            return not_fixed(listed.len());
        }
    }
    estimate
}

/// Sorts `listed` planes by axis.
pub(crate) fn gather_planes<const D: usize>(
    planes: &AxisPlanes<D>,
    listed: &[RecordId],
    by_axis: &mut [Vec<(f32, RecordId)>; D],
) {
    by_axis.iter_mut().for_each(Vec::clear);
    for &record in listed {
        let axis = usize::from(planes.axis()[record.index()]);
        by_axis[axis].push((planes.offset()[record.index()], record));
    }
}
