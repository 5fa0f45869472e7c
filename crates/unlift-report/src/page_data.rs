//! The figures as the page's script reads them: the same numbers as the tables, by position.

use serde::Serialize;

use crate::document::{Document, LengthUnit, Row};
use crate::html::RenderOptions;
use crate::paper::{PublishedCurve, published_2d, published_3d};
use crate::pictures::EncodedPicture;
use crate::scene::Encoded;
use crate::{tables, words};

/// Schemes with a color and a mark of their own, the same on every page.
const KNOWN_SCHEMES: [&str; 7] = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"];
/// Colors and marks there are; further schemes reuse them in turn.
const SLOTS: usize = 8;

#[derive(Debug, Serialize)]
pub(crate) struct PageData<'a> {
    schemes: Vec<SchemeData>,
    solvers: Vec<String>,
    thresholds: Vec<ThresholdData>,
    rows: Vec<RowData<'a>>,
    published: Vec<PublishedData>,
    /// The threshold that is shown first.
    headline: usize,
    /// `m`, `px`, or `nd` for multiples of the neighbor distance.
    unit: &'static str,
    scene: Option<&'a Encoded>,
    pictures: &'a [EncodedPicture],
}

impl PageData<'_> {
    /// Whether any published curve stands beside ours.
    pub(crate) fn has_published(&self) -> bool {
        !self.published.is_empty()
    }
}

#[derive(Debug, Serialize)]
struct SchemeData {
    name: String,
    title: String,
    slot: usize,
}

#[derive(Debug, Serialize)]
struct ThresholdData {
    label: String,
    value: Option<f64>,
}

#[derive(Debug, Serialize)]
struct RowData<'a> {
    scheme: &'a str,
    /// The solver, with the neighborhoods it had where these are not the usual ones.
    solver: String,
    ratio: f64,
    oracle: bool,
    recovered: Vec<Option<f64>>,
    blind: Vec<Option<f64>>,
    /// (error, percent of the points within it), rising.
    errors: Vec<(f64, f64)>,
    /// (stated probability, share that came true), in percent, rising; bins of few points left out.
    reliability: Vec<(f64, f64)>,
}

#[derive(Debug, Serialize)]
struct PublishedData {
    dataset: &'static str,
    scheme: &'static str,
    threshold: usize,
    points: Vec<(f64, f64)>,
}

/// The color and mark of `scheme`; unknown ones take turns in the order they appear.
pub(crate) fn slot(document: &Document, scheme: &str) -> usize {
    // Schemes for images have the color of the scheme for maps that they are most like.
    let known = match scheme {
        "lines2d" => "olc",
        "cp2d" => "cp",
        "dcl2d" => "ray",
        other => other,
    };
    if let Some(slot) = KNOWN_SCHEMES.iter().position(|name| *name == known) {
        return slot;
    }
    let mut unknown: Vec<&str> = Vec::new();
    for row in &document.results {
        let name = row.scheme.as_str();
        if !KNOWN_SCHEMES.contains(&name) && !unknown.contains(&name) {
            unknown.push(name);
        }
    }
    let turn = unknown.iter().position(|name| *name == scheme).unwrap_or(0);
    (KNOWN_SCHEMES.len() + turn) % SLOTS
}

/// What tells apart the rows of one scheme: its curve on the page.
fn series(row: &Row) -> String {
    match row.neighbors.as_str() {
        "oracle" => words::method(&row.solver, row.oracle_noise.as_deref()),
        source => format!("{}, {source}", row.solver),
    }
}

/// Bins with at least this share of the released points are drawn: fewer scatter.
const LEAST_DRAWN: f64 = 0.005;

fn judged(row: &Row) -> Vec<(f64, f64)> {
    let least = LEAST_DRAWN * row.n_points as f64;
    row.reliability
        .iter()
        .flatten()
        .filter(|bin| bin.n as f64 >= least)
        .filter_map(|bin| Some((100.0 * bin.predicted?, 100.0 * bin.observed?)))
        .collect()
}

