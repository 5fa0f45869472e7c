//! The attacker: records and neighborhoods in, positions out. Never imports `truth`.
//!
//! In order, a file or a folder per step, each of which imports only what stands above it and `map`:
//!
//! 1. `options`: what a user may choose; `result`: what comes out.
//! 2. `map`: records, lists and places as solvers read them; `map/settings` is all that differs between maps and images.
//! 3. Solvers, each of which implements the trait of `solve`: `consensus`, `joint`, `placement`, and those of `baselines`.
//! 4. `delta`: the distance that decides support, chosen by how well consensus then does.
//! 5. `exact`: coordinates that a rule of the scheme fixes. `confidence`: how sure the attacker is.
//!    `pairs_of_descriptors`: whose descriptor is whose on a paired line.
//! 6. `checks`: what goes together. `learned`: what is learned of a map. `records`: records with their lists as solvers read them. `task`: model, records and lists together, solved in any parts; `rounds`: joint
//!    recovery one round at a time; `kept`: where they stand, for a run that goes on; `parts`: consensus where each part has its own lists alone; `spread`: joint recovery where each has its own
//!    edges alone.
//!
//! [`prepare`] learns a model, [`Task`] solves with it, and [`recover`] does both.

mod baselines;
mod checks;
mod confidence;
mod consensus;
mod delta;
mod exact;
mod joint;
mod kept;
mod learned;
mod map;
mod options;
mod pairs_of_descriptors;
mod parts;
mod placement;
mod records;
mod result;
mod rounds;
mod solve;
mod spread;
mod task;

pub(crate) use baselines::density::published;
#[doc(hidden)]
pub use confidence::model::{N_KINDS, N_TERMS, centered, terms};
#[doc(hidden)]
pub use confidence::seen::{Cues, Seen};
pub use joint::Outline;
pub use kept::{Kept, Nowhere};
pub use learned::Model;
pub use map::part_edges::{Edges, NamedBy};
pub use options::{Delta, RecoverOptions, Solver};
pub use parts::Part;
pub use result::estimate::{Estimate, Status};
pub use result::probability::Confidence;
pub use result::recovered::Recovered;
pub use result::trials::TrialHistogram;
pub use result::unknown::Unknown;
pub use rounds::Rounds;
pub use solve::Moved;
pub use spread::lead::Lead;
pub use task::Task;

use crate::compiled::{no_such, which};
use crate::density::Peaks;
use crate::neighbors::{Listing, Neighborhoods, ShelvedLists};
use crate::released::{Obfuscation, Released};
use crate::{About, Error, RowOrder, Shelf};
use placement::Placement;
use solve::Solve;

/// What is learned of `released` with the help of `lists` before any point is placed.
///
/// # Errors
/// When options are out of range, or the lists do not have one row per slot.
pub fn prepare<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<Model<D>, Error> {
    Task::learn(released, lists, options).map(|task| task.model())
}

/// [`prepare`] for rounds whose edges are spread, by [`Solver::Joint`]: beside the model what their [`Lead`] must know of the edges.
///
/// # Errors
/// As of [`prepare`], and for another solver.
pub fn prepare_rounds<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(Model<D>, Outline), Error> {
    let task = Task::learn(released, lists, options)?;
    Ok((task.model(), task.outline()?))
}

/// [`prepare_rounds`] with lists that do not fit into memory: the same.
///
/// # Errors
/// As there, for rays from anchors in regions, and when files cannot be read or written.
pub fn prepare_rounds_shelved<const D: usize>(
    released: &Released<D>,
    lists: &ShelvedLists,
    options: &RecoverOptions,
    shelf: &dyn Shelf,
) -> Result<(Model<D>, Outline), Error> {
    let task = Task::learn_shelved(released, (lists, shelf), options)?;
    Ok((task.model(), task.outline()?))
}

/// [`prepare`] with lists that do not fit into memory: the same model. By a solver that [reads them](Solver::reads_shelved).
///
/// # Errors
/// As there, for another solver, for rays from anchors in regions, and when files cannot be read or written.
pub fn prepare_shelved<const D: usize>(
    released: &Released<D>,
    lists: &ShelvedLists,
    options: &RecoverOptions,
    shelf: &dyn Shelf,
) -> Result<Model<D>, Error> {
    Task::learn_shelved(released, (lists, shelf), options).map(|task| task.model())
}

