//! The pipeline, chained in memory.

use std::time::Instant;

use super::break_even::{BreakEven, break_even};
use super::plan::{Plan, PointNeighbors, Source};
use super::row::Row;
use crate::evaluate::{Accuracy, blind, evaluate};
use crate::neighbors::Neighborhoods;
use crate::neighbors::oracle::{self, Noise, Outliers, TrueNeighbors};
use crate::obfuscate::{Entry, obfuscate};
use crate::recover::{RecoverOptions, Recovered, Solver, recover};
use crate::released::Released;
use crate::truth::{DropReason, Original, Secret};
use crate::{Descriptors, Error};

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
    /// Recovery per row, summed over repeats.
    pub rows: Vec<f64>,
}

/// What an audit found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// One row per scheme, noise model, inlier ratio and solver, in this order.
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
    plan.check(original.len())?;
    let mut clock = Clock::default();
    let search = clock.time(|s| &mut s.search, || oracle::search(original))?;
    let per_scheme = plan.noises().len() * plan.ratios().len() * plan.solvers.len();
    let total = per_scheme * plan.schemes.len() * plan.repeats as usize;
    let mut done = 0;
    let mut rows = Vec::new();
    for entry in &plan.schemes {
        let mut by_repeat: Vec<Vec<Row>> = Vec::new();
        let mut seconds = vec![0.0; per_scheme];
        for repeat in 0..plan.repeats {
            let seed = plan.seed.wrapping_add(u64::from(repeat));
            let of_scheme = |error: Error| error.within(entry.name);
            let hidden = hide(entry, original, descriptors, plan, seed, &mut clock);
            let hidden = hidden.map_err(of_scheme)?;
            let baseline =
                clock.time(|s| &mut s.evaluate, || Ok(blind(&hidden.0, original, &hidden.1)))?;
            let mut repeat_rows = Vec::new();
            let slots = hidden.0.slots_per_record();
            let (given, k) = match &plan.source {
                Source::Oracle => (None, plan.k),
                Source::Given(points) => {
                    let lists = translate(points, &hidden.1, &hidden.0).map_err(of_scheme)?;
                    let others = hidden.0.n_records().saturating_sub(1);
                    let k = lists.longest().min(others).max(1);
                    (Some(lists), k)
                }
            };
            let near = || TrueNeighbors::new(&search, &hidden.1, slots, k);
            let near = clock.time(|s| &mut s.neighbors, near).map_err(of_scheme)?;
            for noise in plan.noises() {
                let outliers = clock.time(
                    |s| &mut s.neighbors,
                    || {
                        let noise = noise.unwrap_or(Noise::Uniform);
                        Outliers::new(noise, &near, &search, &hidden.1, seed)
                    },
                )?;
                for ratio in plan.ratios() {
                    let lists = clock.time(
                        |s| &mut s.neighbors,
                        || match (&given, ratio) {
                            (Some(lists), _) => Ok(lists.clone()),
                            (None, ratio) => near.lists(ratio.unwrap_or(1.0), &outliers, seed),
                        },
                    );
                    let lists = lists.map_err(of_scheme)?;
                    let measured = ratio.unwrap_or_else(|| near.measured_inlier_ratio(&lists));
                    for &solver in &plan.solvers {
                        let source = noise.map_or("given", Noise::name);
                        let what =
                            format!("{} at {measured:.2} {source}, {}", entry.name, solver.name());
                        observer.progress(done, total, &what);
                        // The attacker's own seed: that of the obfuscation is the owner's secret.
                        let attacker = u64::from(repeat);
                        let options = RecoverOptions { solver, delta: plan.delta, seed: attacker };
                        let started = Instant::now();
                        let recovered = recover(&hidden.0, &lists, &options)?;
                        let took = started.elapsed().as_secs_f64();
                        seconds[repeat_rows.len()] += took;
                        clock.seconds.recover += took;
                        let accuracy = clock.time(
                            |s| &mut s.evaluate,
                            || evaluate(&recovered, original, &hidden.1),
                        )?;
                        let mut row =
                            blank(entry, plan, (k, solver, noise), measured, &recovered, &hidden.1);
                        row.fill(&accuracy, &baseline, &plan.thresholds);
                        observer.cell(&Cell {
                            row: &row,
                            repeat,
                            original,
                            secret: &hidden.1,
                            released: &hidden.0,
                            recovered: &recovered,
                            accuracy: &accuracy,
                        });
                        repeat_rows.push(row);
                        done += 1;
                    }
                }
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

fn translate(
    given: &PointNeighbors,
    secret: &Secret,
    released: &Released<3>,
) -> Result<Neighborhoods, Error> {
    let scores = given.scores.as_deref();
    let slots = released.slots_per_record();
    oracle::from_points(&given.offsets, &given.neighbors, scores, secret, slots)
}

/// A row with everything but the measurements.
fn blank(
    entry: &Entry,
    plan: &Plan,
    (k, solver, noise): (usize, Solver, Option<Noise>),
    inlier_ratio: f64,
    recovered: &Recovered<3>,
    secret: &Secret,
) -> Row {
    let neighbors = match &plan.source {
        Source::Oracle => "oracle".to_owned(),
        Source::Given(given) => given.name.clone(),
    };
    let mut dropped = std::collections::BTreeMap::new();
    for reason in DropReason::ALL {
        let n = secret.dropped().iter().filter(|d| d.reason == reason).count();
        if n > 0 {
            dropped.insert(reason.name(), n);
        }
    }
    Row {
        scheme: entry.name,
        neighbors,
        oracle_noise: noise.map(Noise::name),
        inlier_ratio,
        k,
        solver: solver.name(),
        delta: recovered.delta(),
        unit: recovered.unit(),
        n_points: recovered.n_slots(),
        lost: Default::default(),
        dropped,
        recovered_percent: Vec::new(),
        blind_percent: Vec::new(),
        axis_accuracy_percent: None,
        assignment_accuracy_percent: None,
        error_percentiles: Vec::new(),
        ransac_trials: recovered.trials().map(|trials| trials.bins().collect()),
        repeats: None,
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
