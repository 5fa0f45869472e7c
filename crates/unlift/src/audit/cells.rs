//! Cells of an audit: the rows of one scheme and one repeat on one map or image, computed in
//! memory.

use std::time::Instant;

use super::clock::{Clock, RowSeconds};
use super::lists::{Kept, Lists};
use super::missing::{NotAudited, told};
use super::observer::{Cell, Counts, Observer};
use super::plan::{Plan, key_of, oracle_seed};
use super::row::{Alone, Row, measure, within};
use crate::evaluate::{
    Accuracy, away_from_own, bearings, belongs, blind, distinct_weights, evaluate,
    farthest_for_rounding, is_noise, joined, off_record,
};
use crate::geometry::knn::Knn;
use crate::obfuscate::{Scheme, all, obfuscate};
use crate::recover::{RecoverOptions, recover};
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error, ErrorKind, recover};

/// [Metric](Row::metrics) of an attacker's own lists: the inlier ratio with as many true neighbors
/// as the lists have records.
const RATIO_AT_K: &str = "inlier_ratio_at_k";

/// A map or an image with its ground truth.
#[derive(Clone, Copy)]
pub(super) struct Owned<'a, const D: usize> {
    pub(super) original: &'a Original<D>,
    pub(super) descriptors: Option<&'a Descriptors>,
    /// The released map and its secret if the points are already hidden under the plan's first scheme.
    pub(super) hidden: Option<&'a (Released<D>, Secret)>,
    pub(super) search: &'a Knn<'a, D>,
    /// Lists that do not depend on the scheme.
    pub(super) kept: &'a Kept,
    /// Name of the item, if the audit has several.
    pub(super) name: Option<&'a str>,
}

impl<const D: usize> Owned<'_, D> {
    /// Returns true if the item may have fewer points than a list has entries. Images may; tiles of
    /// a map do not.
    fn may_be_small(&self) -> bool {
        self.name.is_some() && D == 2
    }
}

/// Plan, scheme, repeat and seed of a group of rows.
#[derive(Clone, Copy)]
pub(super) struct Run<'a, const D: usize> {
    pub(super) plan: &'a Plan<D>,
    pub(super) scheme: &'a str,
    pub(super) repeat: u32,
    /// Seed of the oracle. Released data does not depend on it.
    pub(super) oracle_seed: u64,
}

/// A finished row with the data that pooling needs.
pub(super) struct Finished<'a> {
    pub(super) row: Row,
    pub(super) accuracy: &'a Accuracy,
    pub(super) baseline: &'a Accuracy,
    /// Weight of each slot, such that each distinct place counts once.
    pub(super) weights: &'a [f64],
    /// Names of the metrics that describe an image as a whole.
    pub(super) whole: &'a [String],
    /// Number of entries of all lists.
    pub(super) n_listed: usize,
    pub(super) seconds: RowSeconds,
}

/// Progress of one scheme and repeat.
pub(super) enum Step<'a> {
    /// The work that begins.
    Begins(String),
    /// A part of the work has ended, in units of the cost of one recovery.
    Ended(usize),
    /// A row is finished.
    Row(Box<Finished<'a>>),
}

/// Typical cost of attacks on the records alone, in recoveries.
const ALONE_COST: usize = 4;
/// Typical cost of the lists of one of the attacker's own sources, in recoveries.
const LISTS_COST: usize = 4;

/// Returns the cost of all cells of one scheme and repeat, in recoveries.
fn cost<const D: usize>(plan: &Plan<D>) -> usize {
    let alone = if plan.records_alone && D == 3 { ALONE_COST } else { 0 };
    alone + plan.own_sources().count() * LISTS_COST + plan.rows_per_scheme()
}

