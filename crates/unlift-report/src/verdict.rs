//! The verdict on every scheme by the strongest attack tried: first from the released data alone, then with
//! known neighbors. The worst scheme comes first. The word "safe" never appears, because an audit shows what
//! the tried attacks recover, and others may recover more.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::attack::{self, Basis, Given};
use crate::banner::{Banner, banner, next_steps};
use crate::cards::{Card, Finding, Level, Refusal};
use crate::document::{Bound, BreakEven, Document, Row};
use crate::{bearings, tables, words};

/// The oracle's headline is its tested inlier ratio nearest to this one.
const HEADLINE_RATIO: f64 = 0.5;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Verdict {
    pub banner: Banner,
    pub cards: Vec<Card>,
    pub refusals: Vec<Refusal>,
    pub steps: Vec<String>,
}

/// Judges every scheme by its strongest attacks, for the headline threshold.
pub(crate) fn verdict(document: &Document) -> Verdict {
    let schemes = tables::schemes(document).into_iter();
    let mut cards: Vec<Card> = schemes.filter_map(|scheme| card(document, scheme)).collect();
    // The sort is stable, so equal shares keep the document's order.
    cards.sort_by(|a, b| {
        let ((a, a_then), (b, b_then)) = (a.badness(), b.badness());
        b.total_cmp(&a).then(b_then.total_cmp(&a_then))
    });
    let whole = document.not_audited.iter().filter(|refused| refused.neighbors.is_none());
    let refusals = whole.map(|refused| Refusal {
        scheme: refused.scheme.clone(),
        title: words::scheme_title(&refused.scheme),
        reason: refused.reason.clone(),
    });
    let refusals: Vec<Refusal> = refusals.collect();
    let (banner, steps) = (banner(document, &cards, &refusals), next_steps(document, &cards));
    Verdict { banner, cards, refusals, steps }
}

pub(crate) fn share(row: &Row, typed: &str) -> f64 {
    row.recovered_percent.get(typed).copied().unwrap_or(0.0)
}

/// Returns the row of `scheme` with the largest share on this basis; for the oracle, among the rows whose
/// ratio is nearest to [`HEADLINE_RATIO`].
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

/// Returns the row that recovers most of `scheme` within `typed` from these neighborhoods; of equal ones the first.
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

/// Returns the strongest row of every source of `scheme`: most recovered first, the oracle last.
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

/// Returns the percentage by the records alone within `typed`, the best of the scheme's rows, and the attack's
/// name.
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
    // A baseline that recovers more than the row replaces it.
    let without = |row: &Row| match alone {
        Some((percent, by)) if percent >= blind(row) => {
            (percent, attack::records_alone(by), "records alone".to_owned())
        }
        _ => (blind(row), "a blind guess".to_owned(), "a blind guess".to_owned()),
    };
    let found = |basis, row: &Row, own: Option<f64>| {
        let (floor, by, briefly) = without(row);
        let (recovered, by, briefly) = match own {
            Some(own) if own >= floor => (own, attack::name(row), attack::briefly(row)),
            _ => (floor, by, briefly),
        };
        let (percent, level) = (words::percent(recovered), Level::of(recovered));
        Finding { basis, when: when(basis, row), recovered, percent, level, by, briefly, floor }
    };
    let of = |basis| {
        let row = strongest(document, scheme, basis)?;
        Some(found(basis, row, Some(share(row, typed))))
    };
    let any = document.results.iter().find(|row| row.scheme == scheme)?;
    let mut findings: Vec<Finding> =
        [Basis::Released, Basis::Given, Basis::Oracle].into_iter().filter_map(of).collect();
    // Baselines need only the released data, so they are attacks of today.
    let (floor, ..) = without(any);
    let tells = alone.is_some() || Level::of(floor) > Level::Gray;
    if tells && findings.iter().all(|finding| finding.basis != Basis::Released) {
        findings.insert(0, found(Basis::Released, any, None));
    }
    if findings.is_empty() {
        return None;
    }
    let has_today = findings.iter().any(|finding| finding.basis == Basis::Released);
    let refused = document.not_audited.iter().filter(|refused| refused.scheme == scheme);
    let refused = refused.filter_map(|refused| {
        let source = attack::plain_source(refused.neighbors.as_deref()?, None);
        Some(format!("Not tried with {source}: {}.", refused.reason.trim_end_matches('.')))
    });
    let points = words::points(any.unit);
    Some(Card {
        scheme: scheme.to_owned(),
        title: words::scheme_title(scheme),
        rule: words::scheme_rule(scheme),
        findings,
        baselines: bearings::said(document, scheme)
            .into_iter()
            .chain([baselines(document, scheme, typed, alone)])
            .collect::<Vec<_>>()
            .join(" "),
        break_even: lowest(document, scheme, typed).map(|point| break_even(point, points)),
        untried_today: !has_today,
        refused: refused.collect(),
    })
}

