//! The figures as tables of text: what the page shows without script.

use serde::Serialize;

use crate::document::{Bound, ByReason, Document, LengthUnit, Row};
use crate::words;

/// A table of text.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Table {
    pub id: &'static str,
    pub caption: String,
    pub head: Vec<String>,
    /// Cells; the first `labels` of each row are text, the rest are numbers.
    pub rows: Vec<Vec<String>>,
    pub labels: usize,
}

const NONE: &str = "–";

/// The main figures: percent recovered and the blind attacker's percent, a column per threshold.
pub(crate) fn recovered(document: &Document) -> Table {
    let thresholds = thresholds(document);
    let mut head = texts(&["scheme", "solver", "neighbors right", "K", "delta"]);
    for typed in &thresholds {
        head.push(format!("within {}, %", threshold_text(document, typed)));
    }
    for typed in &thresholds {
        head.push(format!("blind, within {}, %", threshold_text(document, typed)));
    }
    let points = document.results.first().map_or("points", |row| words::points(row.unit));
    head.push(points.to_owned());
    let rows = document.results.iter().map(|row| {
        let mut cells = key_cells(row);
        cells.push(row.k.to_string());
        cells.push(row.delta.map_or(NONE.into(), |delta| words::length(delta, row.unit)));
        for typed in &thresholds {
            let spread = row.std.as_ref().and_then(|std| std.recovered_percent.get(typed));
            cells.push(percent_cell(row.recovered_percent.get(typed), spread));
        }
        for typed in &thresholds {
            let spread = row.std.as_ref().and_then(|std| std.blind_percent.get(typed));
            cells.push(percent_cell(row.blind_percent.get(typed), spread));
        }
        cells.push(words::thousands(row.n_points));
        cells
    });
    let repeats = document.results.iter().map(|row| row.repeats).max().unwrap_or(1);
    let spread = if repeats > 1 {
        format!(" Mean ± standard deviation over {repeats} seeds.")
    } else {
        String::new()
    };
    Table {
        id: "recovered",
        caption: format!("Recovered {points}, in percent of the {points} released.{spread}"),
        rows: rows.collect(),
        head,
        labels: 2,
    }
}

/// The shares over distinct places; `None` when no row has them.
pub(crate) fn distinct(document: &Document) -> Option<Table> {
    document.results.iter().find(|row| row.distinct.is_some())?;
    let thresholds = thresholds(document);
    let mut head = texts(&["scheme", "solver", "neighbors right"]);
    for typed in &thresholds {
        head.push(format!("within {}, %", threshold_text(document, typed)));
    }
    for typed in &thresholds {
        head.push(format!("blind, within {}, %", threshold_text(document, typed)));
    }
    head.push("places".to_owned());
    let rows = document.results.iter().filter_map(|row| {
        let distinct = row.distinct.as_ref()?;
        let mut cells = key_cells(row);
        for shares in [&distinct.recovered_percent, &distinct.blind_percent] {
            cells.extend(thresholds.iter().map(|typed| percent_cell(shares.get(typed), None)));
        }
        cells.push(words::thousands(distinct.n_places));
        Some(cells)
    });
    Some(Table {
        id: "distinct",
        caption: "The same over distinct places: keypoints that lie on each other count once."
            .to_owned(),
        rows: rows.collect(),
        head,
        labels: 2,
    })
}

/// Percentiles of the error.
pub(crate) fn errors(document: &Document) -> Table {
    let mut percentiles: Vec<&String> = Vec::new();
    for key in document.results.iter().flat_map(|row| row.error_percentiles.keys()) {
        if !percentiles.contains(&key) {
            percentiles.push(key);
        }
    }
    let mut head = texts(&["scheme", "solver", "neighbors right", "median", "blind, median"]);
    head.extend(percentiles.iter().map(|key| format!("{key} % within")));
    let rows = document.results.iter().map(|row| {
        let mut cells = key_cells(row);
        let text = |value: Option<f64>| value.map_or(NONE.into(), |v| words::length(v, row.unit));
        cells.push(text(row.median_error));
        cells.push(text(row.blind_median_error));
        for key in &percentiles {
            cells.push(text(row.error_percentiles.get(*key).copied().flatten()));
        }
        cells
    });
    Table {
        id: "errors",
        caption: "Errors. Lost points count as infinitely far; a dash is a percentile among them."
            .to_owned(),
        rows: rows.collect(),
        head,
        labels: 2,
    }
}

/// Break-even ratios, for every threshold.
pub(crate) fn break_even(document: &Document) -> Table {
    let rows = document.break_even.iter().map(|point| {
        let ratio = point.inlier_ratio.map(words::ratio_percent);
        let ratio = match (point.bound, ratio) {
            (Bound::Interpolated, Some(ratio)) => format!("{ratio} %"),
            (Bound::BelowTested, Some(ratio)) => format!("at most {ratio} %"),
            (Bound::AboveTested, Some(ratio)) => format!("more than {ratio} %"),
            (_, None) => "not reached".to_owned(),
        };
        let within = threshold_text(document, &point.threshold);
        let method = words::method(&point.solver, point.oracle_noise.as_deref());
        vec![point.scheme.clone(), method, within, ratio]
    });
    Table {
        id: "break-even",
        caption: "Break-even: the smallest share of right neighbors at which half of the points come back."
            .to_owned(),
        head: texts(&["scheme", "solver", "within", "neighbors right"]),
        rows: rows.collect(),
        labels: 2,
    }
}

