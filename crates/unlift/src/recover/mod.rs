//! The attacker: records and neighborhoods in, positions out. Never imports `truth`.

mod assign;
mod candidate_rows;
mod chance;
mod chance_field;
mod chunks;
mod confidence;
mod consensus;
mod delta;
mod density;
mod exact;
mod family;
mod grid;
mod joint;
mod line_rows;
mod lists;
mod options;
mod plane_windows;
mod ransac;
mod recovered;
mod sections;

pub use confidence::Confidence;
#[doc(hidden)]
pub use confidence::{Cues, N_TERMS, Seen, centered, terms};
pub use options::{Delta, RecoverOptions, Solver};
pub use ransac::TrialHistogram;
pub(crate) use recovered::stored_support;
pub use recovered::{Estimate, Recovered, Status};

use crate::Error;
use crate::density::{published, tomography};
use crate::neighbors::Neighborhoods;
use crate::released::{Obfuscation, Released};
use chunks::Chunks;
use confidence::Solved;
use delta::Prefer;
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
    recover_and_look(released, lists, options).map(|found| found.0)
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
    options.check()?;
    if lists.n_slots() != released.n_slots() {
        let expected = format!("{} rows, one per slot", released.n_slots());
        return Err(Error::new("neighborhoods", expected, lists.n_slots().to_string()));
    }
    let descriptor_row = assign::descriptor_rows(released, lists);
    let peaks = match options.solver {
        Solver::Density => Some(published(released)),
        Solver::Tomography => Some(tomography(released)),
        Solver::Consensus | Solver::Joint | Solver::Ransac => None,
    };
    if let Some(peaks) = peaks {
        // Nothing is known yet about how sure these are.
        let placed = density::place(released, lists, &peaks, descriptor_row)?;
        return Ok((placed, Seen::NOTHING));
    }
    let family = Family::new(released, lists);
    // Joint recovery also asks who lists whom, from the first pass on.
    let graph = (options.solver == Solver::Joint)
        .then(|| joint::Graph::new(lists, released.slots_per_record()));
    let both_ways = match &graph {
        Some(graph) if released.slots_per_record() == 1 => Some(graph.neighborhoods()?),
        _ => None,
    };
    let used = both_ways.as_ref().unwrap_or(lists);
    let prefer = if graph.is_some() { Prefer::Narrow } else { Prefer::Wide };
    let delta = match options.delta {
        Delta::Fixed(delta) => delta,
        Delta::Auto => delta::choose(&family, used, prefer, options.seed).unwrap_or(1.0),
    };
    let consensus = || consensus::solve(&family, Lists::given(used), delta as f32, Chunks::All);
    let (estimates, trials) = match (options.solver, &graph) {
        (Solver::Joint, Some(graph)) => {
            (joint::solve(&family, graph, consensus(), delta as f32, options.seed), None)
        }
        (Solver::Ransac, _) => {
            let (solved, trials) = ransac::solve(&family, lists, delta as f32, options.seed);
            (solved, Some(trials))
        }
        _ => (consensus(), None),
    };
    // The paper's loop stays as published.
    let exact = options.exact_constraints && options.solver != Solver::Ransac;
    let settled = (exact && exact::can_settle(released))
        .then(|| exact::settle(released, estimates.clone(), delta as f32));
    let unsettled = &estimates;
    let estimates = settled.as_ref().unwrap_or(unsettled);
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    let recovered = Recovered::try_new(estimates, with_axis, descriptor_row, origin, unit, delta)?
        .with_trials(trials);
    // Its constants come from maps: in images nobody has compared them with what comes true.
    if !options.confidence || D == 2 {
        return Ok((recovered, Seen::NOTHING));
    }
    let edges = (graph.as_ref(), lists);
    let solved = Solved { estimates, unsettled, delta: delta as f32 };
    let seen = confidence::look(&family, edges, released.slots_per_record(), &solved);
    let confidence = confidence::of(&family, options.solver, estimates, &seen);
    Ok((recovered.with_confidence(confidence)?, seen))
}
