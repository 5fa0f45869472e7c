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
        distinct_percent: row
            .distinct
            .as_ref()
            .map(|d| d.recovered_percent.clone())
            .unwrap_or_default(),
        inlier_ratio: row.inlier_ratio,
        median_error: row.median_error,
    };
    report::ImageFigures {
        name: Some(name.to_owned()),
        n_points: n_points as u64,
        rows: rows.iter().map(figures).collect(),
    }
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
    let mut groups: Vec<(&NotAudited, Vec<&NotAudited>)> = Vec::new();
    for part in missing {
        let same = |(first, _): &&mut (&NotAudited, Vec<&NotAudited>)| {
            (&first.scheme, &first.neighbors, &first.reason)
                == (&part.scheme, &part.neighbors, &part.reason)
        };
        match groups.iter_mut().find(same) {
            Some((_, all)) => all.push(part),
            None => groups.push((part, vec![part])),
        }
    }
    let text = |(first, all): (&NotAudited, Vec<&NotAudited>)| {
        let n_parts = plan.oracle_noise.len() * plan.inlier_ratios.len();
        let part = first.oracle_noise.filter(|_| all.len() < n_parts);
        let reason = part.map_or_else(
            || first.reason.clone(),
            |_| format!("at {}: {}", parts(plan, &all).join(", "), first.reason),
        );
        NotAudited { reason, ..first.clone() }
    };
    groups.into_iter().map(text).collect()
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
