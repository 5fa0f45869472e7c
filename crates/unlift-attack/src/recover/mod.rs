//! Recovery: from released records and neighborhoods to positions.
//!
//! [`recover`] runs a [`Solver`]. `attack` has the steps of ours in their order. The search is generic over the family of records
//! (`map/family.rs`); `exact` and `confidence` have a rule or constants per kind of records, and `anchors` is for one scheme (`dcl2d`).

mod anchors;
mod attack;
mod baselines;
mod beliefs;
mod confidence;
mod consensus;
mod delta;
mod exact;
mod joint;
pub(crate) mod map;
mod peaks;
mod problem;
mod ranking;
pub(crate) mod result;
mod solver;

pub use attack::{records_alone, recover_from};
pub use result::{Confidence, Estimate, Recovered, Status, Unknown};
pub use solver::{Builtin, Delta, RecoverOptions, Solver};

use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::released::Released;

/// Recovers the hidden points of `released` from `lists` by `solver`: the map `R` of Eq. (3) of the paper (3DV 2025).
///
/// The result depends on the arguments alone, not on the number of threads.
///
/// # Errors
/// When options are out of range, the lists do not have one row per slot, the solver fails, or it does not return one position per slot.
pub fn recover<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    solver: &dyn Solver<D>,
    options: &RecoverOptions,
) -> Result<Recovered<D>, Error> {
    attack::check(released, lists, options)?;
    let recovered = solver.recover(released, lists, options)?;
    let (found, n_slots) = (recovered.n_slots(), released.n_slots());
    Error::check_len("solver", found, n_slots, " positions, one per slot")
        .map_err(|error| error.within(solver.name()))?;
    Ok(recovered)
}
