//! The verdict in a few sentences, the worst news first.

use crate::attack::Basis;
use crate::cards::{Card, Finding, Refusal};
use crate::document::{Document, LengthUnit};
use crate::{tables, words};

/// Percent from which on the records alone are said to break a scheme: half of the points, as for break-even.
const BROKEN: f64 = 50.0;

/// The sentences that sum up `cards`, in the order in which they matter: what needs no neighborhoods, what
/// comes back today, what would, and what is not known.
pub(crate) fn sentences(document: &Document, cards: &[Card], refusals: &[Refusal]) -> Vec<String> {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let unit = document.results.first().map_or(LengthUnit::Meter, |row| row.unit);
    let within = words::within(&typed, unit);
    let points = words::points(unit);
    let mut said = Vec::new();
    said.extend(broken(cards, points, &within));
    for basis in [Basis::Released, Basis::Given, Basis::Oracle] {
        said.extend(shares(cards, basis, points, &within));
    }
    if cards.is_empty() && refusals.is_empty() {
        said.push("No scheme was tested.".to_owned());
    }
    if !refusals.is_empty() {
        let names: Vec<String> = refusals.iter().map(|r| r.scheme.to_uppercase()).collect();
        said.push(format!("Not audited, so nothing is known: {}.", words::list(&names)));
    }
    said
}

/// Schemes of which the records alone give back half or more.
fn broken(cards: &[Card], points: &str, within: &str) -> Option<String> {
    let names: Vec<String> = cards
        .iter()
        .filter_map(|card| Some((card, card.alone.filter(|&percent| percent >= BROKEN)?)))
        .map(|(card, percent)| {
            format!("{} ({} %)", card.scheme.to_uppercase(), words::at_least(percent))
        })
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "The released records alone break {}: at least that many of the {points} come back {within} \
             without any neighborhoods.",
            words::list(&names)
        )
    })
}

/// How many schemes give back at least half on this basis, and how far the shares reach.
fn shares(cards: &[Card], basis: Basis, points: &str, within: &str) -> Option<String> {
    let mut found: Vec<(&Card, &Finding)> =
        cards.iter().filter_map(|card| Some((card, card.finding(basis)?))).collect();
    // Cards are in the order of today's shares, others have their own.
    found.sort_by(|a, b| b.1.recovered.total_cmp(&a.1.recovered));
    let (most, least) = (found.first()?, found.last()?);
    let when = &most.1.when;
    let (would, gives) = match basis {
        Basis::Oracle => ("would ", ("give", "give")),
        Basis::Released | Basis::Given => ("", ("gives", "give")),
    };
    if found.len() == 1 {
        let (card, finding) = most;
        // "Only this one" must not read as "only this one comes back".
        let of = if cards.len() == 1 {
            String::new()
        } else {
            format!(" of {}", card.scheme.to_uppercase())
        };
        let back = if would.is_empty() { "come" } else { "would come" };
        return Some(format!(
            "{when}, at least {} % of the {points}{of} {back} back {within}.",
            finding.at_least
        ));
    }
    let half = found.iter().filter(|(_, finding)| finding.recovered >= 50.0).count();
    let tried = if found.len() == cards.len() { "" } else { " on which that was tried" };
    let who = match (half, found.len()) {
        (0, n) => {
            format!("none of the {n} schemes{tried} {would}{} back half of its {points}", gives.0)
        }
        (m, n) if m == n && n == 2 => {
            format!("both schemes{tried} {would}{} back at least half of their {points}", gives.1)
        }
        (m, n) if m == n => format!(
            "all {n} schemes{tried} {would}{} back at least half of their {points}",
            gives.1
        ),
        (1, n) => format!(
            "one of {n} schemes{tried} {would}{} back at least half of its {points}",
            gives.0
        ),
        (m, n) => format!(
            "{m} of {n} schemes{tried} {would}{} back at least half of their {points}",
            gives.1
        ),
    };
    let name = |(card, finding): &(&Card, &Finding)| {
        format!("{} % ({})", finding.at_least, card.scheme.to_uppercase())
    };
    Some(format!("{when}, {who} {within}; the shares run from {} to {}.", name(least), name(most)))
}
