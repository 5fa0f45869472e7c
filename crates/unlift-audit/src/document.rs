//! Converts an audit's outcome to the written document. Nothing is computed here.

use std::time::Instant;

use indexmap::IndexMap;
use serde_json::{Map, Value, json};
use unlift::Unit;
use unlift::audit::{self, NeighborsBy, NotAudited, Plan, Row, Threshold};
use unlift::recover::Delta;
use unlift_report::Given;
use unlift_report::document as report;

use crate::gate::Tried;
use crate::tiles::Tile;

/// Facts about an audit that its outcome does not contain.
pub struct Provenance {
    /// The input files.
    pub input: report::Input,
    /// The recorded options.
    pub options: Map<String, Value>,
    /// Notes for readers of the figures.
    pub notes: Vec<String>,
    /// Gates and their results.
    pub gates: Vec<report::GateResult>,
    /// The command line, if there was one.
    pub command: Option<String>,
    /// The start of the audit.
    pub started: Instant,
}

/// Returns the plan and `more` as recorded options.
pub fn options<const D: usize>(plan: &Plan<D>, more: Map<String, Value>) -> Map<String, Value> {
    let names: Vec<&str> = plan.schemes.iter().map(|scheme| scheme.name()).collect();
    let labels: Vec<&str> = plan.thresholds.iter().map(|t| t.label.as_str()).collect();
    let mut options = Map::new();
    options.insert("schemes".into(), json!(names));
    for (name, value) in plan.schemes.iter().flat_map(|scheme| scheme.parameters()) {
        options.insert(name.into(), json!(value));
    }
    if D == 3 {
        options.insert("records_alone".into(), json!(plan.records_alone));
    }
    let neighbors: Vec<&str> = plan.neighbors.iter().map(NeighborsBy::name).collect();
    options.insert("neighbors".into(), json!(neighbors));
    if plan.asks_oracle() {
        let names: Vec<&str> = plan.oracle_noise.iter().map(|noise| noise.name()).collect();
        options.insert("oracle_noise".into(), json!(names));
    }
    options.insert("inlier_ratios".into(), json!(plan.inlier_ratios));
    options.insert("k".into(), json!(plan.k));
    options
        .insert("solver".into(), json!(plan.solvers.iter().map(|s| s.name()).collect::<Vec<_>>()));
    let delta = match plan.delta {
        Delta::Auto => json!("auto"),
        Delta::Fixed(delta) => json!(delta),
    };
    options.insert("delta".into(), delta);
    options.insert("thresholds".into(), json!(labels));
    options.insert("repeats".into(), json!(plan.repeats));
    options.extend(more);
    options
}

/// Returns the names of schemes and thresholds, and `more`, as recorded options.
pub fn names(tried: &Tried, more: Map<String, Value>) -> Map<String, Value> {
    let thresholds: Vec<&str> = tried.thresholds.iter().map(|t| t.label.as_str()).collect();
    let named = [("schemes", json!(tried.schemes)), ("thresholds", json!(thresholds))];
    let named = named.into_iter().map(|(name, value)| (name.to_owned(), value));
    more.into_iter().chain(named).collect()
}

/// The results of an audit of a map or of images.
pub struct Found<'a> {
    /// One row per combination.
    pub rows: &'a [Row],
    /// Combinations without a row.
    pub not_audited: &'a [NotAudited],
    /// The inlier ratios at which half of the points come back.
    pub break_even: &'a [audit::BreakEven],
    /// The times of the stages.
    pub seconds: &'a audit::Seconds,
}

/// Builds the document of an audit. For images, the caller adds the figures of each image.
pub fn document<const D: usize>(
    plan: &Plan<D>,
    outcome: &Found<'_>,
    provenance: Provenance,
) -> report::Document {
    let seconds = outcome.seconds;
    let stages = [
        ("search", seconds.search),
        ("obfuscate", seconds.obfuscate),
        ("neighbors", seconds.neighbors),
        ("recover", seconds.recover),
        ("records_alone", seconds.records_alone),
        ("evaluate", seconds.evaluate),
    ];
    let rows = seconds.rows.iter().map(|row| {
        let made = (row.neighbors > 0.0).then(|| ("neighbors".to_owned(), row.neighbors));
        ordered(made.into_iter().chain([("recover".to_owned(), row.recover)]))
    });
    report::Document {
        unlift: env!("CARGO_PKG_VERSION").to_owned(),
        schema: report::SCHEMA,
        input: provenance.input,
        options: provenance.options,
        seed: plan.seed,
        results: outcome.rows.iter().map(|r| row(r, &plan.thresholds)).collect(),
        not_audited: not_audited(plan, outcome.not_audited),
        notes: provenance.notes,
        break_even: outcome.break_even.iter().map(break_even).collect(),
        gates: provenance.gates,
        images: Vec::new(),
        tiles: Vec::new(),
        localization: Vec::new(),
        run: report::Run {
            command: provenance.command,
            threads: rayon::current_num_threads() as u32,
            peak_memory_bytes: peak_bytes(),
            seconds: report::Seconds {
                total: provenance.started.elapsed().as_secs_f64(),
                rows: rows.collect(),
                stages: ordered(stages.map(|(name, s)| (name.to_owned(), s))),
            },
        },
    }
}

