//! Audits of one map, in the clear or obfuscated by another program: its result, the parts of a plan without a row, and times.

use std::sync::Arc;
use std::time::Instant;

use super::break_even::{BreakEven, break_even};
use super::cells::{Owned, Rows, of_item};
use super::lists::Kept;
use super::observer::Observer;
use super::plan::{Plan, Variant};
use super::row::Row;
use crate::compiled::Both;
use crate::evaluate::belongs;
use crate::geometry::frame::Bounds;
use crate::neighbors::oracle;
use crate::neighbors::oracle::Noise;
use crate::obfuscate::{Lifted, Scheme};
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{DropReason, Original, Secret};
use crate::{Descriptors, Error};

/// Result of an audit.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// One row per scheme, source, noise model, inlier ratio and solver, in this order. Rows of
    /// many items are over the points of all.
    pub rows: Vec<Row>,
    /// Parts of the plan without a row: schemes that cannot be applied to the map, and sources
    /// without lists for a scheme.
    pub not_audited: Vec<NotAudited>,
    /// Break-even ratios per scheme, noise model and solver.
    pub break_even: Vec<BreakEven>,
    /// Number of maps or images, including those without points.
    pub n_items: usize,
    /// Number of items with at most K points: their lists are shorter than K.
    pub n_too_small: usize,
    /// Time per stage.
    pub seconds: Seconds,
}

/// Runs `plan` on a map. `descriptors` has one row per original.
///
/// Rows depend only on the map, the descriptors and the plan: byte-identical for any number of
/// threads. A scheme that cannot be applied to the map has no rows and is listed in
/// [`not_audited`](Outcome::not_audited).
///
/// # Errors
/// When the plan does not fit the map, no scheme can be applied to it, or the observer stops the audit.
pub fn run<const D: usize>(
    original: &Original<D>,
    descriptors: Option<&Descriptors>,
    plan: &Plan<D>,
    observer: &mut dyn Observer<D>,
) -> Result<Outcome, Error> {
    let one: One<D> = ONE.of()?;
    one(original, descriptors, plan, observer)
}

type One<const D: usize> = fn(
    &Original<D>,
    Option<&Descriptors>,
    &Plan<D>,
    &mut dyn Observer<D>,
) -> Result<Outcome, Error>;

static ONE: Both<One<2>, One<3>> = Both(one::<2>, one::<3>);

fn one<const D: usize>(
    original: &Original<D>,
    descriptors: Option<&Descriptors>,
    plan: &Plan<D>,
    observer: &mut dyn Observer<D>,
) -> Result<Outcome, Error> {
    plan.check(original.len(), descriptors.is_some())?;
    every_cell((original, descriptors), None, plan, observer)
}

/// Runs every cell of `plan`. If `hidden` is given, it is the obfuscation for the plan's only
/// scheme.
pub(super) fn every_cell<const D: usize>(
    (original, descriptors): (&Original<D>, Option<&Descriptors>),
    hidden: Option<&(Released<D>, Secret)>,
    plan: &Plan<D>,
    observer: &mut dyn Observer<D>,
) -> Result<Outcome, Error> {
    let mut clock = Clock::default();
    let search = clock.time(|s| &mut s.search, || oracle::search(original))?;
    let owned = Owned {
        original,
        descriptors,
        hidden,
        search: &search,
        kept: &Kept::default(),
        name: None,
    };
    let Rows { rows, seconds, not_audited } =
        of_item(&owned, plan, &mut clock, observer, &mut |_| ())?;
    if let (true, Some(first)) = (rows.is_empty(), not_audited.first()) {
        return Err(none_applies(first));
    }
    let break_even = break_even(plan, &rows);
    let seconds = Seconds { rows: seconds, ..clock.seconds };
    Ok(Outcome { rows, not_audited, break_even, n_items: 1, n_too_small: 0, seconds })
}

pub(super) fn none_applies(first: &NotAudited) -> Error {
    let found = format!("none: {}: {}", first.scheme, first.reason);
    Error::new("schemes", "one that can be applied to this map", found)
}

/// A scheme whose rule is unknown, because another program hid the points.
#[derive(Debug)]
struct Unknown {
    name: String,
}

impl<const D: usize> Scheme<D> for Unknown {
    fn name(&self) -> &str {
        &self.name
    }

    fn lift(&self, _: &[[f64; D]], _: Option<&Bounds<D>>, _: &Key) -> Result<Lifted<D>, Error> {
        Err(Error::new("scheme", "one that unlift can apply", "a scheme of another program"))
    }
}

/// Returns a placeholder for the scheme called `name` in a plan for [`run_released`].
pub fn scheme_called<const D: usize>(name: &str) -> Arc<dyn Scheme<D>> {
    Arc::new(Unknown { name: name.to_owned() })
}

