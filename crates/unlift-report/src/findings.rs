//! Titles of the page's charts: each says what its chart shows.

use serde::Serialize;

use crate::attack::{self, Basis};
use crate::document::{Document, Row};
use crate::{tables, verdict, words};

/// A title per chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Findings {
    /// Over the share of true neighbors.
    pub curves: String,
    /// Over the error.
    pub errors: String,
    /// Over what the attacker said.
    pub certainty: String,
}

/// The titles for `document`.
pub(crate) fn findings(document: &Document) -> Findings {
    Findings { curves: curves(document), errors: errors(document), certainty: certainty(document) }
}

/// Share of what the most true neighbors give from which on the fewest tested give nearly as much.
const FLAT: f64 = 0.9;
const STEEP: f64 = 0.5;

/// What wrong neighbors cost an attacker: the worst scheme's oracle rows at both ends of the ratios tested.
fn curves(document: &Document) -> String {
    let points = document.results.first().map_or("points", |row| words::points(row.unit));
    let usual = format!("How many {points} come back, by the share of true neighbors");
    let Some(typed) = tables::headline_threshold(document) else { return usual };
    let oracle = || document.results.iter().filter(|row| attack::basis(row) == Some(Basis::Oracle));
    let share = |row: &Row| verdict::share(row, &typed);
    let at = |ratio: f64| {
        let rows = oracle().filter(move |row| row.inlier_ratio == ratio);
        rows.map(share).fold(0.0, f64::max)
    };
    let ratios = || oracle().map(|row| row.inlier_ratio);
    let (low, high) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
    // Far from wrong is no test.
    if low >= high || low > 0.2 {
        return usual;
    }
    let (few, many) = (at(low), at(high));
    let wrong = words::ratio_percent(1.0 - low);
    let few_said = words::percent(few);
    match few / many.max(f64::MIN_POSITIVE) {
        FLAT.. => format!(
            "Wrong neighbors hardly help: with {wrong} % of them wrong, {few_said} % still come back"
        ),
        STEEP.. => {
            format!("With {wrong} % of the neighbors wrong, {few_said} % still come back")
        }
        _ => format!("Wrong neighbors help: with {wrong} % of them wrong, {few_said} % come back"),
    }
}

/// The median error of the strongest attack of today, else of the oracle's.
fn errors(document: &Document) -> String {
    let points = document.results.first().map_or("points", |row| words::points(row.unit));
    let strongest = speaking(document);
    match strongest.and_then(|row| Some((row, row.median_error?))) {
        Some((row, median)) => {
            let scheme = row.scheme.to_uppercase();
            let smallest = tables::thresholds(document).first().and_then(|t| t.parse::<f64>().ok());
            // An exchanged coordinate that is put back leaves an error of rounding.
            match smallest.is_some_and(|smallest| median < 0.001 * smallest) {
                true => format!("Half of the {points} come back exactly ({scheme})"),
                false => {
                    let error = words::length(median, row.unit);
                    format!("Half of the {points} come back to within {error} ({scheme})")
                }
            }
        }
        None => format!("How far off the recovered {points} are"),
    }
}

fn certainty(document: &Document) -> String {
    let said = speaking(document).and_then(|row| {
        let (sure, right) = (row.sure_percent?, row.sure_correct_percent?);
        Some(format!(
            "The attacker is sure of {} % of the {}, and right about {} % of those ({})",
            words::percent(sure),
            words::points(row.unit),
            words::percent(right),
            row.scheme.to_uppercase()
        ))
    });
    said.unwrap_or_else(|| "How well the attacker knows what is right".to_owned())
}

/// The row that the verdict leads with.
fn speaking(document: &Document) -> Option<&Row> {
    let typed = tables::headline_threshold(document)?;
    let share = |row: &Row| verdict::share(row, &typed);
    [Basis::Released, Basis::Given, Basis::Oracle].into_iter().find_map(|basis| {
        let rows = document.results.iter();
        let of_scheme = rows.filter_map(|row| verdict::strongest(document, &row.scheme, basis));
        of_scheme.reduce(|a, b| if share(b) > share(a) { b } else { a })
    })
}
