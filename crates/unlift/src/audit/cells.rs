//! Cells of an audit: the rows of one scheme and one repeat on one map or image.

use std::borrow::Cow;
use std::time::Instant;

use super::clock::{RowSeconds, Seconds};
use super::lists::{Kept, Lists, Made};
use super::missing::{NotAudited, add_new, shortened};
use super::observer::{Cell, Observer};
use super::plan::{Plan, Variant, key_of, oracle_seed};
use super::row::{Alone, Row, measure, within};
use crate::evaluate::{Accuracy, Truth, blind, distinct_weights, evaluate, joined};
use crate::geometry::knn::Knn;
use crate::neighbors::oracle;
use crate::obfuscate::{Scheme, all, obfuscate};
use crate::recover::{RecoverOptions, Recovered, Solver, recover};
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error, ErrorKind, recover};

/// [Metric](Row::metrics) of an attacker's own lists: the inlier ratio with as many true neighbors as the lists have records.
const RATIO_AT_K: &str = "inlier_ratio_at_k";

/// A map or an image with its ground truth.
pub(super) struct Owned<'a, const D: usize> {
    pub(super) original: &'a Original<D>,
    pub(super) descriptors: Option<&'a Descriptors>,
    /// The released map and its secret if the points are already hidden under the plan's first scheme.
    pub(super) hidden: Option<&'a (Released<D>, Secret)>,
    /// Name of the item, if the audit has several.
    pub(super) name: Option<&'a str>,
}

impl<const D: usize> Owned<'_, D> {
    /// Returns true if the item may have fewer points than a list has entries, as images may.
    fn may_be_small(&self) -> bool {
        self.name.is_some() && D == 2
    }
}

/// Scheme, repeat and randomness of a group of rows, and what all groups of an item share.
struct Run<'a, const D: usize> {
    owned: &'a Owned<'a, D>,
    plan: &'a Plan<D>,
    search: &'a Knn<'a, D>,
    /// Lists that do not depend on the scheme.
    kept: &'a Kept,
    scheme: &'a dyn Scheme<D>,
    repeat: u32,
    key: Key,
    /// Seed of the oracle. Released data does not depend on it.
    oracle_seed: u64,
    /// Seed of the attacker.
    seed: u64,
}

/// A finished row with what it was measured from.
pub(super) struct Finished<'a> {
    pub(super) row: Row,
    pub(super) accuracy: Accuracy,
    pub(super) baseline: &'a Accuracy,
    /// The secret in the order of the recovered points.
    pub(super) secret: Cow<'a, Secret>,
    /// Weight of each slot, such that each distinct place counts once.
    pub(super) weights: Vec<f64>,
    /// Names of the metrics that describe an image as a whole.
    pub(super) whole: Vec<String>,
    /// Number of entries of all lists.
    pub(super) n_listed: usize,
}

/// Progress of an item, in units of the cost of one recovery.
struct Progress<'a, const D: usize> {
    observer: &'a mut dyn Observer<D>,
    done: usize,
    total: usize,
}

impl<const D: usize> Progress<'_, D> {
    fn begin(&mut self, what: &str) {
        self.observer.progress(self.done, self.total, what);
    }
}

/// Typical cost in recoveries of the attacks on the records alone, and of the lists of one source.
const COST: usize = 4;

