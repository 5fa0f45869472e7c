//! Cells of an audit: the rows of one scheme and one repeat on one map or image, computed in
//! memory.

use std::time::Instant;

use super::clock::Clock;
use super::clock::RowSeconds;
use super::laws::check_laws;
use super::lists::Lists;
use super::measure::measure;
use super::not_audited::NotAudited;
use super::observer::{Cell, Counts, Observer};
use super::plan::Plan;
use super::records_alone::records_alone;
use super::row::Row;
use super::solved::Solved;
use crate::evaluate::{Accuracy, bearings, blind, distinct_weights, joined};
use crate::geometry::knn::Knn;
use crate::neighbors::oracle::Noise;
use crate::obfuscate::{Scheme, obfuscate};
use crate::recover::Builtin;
use crate::released::Released;
use crate::seed::Key;
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error, ErrorKind};

/// [Metric](Row::metrics) of an attacker's own lists: the inlier ratio with as many true neighbors
/// as the lists have records.
const RATIO_AT_K: &str = "inlier_ratio_at_k";

/// A map or an image with its ground truth.
#[derive(Clone, Copy)]
pub(super) struct Owned<'a, const D: usize> {
    pub(super) original: &'a Original<D>,
    pub(super) descriptors: Option<&'a Descriptors>,
    /// The released map and its secret if the points are already hidden; no scheme is applied then.
    pub(super) hidden: Option<&'a (Released<D>, Secret)>,
    pub(super) search: &'a Knn<'a, D>,
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
    each: impl FnMut(&mut dyn Observer<D>, Option<String>, Option<Finished<'_>>),
) -> Result<Vec<NotAudited>, Error> {
    if let Some(hidden) = owned.hidden {
        return attack(owned, run, hidden, clock, observer, each);
    }
    let hide = || {
        let hidden = obfuscate(scheme, owned.original, owned.descriptors, key)?;
        check_laws(scheme, owned.original, key, (&hidden.0, &hidden.1))?;
        Ok(hidden)
    };
    match clock.time(|s| &mut s.obfuscate, hide) {
        Ok(hidden) => attack(owned, run, &hidden, clock, observer, each),
        Err(error) if !owned.may_be_small() => Ok(vec![NotAudited::scheme(run.scheme, &error)]),
        Err(error) => Err(error.within(run.scheme)),
    }
}

/// Computes every cell of one scheme and repeat for `hidden`, the released map and its secret.
///
/// Calls `each` with a label before each step and with every finished row. Returns the cells
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
    mut each: impl FnMut(&mut dyn Observer<D>, Option<String>, Option<Finished<'_>>),
) -> Result<Vec<NotAudited>, Error> {
    let Run { plan, scheme, repeat, oracle_seed } = *run;
    let original = owned.original;
    // The attacker's crate has no keys, so its seed is the integer of the repeat. Released data
    // depends on a key.
    let attacker = plan.seed.wrapping_add(u64::from(repeat));
    let of_scheme = |error: Error| error.within(scheme);
    let baseline = clock.time(|s| &mut s.evaluate, || Ok(blind(&hidden.0, original, &hidden.1)))?;
    // In the plane all lines meet, so records alone contain no information.
    let alone = match plan.records_alone && D == 3 {
        true => clock
            .time(|s| &mut s.records_alone, || records_alone(hidden, original, plan, attacker))?,
        false => Vec::new(),
    };
    let by_row = hidden.1.by_descriptor_row();
    let mut sources = Lists::new(plan, owned.search, hidden, &by_row, (oracle_seed, attacker));
    let mut missing = Vec::new();
    for variant in &plan.variants() {
        let source = match variant.noise {
            Some(noise) => noise.name().to_owned(),
            None => variant.by.name().to_owned(),
        };
        let what = format!("{scheme}, neighbors by {}", variant.by.name());
        each(observer, Some(what), None);
        let started = Instant::now();
        let mut make = || match owned.may_be_small() {
            true => sources.make_of_what_there_is(variant),
            false => sources.make(variant),
        };
        let made = match clock.time(|s| &mut s.neighbors, || Ok(make()))? {
            Err(error) if !owned.may_be_small() => {
                missing.push(NotAudited::variant(scheme, variant, &error, &hidden.1));
                continue;
            }
            made => made.map_err(of_scheme)?,
        };
        let making = started.elapsed().as_secs_f64();
        let mut solved = Solved::new(plan, (&hidden.0, &made.lists), attacker);
        for (at, solver) in plan.solvers.iter().enumerate() {
            if !observer.goes_on() {
                let error = Error::new("audit", "to run to the end", "a request to stop");
                return Err(error.of_kind(ErrorKind::Stopped));
            }
            let what = format!("{scheme} at {:.2} {source}, {}", made.ratio, solver.name());
            each(observer, Some(what), None);
            let (recovered, took) = match solved.by(at) {
                // The failure of a custom solver costs only its own rows.
                Err(error) if Builtin::of(&**solver).is_none() && !owned.may_be_small() => {
                    let error = error.within(&format!("solver {}", solver.name()));
                    missing.push(NotAudited::variant(scheme, variant, &error, &hidden.1));
                    continue;
                }
                solved => solved?,
            };
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
                oracle_noise: variant.noise.map(Noise::name),
                inlier_ratio: made.ratio,
                k: made.k,
                solver: solver.name().to_owned(),
                ..measured
            };
            row.records_alone.clone_from(&alone);
            row.metrics.extend(made.ratio_at_k.map(|ratio| (RATIO_AT_K.to_owned(), ratio)));
            row.metrics.extend(bearings(&hidden.0, original, secret, &made.lists));
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
            each(observer, None, Some(finished));
        }
    }
    Ok(missing)
}

/// Returns weights with which distinct places count once; empty for maps.
fn places<const D: usize>(owned: &Owned<'_, D>, secret: &Secret) -> Vec<f64> {
    if owned.may_be_small() { distinct_weights(owned.original, secret) } else { Vec::new() }
}
