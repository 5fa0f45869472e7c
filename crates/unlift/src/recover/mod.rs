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
mod lanes;
mod line_rows;
mod lists;
mod options;
mod plane_windows;
mod ransac;
mod recovered;
mod sections;
mod unknown;

pub use confidence::Confidence;
#[doc(hidden)]
pub use confidence::{Cues, N_KINDS, N_TERMS, Seen, centered, terms};
pub use options::{Delta, RecoverOptions, Solver};
pub use ransac::TrialHistogram;
pub(crate) use recovered::stored_support;
pub use recovered::{Estimate, Recovered, Status};
pub use unknown::Unknown;

use crate::density::{Peaks, published, tomography};
use crate::neighbors::Neighborhoods;
use crate::released::{Obfuscation, Released};
use crate::{About, Error, RowOrder};
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
    solve(released, lists, options, false).map(|found| found.recovered)
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
    let found = solve(released, lists, options, true)?;
    match found.start {
        Some(start) => Ok((found.recovered, start)),
        None => Err(Error::new("solver", Solver::Joint.name(), options.solver.name())),
    }
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
    let about = About { map: Some(released.fingerprint()), order: RowOrder::Either };
    Ok(density::place(released, &none, peaks, None)?.with_about(about))
}

/// The least delta tried in an image, as a share of the spacing of points. A fifth of the keypoints have a
/// twin at the same place, and coordinates may be whole numbers: such records agree exactly, so that
/// the evidence of a few slots grows without end as delta shrinks. But the neighbors that a list names
/// are farther apart than that.
const LEAST_DELTA: f64 = 0.25;
/// Delta for rays from anchors, as a share of the spacing of points.
const ANCHOR_DELTA: f64 = 1.75;
/// Partners in an image are looked for within this many deltas.
const EXACT_REACH: f64 = 4.0;
/// How far apart points would be if they were spread evenly over known bounds; 0 without bounds.
fn spacing<const D: usize>(released: &Released<D>) -> f64 {
    let Some(bounds) = released.bounds() else { return 0.0 };
    let volume: f64 = (0..D).map(|c| bounds.high[c] - bounds.low[c]).product();
    libm::pow(volume / released.n_slots().max(1) as f64, 1.0 / D as f64)
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
    solve(released, lists, options, false).map(|found| (found.recovered, found.seen))
}

/// What one run leaves behind.
struct Found<const D: usize> {
    recovered: Recovered<D>,
    seen: Seen,
    /// Where joint recovery started, if it was to be kept.
    start: Option<Recovered<D>>,
}

impl<const D: usize> Found<D> {
    /// Positions of which nobody knows how sure they are.
    fn without_confidence(recovered: Recovered<D>, unknown: Unknown) -> Self {
        let recovered = recovered.without_confidence(unknown);
        Self { recovered, seen: Seen::NOTHING, start: None }
    }
}