fn when(basis: Basis, row: &Row) -> String {
    match basis {
        Basis::Released if attack::queries(&row.neighbors).is_some() => {
            "Today, from released queries and their poses".to_owned()
        }
        Basis::Released if attack::is_again(&row.neighbors) => {
            "Today, from two releases of the map".to_owned()
        }
        Basis::Released => "Today, from the released data alone".to_owned(),
        Basis::Given => "With neighbors from a given file".to_owned(),
        Basis::Oracle if attack::queries(&row.neighbors).is_some() => {
            "With links by the tracks of the model alone".to_owned()
        }
        Basis::Oracle => words::capital(&words::if_known(row.inlier_ratio)),
    }
}

/// Returns what the two baselines recover, and what lists of neighbors add to the larger one: "A blind guess recovers
/// 8.1 %, the released records alone 65.2 %. Lists of neighbors add 21.3 percentage points (by descriptor
/// overlap)."
fn baselines(
    document: &Document,
    scheme: &str,
    typed: &str,
    alone: Option<(f64, Option<&str>)>,
) -> String {
    let rows = document.results.iter().filter(|row| row.scheme == scheme);
    let blind = rows.filter_map(|row| row.blind_percent.get(typed).copied());
    let blind = blind.max_by(f64::total_cmp).unwrap_or(0.0);
    let guess = format!("A blind guess recovers {} %", words::percent(blind));
    let (without, floor) = match alone {
        Some((percent, _)) => {
            let records = words::percent(percent);
            (format!("{guess}, the released records alone {records} %."), percent.max(blind))
        }
        None => (format!("{guess}."), blind),
    };
    let adds: Vec<String> = by_source(document, scheme)
        .into_iter()
        // Solvers without neighborhoods do not show what lists add.
        .filter(|row| attack::has_neighborhoods(row) && !attack::intersects(&row.neighbors))
        .map(|row| {
            let source = attack::plain_source(&row.neighbors, row.oracle_noise.as_deref());
            let source = source.trim_start_matches("neighbors ");
            format!("{} ({source})", added(share(row, typed) - floor))
        })
        .collect();
    match adds.is_empty() {
        true => without,
        false => format!("{without} Lists of neighbors add {}.", words::list(&adds)),
    }
}

/// Returns a gain over a baseline in words; `nothing` only if it is not positive.
fn added(gain: f64) -> String {
    match gain {
        0.05.. => format!("{} percentage points", words::percent(gain)),
        _ if gain > 0.0 => "less than 0.1 percentage points".to_owned(),
        _ => "nothing".to_owned(),
    }
}

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
                "Half of the {points} come back even when only {ratio} % of the neighbors are right, the smallest share tested."
            )
        }
        (Bound::AboveTested, Some(ratio)) => {
            format!(
                "Less than half of the {points} came back, even with {ratio} % of the neighbors right, the largest share tested."
            )
        }
        (_, None) => {
            format!(
                "Less than half of the {points} came back at every tested share of right neighbors."
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_added_only_where_nothing_is() {
        for gain in (-10_000..=10_000).map(|hundredth| f64::from(hundredth) / 100.0) {
            assert_eq!(added(gain) == "nothing", gain <= 0.0, "{gain}");
        }
        assert_eq!(added(0.04), "less than 0.1 percentage points");
        assert_eq!(added(87.99), "88.0 percentage points");
    }
}
