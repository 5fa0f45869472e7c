//! What the released records alone tell, without neighborhoods and descriptors.

use super::baselines::density::published;
use super::options::{RecoverOptions, Solver};
use super::placement::{self, Placement};
use super::recover_with_start;
use super::result::recovered::Recovered;
use crate::density::{Peaks, tomography};
use crate::neighbors::{Geometric, Neighborhoods, geometric_by};
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
    let (n_records, slots) = (released.n_records(), released.slots_per_record());
    let none =
        Neighborhoods::try_new(vec![0; n_records * slots + 1], Vec::new(), None, n_records, slots)?;
    let estimates = Placement::new(released, &none, peaks).solve(0..released.n_slots());
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    let delta = placement::delta(peaks);
    let about =
        About { map: Some(released.fingerprint()), order: RowOrder::Either, ..About::default() };
    Ok(Recovered::try_new(&estimates, with_axis, None, origin, unit, delta)?.with_about(about))
}