fn solve<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
    keep_start: bool,
) -> Result<Found<D>, Error> {
    options.check()?;
    if lists.n_slots() != released.n_slots() {
        let expected = format!("{} rows, one per slot", released.n_slots());
        return Err(Error::new("neighborhoods", expected, lists.n_slots().to_string()));
    }
    // Lists of another map may have as many rows.
    let n_records = released.n_records();
    if let Some(record) = lists.records().iter().find(|record| record.index() >= n_records) {
        let expected = format!("records below {n_records}");
        return Err(Error::new("neighborhoods", expected, record.0.to_string()));
    }
    let map = released.fingerprint();
    map.expect(lists.about().map)?;
    let about = About { map: Some(map), order: lists.about().order };
    let descriptor_row = assign::descriptor_rows(released, lists);
    let peaks = match options.solver {
        Solver::Density => Some(published(released)),
        Solver::Tomography => Some(tomography(released)),
        Solver::Consensus | Solver::Joint | Solver::JointStart | Solver::Ransac => None,
    };
    if let Some(peaks) = peaks {
        let placed = density::place(released, lists, &peaks, descriptor_row)?.with_about(about);
        return Ok(Found::without_confidence(placed, Unknown::FromRecordsAlone));
    }
    let family = Family::new(released, lists);
    // Joint recovery also asks who lists whom, from the first pass on.
    let graph = matches!(options.solver, Solver::Joint | Solver::JointStart)
        .then(|| joint::Graph::new(lists, released.slots_per_record()));
    let both_ways = match &graph {
        Some(graph) if released.slots_per_record() == 1 => Some(graph.neighborhoods()?),
        _ => None,
    };
    let used = both_ways.as_ref().unwrap_or(lists);
    let prefer = match &family {
        _ if graph.is_none() => Prefer::Wide,
        Family::Candidates { .. } if D == 2 => Prefer::Narrowest,
        _ if lists.scores().is_some() => Prefer::NarrowOfScored,
        _ => Prefer::Narrow,
    };
    let spacing = spacing(released);
    let delta = match options.delta {
        Delta::Fixed(delta) => delta,
        // Anchors say nothing at one delta rather than at another.
        Delta::Auto if family.has_regions() => ANCHOR_DELTA * spacing,
        Delta::Auto => {
            let least = LEAST_DELTA * spacing;
            let per_list = lists.records().len() as f64 / lists.n_slots().max(1) as f64;
            let share = per_list / n_records.max(1) as f64;
            delta::choose(&family, used, prefer, (least, share), options.seed).unwrap_or(1.0)
        }
    };
    let consensus = || consensus::solve(&family, Lists::given(used), delta as f32, Chunks::All);
    let mut start = None;
    let (estimates, trials) = match (options.solver, &graph) {
        (Solver::Joint, Some(graph)) => {
            let first = consensus();
            start = keep_start.then(|| first.clone());
            (joint::solve(&family, graph, first, delta as f32, options.seed), None)
        }
        (Solver::Ransac, _) => {
            let (solved, trials) = ransac::solve(&family, lists, delta as f32, options.seed);
            (solved, Some(trials))
        }
        _ => (consensus(), None),
    };
    // In an image delta is narrow and values are few: partners are looked for farther away.
    let exact_reach = if D == 2 { EXACT_REACH * delta } else { delta };
    // The paper's loop stays as published.
    let exact = options.exact_constraints && options.solver != Solver::Ransac;
    let exact = exact && exact::can_settle(released);
    let settle = |estimates| exact::settle(released, estimates, exact_reach as f32);
    let settled = exact.then(|| {
        let mut settled = settle(estimates.clone());
        if let (Solver::Joint, Some(graph)) = (options.solver, &graph) {
            for _ in 0..exact::feeds(released) {
                settled = settle(joint::solve(&family, graph, settled, delta as f32, options.seed));
            }
        }
        settled
    });
    let unsettled = &estimates;
    let estimates = settled.as_ref().unwrap_or(unsettled);
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    let finished = |estimates: &[Estimate<D>]| {
        let descriptor_row = descriptor_row.clone();
        Recovered::try_new(estimates, with_axis, descriptor_row, origin, unit, delta)
            .map(|recovered| recovered.with_about(about))
    };
    let start = match start.map(|first| if exact { settle(first) } else { first }) {
        Some(first) => Some(finished(&first)?.without_confidence(Unknown::FirstPass)),
        None => None,
    };
    let recovered = finished(estimates)?.with_trials(trials);
    let unknown = match options.solver {
        Solver::JointStart => Some(Unknown::FirstPass),
        _ if !options.confidence => Some(Unknown::NotAsked),
        // Its constants come from maps: in images nobody has compared them with what comes true.
        _ if D == 2 => Some(Unknown::OfImages),
        _ => None,
    };
    if let Some(unknown) = unknown {
        return Ok(Found { start, ..Found::without_confidence(recovered, unknown) });
    }
    let edges = (graph.as_ref(), lists);
    let solved = Solved { estimates, unsettled, delta: delta as f32 };
    let seen = confidence::look(&family, edges, released, &solved);
    let recovered = match confidence::unknown(lists) {
        Some(unknown) => recovered.without_confidence(unknown),
        None => {
            let confidence = confidence::of(options.solver, estimates, &seen);
            recovered.with_confidence(confidence)?
        }
    };
    Ok(Found { recovered, seen, start })
}
