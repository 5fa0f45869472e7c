//! One plain sentence per scheme, worst first. The word "safe" never appears: an audit shows what
//! one attack took, not what no attack can take.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::document::{Bound, BreakEven, Document, Row};
use crate::{tables, words};

/// The inlier ratio of the headline, if it was tested; else the tested one nearest to it.
const HEADLINE_RATIO: f64 = 0.5;
/// A gain over the blind attacker below this many percentage points says that nothing was gained.
const GAIN_THAT_COUNTS: f64 = 2.0;

impl BreakEven {
    /// Whether this is the ratio of the curve on which `row` lies.
    pub(crate) fn is_of(&self, row: &Row) -> bool {
        let noise = self.oracle_noise.as_ref();
        self.scheme == row.scheme
            && self.solver == row.solver
            && noise.is_none_or(|noise| row.oracle_noise.as_ref() == Some(noise))
    }
}

/// The verdict on one scheme.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Card {
    pub scheme: String,
    pub title: String,
    pub rule: &'static str,
    /// Whole percent, rounded down.
    pub at_least: String,
    pub recovered: f64,
    pub blind: f64,
    /// "of the points come back within 10 cm when half of the neighbors are right".
    pub sentence: String,
    /// How much, in a word or two.
    pub amount: &'static str,
    pub gain: String,
    pub break_even: Option<String>,
    pub solver: String,
}

/// The verdicts of a document and the sentence that sums them up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Verdict {
    pub summary: String,
    pub cards: Vec<Card>,
}

/// Judges every scheme by the strongest solver at the headline ratio, for the headline threshold.
pub(crate) fn verdict(document: &Document) -> Verdict {
    let mut cards: Vec<Card> = Vec::new();
    for row in &document.results {
        if cards.iter().any(|card| card.scheme == row.scheme) {
            continue;
        }
        cards.extend(headline(document, &row.scheme).and_then(|row| card(document, row)));
    }
    // Stable: equal shares keep the document's order.
    cards.sort_by(|a, b| b.recovered.total_cmp(&a.recovered));
    Verdict { summary: summary(document, &cards), cards }
}

/// The row that speaks for `scheme`: nearest to the headline ratio, then the largest share.
pub(crate) fn headline<'a>(document: &'a Document, scheme: &str) -> Option<&'a Row> {
    let away = |row: &Row| (row.inlier_ratio - HEADLINE_RATIO).abs();
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let share = |row: &Row| row.recovered_percent.get(&typed).copied().unwrap_or(0.0);
    document
        .results
        .iter()
        .filter(|row| row.scheme == scheme)
        .min_by(|a, b| away(a).total_cmp(&away(b)).then(share(b).total_cmp(&share(a))))
}

/// Of every source but the oracle and that of `speaks`, the row that recovers most of its scheme; in order of name.
pub(crate) fn other_sources<'a>(document: &'a Document, speaks: &Row) -> Vec<&'a Row> {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let share = |row: &Row| row.recovered_percent.get(&typed).copied().unwrap_or(0.0);
    let mut best: BTreeMap<&str, &Row> = BTreeMap::new();
    for row in document.results.iter().filter(|row| row.scheme == speaks.scheme) {
        if row.neighbors != "oracle" && row.neighbors != speaks.neighbors {
            let so_far = best.entry(&row.neighbors).or_insert(row);
            if share(row) > share(so_far) {
                *so_far = row;
            }
        }
    }
    best.into_values().collect()
}

fn card(document: &Document, row: &Row) -> Option<Card> {
    let typed = &tables::headline_threshold(document)?;
    let recovered = *row.recovered_percent.get(typed)?;
    let points = words::points(row.unit);
    let blind = row.blind_percent.get(typed).copied().unwrap_or(0.0);
    let within = words::threshold(typed, row.unit);
    let when = condition(row);
    let break_even = document.break_even.iter().find(|b| b.is_of(row) && b.threshold == *typed);
    Some(Card {
        scheme: row.scheme.clone(),
        title: words::scheme_title(&row.scheme).to_owned(),
        rule: words::scheme_rule(&row.scheme),
        at_least: words::at_least(recovered),
        recovered,
        blind,
        sentence: format!("of the {points} come back within {within} {when}"),
        amount: amount(recovered, blind),
        gain: gain(recovered, blind),
        break_even: break_even.map(|point| break_even_sentence(point, points)),
        solver: words::method(&row.solver, row.oracle_noise.as_deref()),
    })
}

fn condition(row: &Row) -> String {
    if row.neighbors == "oracle" {
        let when = words::when_right(row.inlier_ratio);
        match row.oracle_noise.as_deref() {
            None | Some("uniform") => when,
            Some(noise) => format!("{when} and the others {noise}"),
        }
    } else {
        let right = words::ratio_percent(row.inlier_ratio);
        match row.neighbors.as_str() {
            "file" => format!("with the given neighborhoods, of which {right} % is right"),
            own => format!("with neighborhoods found by {own}, of which {right} % is right"),
        }
    }
}

fn amount(recovered: f64, blind: f64) -> &'static str {
    if recovered - blind < GAIN_THAT_COUNTS {
        return "no more than by guessing";
    }
    match recovered {
        80.0.. => "almost all",
        50.0.. => "most",
        20.0.. => "a large part",
        5.0.. => "a small part",
        _ => "little",
    }
}

fn gain(recovered: f64, blind: f64) -> String {
    let guess = words::significant(blind, 2);
    if recovered - blind < GAIN_THAT_COUNTS {
        return format!("A blind guess gets {guess} %: the neighbors added nothing here.");
    }
    let points = words::at_least(recovered - blind);
    format!("A blind guess gets {guess} %; the neighbors add {points} percentage points.")
}

fn break_even_sentence(point: &BreakEven, points: &str) -> String {
    match (point.bound, point.inlier_ratio.map(words::ratio_percent)) {
        (Bound::Interpolated, Some(ratio)) => {
            format!("Half of the {points} come back when only {ratio} % of neighbors are right.")
        }
        (Bound::BelowTested, Some(ratio)) => {
            format!("Half come back even when {ratio} % are right, the fewest tested.")
        }
        (Bound::AboveTested, Some(ratio)) => {
            format!("Less than half came back at every ratio tested, up to {ratio} %.")
        }
        (_, None) => "Less than half came back at every ratio tested.".to_owned(),
    }
}

fn summary(document: &Document, cards: &[Card]) -> String {
    let (Some(worst), Some(best)) = (cards.first(), cards.last()) else {
        return "No scheme was tested.".to_owned();
    };
    let Some(row) = headline(document, &worst.scheme) else {
        return String::new();
    };
    let typed = tables::headline_threshold(document);
    let within = typed.map(|typed| words::threshold(&typed, row.unit));
    let within = within.unwrap_or_default();
    let when = condition(row);
    if cards.len() == 1 {
        return format!("At least {} % {}.", worst.at_least, worst.sentence);
    }
    let most = cards.iter().filter(|card| card.recovered >= 50.0).count();
    let points = words::points(row.unit);
    let who = match (most, cards.len()) {
        (0, n) => format!("None of the {n} schemes gives back half of its {points}"),
        (m, n) if m == n => format!("All {n} schemes give back most of their {points}"),
        (1, n) => format!("One of {n} schemes gives back most of its {points}"),
        (m, n) => format!("{m} of {n} schemes give back most of their {points}"),
    };
    let (low, high) = (&best.at_least, &worst.at_least);
    format!("{who}; the shares run from {low} to {high} % within {within} {when}.")
}
