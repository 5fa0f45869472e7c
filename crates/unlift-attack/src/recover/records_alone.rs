//! Attacks on the released records alone, without neighborhoods and descriptors.

use rayon::prelude::*;

use crate::density::{Peaks, tomography};
use crate::neighbors::{Geometric, Neighborhoods, geometric_by};
use crate::recover::baselines::density::published;
use crate::recover::map::lines::{LineRow, from_lines, from_rays};
use crate::recover::map::lists::found;
use crate::recover::options::RecoverOptions;
use crate::recover::problem::Problem;
use crate::recover::result::{Estimate, Recovered, Status, stored_support};
use crate::recover::solver::Builtin;
use crate::released::{Obfuscation, Released};
use crate::{About, Error, RowOrder};

/// Runs our attacks on the records alone; returns the name and the result of each. They recover nothing from a map of planes, or
/// of rays from one center.
///
/// They read the whole map: a sample of its records is a sparser map, of which less is recovered, so that the baseline would be too low.
/// The published density attack runs on rays only: on lines it recovered less than tomography on every map and at every
/// threshold (docs/benchmarks.md), and took four times as long.
///
/// # Errors
/// When `options` are out of range.
pub fn records_alone<const D: usize>(
    released: &Released<D>,
    options: &RecoverOptions,
) -> Result<Vec<(&'static str, Recovered<D>)>, Error> {
    let mut attacks = Vec::new();
    if matches!(released.obfuscation(), Obfuscation::Rays(_)) {
        attacks.push((Builtin::Density.name(), at(released, &published(released))?));
    }
    let peaks = tomography(released);
    attacks.push((Builtin::Tomography.name(), at(released, &peaks)?));
    // Planes and rays from one center have no geometric lists.
    if let Ok(lists) = geometric_by(released, Geometric::K, &peaks) {
        let options = RecoverOptions { confidence: false, ..*options };
        let problem = Problem::new(released, &lists, Builtin::Joint, &options)?;
        let start = problem.start();
        attacks.push(("geometric, consensus", problem.finish(start.clone())?));
        attacks.push(("geometric, joint", problem.finish(problem.joint(start, &[]))?));
    }
    Ok(attacks)
}

/// Returns the positions of `peaks`. For paired lines, the order of the two points is unknown.
fn at<const D: usize>(released: &Released<D>, peaks: &Peaks) -> Result<Recovered<D>, Error> {
    let none = Neighborhoods::unchecked(vec![0; released.n_slots() + 1], Vec::new());
    let estimates = Placement::new(released, &none, peaks).solve();
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    let delta = delta(peaks);
    let about =
        About { map: Some(released.fingerprint()), order: RowOrder::Either, ..About::default() };
    Ok(Recovered::try_new(&estimates, with_axis, None, origin, unit, delta)?.with_about(about))
}

/// A solver that places each hidden point at its peak.
///
/// Lists do not change positions. For paired lines they decide which of the two positions belongs to which slot: the cheaper
/// assignment wins, with the distances to the listed records (Eq. (4)) as cost. With empty lists the order is that along the line.
pub(super) struct Placement<'a, const D: usize> {
    rows: Vec<LineRow<D>>,
    slots_per_record: usize,
    lists: &'a Neighborhoods,
    peaks: &'a Peaks,
}

/// Returns the delta that decides support: the resolution of `peaks`, or 1 if there are no peaks.
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

    pub(super) fn solve(&self) -> Vec<Estimate<D>> {
        let reach = delta(self.peaks) as f32;
        let place = |slot: usize| {
            let is_crossed = self.slots_per_record == 2 && self.is_crossed(slot);
            let mut estimate = self.peak(if is_crossed { slot ^ 1 } else { slot });
            if !self.rows.is_empty() {
                let distances = self.distances(slot, &estimate.position);
                let support = distances.filter(|&distance| distance <= reach).count();
                estimate.support = stored_support(support as u32);
            }
            estimate
        };
        (0..self.lists.n_slots()).into_par_iter().map(place).collect()
    }

    fn peak(&self, slot: usize) -> Estimate<D> {
        let Some(peak) = self.peaks.of[slot] else {
            return Estimate::lost(Status::NoSupport);
        };
        // These attacks return positions in three dimensions only.
        let position = std::array::from_fn(|c| peak.position[c % 3]);
        found(position, 0, peak.axis.into(), peak.evidence)
    }

    /// Whether exchanging the two peaks of the record of `slot` lowers the cost.
    fn is_crossed(&self, slot: usize) -> bool {
        let (a, b) = (slot & !1, slot | 1);
        let cost =
            |peak: usize, slot: usize| self.distances(slot, &self.peak(peak).position).sum::<f32>();
        cost(a, a) + cost(b, b) > cost(b, a) + cost(a, b)
    }

    fn distances(&self, slot: usize, x: &[f32; D]) -> impl Iterator<Item = f32> {
        self.lists.of(slot).iter().map(move |record| {
            let row = &self.rows[record.index()];
            let away: [f32; D] = std::array::from_fn(|c| x[c] - row.through[c]);
            let along: f32 = (0..D).map(|c| away[c] * row.direction[c]).sum();
            let across = |c: usize| away[c] - along * row.direction[c];
            (0..D).map(|c| across(c) * across(c)).sum::<f32>().sqrt()
        })
    }
}
