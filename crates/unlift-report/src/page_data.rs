//! The data of the page's script: the numbers of the tables, by position.

use serde::Serialize;

use crate::attack::{self, Given};
use crate::choices::{Choices, unit_sign};
use crate::document::{Document, LengthUnit, Row};
use crate::options::RenderOptions;
use crate::paper::{PublishedCurve, published_2d, published_3d};
use crate::pictures::{EncodedPicture, first_choice};
use crate::scene::Encoded;
use crate::{tables, verdict};

#[derive(Debug, Serialize)]
pub(crate) struct PageData<'a> {
    #[serde(flatten)]
    choices: Choices,
    thresholds: Vec<ThresholdData>,
    rows: Vec<RowData>,
    published: Vec<PublishedData>,
    headline: usize,
    /// `m`, `px`, or `×` for multiples of the usual distance to the K-th neighbor.
    unit: &'static str,
    scene: Option<&'a Encoded>,
    pictures: &'a [EncodedPicture],
    first_picture: Option<&'a str>,
}

impl PageData<'_> {
    pub(crate) fn has_published(&self) -> bool {
        !self.published.is_empty()
    }
}

#[derive(Debug, Serialize)]
struct ThresholdData {
    label: String,
    value: Option<f64>,
}

#[derive(Debug, Serialize)]
struct RowData {
    /// Places in the lists of [`Choices`].
    scheme: usize,
    given: usize,
    solver: usize,
    /// The label of this row's neighborhoods: `neighbors by descriptor overlap, 11 % right`.
    label: String,
    ratio: f64,
    attack: bool,
    strongest: Vec<bool>,
    recovered: Vec<Option<f64>>,
    errors: Vec<(f64, f64)>,
    /// (stated probability, share that was right), in percent, ascending; without bins of few
    /// points.
    reliability: Vec<(f64, f64)>,
    unknown: Option<String>,
}

#[derive(Debug, Serialize)]
struct PublishedData {
    dataset: &'static str,
    scheme: &'static str,
    threshold: usize,
    points: Vec<(f64, f64)>,
}

fn is_strongest(document: &Document, row: &Row, typed: &str) -> bool {
    let best = verdict::strongest_given(document, &row.scheme, &Given::of(row), typed);
    best.is_some_and(|best| std::ptr::eq(best, row))
}

/// Bins with at least this share of the released points are drawn; smaller ones scatter.
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
    let choices = Choices::of(document);
    let by_threshold = |map: &crate::document::ByThreshold| {
        thresholds.iter().map(|typed| map.get(typed).copied()).collect::<Vec<_>>()
    };
    let rows = document.results.iter().enumerate().filter_map(|(index, row)| {
        let cdf = options.error_cdf.iter().find(|cdf| cdf.row == index);
        let given = Given::of(row);
        Some(RowData {
            scheme: choices.scheme(&row.scheme)?,
            given: choices.given(&given)?,
            solver: choices.solver(&row.solver)?,
            label: given.label(),
            ratio: row.inlier_ratio,
            attack: attack::basis(row).is_some(),
            strongest: thresholds.iter().map(|typed| is_strongest(document, row, typed)).collect(),
            recovered: by_threshold(&row.recovered_percent),
            errors: cdf.map_or_else(|| percentile_points(row), |cdf| cdf.points.clone()),
            reliability: judged(row),
            unknown: row.sure_unknown.clone(),
        })
    });
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
        unit: unit_sign(document.results.first().map(|row| row.unit)),
        headline: tables::headline_threshold(document)
            .and_then(|typed| thresholds.iter().position(|other| *other == typed))
            .unwrap_or(0),
        choices,
        scene,
        first_picture: first_choice(pictures),
        pictures,
    }
}

/// Returns the published curves of tested schemes and thresholds; none for a map without a declared
/// scale.
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
    // Shares within thresholds lie on the same curve.
    for (typed, &percent) in &row.recovered_percent {
        points.extend(typed.parse().ok().map(|threshold: f64| (threshold, percent)));
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points
}
