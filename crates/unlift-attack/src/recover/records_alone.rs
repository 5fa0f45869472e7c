//! Attacks on the released records alone, without neighborhoods and descriptors.

use crate::density::{Peaks, tomography};
use crate::neighbors::{Geometric, Neighborhoods, geometric_by};
use crate::recover::attack::Attack;
use crate::recover::baselines::density::published;
use crate::recover::options::{Delta, RecoverOptions};
use crate::recover::placement::{Placement, delta};
use crate::recover::result::Recovered;
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
        let joint = Attack::new(released, &lists, &options, Builtin::Joint).run()?;
        // Delta does not need to be learned twice.
        let options = RecoverOptions { delta: Delta::Fixed(joint.delta()), ..options };
        let start = Attack::new(released, &lists, &options, Builtin::Joint);
        attacks.push(("geometric, consensus", Attack { only_starts: true, ..start }.run()?));
        attacks.push(("geometric, joint", joint));
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
