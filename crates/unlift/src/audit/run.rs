//! The pipeline, chained in memory.

use std::collections::BTreeMap;
use std::time::Instant;

use super::break_even::{BreakEven, break_even};
use super::lists::Lists;
use super::plan::{Plan, Source, Variant};
use super::row::Row;
use crate::evaluate::{Accuracy, blind, evaluate, in_better_order, reference, reliability};
use crate::geometry::knn::Knn;
use crate::neighbors::oracle::{self, Noise};
use crate::obfuscate::{Entry, obfuscate};
use crate::recover::{RecoverOptions, Recovered, Solver, recover};
use crate::released::Released;
use crate::truth::{DropReason, Original, Secret};
use crate::{Descriptors, Error, Unit};

/// Everything known about one row of one repeat, for whoever writes clouds or draws pictures.
pub struct Cell<'a> {
    /// The row of this repeat.
    pub row: &'a Row,
    /// Which repeat, from 0.
    pub repeat: u32,
    /// The truth.
    pub original: &'a Original<3>,
    /// The secret of this obfuscation.
    pub secret: &'a Secret,
    /// What the attacker saw.
    pub released: &'a Released<3>,
    /// What the attacker got.
    pub recovered: &'a Recovered<3>,
    /// Error per slot.
    pub accuracy: &'a Accuracy,
}

/// Hears how an audit goes.
pub trait Observer {
    /// `done` of `total` cells are finished; `what` comes next.
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// One cell is finished.
    fn cell(&mut self, cell: &Cell<'_>) {
        let _ = cell;
    }
}

/// An observer that does nothing.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl Observer for Silent {}

/// Where the time went. Never part of results.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Searching nearest neighbors of the originals.
    pub search: f64,
    /// Obfuscating, over all schemes and repeats.
    pub obfuscate: f64,
    /// Making neighborhoods.
    pub neighbors: f64,
    /// Recovering.
    pub recover: f64,
    /// Evaluating, the blind attacker included.
    pub evaluate: f64,
    /// Per row, summed over repeats.
    pub rows: Vec<RowSeconds>,
}

/// Where the time of one row went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowSeconds {
    /// Making its neighborhoods; 0 where another solver's row already has the time.
    pub neighbors: f64,
    /// Recovering.
    pub recover: f64,
}

/// What an audit found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// One row per scheme, source, noise model, inlier ratio and solver, in this order.
    pub rows: Vec<Row>,
    /// The ratio at which half of the points come back, per scheme, noise model and solver.
    pub break_even: Vec<BreakEven>,
    /// Where the time went.
    pub seconds: Seconds,
}

/// Runs `plan` on the owner's map. `descriptors` has one row per original.
///
/// Rows depend on the map, the descriptors and the plan alone: the same bytes for any number of
/// threads.
///
/// # Errors
/// When the plan does not fit the map, or a scheme cannot hide it.
pub fn run(
    original: &Original<3>,
    descriptors: Option<&Descriptors>,
    plan: &Plan,
    observer: &mut dyn Observer,
) -> Result<Outcome, Error> {
    plan.check(original.len(), descriptors.is_some())?;
    let mut clock = Clock::default();
    let search = clock.time(|s| &mut s.search, || oracle::search(original))?;
    let variants = plan.variants();
    let per_scheme = variants.len() * plan.solvers.len() + usize::from(plan.reference);
    let total = per_scheme * plan.schemes.len() * plan.repeats as usize;
    let mut done = 0;
    let mut rows = Vec::new();
    for entry in &plan.schemes {
        let mut by_repeat: Vec<Vec<Row>> = Vec::new();
        let mut seconds = vec![RowSeconds::default(); per_scheme];
        for repeat in 0..plan.repeats {
            let seed = plan.seed.wrapping_add(u64::from(repeat));
            // The attacker's own seed: that of the obfuscation is the owner's secret.
            let attacker = u64::from(repeat);
            let of_scheme = |error: Error| error.within(entry.name);
            let hidden = hide(entry, original, descriptors, plan, seed, &mut clock);
            let hidden = hidden.map_err(of_scheme)?;
            let baseline =
                clock.time(|s| &mut s.evaluate, || Ok(blind(&hidden.0, original, &hidden.1)))?;
            let mut repeat_rows = Vec::new();
            let by_row = hidden.1.by_descriptor_row();
            let mut sources = Lists::new(plan, &search, &hidden, &by_row, (seed, attacker));
            for variant in &variants {
                let source = match variant.noise {
                    Some(noise) => noise.name().to_owned(),
                    None => variant.source.name(),
                };
                let what = format!("{}, neighbors by {}", entry.name, variant.source.name());
                observer.progress(done, total, &what);
                let started = Instant::now();
                let made = clock
                    .time(|s| &mut s.neighbors, || sources.make(variant))
                    .map_err(of_scheme)?;
                let making = started.elapsed().as_secs_f64();
                let secret = match variant.source {
                    Source::Own(_) => &by_row,
                    Source::Oracle | Source::Given(_) => &hidden.1,
                };
                // Lists from the records alone follow the order along a paired line: no descriptor
                // tells its two slots apart.
                let in_some_order = hidden.0.slots_per_record() == 2
                    && matches!(&variant.source, Source::Own(from) if !from.needs_descriptors());
                for (at, &solver) in plan.solvers.iter().enumerate() {
                    let what =
                        format!("{} at {:.2} {source}, {}", entry.name, made.ratio, solver.name());
                    observer.progress(done, total, &what);
                    let options = RecoverOptions {
                        solver,
                        delta: plan.delta,
                        seed: attacker,
                        exact_constraints: plan.exact_constraints,
                        ..RecoverOptions::default()
                    };
                    let started = Instant::now();
                    let recovered = recover(&hidden.0, &made.lists, &options)?;
                    let took = started.elapsed().as_secs_f64();
                    let row_seconds = &mut seconds[repeat_rows.len()];
                    row_seconds.recover += took;
                    // Lists are made once for all solvers: the first one's row has the time.
                    row_seconds.neighbors += if at == 0 { making } else { 0.0 };
                    clock.seconds.recover += took;
                    let ordered =
                        in_some_order.then(|| in_better_order(&recovered, original, secret));
                    let secret = ordered.as_ref().unwrap_or(secret);
                    let accuracy = clock
                        .time(|s| &mut s.evaluate, || evaluate(&recovered, original, secret))?;
                    let mut row = blank(entry, variant, (made.k, solver), &recovered, secret);
                    row.inlier_ratio = made.ratio;
                    row.fill(&accuracy, &baseline, &plan.thresholds);
                    let smallest = Row::smallest(&plan.thresholds);
                    row.reliability = reliability(&recovered, &accuracy, smallest);
                    observer.cell(&Cell {
                        row: &row,
                        repeat,
                        original,
                        secret,
                        released: &hidden.0,
                        recovered: &recovered,
                        accuracy: &accuracy,
                    });
                    repeat_rows.push(row);
                    done += 1;
                }
            }
            if plan.reference {
                let row = reference_row(entry, &hidden, original, &search, &baseline, plan);
                repeat_rows.push(row);
                done += 1;
            }
            by_repeat.push(repeat_rows);
        }
        for at in 0..per_scheme {
            let same: Vec<Row> = by_repeat.iter().map(|rows| rows[at].clone()).collect();
            rows.push(Row::mean(&same));
        }
        clock.seconds.rows.extend(seconds);
    }
    observer.progress(done, total, "done");
    let break_even = break_even(plan, &rows);
    Ok(Outcome { rows, break_even, seconds: clock.seconds })
}