/// Computes every cell of one scheme and repeat. Calls `each` with every finished row. Returns the
/// cells without a row, for which the scheme, a source or a custom solver failed.
///
/// # Errors
/// For images, whose rows are pooled, any failure of a scheme, source or solver. For maps, failures of
/// built-in solvers and of measures only. Also when the observer stops the audit.
fn cells<const D: usize>(
    run: &Run<'_, D>,
    clock: &mut Seconds,
    progress: &mut Progress<'_, D>,
    each: &mut dyn FnMut(Finished<'_>, RowSeconds),
) -> Result<Vec<NotAudited>, Error> {
    let (owned, plan, scheme) = (run.owned, run.plan, run.scheme.name());
    let hidden = match clock.time(|s| &mut s.obfuscate, || hide(run)) {
        Err(error) if !owned.may_be_small() => {
            return Ok(vec![NotAudited::new(scheme, None, error)]);
        }
        hidden => hidden.map_err(|error| error.within(scheme))?,
    };
    let (released, secret) = &*hidden;
    let guess = || blind(released, owned.original, secret);
    let baseline = clock.time(|s| &mut s.evaluate, guess);
    // In the plane all lines meet, so records alone contain no information.
    let mut alone = Vec::new();
    if plan.records_alone && D == 3 {
        progress.begin(&format!("{scheme}, records alone"));
        let attack = || records_alone(&hidden, owned.original, plan, run.seed);
        alone = clock.time(|s| &mut s.records_alone, attack)?;
        progress.done += COST;
    }
    let release = Release { run, released, secret, baseline, alone };
    let seeds = (run.oracle_seed, run.seed);
    let mut sources = Lists::new(plan.k, run.search, &hidden, seeds, run.kept);
    let options = RecoverOptions { seed: run.seed, ..RecoverOptions::default() };
    let mut missing = Vec::new();
    for variant in &plan.variants() {
        let source = variant.noise.map_or(variant.by.name(), |noise| noise.name());
        progress.begin(&format!("{scheme}, neighbors by {}", variant.by.name()));
        let started = Instant::now();
        let make = || sources.make(variant, owned.may_be_small());
        let made = match clock.time(|s| &mut s.neighbors, make) {
            Err(error) if !owned.may_be_small() => {
                missing.push(NotAudited::variant(scheme, variant, &error, secret));
                continue;
            }
            made => made.map_err(|error| error.within(scheme))?,
        };
        let making = started.elapsed().as_secs_f64();
        if variant.by.source().is_some() {
            progress.done += COST;
        }
        for (at, solver) in plan.solvers.iter().enumerate() {
            if !progress.observer.goes_on() {
                let error = Error::new("audit", "to run to the end", "a request to stop");
                return Err(error.of_kind(ErrorKind::Stopped));
            }
            progress.begin(&format!("{scheme} at {:.2} {source}, {}", made.ratio, solver.name()));
            let started = Instant::now();
            let recovered = match recover(released, &made.lists, &**solver, &options) {
                // The failure of a custom solver costs only its own rows.
                Err(error) if solver.builtin().is_none() && !owned.may_be_small() => {
                    let error = error.within(&format!("solver {}", solver.name()));
                    missing.push(NotAudited::variant(scheme, variant, &error, secret));
                    continue;
                }
                recovered => recovered?,
            };
            // All solvers share the lists. The first solver's row has the time of making them.
            let neighbors = if at == 0 { making } else { 0.0 };
            let seconds = RowSeconds { neighbors, recover: started.elapsed().as_secs_f64() };
            clock.recover += seconds.recover;
            let evaluate = || release.evaluate((variant, &made), &**solver, &recovered);
            let finished = clock.time(|s| &mut s.evaluate, evaluate)?;
            progress.observer.cell(&release.cell(&finished, &made, &recovered));
            progress.done += 1;
            each(finished, seconds);
        }
    }
    Ok(missing)
}

/// Hides the points under the scheme of `run` and checks the result, or returns what was given.
fn hide<'a, const D: usize>(run: &Run<'a, D>) -> Result<Cow<'a, (Released<D>, Secret)>, Error> {
    let Owned { original, descriptors, hidden, .. } = *run.owned;
    let is_given = run.scheme.name() == run.plan.schemes[0].name();
    if let Some(given) = hidden.filter(|_| is_given) {
        return Ok(Cow::Borrowed(given));
    }
    let hidden = obfuscate(run.scheme, original, descriptors, &run.key)?;
    check_laws(run.scheme, original, &run.key, (&hidden.0, &hidden.1))?;
    Ok(Cow::Owned(hidden))
}

/// The release of an item under one scheme, with what all its rows share.
struct Release<'a, const D: usize> {
    run: &'a Run<'a, D>,
    released: &'a Released<D>,
    secret: &'a Secret,
    /// Errors of a blind guess.
    baseline: Accuracy,
    /// What comes back from the records alone.
    alone: Vec<Alone>,
}