/// Points lost and dropped by reason, axis and descriptor accuracy.
pub(crate) fn losses(document: &Document) -> Table {
    let percent = |value: Option<f64>| value.map_or(NONE.into(), words::percent);
    let rows = document.results.iter().map(|row| {
        let mut cells = key_cells(row);
        cells.extend([
            words::thousands(row.n_points),
            reasons(&row.dropped),
            words::thousands(row.n_lost),
            reasons(&row.lost),
            percent(row.axis_accuracy_percent),
            percent(row.exact_percent),
            percent(row.assignment_accuracy_percent),
            percent(row.sure_percent),
            percent(row.sure_correct_percent),
        ]);
        cells
    });
    let columns = [
        "points released",
        "not released",
        "lost",
        "lost by reason",
        "axis right, %",
        "exact, %",
        "descriptor right, %",
        "sure, %",
        "sure and right, %",
    ];
    let mut head = texts(&["scheme", "solver", "neighbors right"]);
    head.extend(texts(&columns));
    Table {
        id: "losses",
        caption: "Points not released by the scheme, points the recovery gave up, choices it got right, and points it is sure of."
            .to_owned(),
        head,
        rows: rows.collect(),
        labels: 2,
    }
}

/// RANSAC's trials per point; `None` when no row has them.
pub(crate) fn trials(document: &Document) -> Option<Table> {
    let mut rows = Vec::new();
    for row in &document.results {
        let Some(bins) = &row.ransac_trials else {
            continue;
        };
        let text: Vec<String> = bins
            .iter()
            .map(|(bound, count)| {
                format!("≤ {}: {}", words::thousands(*bound), words::thousands(*count))
            })
            .collect();
        let mut cells = key_cells(row);
        cells.push(text.join(" · "));
        rows.push(cells);
    }
    (!rows.is_empty()).then(|| Table {
        id: "trials",
        caption: "RANSAC: number of points by trials needed.".to_owned(),
        head: texts(&["scheme", "solver", "neighbors right", "points by trials"]),
        rows,
        labels: 2,
    })
}

/// Seconds per row and stage; `None` when the run has none.
pub(crate) fn times(document: &Document) -> Option<Table> {
    let seconds = &document.run.seconds;
    let mut stages: Vec<&String> = Vec::new();
    for stage in seconds.rows.iter().flat_map(|row| row.keys()) {
        if !stages.contains(&stage) {
            stages.push(stage);
        }
    }
    if stages.is_empty() {
        return None;
    }
    let rows = document.results.iter().zip(&seconds.rows).map(|(row, times)| {
        let mut cells = key_cells(row);
        let text =
            |stage: &&String| times.get(*stage).map_or(NONE.into(), |s| words::significant(*s, 3));
        cells.extend(stages.iter().map(text));
        cells
    });
    let rows = rows.collect();
    let mut head = texts(&["scheme", "solver", "neighbors right"]);
    head.extend(stages.iter().map(|stage| format!("{stage}, s")));
    Some(Table { id: "times", caption: "Seconds by stage.".to_owned(), head, rows, labels: 2 })
}

/// Every threshold of the document, as typed, in order.
pub(crate) fn thresholds(document: &Document) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for typed in document.results.iter().flat_map(|row| row.recovered_percent.keys()) {
        if !all.contains(typed) {
            all.push(typed.clone());
        }
    }
    all
}

/// In pixels, the threshold that speaks for an image: half way between exact and roughly right.
const HEADLINE_PX: f64 = 10.0;

/// The threshold that verdicts are about: the first; for images the one nearest to 10 px.
pub(crate) fn headline_threshold(document: &Document) -> Option<String> {
    let all = thresholds(document);
    if document.results.first().is_none_or(|row| row.unit != LengthUnit::Pixel) {
        return all.into_iter().next();
    }
    let away = |typed: &String| {
        typed.parse::<f64>().map_or(f64::INFINITY, |value| (value / HEADLINE_PX).ln().abs())
    };
    all.into_iter().min_by(|a, b| away(a).total_cmp(&away(b)))
}

/// A threshold in words of the document's unit.
pub(crate) fn threshold_text(document: &Document, typed: &str) -> String {
    match document.results.first() {
        Some(row) => words::threshold(typed, row.unit),
        None => typed.to_owned(),
    }
}

pub(crate) fn key_cells(row: &Row) -> Vec<String> {
    vec![row.scheme.clone(), row.solver.clone(), ratio_cell(row)]
}

/// How many neighbors are right, and who says who they are unless that is a uniform oracle.
fn ratio_cell(row: &Row) -> String {
    let source = match (row.neighbors.as_str(), row.oracle_noise.as_deref()) {
        ("oracle", None | Some("uniform")) => String::new(),
        ("oracle", Some(noise)) => format!(" ({noise})"),
        (source, _) => format!(" ({source})"),
    };
    format!("{} %{source}", words::ratio_percent(row.inlier_ratio))
}

fn percent_cell(value: Option<&f64>, spread: Option<&f64>) -> String {
    match (value, spread) {
        (None, _) => NONE.to_owned(),
        (Some(value), None) => words::percent(*value),
        (Some(value), Some(spread)) => {
            format!("{} ± {}", words::percent(*value), words::percent(*spread))
        }
    }
}

fn reasons(map: &ByReason) -> String {
    if map.values().all(|&count| count == 0) {
        return NONE.to_owned();
    }
    let parts = map.iter().filter(|(_, count)| **count > 0);
    let parts =
        parts.map(|(name, count)| format!("{} {}", words::thousands(*count), words::reason(name)));
    parts.collect::<Vec<_>>().join(", ")
}

fn texts(items: &[&str]) -> Vec<String> {
    items.iter().map(|item| (*item).to_owned()).collect()
}
