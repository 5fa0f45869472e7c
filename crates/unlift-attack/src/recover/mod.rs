//! Recovery: from released records and neighborhoods to positions. No code here imports `truth`.
//!
//! Modules, in an order in which each imports mostly modules above it:
//!
//! 1. `options`: options of recovery. `result`: recovered positions. `solver`: the
//!    trait [`Solver`], which you can implement.
//! 2. `map`: the data that all solvers read. `map/family.rs`: the trait of families of records, on which no step depends otherwise.
//!    `problem`: what all steps of `joint` read.
//! 3. `consensus`, `joint`, `ranking` and `beliefs`: the steps of our attack. `anchors`: start and layout of rays from anchors.
//! 4. `delta`: the choice of the distance that decides support.
//! 5. `exact`: coordinates that a rule of the scheme fixes. `confidence`: the probability that an estimate is right.
//! 6. `attack`: the steps in their order. `records_alone`: attacks without neighborhoods. `baselines`: published attacks.
//!
//! [`recover`] runs the whole attack.

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
mod options;
mod problem;
mod ranking;
mod records_alone;
mod result;
mod solver;

pub use attack::recover_from;
pub use options::{Delta, RecoverOptions};
pub use records_alone::records_alone;
pub use result::{Confidence, Estimate, Recovered, Status, TrialHistogram, Unknown};
pub use solver::{Builtin, Solver};

use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::released::Released;

/// Recovers the hidden points of `released` from `lists` by `solver`: the map `R` of Eq. (3).
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
    if recovered.n_slots() == released.n_slots() {
        return Ok(recovered);
    }
    let expected = format!("{} positions, one per slot", released.n_slots());
    let found = recovered.n_slots().to_string();
    Err(Error::new("solver", expected, found).within(solver.name()))
}
