//! The figures as tables of text: what the page shows without script.

mod details;
mod pictures;

use serde::Serialize;

use crate::document::{Bound, Document, LengthUnit, Row};
use crate::{attack, words};

pub(crate) use details::{choices, losses, metrics, times, trials};
pub(crate) use pictures::{likeness, objects};

/// A table of text.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Table {
    pub id: &'static str,
    pub caption: String,
    pub columns: Vec<Column>,
    /// Cells by row; as many as there are columns.
    pub rows: Vec<Vec<String>>,
    /// What a cell means that a head cannot say.
    pub notes: Vec<String>,
}

/// The head of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Column {
    pub name: String,
    pub class: Class,
}

/// How the cells of a column are set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Class {
    /// Names, flush left, on one line.
    Label,
    /// Figures, flush right.
    Figure,
    /// Text that may be long: flush left, on several lines.
    Prose,
}

const NONE: &str = "–";

impl Table {
    /// Without columns of dashes: what no row has takes no room.
    fn without_empty_columns(mut self) -> Self {
        let kept: Vec<bool> = (0..self.columns.len())
            .map(|at| self.rows.is_empty() || self.rows.iter().any(|row| row[at] != NONE))
            .collect();
        let mut keep = kept.iter();
        self.columns.retain(|_| *keep.next().unwrap_or(&true));
        for row in &mut self.rows {
            let mut keep = kept.iter();
            row.retain(|_| *keep.next().unwrap_or(&true));
        }
        self
    }
}

pub(crate) fn column(name: impl Into<String>, class: Class) -> Column {
    Column { name: name.into(), class }
}

/// The columns that tell rows apart.
fn key_columns() -> Vec<Column> {
    let labels = ["scheme", "solver", "neighbors by"].map(|name| column(name, Class::Label));
    labels.into_iter().chain([column("of them right", Class::Figure)]).collect()
}

fn key_cells(row: &Row) -> Vec<String> {
    let source = attack::source(&row.neighbors, row.oracle_noise.as_deref());
    let right = format!("{} %", words::ratio_percent(row.inlier_ratio));
    vec![row.scheme.clone(), row.solver.clone(), source, right]
}

fn within_columns(document: &Document) -> impl Iterator<Item = Column> {
    let names = thresholds(document).into_iter().map(|typed| threshold_text(document, &typed));
    names.map(|name| column(format!("within {name}, %"), Class::Figure))
}

fn points(document: &Document) -> &'static str {
    document.results.first().map_or("points", |row| words::points(row.unit))
}

/// The main figures: percent recovered, a column per threshold.
pub(crate) fn recovered(document: &Document) -> Table {
    let thresholds = thresholds(document);
    let mut columns = key_columns();
    columns.extend(["K", "delta"].map(|name| column(name, Class::Figure)));
    columns.extend(within_columns(document));
    let points = points(document);
    columns.push(column(points, Class::Figure));
    let rows = document.results.iter().map(|row| {
        let mut cells = key_cells(row);
        cells.push(row.k.to_string());
        cells.push(row.delta.map_or(NONE.into(), |delta| words::length(delta, row.unit)));
        for typed in &thresholds {
            let spread = row.std.as_ref().and_then(|std| std.recovered_percent.get(typed));
            cells.push(percent_cell(row.recovered_percent.get(typed), spread));
        }
        cells.push(words::thousands(row.n_points));
        cells
    });
    let repeats = document.results.iter().map(|row| row.repeats).max().unwrap_or(1);
    let spread = if repeats > 1 {
        format!(
            " Mean ± standard deviation (where above {SPREAD_THAT_COUNTS}) over {repeats} seeds."
        )
    } else {
        String::new()
    };
    let table = Table {
        id: "recovered",
        caption: format!("Recovered {points}, in percent of the {points} released.{spread}"),
        rows: rows.collect(),
        columns,
        notes: Vec::new(),
    };
    table.without_empty_columns()
}