fn by_threshold(thresholds: &[Threshold], percents: &[f64]) -> report::ByThreshold {
    ordered(thresholds.iter().map(|t| t.label.clone()).zip(percents.iter().copied()))
}

/// Returns the figures of every tile: those of its `rows` that are in the pooled `results`.
pub fn tiles(
    tiles: &[Tile],
    rows: &[Vec<Row>],
    results: &[Row],
    thresholds: &[Threshold],
) -> Vec<report::TileFigures> {
    let figures = |(tile, rows): (&Tile, &Vec<Row>)| {
        let percent = |result: &Row| {
            let row = rows.iter().find(|row| row.is_same_cell(result));
            row.map(|row| by_threshold(thresholds, &row.recovered_percent)).unwrap_or_default()
        };
        report::TileFigures {
            bounds: Some(tile.bounds),
            n_points: tile.rows.len() as u64,
            recovered_percent: results.iter().map(percent).collect(),
        }
    };
    tiles.iter().zip(rows).map(figures).collect()
}

/// Returns the figures of one image of an audit.
pub fn image(
    name: &str,
    n_points: usize,
    rows: &[Row],
    thresholds: &[Threshold],
) -> report::ImageFigures {
    let figures = |row: &Row| report::ImageRow {
        recovered_percent: by_threshold(thresholds, &row.recovered_percent),
        distinct_percent: row
            .distinct
            .as_ref()
            .map(|d| by_threshold(thresholds, &d.recovered_percent))
            .unwrap_or_default(),
        inlier_ratio: row.inlier_ratio,
        median_error: row.error_percentiles.first().copied().flatten(),
    };
    report::ImageFigures {
        name: Some(name.to_owned()),
        n_points: n_points as u64,
        rows: rows.iter().map(figures).collect(),
    }
}

/// Returns the neighborhoods of a row, as the page distinguishes them.
pub(crate) fn given(row: &Row) -> Given {
    Given {
        neighbors: row.neighbors.clone(),
        oracle_noise: row.oracle_noise.map(str::to_owned),
        inlier_ratio: row.inlier_ratio,
    }
}

/// Fields of a row that are unknown where points come from files.
const UNKNOWN: [&str; 6] = ["scheme", "neighbors", "oracle_noise", "inlier_ratio", "k", "solver"];

/// Returns a row as `evaluate` prints it: rounded, without the fields of its name, with `notes`.
pub fn evaluated(
    found: &Row,
    thresholds: &[Threshold],
    notes: &[String],
) -> Result<Value, serde_json::Error> {
    let mut value = unlift_report::rounded(&row(found, thresholds))?;
    if let Some(fields) = value.as_object_mut() {
        fields.retain(|name, _| !UNKNOWN.contains(&name.as_str()));
        if found.blind_percent.is_empty() {
            fields.retain(|name, _| !name.starts_with("blind_"));
        }
        if !notes.is_empty() {
            fields.insert("notes".to_owned(), json!(notes));
        }
    }
    Ok(value)
}