/// Recovers the hidden points of `released` with the help of `lists`: `R` of Eq. (3).
///
/// The result depends on the records, the neighborhoods and the options alone, not on threads. It is that of [`prepare`]
/// and [`Task`], however many parts the latter is solved in.
///
/// # Errors
/// When options are out of range, or the lists do not have one row per slot.
pub fn recover<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<Recovered<D>, Error> {
    let compiled = which(&(at_once::<2> as AtOnce<2>), &(at_once::<3> as AtOnce<3>));
    let at_once: AtOnce<D> = compiled.ok_or_else(no_such::<D>)?;
    at_once(released, lists, options)
}

type AtOnce<const D: usize> =
    fn(&Released<D>, &Neighborhoods, &RecoverOptions) -> Result<Recovered<D>, Error>;

fn at_once<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<Recovered<D>, Error> {
    let task = Task::learn(released, lists, options)?;
    let start = task.solve(0..task.n_slots())?;
    task.finish(task.go_on(start)?)
}

/// [`recover`] by [`Solver::Joint`], and beside it the pass that it starts from: bit for bit what
/// [`Solver::JointStart`] gives, without a run of its own.
///
/// # Errors
/// As there, and when `options` ask for another solver.
pub fn recover_with_start<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(Recovered<D>, Recovered<D>), Error> {
    let compiled = which(&(with_start::<2> as WithStart<2>), &(with_start::<3> as WithStart<3>));
    let with_start: WithStart<D> = compiled.ok_or_else(no_such::<D>)?;
    with_start(released, lists, options)
}

/// [`recover`] with lists that do not fit into memory: the same, bit for bit. By a solver that [reads them](Solver::reads_shelved).
///
/// In memory are the records, and of each slot some 150 bytes (estimates, places, what rounds keep), beside a few windows of
/// `shelf`. Lists are read once per round, and who lists whom is put on `shelf`: 10 to 15 bytes an entry (one slot per record, two), and eight more
/// at first.
///
/// # Errors
/// As there, for another solver, for rays from anchors in regions, and when files cannot be read or written.
pub fn recover_shelved<const D: usize>(
    released: &Released<D>,
    lists: &ShelvedLists,
    options: &RecoverOptions,
    shelf: &dyn Shelf,
) -> Result<Recovered<D>, Error> {
    let compiled = which(&(shelved::<2> as Shelved<2>), &(shelved::<3> as Shelved<3>));
    let shelved: Shelved<D> = compiled.ok_or_else(no_such::<D>)?;
    shelved(released, lists, options, shelf)
}

type Shelved<const D: usize> =
    fn(&Released<D>, &ShelvedLists, &RecoverOptions, &dyn Shelf) -> Result<Recovered<D>, Error>;

fn shelved<const D: usize>(
    released: &Released<D>,
    lists: &ShelvedLists,
    options: &RecoverOptions,
    shelf: &dyn Shelf,
) -> Result<Recovered<D>, Error> {
    let task = Task::learn_shelved(released, (lists, shelf), options)?;
    let start = task.solve(0..task.n_slots())?;
    task.finish(task.go_on(start)?)
}

/// [`recover`] or [`recover_shelved`], as `lists` are in memory or on `shelf`, that goes on from where the rounds stood that were `kept`: the
/// same, bit for bit. Rounds that begin anew from where a rule of the scheme moved slots (`cp2d`) are not kept.
///
/// # Errors
/// As there, when lists are on a shelf and none is given, and when what was kept is not of this map and solver.
pub fn recover_kept<const D: usize>(
    released: &Released<D>,
    (lists, shelf): (&Listing, Option<&dyn Shelf>),
    options: &RecoverOptions,
    kept: &mut dyn Kept,
) -> Result<Recovered<D>, Error> {
    let compiled = which(&(go_on::<2> as GoOn<2>), &(go_on::<3> as GoOn<3>));
    let go_on: GoOn<D> = compiled.ok_or_else(no_such::<D>)?;
    go_on(released, (lists, shelf), options, kept)
}

type GoOn<const D: usize> = fn(
    &Released<D>,
    (&Listing, Option<&dyn Shelf>),
    &RecoverOptions,
    &mut dyn Kept,
) -> Result<Recovered<D>, Error>;

