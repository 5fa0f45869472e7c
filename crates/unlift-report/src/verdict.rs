//! What comes back, per scheme, by the strongest attack tried: first today, from the released data
//! alone, then if neighbors were known. Worst first. The word "safe" never appears: an audit shows
//! what one attack took, not what no attack can take.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::attack::{self, Basis, Given};
use crate::cards::{Card, Finding, Refusal};
use crate::document::{Bound, BreakEven, Document, Row};
use crate::{lead, quantity, tables, words};

/// The inlier ratio of the oracle's headline, if it was tested; else the tested one nearest to it.
const HEADLINE_RATIO: f64 = 0.5;

/// The verdicts of a document and the sentences that sum them up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Verdict {
    pub lead: Vec<String>,
    pub cards: Vec<Card>,
    pub refusals: Vec<Refusal>,
    /// Whether any attack had the released data alone: else the page says that none was tried.
    pub tested_today: bool,
}

/// Judges every scheme by its strongest attacks, for the headline threshold.
pub(crate) fn verdict(document: &Document) -> Verdict {
    let mut cards: Vec<Card> = Vec::new();
    for row in &document.results {
        if cards.iter().all(|card| card.scheme != row.scheme) {
            cards.extend(card(document, &row.scheme));
        }
    }
    // Stable: equal shares keep the document's order.
    cards.sort_by(|a, b| {
        let ((a, a_then), (b, b_then)) = (a.badness(), b.badness());
        b.total_cmp(&a).then(b_then.total_cmp(&a_then))
    });
    let whole = document.not_audited.iter().filter(|refused| refused.neighbors.is_none());
    let refusals = whole.map(|refused| Refusal {
        scheme: refused.scheme.clone(),
        title: words::scheme_title(&refused.scheme).to_owned(),
        reason: refused.reason.clone(),
    });
    let refusals: Vec<Refusal> = refusals.collect();
    let tested_today = cards.iter().any(|card| card.finding(Basis::Released).is_some());
    for card in &mut cards {
        card.untried_today = tested_today && card.finding(Basis::Released).is_none();
    }
    Verdict { lead: lead::sentences(document, &cards, &refusals), cards, refusals, tested_today }
}

/// Percent that came back within the threshold `typed`.
fn share(row: &Row, typed: &str) -> f64 {
    row.recovered_percent.get(typed).copied().unwrap_or(0.0)
}

/// The row of `scheme` that speaks for attacks on this basis: the largest share, of the oracle's rows at
/// the ratio nearest to the headline's.
pub(crate) fn strongest<'a>(document: &'a Document, scheme: &str, basis: Basis) -> Option<&'a Row> {
    let typed = tables::headline_threshold(document)?;
    let away = |row: &Row| match basis {
        Basis::Oracle => (row.inlier_ratio - HEADLINE_RATIO).abs(),
        Basis::Released | Basis::Given => 0.0,
    };
    let rows = document.results.iter().filter(|row| row.scheme == scheme);
    rows.filter(|row| attack::basis(row) == Some(basis)).min_by(|a, b| {
        away(a).total_cmp(&away(b)).then(share(b, &typed).total_cmp(&share(a, &typed)))
    })
}

/// The row that recovers most of `scheme` within `typed` from these neighborhoods; of equal ones the first.
pub(crate) fn strongest_given<'a>(
    document: &'a Document,
    scheme: &str,
    given: &Given,
    typed: &str,
) -> Option<&'a Row> {
    let share = |row: &Row| row.recovered_percent.get(typed).copied().unwrap_or(-1.0);
    let mut best: Option<&Row> = None;
    for row in &document.results {
        let is_rival = row.scheme == scheme
            && attack::basis(row).is_some()
            && Given::of(row).same_choice(given);
        if is_rival && best.is_none_or(|best| share(row) > share(best)) {
            best = Some(row);
        }
    }
    best
}

/// The strongest row of every source of `scheme` but the oracle, most recovered first, then the oracle's.
pub(crate) fn by_source<'a>(document: &'a Document, scheme: &str) -> Vec<&'a Row> {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let mut best: BTreeMap<&str, &Row> = BTreeMap::new();
    for row in document.results.iter().filter(|row| row.scheme == scheme) {
        if matches!(attack::basis(row), Some(Basis::Released | Basis::Given)) {
            let so_far = best.entry(&row.neighbors).or_insert(row);
            if share(row, &typed) > share(so_far, &typed) {
                *so_far = row;
            }
        }
    }
    let mut rows: Vec<&Row> = best.into_values().collect();
    rows.sort_by(|a, b| share(b, &typed).total_cmp(&share(a, &typed)));
    rows.extend(strongest(document, scheme, Basis::Oracle));
    rows
}

/// Percent by the records alone within `typed`, and the attack that got it: the best of the scheme's rows.
pub(crate) fn records_alone<'a>(
    document: &'a Document,
    scheme: &str,
    typed: &str,
) -> Option<(f64, Option<&'a str>)> {
    let rows = document.results.iter().filter(|row| row.scheme == scheme);
    let shares = rows.filter_map(|row| {
        let percent = *row.records_alone_percent.as_ref()?.get(typed)?;
        let by = row.records_alone_by.as_ref().and_then(|by| by.get(typed));
        Some((percent, by.map(String::as_str)))
    });
    shares.max_by(|a, b| a.0.total_cmp(&b.0))
}

