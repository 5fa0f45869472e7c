//! The results of an attack, and the parts of the document that are made of them.

use serde_json::{Map, Value, json};
use unlift::audit::{NeighborsBy, NotAudited, Plan, Row, Seconds, Threshold};
use unlift::neighbors::Needs;
use unlift::recover::Builtin;
use unlift_report::{Document, RenderOptions};

use crate::sources;

/// What an attack gives, before gates.
#[derive(Default)]
pub struct Attacked {
    pub tried: Tried,
    /// The figures, and what else the attack knows of the document.
    pub document: Document,
    pub not_audited: Vec<NotAudited>,
    pub seconds: Seconds,
    /// A doubt per row, or none.
    pub doubts: Vec<Option<String>>,
    pub rendering: RenderOptions,
}

/// What an audit tries, by the names that its rows have.
#[derive(Clone, Default)]
pub struct Tried {
    pub schemes: Vec<String>,
    pub solvers: Vec<String>,
    pub sources: Vec<String>,
    /// Inlier ratios of the oracle; none without it.
    pub inlier_ratios: Vec<f64>,
    pub thresholds: Vec<Threshold>,
    /// Whether records alone could be attacked and are not.
    pub lacks_records_alone: bool,
    /// Whether descriptors are known and the best source for them is not tried.
    pub lacks_best_source: bool,
    /// Whether the strongest solver is not tried.
    pub lacks_joint: bool,
    /// Whether localization is measured.
    pub localizes: bool,
}

impl Tried {
    /// Returns what `plan` tries; `described` is true if there are descriptors. True neighbors alone replace a source, as no source
    /// is better.
    pub fn by<const D: usize>(plan: &Plan<D>, described: bool) -> Self {
        let described = described || plan.own_sources().any(|by| by.needs() != Needs::Nothing);
        let is_best = |by: &NeighborsBy<D>| match by {
            NeighborsBy::Oracle => plan.inlier_ratios.contains(&1.0),
            by => by.name() == sources::BY_DESCRIPTORS.name,
        };
        let inlier_ratios = if plan.asks_oracle() { &plan.inlier_ratios[..] } else { &[] };
        Self {
            schemes: plan.schemes.iter().map(|scheme| scheme.name().to_owned()).collect(),
            solvers: plan.solvers.iter().map(|solver| solver.name().to_owned()).collect(),
            sources: plan.neighbors.iter().map(|by| by.name().to_owned()).collect(),
            inlier_ratios: inlier_ratios.to_vec(),
            thresholds: plan.thresholds.clone(),
            lacks_records_alone: D == 3 && !plan.records_alone,
            lacks_best_source: described && !plan.neighbors.iter().any(is_best),
            lacks_joint: plan.solvers.iter().all(|by| by.builtin() != Some(Builtin::Joint)),
            localizes: false,
        }
    }
}

/// Returns the plan, the options of the user and the network that paints as recorded options.
pub fn options<const D: usize>(
    plan: &Plan<D>,
    given: &Map<String, Value>,
    inverter_sha256: Option<&str>,
) -> Map<String, Value> {
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
    record("thresholds", plan.thresholds.iter().map(|t| t.label.as_str()).collect());
    record("repeats", json!(plan.repeats));
    options.extend(given.clone());
    options.extend(inverter_sha256.map(|hash| ("inverter_sha256".to_owned(), hash.into())));
    options
}

/// Returns the options of the user, and the names of schemes and thresholds, as recorded options.
pub fn names(tried: &Tried, given: &Map<String, Value>) -> Map<String, Value> {
    let mut options = given.clone();
    options.insert("schemes".to_owned(), json!(tried.schemes));
    let labels = tried.thresholds.iter().map(|t| t.label.as_str());
    options.insert("thresholds".to_owned(), labels.collect());
    options
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

/// Lists what has no row, once per scheme, source and reason. If other rows of the source exist, the reason names the affected part.
pub fn not_audited<const D: usize>(plan: &Plan<D>, missing: &[NotAudited]) -> Vec<NotAudited> {
    let same = |a: &NotAudited, b: &NotAudited| {
        (&a.scheme, &a.neighbors, &a.reason) == (&b.scheme, &b.neighbors, &b.reason)
    };
    let n_parts = plan.oracle_noise.len() * plan.inlier_ratios.len();
    // The inlier ratio, with the noise model if there are several.
    let part = |part: &NotAudited| {
        let ratio = part.inlier_ratio.map(|ratio| ratio.to_string());
        let noise = part.oracle_noise.filter(|_| plan.oracle_noise.len() > 1);
        let noise = noise.map(|noise| format!(" ({noise})"));
        ratio.unwrap_or_default() + &noise.unwrap_or_default()
    };
    let mut listed = distinct(missing.to_vec(), same);
    for first in &mut listed {
        let parts: Vec<String> = missing.iter().filter(|of| same(of, first)).map(part).collect();
        if first.oracle_noise.is_some() && parts.len() < n_parts {
            first.reason = format!("at {}: {}", parts.join(", "), first.reason);
        }
    }
    listed
}

/// Removes items that repeat an earlier one, because an audit has one row per combination.
pub fn distinct<T>(items: Vec<T>, same: impl Fn(&T, &T) -> bool) -> Vec<T> {
    let mut kept: Vec<T> = Vec::with_capacity(items.len());
    for item in items {
        if !kept.iter().any(|earlier| same(earlier, &item)) {
            kept.push(item);
        }
    }
    kept
}