impl<const D: usize> Release<'_, D> {
    /// Evaluates what `solver` recovered from the lists `made`, with the measures of the plan.
    fn evaluate(
        &self,
        (variant, made): (&Variant<'_, D>, &Made),
        solver: &dyn Solver<D>,
        recovered: &Recovered<D>,
    ) -> Result<Finished<'_>, Error> {
        let (original, plan) = (self.run.owned.original, self.run.plan);
        let (measured, accuracy) =
            measure(recovered, original, self.secret, Some(&self.baseline), &plan.thresholds)?;
        let secret = joined(recovered, original, self.secret);
        let mut row = Row {
            scheme: self.run.scheme.name().to_owned(),
            neighbors: variant.by.name().to_owned(),
            oracle_noise: variant.noise.map(|noise| noise.name().to_owned()),
            inlier_ratio: made.ratio,
            k: made.k,
            solver: solver.name().to_owned(),
            ..measured
        };
        row.add_alone(self.alone.iter().cloned());
        let truth = Truth { original, released: self.released, secret: &secret };
        row.metrics.extend(made.ratio_at_k.map(|ratio| (RATIO_AT_K.to_owned(), ratio)));
        row.metrics.extend(truth.bearings(&made.lists));
        row.metrics.extend(truth.off_record());
        let mut weights = Vec::new();
        if self.run.owned.may_be_small() {
            weights = distinct_weights(original, &secret);
            row.fill_distinct(&accuracy, &self.baseline, &weights, &plan.thresholds);
        }
        let (baseline, whole) = (&self.baseline, Vec::new());
        let n_listed = made.lists.records().len();
        let mut finished = Finished { row, accuracy, baseline, secret, weights, whole, n_listed };
        let mut metrics = Vec::new();
        for measure in &plan.measures {
            let measured = measure.measure(&self.cell(&finished, made, recovered))?;
            if measure.is_of_images() {
                finished.whole.extend(measured.iter().map(|(name, _)| name.clone()));
            }
            metrics.extend(measured);
        }
        finished.row.metrics.extend(metrics);
        Ok(finished)
    }

    fn cell<'c>(
        &'c self,
        finished: &'c Finished<'_>,
        made: &'c Made,
        recovered: &'c Recovered<D>,
    ) -> Cell<'c, D> {
        let Finished { row, accuracy, secret, .. } = finished;
        let Owned { name, original, descriptors, .. } = *self.run.owned;
        let (repeat, released, lists) = (self.run.repeat, self.released, &made.lists);
        Cell {
            name,
            row,
            repeat,
            original,
            descriptors,
            secret,
            released,
            lists,
            recovered,
            accuracy,
        }
    }
}

/// Runs and measures all attacks on the records alone. Omits those that place no point of `hidden`.
///
/// # Errors
/// When the arguments do not belong together.
pub fn records_alone<const D: usize>(
    (released, secret): &(Released<D>, Secret),
    original: &Original<D>,
    plan: &Plan<D>,
    seed: u64,
) -> Result<Vec<Alone>, Error> {
    let options = RecoverOptions { seed, ..RecoverOptions::default() };
    let mut results = Vec::new();
    for (name, recovered) in recover::records_alone(released, &options)? {
        if (0..recovered.n_slots()).any(|slot| recovered.position(slot).is_some()) {
            let accuracy = evaluate(&recovered, original, secret)?;
            results.push(Alone { name, shares: within(&accuracy, &plan.thresholds) });
        }
    }
    Ok(results)
}

/// Result of one map or image.
#[derive(Default)]
pub(super) struct Rows {
    /// One row per scheme, source, noise model, inlier ratio and solver: means over repeats.
    pub(super) rows: Vec<Row>,
    /// Seconds per row, summed over repeats.
    pub(super) seconds: Vec<RowSeconds>,
    pub(super) not_audited: Vec<NotAudited>,
}