/// Runs `plan` on given records and their secret. The plan's only scheme comes from
/// [`scheme_called`].
///
/// The records must be of the points `original`, in the same frame and unit. Repeats differ only in
/// the seeds of the oracle and the attacker.
///
/// # Errors
/// When the plan does not fit the map, or when the three do not belong together: wrong ground truth
/// would make the map look safe.
pub fn run_released(
    original: &Original<3>,
    hidden: &(Released<3>, Secret),
    plan: &Plan<3>,
    observer: &mut dyn Observer<3>,
) -> Result<Outcome, Error> {
    let (released, secret) = hidden;
    plan.check(original.len(), released.descriptors().is_some())?;
    belongs(original, released, secret)?;
    every_cell((original, None), Some(hidden), plan, observer)
}

/// A scheme, or a scheme with one source, that could not be audited. It has no row, because an
/// unknown value must not look like a small one.
#[derive(Clone, Debug, PartialEq)]
pub struct NotAudited {
    /// Scheme name.
    pub scheme: String,
    /// Source without lists, as in [`Row::neighbors`](super::Row::neighbors); `None` if the scheme
    /// has no rows at all.
    pub neighbors: Option<String>,
    /// Noise model, if the source is the oracle.
    pub oracle_noise: Option<&'static str>,
    /// Inlier ratio requested of the oracle.
    pub inlier_ratio: Option<f64>,
    /// Error message: what was expected and what was found.
    pub reason: String,
}

impl NotAudited {
    pub(super) fn scheme(scheme: &str, error: &Error) -> Self {
        Self {
            scheme: scheme.to_owned(),
            neighbors: None,
            oracle_noise: None,
            inlier_ratio: None,
            reason: error.to_string(),
        }
    }

    pub(super) fn variant<const D: usize>(
        scheme: &str,
        variant: &Variant<'_, D>,
        error: &Error,
        secret: &Secret,
    ) -> Self {
        let mut reason = error.to_string();
        let (left, all) = (secret.dropped().len(), secret.n_originals());
        if left > 0 {
            let why = DropReason::ALL
                .map(|why| (why, secret.dropped().iter().filter(|d| d.reason == why).count()));
            let most = why.into_iter().max_by_key(|(_, n)| *n).map_or("", |(why, _)| why.name());
            let most = most.replace('_', " ");
            reason.push_str(&format!(
                " ({scheme} leaves out {left} of {all} points, most of them as {most})"
            ));
        }
        Self {
            scheme: scheme.to_owned(),
            neighbors: Some(variant.by.name().to_owned()),
            oracle_noise: variant.noise.map(Noise::name),
            inlier_ratio: variant.inlier_ratio,
            reason,
        }
    }

    /// Returns true if both have the same scheme and variant. Reasons are not compared.
    pub(super) fn is_same_cell(&self, other: &Self) -> bool {
        self.scheme == other.scheme
            && self.neighbors == other.neighbors
            && self.oracle_noise == other.oracle_noise
            && self.inlier_ratio == other.inlier_ratio
    }
}

/// Shortens `missing` of one scheme: a scheme without rows that failed for a single reason becomes
/// one entry.
pub(super) fn told(missing: Vec<NotAudited>, has_rows: bool) -> Vec<NotAudited> {
    match missing.first() {
        Some(first) if !has_rows && missing.iter().all(|m| m.reason == first.reason) => {
            let (scheme, reason) = (first.scheme.clone(), first.reason.clone());
            let (neighbors, oracle_noise, inlier_ratio) = (None, None, None);
            vec![NotAudited { scheme, neighbors, oracle_noise, inlier_ratio, reason }]
        }
        _ => missing,
    }
}

/// Seconds per stage. They are not part of the results.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Seconds {
    /// Search of the originals' nearest neighbors.
    pub search: f64,
    /// Obfuscation, over all schemes and repeats.
    pub obfuscate: f64,
    /// Making of neighborhoods.
    pub neighbors: f64,
    /// Recovery.
    pub recover: f64,
    /// Attacks on the records alone, with their evaluation.
    pub records_alone: f64,
    /// Evaluation, including the blind baseline.
    pub evaluate: f64,
    /// Seconds per row, summed over repeats.
    pub rows: Vec<RowSeconds>,
}

/// Seconds of one row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RowSeconds {
    /// Making of its neighborhoods; 0 if another solver's row contains this time.
    pub neighbors: f64,
    /// Recovery.
    pub recover: f64,
}

impl RowSeconds {
    pub(super) fn add(&mut self, more: &Self) {
        self.neighbors += more.neighbors;
        self.recover += more.recover;
    }
}

#[derive(Default)]
pub(super) struct Clock {
    pub(super) seconds: Seconds,
}

impl Clock {
    pub(super) fn time<T>(
        &mut self,
        stage: impl Fn(&mut Seconds) -> &mut f64,
        work: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let started = Instant::now();
        let result = work();
        *stage(&mut self.seconds) += started.elapsed().as_secs_f64();
        result
    }

    /// Adds the stages of another clock, without the seconds per row.
    pub(super) fn merge(&mut self, more: &Self) {
        let (to, more) = (&mut self.seconds, &more.seconds);
        to.search += more.search;
        to.obfuscate += more.obfuscate;
        to.neighbors += more.neighbors;
        to.recover += more.recover;
        to.records_alone += more.records_alone;
        to.evaluate += more.evaluate;
    }
}
