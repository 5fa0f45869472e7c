//! The attacker: records and neighborhoods in, positions out. Never imports `truth`.

mod candidate_rows;
mod chance;
mod chunks;
mod consensus;
mod delta;
mod family;
mod line_rows;
mod lists;
mod null_sample;
mod options;
mod plane_windows;
mod recovered;
mod sections;

pub use options::{Delta, RecoverOptions, Solver};
pub use recovered::{Estimate, Recovered, Status};

use crate::Error;
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
    let family = Family::new(released);
    let delta = match options.delta {
        Delta::Fixed(delta) => delta,
        Delta::Auto => delta::choose(&family, lists, options.seed).unwrap_or(1.0),
    };
    let estimates = match options.solver {
        Solver::Consensus => {
            consensus::solve(&family, Lists::given(lists), delta as f32, options.seed, Chunks::All)
        }
        Solver::Ransac => {
            consensus::solve(&family, Lists::given(lists), delta as f32, options.seed, Chunks::All)
        }
    };
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    Recovered::try_new(&estimates, with_axis, None, released.origin(), released.unit(), delta)
}
