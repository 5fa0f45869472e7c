//! Attacks on the released records alone, without neighborhoods and descriptors.

use rayon::prelude::*;

use crate::density::{Peak, Peaks, tomography};
use crate::neighbors::{Geometric, Neighborhoods, geometric_by};
use crate::recover::attack::Attack;
use crate::recover::baselines::density::published;
use crate::recover::map::rows_of;
use crate::recover::result::{Estimate, Recovered, Status, Unknown, stored_support};
use crate::recover::solver::{Builtin, Delta, RecoverOptions};
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
    options.check()?;
    let none = Neighborhoods::unchecked(vec![0; released.n_slots() + 1], Vec::new());
    // For paired lines, the order of the two points is unknown.
    let none = none.with_about(About { order: RowOrder::Either, ..About::default() });
    let mut attacks = Vec::new();
    if matches!(released.obfuscation(), Obfuscation::Rays(_)) {
        attacks.push((Builtin::Density.name(), at_peaks(released, &none, &published(released))?));
    }
    let peaks = tomography(released);
    attacks.push((Builtin::Tomography.name(), at_peaks(released, &none, &peaks)?));
    // Planes and rays from one center have no geometric lists.
    if let Ok(lists) = geometric_by(released, Geometric::K, &peaks) {
        let options = RecoverOptions { confidence: false, ..*options };
        let joint = Attack::new(released, &lists, &options, Builtin::Joint).run()?;
        // Delta does not need to be learned twice.
        let options = RecoverOptions { delta: Delta::Fixed(joint.delta()), ..options };
        let start = Attack::new(released, &lists, &options, Builtin::Joint);
        attacks.push(("geometric, consensus", Attack { only_starts: true, ..start }.run()?));
        attacks.push(("geometric, joint", joint));
    }
    Ok(attacks)
}

/// Returns the points at `peaks`.
///
/// Lists do not change positions. For paired lines they decide which of the two positions belongs to which slot: the cheaper
/// assignment wins, with the distances to the listed records (Eq. (4)) as cost. With empty lists the order is that along the line.
pub(super) fn at_peaks<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    peaks: &Peaks,
) -> Result<Recovered<D>, Error> {
    let rows = rows_of(released, None);
    // Delta is the resolution of the peaks.
    let delta = if peaks.resolution > 0.0 { peaks.resolution } else { 1.0 };
    let peak = |slot: usize| match peaks.of[slot] {
        // These attacks return positions in three dimensions only.
        Some(Peak { position, axis, evidence }) => {
            Estimate::at(std::array::from_fn(|c| position[c % 3]), 0, axis.into(), evidence)
        }
        None => Estimate::lost(Status::NoSupport),
    };
    let distances = |slot: usize, x: [f32; D]| {
        let rows = &rows;
        lists.of(slot).iter().map(move |record| {
            let row = &rows[record.index()];
            row.distance2(&x, row.along(&x)).sqrt()
        })
    };
    let cost = |at: usize, slot: usize| distances(slot, peak(at).position).sum::<f32>();
    let place = |slot: usize| {
        let (a, b) = (slot & !1, slot | 1);
        let is_crossed =
            released.slots_per_record() == 2 && cost(a, a) + cost(b, b) > cost(b, a) + cost(a, b);
        let mut estimate = peak(if is_crossed { slot ^ 1 } else { slot });
        if !rows.is_empty() {
            let near = distances(slot, estimate.position).filter(|&d| d <= delta as f32);
            estimate.support = stored_support(near.count() as u32);
        }
        estimate
    };
    let estimates: Vec<_> = (0..released.n_slots()).into_par_iter().map(place).collect();
    let recovered = Recovered::new(released, lists, &estimates, delta)?;
    Ok(recovered.without_confidence(Unknown::OtherSolver))
}