/// What an attacker gets without neighborhoods, per scheme: by a guess, and by the records alone.
pub(crate) fn baselines(document: &Document) -> Table {
    let thresholds = thresholds(document);
    let mut columns = ["scheme", "attacker"].map(|name| column(name, Class::Label)).to_vec();
    columns.extend(within_columns(document));
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut schemes: Vec<&str> = Vec::new();
    for row in &document.results {
        if !schemes.contains(&row.scheme.as_str()) {
            schemes.push(&row.scheme);
        }
    }
    for scheme in schemes {
        let of = || document.results.iter().filter(|row| row.scheme == scheme);
        let mut add = |cells: Vec<String>| {
            // Rows of one scheme share their baselines: each is said once.
            if !rows.contains(&cells) {
                rows.push(cells);
            }
        };
        for row in of() {
            let spread = |typed| row.std.as_ref().and_then(|std| std.blind_percent.get(typed));
            let shares = thresholds
                .iter()
                .map(|typed| percent_cell(row.blind_percent.get(typed), spread(typed)));
            add([scheme.to_owned(), "blind guess".to_owned()].into_iter().chain(shares).collect());
        }
        for row in of() {
            let Some(alone) = &row.records_alone_percent else { continue };
            // Another attack may be best at another threshold.
            let mut by: Vec<&str> = Vec::new();
            for name in row.records_alone_by.iter().flat_map(|by| by.values()) {
                if !by.contains(&name.as_str()) {
                    by.push(name);
                }
            }
            let who = attack::records_alone((!by.is_empty()).then(|| by.join("; ")).as_deref());
            let shares = thresholds.iter().map(|typed| percent_cell(alone.get(typed), None));
            add([scheme.to_owned(), who].into_iter().chain(shares).collect());
        }
    }
    Table {
        id: "baselines",
        caption: "Without neighborhoods: what neighborhoods give away is what exceeds the larger of both."
            .to_owned(),
        columns,
        rows,
        notes: Vec::new(),
    }
}

/// The shares over distinct places; `None` when no row has them.
pub(crate) fn distinct(document: &Document) -> Option<Table> {
    document.results.iter().find(|row| row.distinct.is_some())?;
    let thresholds = thresholds(document);
    let mut columns = key_columns();
    columns.extend(within_columns(document));
    for typed in &thresholds {
        let name = format!("blind, within {}, %", threshold_text(document, typed));
        columns.push(column(name, Class::Figure));
    }
    columns.push(column("places", Class::Figure));
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
        columns,
        notes: Vec::new(),
    })
}

/// Percentiles of the error.
pub(crate) fn errors(document: &Document) -> Table {
    let mut percentiles: Vec<&String> = Vec::new();
    for key in document.results.iter().flat_map(|row| row.error_percentiles.keys()) {
        // Half within is the median, which has a column.
        if !percentiles.contains(&key) && key != "50" {
            percentiles.push(key);
        }
    }
    let mut columns = key_columns();
    columns.extend(["median", "blind, median"].map(|name| column(name, Class::Figure)));
    let names = percentiles.iter().map(|key| format!("{key} % within"));
    columns.extend(names.map(|name| column(name, Class::Figure)));
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
    let table = Table {
        id: "errors",
        caption: "Errors. Lost points count as infinitely far; a dash is a percentile among them."
            .to_owned(),
        rows: rows.collect(),
        columns,
        notes: Vec::new(),
    };
    table.without_empty_columns()
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
        let source = attack::source("oracle", point.oracle_noise.as_deref());
        vec![point.scheme.clone(), point.solver.clone(), source, within, ratio]
    });
    let labels = ["scheme", "solver", "neighbors by"].map(|name| column(name, Class::Label));
    let numbers = ["within", "of them right"].map(|name| column(name, Class::Figure));
    let caption =
        "Break-even: the smallest share of right neighbors at which half of the points come back.";
    Table {
        id: "break-even",
        caption: caption.to_owned(),
        columns: labels.into_iter().chain(numbers).collect(),
        rows: rows.collect(),
        notes: Vec::new(),
    }
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

/// A standard deviation over seeds up to this many percentage points is not worth a look.
const SPREAD_THAT_COUNTS: f64 = 0.5;

/// A percentage, with its standard deviation over seeds where that is worth a look.
pub(crate) fn percent_cell(value: Option<&f64>, spread: Option<&f64>) -> String {
    match (value, spread.filter(|spread| **spread > SPREAD_THAT_COUNTS)) {
        (None, _) => NONE.to_owned(),
        (Some(value), None) => words::percent(*value),
        (Some(value), Some(spread)) => {
            format!("{} ± {}", words::percent(*value), words::percent(*spread))
        }
    }
}