pub(crate) fn page_data<'a>(
    document: &'a Document,
    scene: Option<&'a Encoded>,
    pictures: &'a [EncodedPicture],
    options: &RenderOptions,
) -> PageData<'a> {
    let thresholds = tables::thresholds(document);
    let by_threshold = |map: &crate::document::ByThreshold| {
        thresholds.iter().map(|typed| map.get(typed).copied()).collect::<Vec<_>>()
    };
    let rows = document.results.iter().enumerate().map(|(index, row)| {
        let cdf = options.error_cdf.iter().find(|cdf| cdf.row == index);
        RowData {
            scheme: &row.scheme,
            solver: series(row),
            ratio: row.inlier_ratio,
            oracle: row.neighbors == "oracle",
            recovered: by_threshold(&row.recovered_percent),
            blind: by_threshold(&row.blind_percent),
            reliability: judged(row),
            errors: cdf.map_or_else(|| percentile_points(row), |cdf| cdf.points.clone()),
        }
    });
    let mut schemes: Vec<SchemeData> = Vec::new();
    let mut solvers: Vec<String> = Vec::new();
    for row in &document.results {
        if !schemes.iter().any(|scheme| scheme.name == row.scheme) {
            schemes.push(SchemeData {
                name: row.scheme.clone(),
                title: words::scheme_title(&row.scheme).to_owned(),
                slot: slot(document, &row.scheme),
            });
        }
        let method = series(row);
        if !solvers.contains(&method) {
            solvers.push(method);
        }
    }
    PageData {
        rows: rows.collect(),
        published: published(document, &thresholds),
        thresholds: thresholds
            .iter()
            .map(|typed| ThresholdData {
                label: tables::threshold_text(document, typed),
                value: typed.parse().ok(),
            })
            .collect(),
        unit: match document.results.first().map(|row| row.unit) {
            Some(LengthUnit::KthNeighbor) => "nd",
            Some(LengthUnit::Pixel) => "px",
            _ => "m",
        },
        headline: tables::headline_threshold(document)
            .and_then(|typed| thresholds.iter().position(|other| *other == typed))
            .unwrap_or(0),
        schemes,
        solvers,
        scene,
        pictures,
    }
}

/// Published curves whose scheme was tested and whose threshold is one of ours; none for a map
/// without a declared scale.
fn published(document: &Document, thresholds: &[String]) -> Vec<PublishedData> {
    let all = |unit| document.results.iter().all(|row| row.unit == unit);
    let published = match () {
        () if all(LengthUnit::Meter) => published_3d(),
        () if all(LengthUnit::Pixel) => published_2d(),
        () => return Vec::new(),
    };
    let same = |typed: &String, curve: &PublishedCurve| {
        typed.parse::<f64>().is_ok_and(|value| (value - curve.threshold).abs() < 1e-9)
    };
    let tested = |scheme: &str| document.results.iter().any(|row| row.scheme == scheme);
    let curves = published.into_iter().filter(|curve| tested(curve.scheme));
    let matched = curves.filter_map(|curve| {
        let threshold = thresholds.iter().position(|typed| same(typed, &curve))?;
        let PublishedCurve { dataset, scheme, points, .. } = curve;
        Some(PublishedData { dataset, scheme, threshold, points })
    });
    matched.collect()
}

fn percentile_points(row: &crate::document::Row) -> Vec<(f64, f64)> {
    let points = row.error_percentiles.iter();
    let mut points: Vec<(f64, f64)> =
        points.filter_map(|(percent, error)| Some(((*error)?, percent.parse().ok()?))).collect();
    // The shares within the thresholds are points of the same curve.
    for (typed, &percent) in &row.recovered_percent {
        points.extend(typed.parse().ok().map(|threshold: f64| (threshold, percent)));
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points
}