/// Converts a row to its written form.
pub fn row(row: &Row, thresholds: &[Threshold]) -> report::Row {
    let by_threshold = |percents: &[f64]| by_threshold(thresholds, percents);
    let by_reason = |counts: &std::collections::BTreeMap<&'static str, usize>| {
        ordered(counts.iter().map(|(reason, &n)| ((*reason).to_owned(), n as u64)))
    };
    let labels = || thresholds.iter().map(|t| t.label.clone());
    let label = |p: f64| format!("{p:.0}");
    let alone: Option<Vec<(&str, f64)>> =
        (0..thresholds.len()).map(|at| row.best_alone(at)).collect();
    report::Row {
        scheme: row.scheme.clone(),
        neighbors: row.neighbors.clone(),
        oracle_noise: row.oracle_noise.map(str::to_owned),
        inlier_ratio: row.inlier_ratio,
        k: row.k as u32,
        solver: row.solver.to_owned(),
        delta: Some(row.delta),
        unit: match row.unit {
            Unit::Meter => report::LengthUnit::Meter,
            Unit::KthNeighbor => report::LengthUnit::KthNeighbor,
            Unit::Pixel => report::LengthUnit::Pixel,
        },
        n_points: row.n_points as u64,
        n_lost: row.n_lost() as u64,
        lost: by_reason(&row.lost),
        dropped: by_reason(&row.dropped),
        recovered_percent: by_threshold(&row.recovered_percent),
        blind_percent: by_threshold(&row.blind_percent),
        records_alone_percent: alone
            .as_ref()
            .map(|best| ordered(labels().zip(best.iter().map(|(_, percent)| *percent)))),
        records_alone_by: alone
            .map(|best| ordered(labels().zip(best.iter().map(|(name, _)| (*name).to_owned())))),
        axis_accuracy_percent: row.axis_accuracy_percent,
        exact_percent: row.exact_percent,
        assignment_accuracy_percent: row.assignment_accuracy_percent,
        metrics: ordered(row.metrics.iter().map(|(name, &value)| (name.clone(), value))),
        median_error: row.error_percentiles[0],
        blind_median_error: row.blind_median_error,
        error_percentiles: ordered(
            audit::PERCENTILES.iter().map(|&p| label(p)).zip(row.error_percentiles.iter().copied()),
        ),
        sure_unknown: row.sure_unknown.map(|unknown| unknown.reason().to_owned()),
        sure_percent: row.reliability.as_ref().map(|r| r.sure_percent()),
        sure_correct_percent: row.reliability.as_ref().and_then(|r| r.sure_correct_percent()),
        reliability: row.reliability.as_ref().map(|r| r.bins.iter().map(bin).collect()),
        ransac_trials: row
            .ransac_trials
            .as_ref()
            .map(|bins| bins.iter().map(|&(up_to, n)| (u64::from(up_to), n)).collect()),
        repeats: row.repeats.as_ref().map_or(1, |r| r.n),
        std: row.repeats.as_ref().map(|r| report::Spread {
            recovered_percent: by_threshold(&r.recovered_percent_std),
            blind_percent: by_threshold(&r.blind_percent_std),
            median_error: r.median_error_std,
        }),
        distinct: row.distinct.as_ref().map(|d| report::Distinct {
            n_places: d.n_places as u64,
            recovered_percent: by_threshold(&d.recovered_percent),
            blind_percent: by_threshold(&d.blind_percent),
        }),
    }
}

/// Lists what has no row, once per scheme, source and reason. If other rows of the source exist,
/// the reason names the affected part.
fn not_audited<const D: usize>(plan: &Plan<D>, missing: &[NotAudited]) -> Vec<report::NotAudited> {
    let mut told: Vec<(&NotAudited, Vec<&NotAudited>)> = Vec::new();
    for part in missing {
        let same = |(first, _): &&mut (&NotAudited, Vec<&NotAudited>)| {
            (&first.scheme, &first.neighbors, &first.reason)
                == (&part.scheme, &part.neighbors, &part.reason)
        };
        match told.iter_mut().find(same) {
            Some((_, all)) => all.push(part),
            None => told.push((part, vec![part])),
        }
    }
    let text = |(first, all): (&NotAudited, Vec<&NotAudited>)| {
        let asked = plan.oracle_noise.len() * plan.inlier_ratios.len();
        let part = first.oracle_noise.filter(|_| all.len() < asked);
        let reason = part.map_or_else(
            || first.reason.clone(),
            |_| format!("at {}: {}", parts(plan, &all).join(", "), first.reason),
        );
        let (scheme, neighbors) = (first.scheme.clone(), first.neighbors.clone());
        report::NotAudited { scheme, neighbors, reason }
    };
    told.into_iter().map(text).collect()
}

/// Returns inlier ratios, with the noise model if there are several.
fn parts<const D: usize>(plan: &Plan<D>, missing: &[&NotAudited]) -> Vec<String> {
    let part = |missing: &&NotAudited| {
        let ratio = missing.inlier_ratio.map(|ratio| ratio.to_string()).unwrap_or_default();
        match missing.oracle_noise {
            Some(noise) if plan.oracle_noise.len() > 1 => format!("{ratio} ({noise})"),
            _ => ratio,
        }
    };
    missing.iter().map(part).collect()
}

fn bin(bin: &unlift::evaluate::Bin) -> report::ReliabilityBin {
    report::ReliabilityBin { predicted: bin.predicted(), observed: bin.observed(), n: bin.n as u64 }
}

fn break_even(row: &audit::BreakEven) -> report::BreakEven {
    report::BreakEven {
        scheme: row.scheme.clone(),
        solver: row.solver.to_owned(),
        oracle_noise: Some(row.oracle_noise.to_owned()),
        threshold: row.threshold.clone(),
        inlier_ratio: Some(row.inlier_ratio),
        bound: match row.bound {
            audit::Bound::Interpolated => report::Bound::Interpolated,
            audit::Bound::BelowTested => report::Bound::BelowTested,
            audit::Bound::AboveTested => report::Bound::AboveTested,
        },
    }
}

/// Collects pairs into an ordered map.
pub fn ordered<V>(pairs: impl IntoIterator<Item = (String, V)>) -> IndexMap<String, V> {
    pairs.into_iter().collect()
}

/// Returns the peak resident memory of this process in bytes, if the system reports it (Linux).
pub fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}