/// Computes the rows of `owned`. Calls `finished` with every row of every repeat.
pub(super) fn of_item<const D: usize>(
    owned: &Owned<'_, D>,
    plan: &Plan<D>,
    clock: &mut Seconds,
    observer: &mut dyn Observer<D>,
    finished: &mut dyn FnMut(&Finished<'_>),
) -> Result<Rows, Error> {
    let search = &clock.time(|s| &mut s.search, || oracle::search(owned.original))?;
    let kept = &Kept::default();
    let n_costly = plan.own_sources().count() + usize::from(plan.records_alone && D == 3);
    let per_scheme = n_costly * COST + plan.rows_per_scheme();
    let total = per_scheme * plan.schemes.len() * plan.repeats as usize;
    let mut progress = Progress { observer, done: 0, total };
    let mut all = Rows::default();
    for scheme in &plan.schemes {
        let mut by_repeat: Vec<Vec<(Row, RowSeconds)>> = Vec::new();
        let mut missing: Vec<NotAudited> = Vec::new();
        let n_before = all.rows.len();
        for repeat in 0..plan.repeats {
            // The attacker's crate has no keys, so its seed is an integer.
            let seed = plan.seed.wrapping_add(u64::from(repeat));
            let key = Key::from_seed(seed);
            let (key, oracle_seed) = match owned.name {
                None => (key, seed),
                Some(name) => (key_of(&key, name), oracle_seed(seed, name)),
            };
            let scheme = &**scheme;
            let run = Run { owned, plan, search, kept, scheme, repeat, key, oracle_seed, seed };
            let (mut of_repeat, before) = (Vec::new(), progress.done);
            let mut each = |row: Finished<'_>, seconds: RowSeconds| {
                finished(&row);
                of_repeat.push((row.row, seconds));
            };
            let lacking = cells(&run, clock, &mut progress, &mut each)?;
            progress.done = before + per_scheme;
            by_repeat.push(of_repeat);
            add_new(&mut missing, lacking);
        }
        for (row, _) in &by_repeat[0] {
            let same = by_repeat.iter().map(|rows| rows.iter().find(|(r, _)| r.is_same_cell(row)));
            // A mean over only the seeds that succeeded would be biased.
            let Some(same) = same.collect::<Option<Vec<_>>>() else { continue };
            let mut seconds = RowSeconds::default();
            same.iter().for_each(|(_, more)| seconds.add(more));
            all.seconds.push(seconds);
            all.rows.push(Row::mean(&same.iter().map(|(row, _)| row.clone()).collect::<Vec<_>>()));
        }
        all.not_audited.extend(shortened(missing, all.rows.len() > n_before));
    }
    progress.begin("done");
    Ok(all)
}

/// Checks for a scheme that hidden points lie on their records, and that one key gives one map.
///
/// Little can be recovered from a scheme with a bug, so a report would wrongly call it safe. Tests
/// check the built-in schemes; custom schemes are applied a second time here.
///
/// # Errors
/// The first law that does not hold.
pub fn check_laws<const D: usize>(
    scheme: &dyn Scheme<D>,
    original: &Original<D>,
    key: &Key,
    (released, secret): (&Released<D>, &Secret),
) -> Result<(), Error> {
    let truth = Truth { original, released, secret };
    truth.belongs()?;
    if all().any(|entry| entry.name == scheme.name()) {
        return Ok(());
    }
    let away = truth.away_from_own();
    let farthest = away.iter().copied().fold(0.0, f64::max);
    let limit = truth.farthest_for_rounding();
    // Bearings may have decoys, and nothing is recovered from them in any case. The error of a scheme with noise is measured.
    let may_be_off = || released.obfuscation().is_bearings() || truth.is_noise();
    if farthest > limit && !may_be_off() {
        let off = away.iter().filter(|&&away| away > limit).count();
        let found = format!("{off} of {} away from them, by up to {farthest:.2e}", away.len());
        return Err(Error::new("hidden points", "on their own records", found));
    }
    let (again, secret_again) = obfuscate(scheme, original, None, key)?;
    if again.obfuscation() != released.obfuscation() || secret_again.hidden() != secret.hidden() {
        return Err(Error::new("records", "the same for the same key", "different ones"));
    }
    Ok(())
}