fn go_on<const D: usize>(
    released: &Released<D>,
    (lists, shelf): (&Listing, Option<&dyn Shelf>),
    options: &RecoverOptions,
    kept: &mut dyn Kept,
) -> Result<Recovered<D>, Error> {
    let task = match (lists, shelf) {
        (Listing::Here(lists), _) => Task::learn(released, lists, options)?,
        (Listing::Away(lists), Some(shelf)) => {
            Task::learn_shelved(released, (lists, shelf), options)?
        }
        (Listing::Away(_), None) => {
            return Err(Error::new("lists", "a shelf that they are on", "none"));
        }
    };
    task.finish(task.run(kept)?)
}

/// [`recover_with_start`] with lists that do not fit into memory: the same, bit for bit.
///
/// # Errors
/// As there, and as of [`recover_shelved`].
pub fn recover_shelved_with_start<const D: usize>(
    released: &Released<D>,
    lists: &ShelvedLists,
    options: &RecoverOptions,
    shelf: &dyn Shelf,
) -> Result<(Recovered<D>, Recovered<D>), Error> {
    let compiled = which(
        &(shelved_with_start::<2> as ShelvedWithStart<2>),
        &(shelved_with_start::<3> as ShelvedWithStart<3>),
    );
    let shelved: ShelvedWithStart<D> = compiled.ok_or_else(no_such::<D>)?;
    shelved(released, lists, options, shelf)
}

type ShelvedWithStart<const D: usize> = fn(
    &Released<D>,
    &ShelvedLists,
    &RecoverOptions,
    &dyn Shelf,
) -> Result<(Recovered<D>, Recovered<D>), Error>;

fn shelved_with_start<const D: usize>(
    released: &Released<D>,
    lists: &ShelvedLists,
    options: &RecoverOptions,
    shelf: &dyn Shelf,
) -> Result<(Recovered<D>, Recovered<D>), Error> {
    both(&Task::learn_shelved(released, (lists, shelf), options)?, options)
}

type WithStart<const D: usize> = fn(
    &Released<D>,
    &Neighborhoods,
    &RecoverOptions,
) -> Result<(Recovered<D>, Recovered<D>), Error>;

fn with_start<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(Recovered<D>, Recovered<D>), Error> {
    both(&Task::learn(released, lists, options)?, options)
}

/// What came back, and where it started.
fn both<const D: usize>(
    task: &Task<'_, D>,
    options: &RecoverOptions,
) -> Result<(Recovered<D>, Recovered<D>), Error> {
    if options.solver != Solver::Joint {
        return Err(Error::new("solver", Solver::Joint.name(), options.solver.name()));
    }
    let start = task.solve(0..task.n_slots())?;
    let recovered = task.finish(task.go_on(start.clone())?)?;
    let start = task.finish_start(start, &recovered)?;
    Ok((recovered, start))
}

/// [`recover`], with what confidence is made of. For fitting it alone.
///
/// # Errors
/// As there.
#[doc(hidden)]
pub fn recover_and_look<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(Recovered<D>, Seen), Error> {
    let compiled = which(&(and_look::<2> as AndLook<2>), &(and_look::<3> as AndLook<3>));
    let and_look: AndLook<D> = compiled.ok_or_else(no_such::<D>)?;
    and_look(released, lists, options)
}

type AndLook<const D: usize> =
    fn(&Released<D>, &Neighborhoods, &RecoverOptions) -> Result<(Recovered<D>, Seen), Error>;

fn and_look<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(Recovered<D>, Seen), Error> {
    let task = Task::learn(released, lists, options)?;
    let start = task.solve(0..task.n_slots())?;
    task.finish_and_look(task.go_on(start)?)
}

/// The positions at which `peaks` puts the hidden points: which of a paired line's is whose is not known.
///
/// # Errors
/// When there is not one peak, or none, per slot.
pub(crate) fn recover_at<const D: usize>(
    released: &Released<D>,
    peaks: &Peaks,
) -> Result<Recovered<D>, Error> {
    let (n_records, slots) = (released.n_records(), released.slots_per_record());
    let none =
        Neighborhoods::try_new(vec![0; n_records * slots + 1], Vec::new(), None, n_records, slots)?;
    let estimates = Placement::new(released, &none, peaks).solve(0..released.n_slots())?;
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    let delta = placement::delta(peaks);
    let about =
        About { map: Some(released.fingerprint()), order: RowOrder::Either, ..About::default() };
    Ok(Recovered::try_new(&estimates, with_axis, None, origin, unit, delta)?.with_about(about))
}