fn hide(
    entry: &Entry,
    original: &Original<3>,
    descriptors: Option<&Descriptors>,
    plan: &Plan,
    seed: u64,
    clock: &mut Clock,
) -> Result<(Released<3>, Secret), Error> {
    let scheme =
        entry.in_3d.ok_or_else(|| Error::new("scheme", "one for 3D points", entry.name))?;
    clock.time(
        |s| &mut s.obfuscate,
        || obfuscate(scheme, original, descriptors, &plan.scheme_options, seed),
    )
}

/// The row of an attacker who is told where three true neighbors of every point are.
fn reference_row(
    entry: &Entry,
    (released, secret): &(Released<3>, Secret),
    original: &Original<3>,
    search: &Knn<'_, 3>,
    baseline: &Accuracy,
    plan: &Plan,
) -> Row {
    let mut row = unmeasured(entry, REFERENCE.to_owned(), (3, REFERENCE), released.unit(), secret);
    row.inlier_ratio = 1.0;
    row.fill(&reference(released, original, secret, search), baseline, &plan.thresholds);
    row
}

/// The name of that attacker: as a source and as a solver, though it is neither.
pub const REFERENCE: &str = "reference";

/// A row of which only the cell is known.
fn unmeasured(
    entry: &Entry,
    neighbors: String,
    (k, solver): (usize, &'static str),
    unit: Unit,
    secret: &Secret,
) -> Row {
    let mut dropped = BTreeMap::new();
    for reason in DropReason::ALL {
        let n = secret.dropped().iter().filter(|d| d.reason == reason).count();
        if n > 0 {
            dropped.insert(reason.name(), n);
        }
    }
    Row {
        scheme: entry.name,
        neighbors,
        oracle_noise: None,
        inlier_ratio: 0.0,
        k,
        solver,
        delta: 0.0,
        unit,
        n_points: secret.n_slots(),
        lost: BTreeMap::new(),
        dropped,
        recovered_percent: Vec::new(),
        blind_percent: Vec::new(),
        axis_accuracy_percent: None,
        exact_percent: None,
        assignment_accuracy_percent: None,
        error_percentiles: Vec::new(),
        reliability: None,
        ransac_trials: None,
        repeats: None,
    }
}

/// A row with everything but the measurements.
fn blank(
    entry: &Entry,
    variant: &Variant<'_>,
    (k, solver): (usize, Solver),
    recovered: &Recovered<3>,
    secret: &Secret,
) -> Row {
    let cell = (k, solver.name());
    let row = unmeasured(entry, variant.source.name(), cell, recovered.unit(), secret);
    Row {
        oracle_noise: variant.noise.map(Noise::name),
        delta: recovered.delta(),
        ransac_trials: recovered.trials().map(|trials| trials.bins().collect()),
        ..row
    }
}

#[derive(Default)]
struct Clock {
    seconds: Seconds,
}

impl Clock {
    fn time<T>(
        &mut self,
        stage: impl Fn(&mut Seconds) -> &mut f64,
        work: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let started = Instant::now();
        let result = work();
        *stage(&mut self.seconds) += started.elapsed().as_secs_f64();
        result
    }
}
