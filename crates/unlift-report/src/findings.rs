//! Titles of the page's charts: each states the result that its chart shows.

use serde::Serialize;

use crate::attack::{self, Basis};
use crate::document::{Document, Row};
use crate::{tables, verdict, words};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Findings {
    pub curves: String,
    pub errors: String,
    pub certainty: String,
}

pub(crate) fn findings(document: &Document) -> Findings {
    Findings { curves: curves(document), errors: errors(document), certainty: certainty(document) }
}

/// Ratio of the recovery with the fewest right neighbors to that with the most, from which on wrong
/// neighbors hardly matter; below [`STEEP`] they matter much.
const FLAT: f64 = 0.9;
const STEEP: f64 = 0.5;

/// Returns a title on how much wrong neighbors reduce the recovery: the best oracle rows at the lowest and
/// highest tested ratio.
fn curves(document: &Document) -> String {
    let points = document.results.first().map_or("points", |row| words::points(row.unit));
    let usual = format!("How many {points} come back, by the share of right neighbors");
    let Some(typed) = tables::headline_threshold(document) else { return usual };
    let oracle = || document.results.iter().filter(|row| attack::basis(row) == Some(Basis::Oracle));
    let share = |row: &Row| verdict::share(row, &typed);
    let at = |ratio: f64| {
        let rows = oracle().filter(move |row| row.inlier_ratio == ratio);
        rows.map(share).fold(0.0, f64::max)
    };
    let ratios = || oracle().map(|row| row.inlier_ratio);
    let (low, high) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(0.0, f64::max));
    // Mostly right neighbors show nothing about wrong ones.
    if low >= high || low > 0.2 {
        return usual;
    }
    let (few, many) = (at(low), at(high));
    let wrong = words::ratio_percent(1.0 - low);
    let few_said = words::percent(few);
    match few / many.max(f64::MIN_POSITIVE) {
        FLAT.. => format!(
            "Wrong neighbors hardly stop the attack: with {wrong} % of them wrong, {few_said} % of the {points} still come back"
        ),
        STEEP.. => {
            format!(
                "With {wrong} % of the neighbors wrong, {few_said} % of the {points} still come back"
            )
        }
        _ => format!(
            "Wrong neighbors weaken the attack: with {wrong} % of them wrong, {few_said} % of the {points} come back"
        ),
    }
}

fn errors(document: &Document) -> String {
    let points = document.results.first().map_or("points", |row| words::points(row.unit));
    let strongest = speaking(document);
    match strongest.and_then(|row| Some((row, row.median_error?))) {
        Some((row, median)) => {
            let scheme = row.scheme.to_uppercase();
            let smallest = tables::thresholds(document).first().and_then(|t| t.parse::<f64>().ok());
            // Swapped coordinates that are restored leave only an error of rounding.
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
    said.unwrap_or_else(|| "How well the attacker can judge its own result".to_owned())
}

fn speaking(document: &Document) -> Option<&Row> {
    let typed = tables::headline_threshold(document)?;
    let share = |row: &Row| verdict::share(row, &typed);
    [Basis::Released, Basis::Given, Basis::Oracle].into_iter().find_map(|basis| {
        let rows = document.results.iter();
        let of_scheme = rows.filter_map(|row| verdict::strongest(document, &row.scheme, basis));
        of_scheme.reduce(|a, b| if share(b) > share(a) { b } else { a })
    })
}
