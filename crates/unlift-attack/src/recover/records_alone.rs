//! What the released records alone tell, without neighborhoods and descriptors.

use std::ops::Range;

use rayon::prelude::*;

use crate::density::{Peak, Peaks, tomography};
use crate::neighbors::{Geometric, Neighborhoods, geometric_by};
use crate::recover::map::lines::{LineRow, from_lines, from_rays};
use crate::recover::options::{RecoverOptions, Solver};
use crate::recover::published_density::published;
use crate::recover::recover_with_start;
use crate::recover::result::{Estimate, Recovered, Status, stored_support};
use crate::released::{Obfuscation, Released};
use crate::{About, Error, RowOrder};

/// Our attacks on the records alone: the name of each, and what it recovers. A map of planes, or of rays from one center, gives
/// nothing away by itself.
///
/// The whole map is attacked: a sample of its records would make a sparser map, of which less comes back,
/// and a baseline that is too low hides what a scheme gives away by itself. The published density attack is tried
/// on rays only: of lines it brought back less than tomography on every map and within every distance
/// (docs/benchmarks.md), at four times the cost.
///
/// # Errors
/// When `options` are out of range.
pub fn records_alone<const D: usize>(
    released: &Released<D>,
    options: &RecoverOptions,
) -> Result<Vec<(&'static str, Recovered<D>)>, Error> {
    let mut attacks = Vec::new();
    if matches!(released.obfuscation(), Obfuscation::Rays(_)) {
        attacks.push((Solver::Density.name(), at(released, &published(released))?));
    }
    let peaks = tomography(released);
    attacks.push((Solver::Tomography.name(), at(released, &peaks)?));
    // A map of planes, or of rays from one center, has no such lists.
    if let Ok(lists) = geometric_by(released, Geometric::K, &peaks) {
        let options = RecoverOptions { confidence: false, ..*options };
        let (joint, start) = recover_with_start(released, &lists, &options)?;
        attacks.push(("geometric, joint", joint));
        attacks.push(("geometric, joint-start", start));
    }
    Ok(attacks)
}

/// The positions at which `peaks` puts the hidden points: which of a paired line's is whose is not known.
fn at<const D: usize>(released: &Released<D>, peaks: &Peaks) -> Result<Recovered<D>, Error> {
    let none = Neighborhoods::unchecked(vec![0; released.n_slots() + 1], Vec::new());
    let estimates = Placement::new(released, &none, peaks).solve(0..released.n_slots());
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    let delta = delta(peaks);
    let about =
        About { map: Some(released.fingerprint()), order: RowOrder::Either, ..About::default() };
    Ok(Recovered::try_new(&estimates, with_axis, None, origin, unit, delta)?.with_about(about))
}

// Recovery from the records alone: the attacks of `density` as solvers.

/// The hidden points of one map where `peaks` puts them.
///
/// Lists do not move a position. For paired lines they decide which of the two positions belongs to
/// which slot, by the cheaper of the two bijections (cost: Eq. (4), distances to the listed records);
/// with empty lists the order is that along the line.
pub(super) struct Placement<'a, const D: usize> {
    rows: Vec<LineRow<D>>,
    slots_per_record: usize,
    lists: &'a Neighborhoods,
    peaks: &'a Peaks,
}

/// The distance that decides support: the resolution of `peaks`; any, where they have none.
pub(super) fn delta(peaks: &Peaks) -> f64 {
    if peaks.resolution > 0.0 { peaks.resolution } else { 1.0 }
}

impl<'a, const D: usize> Placement<'a, D> {
    pub(super) fn new(released: &Released<D>, lists: &'a Neighborhoods, peaks: &'a Peaks) -> Self {
        let rows = match released.obfuscation() {
            Obfuscation::Lines(lines) => from_lines(lines, None),
            Obfuscation::Rays(rays) => from_rays(rays, None),
            Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => Vec::new(),
        };
        Self { rows, slots_per_record: released.slots_per_record(), lists, peaks }
    }

    /// The peak of `slot` as it stands.
    fn peak(&self, slot: usize) -> Estimate<D> {
        match self.peaks.of[slot] {
            Some(peak) => estimate(&peak),
            None => Estimate::lost(Status::NoSupport),
        }
    }

    /// Whether the two peaks of `slot`'s record are better exchanged.
    fn is_crossed(&self, slot: usize) -> bool {
        let (a, b) = (slot & !1, slot | 1);
        let pair = [self.peak(a), self.peak(b)];
        let cost = |at: usize, slot: usize| {
            let x = &pair[at].position;
            self.lists.of(slot).iter().map(|r| distance(&self.rows[r.index()], x)).sum::<f32>()
        };
        cost(0, a) + cost(1, b) > cost(1, a) + cost(0, b)
    }
}

impl<const D: usize> Placement<'_, D> {
    /// The estimates of `slots`, in order.
    pub(super) fn solve(&self, slots: Range<usize>) -> Vec<Estimate<D>> {
        let reach = delta(self.peaks) as f32;
        let place = |slot: usize| {
            let is_crossed = self.slots_per_record == 2 && self.is_crossed(slot);
            let mut estimate = self.peak(if is_crossed { slot ^ 1 } else { slot });
            if !self.rows.is_empty() {
                let near = |row: &LineRow<D>| distance(row, &estimate.position) <= reach;
                let listed = self.lists.of(slot).iter();
                let support = listed.filter(|r| near(&self.rows[r.index()])).count();
                estimate.support = stored_support(support as u32);
            }
            estimate
        };
        slots.into_par_iter().map(place).collect()
    }
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
