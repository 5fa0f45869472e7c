//! The attacker: records and neighborhoods in, positions out. Never imports `truth`.
//!
//! In order, a file or a folder per step, each of which imports only what stands above it and `map`:
//!
//! 1. `options`: what a user may choose; `result`: what comes out; `solver`: the trait that you implement for a solver of your own.
//! 2. `map`: records, lists and places as solvers read them; `Settings` (in `map/family`) is all that differs between maps and images.
//! 3. Solvers: `consensus` and `joint`; `ransac` and `published_density` are attacks as published, for comparison.
//! 4. `delta`: the distance that decides support, chosen by how well consensus then does.
//! 5. `exact`: coordinates that a rule of the scheme fixes. `confidence`: how sure the attacker is.
//! 6. `problem`: a released map with its lists, solved and finished, at once or in parts by consensus. `model`: what parts must know of the
//!    whole map. `records_alone`: attacks without neighborhoods.
//!
//! [`recover`] is the whole attack. [`prepare`] learns a [`Model`], with which parts of a map are solved elsewhere.

mod assignment;
mod confidence;
mod consensus;
mod delta;
mod exact;
mod joint;
mod map;
mod model;
mod options;
mod problem;
mod published_density;
mod ransac;
mod records_alone;
mod result;
mod solver;

#[doc(hidden)]
pub use confidence::cues::{Cues, Seen};
#[doc(hidden)]
pub use confidence::{N_KINDS, N_TERMS, centered, terms};
pub use model::Model;
pub use options::{Delta, RecoverOptions};
pub use problem::Part;
pub use records_alone::records_alone;
pub use result::{Confidence, Estimate, Recovered, Status, TrialHistogram, Unknown};
pub use solver::{Builtin, Solver};

use crate::Error;
use crate::compiled::Both;
use crate::neighbors::Neighborhoods;
use crate::released::Released;
use problem::{Problem, check_lists};

/// Learns what consensus must know of `released` and all of its `lists` before any point is placed.
///
/// # Errors
/// When options are out of range, or the lists do not have one row per slot.
pub fn prepare<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<Model<D>, Error> {
    Problem::new(released, lists, Builtin::Consensus, options)?.model()
}

/// Recovers the hidden points of `released` with the help of `lists` by `solver`: `R` of Eq. (3).
///
/// The result depends on the records, the neighborhoods and the options alone, not on threads.
///
/// # Errors
/// When options are out of range, the lists do not have one row per slot, or the solver fails or does not answer for every slot.
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
        solve(*self, released, lists, options, false).map(|(recovered, _)| recovered)
    }

    fn reads_lists(&self) -> bool {
        Self::FROM_LISTS.contains(self)
    }
}

/// Recovers by [`Builtin::Joint`] and returns beside it the pass that it starts from: bit for bit what [`Builtin::JointStart`]
/// gives, without a run of its own.
///
/// # Errors
/// When options are out of range, or the lists do not have one row per slot.
pub fn recover_with_start<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(Recovered<D>, Recovered<D>), Error> {
    let with_start: WithStart<D> = WITH_START.of()?;
    with_start(released, lists, options)
}

type WithStart<const D: usize> = fn(
    &Released<D>,
    &Neighborhoods,
    &RecoverOptions,
) -> Result<(Recovered<D>, Recovered<D>), Error>;

static WITH_START: Both<WithStart<2>, WithStart<3>> = Both(with_start::<2>, with_start::<3>);

fn with_start<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(Recovered<D>, Recovered<D>), Error> {
    let problem = Problem::new(released, lists, Builtin::Joint, options)?;
    let start = problem.solve(0..problem.n_slots());
    let (recovered, _) = problem.finish(problem.run_joint(start.clone()), false)?;
    let start = problem.finish_start(start, &recovered)?;
    Ok((recovered, start))
}

/// Recovers by [`Builtin::Joint`] and returns beside it what confidence is made of, for fitting it.
///
/// # Errors
/// When options are out of range, or the lists do not have one row per slot.
#[doc(hidden)]
pub fn recover_and_look<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(Recovered<D>, Seen), Error> {
    let solve: Solve<D> = SOLVE.of()?;
    solve(Builtin::Joint, released, lists, options, true)
}

type Solve<const D: usize> = fn(
    Builtin,
    &Released<D>,
    &Neighborhoods,
    &RecoverOptions,
    bool,
) -> Result<(Recovered<D>, Seen), Error>;

static SOLVE: Both<Solve<2>, Solve<3>> = Both(solve::<2>, solve::<3>);

fn solve<const D: usize>(
    solver: Builtin,
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
    want_features: bool,
) -> Result<(Recovered<D>, Seen), Error> {
    let problem = Problem::new(released, lists, solver, options)?;
    let start = problem.solve(0..problem.n_slots());
    problem.finish(problem.run_joint(start), want_features)
}