/// Hides the points with `scheme` under `key` and computes every cell.
///
/// # Errors
/// Returns the errors of [`attack`]. For images, it also fails if the scheme cannot hide the points.
pub(super) fn cells<const D: usize>(
    owned: &Owned<'_, D>,
    run: &Run<'_, D>,
    (scheme, key): (&dyn Scheme<D>, &Key),
    clock: &mut Clock,
    observer: &mut dyn Observer<D>,
    each: impl FnMut(&mut dyn Observer<D>, Step<'_>),
) -> Result<Vec<NotAudited>, Error> {
    if let Some(hidden) = owned.hidden.filter(|_| run.scheme == run.plan.schemes[0].name()) {
        return attack(owned, run, hidden, clock, observer, each);
    }
    let hide = || {
        let hidden = obfuscate(scheme, owned.original, owned.descriptors, key)?;
        check_laws(scheme, owned.original, key, (&hidden.0, &hidden.1))?;
        Ok(hidden)
    };
    match clock.time(|s| &mut s.obfuscate, hide) {
        Ok(hidden) => attack(owned, run, &hidden, clock, observer, each),
        Err(error) if !owned.may_be_small() => Ok(vec![NotAudited::new(run.scheme, None, error)]),
        Err(error) => Err(error.within(run.scheme)),
    }
}

/// Computes every cell of one scheme and repeat for `hidden`, the released map and its secret.
///
/// Calls `each` with the progress and every finished row. Returns the cells
/// without a row, for which a source or a custom solver failed.
///
/// # Errors
/// For images, whose rows are pooled, any failure of a source or solver. For maps, failures of
/// built-in solvers and of measures only. Also when the observer stops the audit.
pub(super) fn attack<const D: usize>(
    owned: &Owned<'_, D>,
    run: &Run<'_, D>,
    hidden: &(Released<D>, Secret),
    clock: &mut Clock,
    observer: &mut dyn Observer<D>,
    mut each: impl FnMut(&mut dyn Observer<D>, Step<'_>),
) -> Result<Vec<NotAudited>, Error> {
    let Run { plan, scheme, repeat, oracle_seed } = *run;
    let original = owned.original;
    // The attacker's crate has no keys, so its seed is the integer of the repeat. Released data
    // depends on a key.
    let attacker = plan.seed.wrapping_add(u64::from(repeat));
    let of_scheme = |error: Error| error.within(scheme);
    let baseline = clock.time(|s| &mut s.evaluate, || Ok(blind(&hidden.0, original, &hidden.1)))?;
    // In the plane all lines meet, so records alone contain no information.
    let mut alone = Vec::new();
    if plan.records_alone && D == 3 {
        each(observer, Step::Begins(format!("{scheme}, records alone")));
        alone = clock
            .time(|s| &mut s.records_alone, || records_alone(hidden, original, plan, attacker))?;
        each(observer, Step::Ended(ALONE_COST));
    }
    let by_row = hidden.1.by_descriptor_row();
    let mut sources =
        Lists::new(plan, owned.search, hidden, &by_row, (oracle_seed, attacker), owned.kept);
    let mut missing = Vec::new();
    for variant in &plan.variants() {
        let source = match variant.noise {
            Some(noise) => noise.name().to_owned(),
            None => variant.by.name().to_owned(),
        };
        let what = format!("{scheme}, neighbors by {}", variant.by.name());
        each(observer, Step::Begins(what));
        let started = Instant::now();
        let mut make = || Ok(sources.make(variant, owned.may_be_small()));
        let made = match clock.time(|s| &mut s.neighbors, &mut make)? {
            Err(error) if !owned.may_be_small() => {
                missing.push(NotAudited::variant(scheme, variant, &error, &hidden.1));
                continue;
            }
            made => made.map_err(of_scheme)?,
        };
        let making = started.elapsed().as_secs_f64();
        if variant.by.source().is_some() {
            each(observer, Step::Ended(LISTS_COST));
        }
        let options =
            RecoverOptions { delta: plan.delta, seed: attacker, ..RecoverOptions::default() };
        for (at, solver) in plan.solvers.iter().enumerate() {
            if !observer.goes_on() {
                let error = Error::new("audit", "to run to the end", "a request to stop");
                return Err(error.of_kind(ErrorKind::Stopped));
            }
            let what = format!("{scheme} at {:.2} {source}, {}", made.ratio, solver.name());
            each(observer, Step::Begins(what));
            let started = Instant::now();
            let recovered = match recover(&hidden.0, &made.lists, &**solver, &options) {
                // The failure of a custom solver costs only its own rows.
                Err(error) if solver.builtin().is_none() && !owned.may_be_small() => {
                    let error = error.within(&format!("solver {}", solver.name()));
                    missing.push(NotAudited::variant(scheme, variant, &error, &hidden.1));
                    continue;
                }
                recovered => recovered?,
            };
            let took = started.elapsed().as_secs_f64();
            // All solvers share the lists. The first solver's row has the time of making them.
            let making = if at == 0 { making } else { 0.0 };
            clock.seconds.recover += took;
            let blind = Some(&baseline);
            let measure = || measure(&recovered, original, &hidden.1, blind, &plan.thresholds);
            let (measured, accuracy) = clock.time(|s| &mut s.evaluate, measure)?;
            let secret = &*joined(&recovered, original, &hidden.1);
            let mut row = Row {
                scheme: scheme.to_owned(),
                neighbors: variant.by.name().to_owned(),
                oracle_noise: variant.noise.map(|noise| noise.name().to_owned()),
                inlier_ratio: made.ratio,
                k: made.k,
                solver: solver.name().to_owned(),
                ..measured
            };
            row.add_alone(alone.iter().cloned());
            row.metrics.extend(made.ratio_at_k.map(|ratio| (RATIO_AT_K.to_owned(), ratio)));
            row.metrics.extend(bearings(&hidden.0, original, secret, &made.lists));
            row.metrics.extend(off_record(&hidden.0, original, secret));
            let weights = places(owned, secret);
            if owned.may_be_small() {
                row.fill_distinct(&accuracy, &baseline, &weights, &plan.thresholds);
            }
            let bare = row.clone();
            let cell = Cell {
                name: owned.name,
                row: &bare,
                repeat,
                original,
                descriptors: owned.descriptors,
                secret,
                released: &hidden.0,
                lists: &made.lists,
                recovered: &recovered,
                accuracy: &accuracy,
            };
            let mut whole = Vec::new();
            for measure in &plan.measures {
                let measured = clock.time(|s| &mut s.evaluate, || measure.measure(&cell))?;
                if measure.counts() == Counts::Images {
                    whole.extend(measured.iter().map(|(name, _)| name.clone()));
                }
                row.metrics.extend(measured);
            }
            observer.cell(&Cell { row: &row, ..cell });
            let finished = Finished {
                row,
                accuracy: &accuracy,
                baseline: &baseline,
                weights: &weights,
                whole: &whole,
                n_listed: made.lists.records().len(),
                seconds: RowSeconds { neighbors: making, recover: took },
            };
            each(observer, Step::Ended(1));
            each(observer, Step::Row(Box::new(finished)));
        }
    }
    Ok(missing)
}

/// Returns weights with which distinct places count once; empty for maps.
fn places<const D: usize>(owned: &Owned<'_, D>, secret: &Secret) -> Vec<f64> {
    if owned.may_be_small() { distinct_weights(owned.original, secret) } else { Vec::new() }
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
    let mut found = Vec::new();
    for (name, recovered) in recover::records_alone(released, &options)? {
        if (0..recovered.n_slots()).any(|slot| recovered.position(slot).is_some()) {
            let accuracy = evaluate(&recovered, original, secret)?;
            found.push(Alone { name, shares: within(&accuracy, &plan.thresholds) });
        }
    }
    Ok(found)
}

/// Result of one map or image.
#[derive(Default)]
pub(super) struct Rows {
    /// One row per scheme, source, noise model, inlier ratio and solver, in this order; means over
    /// repeats.
    pub(super) rows: Vec<Row>,
    /// Seconds per row, summed over repeats.
    pub(super) seconds: Vec<RowSeconds>,
    pub(super) not_audited: Vec<NotAudited>,
}

/// Computes the rows of `owned`. Calls `finished` with every row of every repeat.
///
/// # Errors
/// Returns the errors of [`cells`].
pub(super) fn of_item<const D: usize>(
    owned: &Owned<'_, D>,
    plan: &Plan<D>,
    clock: &mut Clock,
    observer: &mut dyn Observer<D>,
    finished: &mut dyn FnMut(&Finished<'_>),
) -> Result<Rows, Error> {
    let per_scheme = cost(plan);
    let total = per_scheme * plan.schemes.len() * plan.repeats as usize;
    let (mut found, mut done) = (Rows::default(), 0);
    for scheme in &plan.schemes {
        let mut by_repeat: Vec<Vec<(Row, RowSeconds)>> = Vec::new();
        let mut missing: Vec<NotAudited> = Vec::new();
        let n_before = found.rows.len();
        for repeat in 0..plan.repeats {
            let (key, oracle_seed) = seeds(plan.seed.wrapping_add(u64::from(repeat)), owned.name);
            let run = Run { plan, scheme: scheme.name(), repeat, oracle_seed };
            let (mut of_repeat, before) = (Vec::new(), done);
            let hide = (&**scheme, &key);
            let lacking = cells(owned, &run, hide, clock, observer, |observer, step| match step {
                Step::Begins(what) => observer.progress(done, total, &what),
                Step::Ended(cost) => done += cost,
                Step::Row(row) => {
                    finished(&row);
                    let Finished { row, seconds, .. } = *row;
                    of_repeat.push((row, seconds));
                }
            })?;
            done = before + per_scheme;
            by_repeat.push(of_repeat);
            for one in lacking {
                if !missing.iter().any(|other| other.is_same_cell(&one)) {
                    missing.push(one);
                }
            }
        }
        for (row, _) in &by_repeat[0] {
            let same = by_repeat.iter().map(|rows| rows.iter().find(|(r, _)| r.is_same_cell(row)));
            // A mean over only the seeds that succeeded would be biased.
            let Some(same) = same.collect::<Option<Vec<_>>>() else { continue };
            let mut seconds = RowSeconds::default();
            same.iter().for_each(|(_, more)| seconds.add(more));
            found.seconds.push(seconds);
            found
                .rows
                .push(Row::mean(&same.iter().map(|(row, _)| row.clone()).collect::<Vec<_>>()));
        }
        found.not_audited.extend(told(missing, found.rows.len() > n_before));
    }
    observer.progress(done, total, "done");
    Ok(found)
}

fn seeds(seed: u64, name: Option<&str>) -> (Key, u64) {
    let key = Key::from_seed(seed);
    match name {
        None => (key, seed),
        Some(name) => (key_of(&key, name), oracle_seed(seed, name)),
    }
}

/// Checks two laws of schemes for what a scheme made of `original` under `key`: every hidden point
/// lies on its own record, and the same key gives the same map.
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
    belongs(original, released, secret)?;
    if all().any(|entry| entry.name == scheme.name()) {
        return Ok(());
    }
    let away = away_from_own(released, original, secret);
    let farthest = away.iter().copied().fold(0.0, f64::max);
    let most = farthest_for_rounding(released, original, secret);
    // Bearings may have decoys, and nothing is recovered from them in any case. The error of a scheme with noise is measured.
    let may_be_off =
        || released.obfuscation().is_bearings() || is_noise(released, original, secret);
    if farthest > most && !may_be_off() {
        let off = away.iter().filter(|&&away| away > most).count();
        let found = format!("{off} of {} away from them, by up to {farthest:.2e}", away.len());
        return Err(Error::new("hidden points", "on their own records", found));
    }
    let (again, secret_again) = obfuscate(scheme, original, None, key)?;
    if again.obfuscation() != released.obfuscation() || secret_again.hidden() != secret.hidden() {
        return Err(Error::new("records", "the same for the same key", "different ones"));
    }
    Ok(())
}
