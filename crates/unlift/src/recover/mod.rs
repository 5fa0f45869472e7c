//! The attacker: records and neighborhoods in, positions out. Never imports `truth`.

mod assign;
mod candidate_rows;
mod chance;
mod chunks;
mod consensus;
mod delta;
mod density;
mod family;
mod line_rows;
mod lists;
mod null_sample;
mod options;
mod plane_windows;
mod ransac;
mod recovered;
mod sections;

pub use options::{Delta, RecoverOptions, Solver};
pub use ransac::TrialHistogram;
pub(crate) use recovered::stored_support;
pub use recovered::{Estimate, Recovered, Status};

use crate::Error;
use crate::density::{published, tomography};
use crate::neighbors::Neighborhoods;
use crate::released::{Obfuscation, Released};
use chunks::Chunks;
use family::Family;
use lists::Lists;

/// Recovers the hidden points of `released` with the help of `lists`: `R` of Eq. (3).
///
/// The result depends on the records, the neighborhoods and the options alone, not on threads.
///
/// # Errors
/// When options are out of range, or the lists do not have one row per slot.
pub fn recover<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<Recovered<D>, Error> {
    options.check()?;
    if lists.n_slots() != released.n_slots() {
        let expected = format!("{} rows, one per slot", released.n_slots());
        return Err(Error::new("neighborhoods", expected, lists.n_slots().to_string()));
    }
    let descriptor_row = assign::descriptor_rows(released, lists);
    let family = Family::new(released);
    let delta = || match options.delta {
        Delta::Fixed(delta) => delta,
        Delta::Auto => delta::choose(&family, lists, options.seed).unwrap_or(1.0),
    };
    let (estimates, trials, delta) = match options.solver {
        Solver::Consensus => {
            let (given, delta) = (Lists::given(lists), delta());
            let all = Chunks::All;
            (consensus::solve(&family, given, delta as f32, options.seed, all), None, delta)
        }
        Solver::Ransac => {
            let delta = delta();
            let (solved, trials) = ransac::solve(&family, lists, delta as f32, options.seed);
            (solved, Some(trials), delta)
        }
        Solver::Density => {
            return density::place(released, lists, &published(released), descriptor_row);
        }
        Solver::Tomography => {
            return density::place(released, lists, &tomography(released), descriptor_row);
        }
    };
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    Recovered::try_new(&estimates, with_axis, descriptor_row, origin, unit, delta)
        .map(|recovered| recovered.with_trials(trials))
}
