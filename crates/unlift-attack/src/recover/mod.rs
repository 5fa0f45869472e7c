//! Recovery: from released records and neighborhoods to positions. No code here imports `truth`.
//!
//! Modules, in an order in which each imports only modules above it and `map`:
//!
//! 1. `options`: options of recovery. `assignment`: descriptors of paired lines. `result`: recovered positions. `solver`: the
//!    trait [`Solver`], which you can implement.
//! 2. `map`: the data that all solvers read. `Settings` in `map/family` holds every constant that differs between maps and images.
//!    `input`: what all steps of `joint` read.
//! 3. `consensus`, `joint`, `ranking` and `beliefs`: the steps of our attack. `anchors`: start and layout of rays from anchors.
//! 4. `delta`: the choice of the distance that decides support.
//! 5. `exact`: coordinates that a rule of the scheme fixes. `confidence`: the probability that an estimate is right.
//! 6. `problem`: the steps in their order. `records_alone`: attacks without neighborhoods. `baselines`: published attacks.
//!
//! [`recover`] runs the whole attack.

mod anchors;
mod assignment;
mod baselines;
mod beliefs;
mod confidence;
mod consensus;
mod delta;
mod exact;
mod input;
mod joint;
mod map;
mod options;
mod placement;
mod problem;
mod ranking;
mod records_alone;
mod result;
mod solver;

pub use options::{Delta, RecoverOptions};
pub use records_alone::records_alone;
pub use result::{Confidence, Estimate, Recovered, Status, TrialHistogram, Unknown};
pub use solver::{Builtin, Solver};

use crate::Error;
use crate::compiled::Both;
use crate::neighbors::Neighborhoods;
use crate::released::Released;
use problem::{Problem, check_lists};

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
    check_lists(released, lists)?;
    options.check()?;
    let recovered = solver.recover(released, lists, options)?;
    if recovered.n_slots() == released.n_slots() {
        return Ok(recovered);
    }
    let expected = format!("{} positions, one per slot", released.n_slots());
    let found = recovered.n_slots().to_string();
    Err(Error::new("solver", expected, found).within(solver.name()))
}

impl<const D: usize> Solver<D> for Builtin {
    fn name(&self) -> &str {
        Self::name(self)
    }

    fn recover(
        &self,
        released: &Released<D>,
        lists: &Neighborhoods,
        options: &RecoverOptions,
    ) -> Result<Recovered<D>, Error> {
        let solve: Solve<D> = SOLVE.of()?;
        solve(*self, released, lists, options)
    }

    fn reads_lists(&self) -> bool {
        Self::FROM_LISTS.contains(self)
    }
}

/// Recovers by [`Builtin::Joint`] from known positions of some slots. Positions that are more likely right than wrong, by
/// the confidence in `known`, stay as they are until exact constraints apply (`cp2d`). The result has no confidence.
///
/// # Errors
/// When options are out of range, the lists do not have one row per slot, or `known` belongs to another map.
pub fn recover_from<const D: usize>(
    known: &Recovered<D>,
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<Recovered<D>, Error> {
    released.fingerprint().expect(known.about().map)?;
    let problem = Problem::new(released, lists, Builtin::Joint, options)?;
    let known: Vec<_> = (0..problem.n_slots()).map(|slot| known.sure_estimate(slot)).collect();
    problem.finish(problem.joint(problem.start(), &known))
}

type Solve<const D: usize> =
    fn(Builtin, &Released<D>, &Neighborhoods, &RecoverOptions) -> Result<Recovered<D>, Error>;

static SOLVE: Both<Solve<2>, Solve<3>> = Both(solve::<2>, solve::<3>);

fn solve<const D: usize>(
    solver: Builtin,
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<Recovered<D>, Error> {
    let problem = Problem::new(released, lists, solver, options)?;
    problem.finish(problem.joint(problem.start(), &[]))
}