fn card(document: &Document, scheme: &str) -> Option<Card> {
    let typed = &tables::headline_threshold(document)?;
    let alone = records_alone(document, scheme, typed);
    let blind = |row: &Row| row.blind_percent.get(typed).copied().unwrap_or(0.0);
    // What needs no neighborhoods: whoever has more need not use it.
    let without = |row: &Row| {
        let guess = (blind(row), "a blind guess".to_owned());
        match alone {
            Some((percent, by)) if percent >= guess.0 => (percent, attack::records_alone(by)),
            _ => guess,
        }
    };
    let found = |basis, row: &Row, own: Option<f64>| {
        let (floor, by) = without(row);
        let (recovered, by) = match own {
            Some(own) if own >= floor => (own, attack::name(row)),
            _ => (floor, by),
        };
        Finding {
            basis,
            when: when(basis, row),
            recovered,
            at_least: words::at_least(recovered),
            amount: quantity::amount(recovered),
            by,
            floor,
        }
    };
    let of = |basis| {
        let row = strongest(document, scheme, basis)?;
        Some(found(basis, row, Some(share(row, typed))))
    };
    let any = document.results.iter().find(|row| row.scheme == scheme)?;
    let mut findings: Vec<Finding> =
        [Basis::Released, Basis::Given, Basis::Oracle].into_iter().filter_map(of).collect();
    // Records alone are released as well.
    if alone.is_some() && findings.iter().all(|finding| finding.basis != Basis::Released) {
        findings.insert(0, found(Basis::Released, any, None));
    }
    if findings.is_empty() {
        return None;
    }
    let refused = document.not_audited.iter().filter(|refused| refused.scheme == scheme);
    let refused = refused.filter_map(|refused| {
        let source = attack::source(refused.neighbors.as_deref()?, None);
        Some(format!(
            "Neighborhoods by {source} were not tried: {}.",
            refused.reason.trim_end_matches('.')
        ))
    });
    let points = words::points(any.unit);
    Some(Card {
        scheme: scheme.to_owned(),
        title: words::scheme_title(scheme).to_owned(),
        rule: words::scheme_rule(scheme),
        findings,
        baselines: baselines(document, scheme, typed, alone),
        break_even: lowest(document, scheme, typed).map(|point| break_even(point, points)),
        untried_today: false,
        refused: refused.collect(),
        alone: alone.map(|(percent, _)| percent),
    })
}

/// Under which condition an attack on this basis gets what it got.
fn when(basis: Basis, row: &Row) -> String {
    match basis {
        Basis::Released => "Today, from the released data alone".to_owned(),
        Basis::Given => "With the given neighborhoods".to_owned(),
        Basis::Oracle => words::capital(&words::if_known(row.inlier_ratio)),
    }
}

/// "A blind guess gets 8.1 %, the records alone 65 %. To that, neighborhoods add nothing (overlap), ..."
fn baselines(
    document: &Document,
    scheme: &str,
    typed: &str,
    alone: Option<(f64, Option<&str>)>,
) -> String {
    let rows = document.results.iter().filter(|row| row.scheme == scheme);
    let blind = rows.filter_map(|row| row.blind_percent.get(typed).copied());
    let blind = blind.max_by(f64::total_cmp).unwrap_or(0.0);
    let guess = words::significant(blind, 2);
    let (without, floor) = match alone {
        Some((percent, _)) => {
            // The figure of the card, as there.
            let said = match percent < 10.0 {
                true => words::significant(percent, 2),
                false => words::at_least(percent),
            };
            (
                format!("A blind guess gets {guess} %, the records alone {said} %."),
                percent.max(blind),
            )
        }
        None => (format!("A blind guess gets {guess} %."), blind),
    };
    let adds: Vec<String> = by_source(document, scheme)
        .into_iter()
        // A solver that needs no neighborhoods tells nothing about what they add.
        .filter(|row| attack::has_neighborhoods(row))
        .map(|row| {
            let source = attack::source(&row.neighbors, row.oracle_noise.as_deref());
            format!("{} ({source})", quantity::added(share(row, typed) - floor))
        })
        .collect();
    match adds.is_empty() {
        true => without,
        false => format!("{without} To that, neighborhoods add {}.", words::list(&adds)),
    }
}

/// The break-even ratio of the scheme's strongest attack: the lowest one.
fn lowest<'a>(document: &'a Document, scheme: &str, typed: &str) -> Option<&'a BreakEven> {
    let rank = |point: &BreakEven| match (point.bound, point.inlier_ratio) {
        (Bound::BelowTested, ratio) => (0, ratio.unwrap_or(0.0)),
        (Bound::Interpolated, ratio) => (1, ratio.unwrap_or(1.0)),
        (Bound::AboveTested, ratio) => (2, ratio.unwrap_or(1.0)),
    };
    let of = |point: &&BreakEven| point.scheme == scheme && point.threshold == typed;
    document.break_even.iter().filter(of).min_by(|a, b| {
        let ((a, a_ratio), (b, b_ratio)) = (rank(a), rank(b));
        a.cmp(&b).then(a_ratio.total_cmp(&b_ratio))
    })
}

fn break_even(point: &BreakEven, points: &str) -> String {
    match (point.bound, point.inlier_ratio.map(words::ratio_percent)) {
        (Bound::Interpolated, Some(ratio)) => {
            format!(
                "Half of the {points} come back as soon as {ratio} % of the neighbors are right."
            )
        }
        (Bound::BelowTested, Some(ratio)) => {
            format!(
                "Half of the {points} come back even when {ratio} % of the neighbors are right, the fewest tested."
            )
        }
        (Bound::AboveTested, Some(ratio)) => {
            format!(
                "Less than half came back at every share of right neighbors tested, up to {ratio} %."
            )
        }
        (_, None) => {
            "Less than half came back at every share of right neighbors tested.".to_owned()
        }
    }
}
