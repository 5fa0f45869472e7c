//! Parts of the written document. Nothing is computed here.

use indexmap::IndexMap;
use serde_json::{Map, Value, json};
use unlift::audit::{self, NeighborsBy, NotAudited, Plan, Row};
use unlift::recover::Delta;
use unlift_report::document as report;

use crate::audit::Output;
use crate::gate::Tried;
use crate::tiles::Tile;

/// Returns the plan and `more` as recorded options.
pub fn options<const D: usize>(plan: &Plan<D>, more: Map<String, Value>) -> Map<String, Value> {
    let mut options = Map::new();
    let mut record = |name: &str, value: Value| _ = options.insert(name.to_owned(), value);
    record("schemes", plan.schemes.iter().map(|scheme| scheme.name()).collect());
    for (name, value) in plan.schemes.iter().flat_map(|scheme| scheme.parameters()) {
        record(name, json!(value));
    }
    if D == 3 {
        record("records_alone", json!(plan.records_alone));
    }
    record("neighbors", plan.neighbors.iter().map(NeighborsBy::name).collect());
    if plan.asks_oracle() {
        record("oracle_noise", plan.oracle_noise.iter().map(|noise| noise.name()).collect());
    }
    record("inlier_ratios", json!(plan.inlier_ratios));
    record("k", json!(plan.k));
    record("solver", plan.solvers.iter().map(|solver| solver.name()).collect());
    record(
        "delta",
        match plan.delta {
            Delta::Auto => json!("auto"),
            Delta::Fixed(delta) => json!(delta),
        },
    );
    record("thresholds", plan.thresholds.iter().map(|t| t.label.as_str()).collect());
    record("repeats", json!(plan.repeats));
    options.extend(more);
    options
}

/// Returns the names of schemes and thresholds, and `more`, as recorded options.
pub fn names(tried: &Tried, mut more: Map<String, Value>) -> Map<String, Value> {
    more.insert("schemes".to_owned(), json!(tried.schemes));
    let labels = tried.thresholds.iter().map(|t| t.label.as_str());
    more.insert("thresholds".to_owned(), labels.collect());
    more
}

/// Returns what the document says of the run itself.
pub fn run(output: &Output, seconds: &audit::Seconds) -> report::Run {
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
    report::Run {
        command: output.command.clone(),
        threads: rayon::current_num_threads() as u32,
        peak_memory_bytes: peak_bytes(),
        seconds: report::Seconds {
            total: output.started.elapsed().as_secs_f64(),
            rows: rows.collect(),
            stages: ordered(stages.map(|(name, s)| (name.to_owned(), s))),
        },
    }
}

/// Returns the figures of every tile: those of its `rows` that are in the pooled `results`.
pub fn tiles(tiles: &[Tile], rows: &[Vec<Row>], results: &[Row]) -> Vec<report::TileFigures> {
    let figures = |(tile, rows): (&Tile, &Vec<Row>)| {
        let percent = |result: &Row| {
            let row = rows.iter().find(|row| row.is_same_cell(result));
            row.map(|row| row.recovered_percent.clone()).unwrap_or_default()
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
pub fn image(name: &str, n_points: usize, rows: &[Row]) -> report::ImageFigures {
    let figures = |row: &Row| report::ImageRow {
        recovered_percent: row.recovered_percent.clone(),
        distinct_percent: row.distinct.clone().unwrap_or_default().recovered_percent,
        inlier_ratio: row.inlier_ratio,
        median_error: row.median_error,
    };
    let (name, rows) = (Some(name.to_owned()), rows.iter().map(figures).collect());
    report::ImageFigures { name, n_points: n_points as u64, rows }
}

/// Fields of a row that are unknown where points come from files.
const UNKNOWN: [&str; 6] = ["scheme", "neighbors", "oracle_noise", "inlier_ratio", "k", "solver"];

/// Returns a row as `evaluate` prints it: rounded, without the fields of its name, with `notes`.
pub fn evaluated(row: &Row, notes: &[String]) -> Result<Value, serde_json::Error> {
    let mut value = unlift_report::rounded(row)?;
    if let Some(fields) = value.as_object_mut() {
        fields.retain(|name, _| !UNKNOWN.contains(&name.as_str()));
        if row.blind_percent.is_empty() {
            fields.retain(|name, _| !name.starts_with("blind_"));
        }
        if !notes.is_empty() {
            fields.insert("notes".to_owned(), json!(notes));
        }
    }
    Ok(value)
}

/// Lists what has no row, once per scheme, source and reason. If other rows of the source exist,
/// the reason names the affected part.
pub fn not_audited<const D: usize>(plan: &Plan<D>, missing: &[NotAudited]) -> Vec<NotAudited> {
    let same = |a: &NotAudited, b: &NotAudited| {
        (&a.scheme, &a.neighbors, &a.reason) == (&b.scheme, &b.neighbors, &b.reason)
    };
    let n_parts = plan.oracle_noise.len() * plan.inlier_ratios.len();
    let mut listed: Vec<NotAudited> = Vec::new();
    for (at, first) in missing.iter().enumerate() {
        if missing[..at].iter().any(|earlier| same(earlier, first)) {
            continue;
        }
        let all = missing.iter().filter(|part| same(part, first));
        let reason = match first.oracle_noise.filter(|_| all.clone().count() < n_parts) {
            None => first.reason.clone(),
            Some(_) => {
                // Inlier ratios, with the noise model if there are several.
                let part = |part: &NotAudited| {
                    let ratio = part.inlier_ratio.map(|ratio| ratio.to_string());
                    let noise = part.oracle_noise.filter(|_| plan.oracle_noise.len() > 1);
                    let noise = noise.map(|noise| format!(" ({noise})"));
                    ratio.unwrap_or_default() + &noise.unwrap_or_default()
                };
                let parts: Vec<String> = all.map(part).collect();
                format!("at {}: {}", parts.join(", "), first.reason)
            }
        };
        listed.push(NotAudited { reason, ..first.clone() });
    }
    listed
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
