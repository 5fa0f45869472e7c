//! The first lines of the page and of the terminal: the severity, the strongest attack, and the next steps.

use serde::Serialize;

use crate::attack::Basis;
use crate::cards::{Card, Finding, Level, Refusal};
use crate::document::{Document, LengthUnit, Row};
use crate::{again, bearings, sequence, tables, words};

/// The verdict on a whole audit in a few lines.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Banner {
    pub level: Level,
    /// "Not protected."
    pub headline: String,
    /// What the strongest attack recovers, and from which data.
    pub sentence: String,
    /// What known neighbors would give away under every scheme, so that schemes not named above do not look
    /// fine.
    pub every: Option<String>,
    pub unknown: Option<String>,
}

pub(crate) fn banner(document: &Document, cards: &[Card], refusals: &[Refusal]) -> Banner {
    let names: Vec<String> = refusals.iter().map(|one| one.scheme.to_uppercase()).collect();
    let unknown = (!refusals.is_empty())
        .then(|| format!("Not audited, so nothing is known: {}.", words::list(&names)));
    let today = worst(cards, Basis::Released);
    let known = worst(cards, Basis::Given).or_else(|| worst(cards, Basis::Oracle));
    // The model may have fewer tracks than an attacker finds links.
    let every = every(cards).filter(|_| !sequence::is_sequence(document));
    let (level, headline, sentence) = match (today, known) {
        (Some(found), _) => {
            let level = Level::of(found.1.recovered);
            (level, headline(level, cards), said(document, found))
        }
        // An untested attack may succeed, so known neighbors decide the color.
        (None, Some(found)) => {
            let level = Level::of(found.1.recovered).min(Level::Orange);
            let headline = "Not tested: what an attacker recovers from the released data alone.";
            (level, headline.to_owned(), said(document, found))
        }
        (None, None) => {
            let nothing = "Nothing is known about this protection.";
            (Level::Gray, "No scheme was tested.".to_owned(), nothing.to_owned())
        }
    };
    let bearings = cards.iter().find_map(|card| bearings::said(document, &card.scheme));
    let (level, headline) = match level {
        // Few recovered points do not mean that little is seen.
        Level::Gray if bearings.is_some() => {
            (Level::Orange, "Bearings of points are published.".to_owned())
        }
        level => (level, headline),
    };
    let sentence = bearings.into_iter().chain([sentence]).collect::<Vec<_>>().join(" ");
    Banner { level, headline, sentence, every, unknown }
}

/// Returns a sentence on what every scheme would give back with known neighbors, if several were tried so.
fn every(cards: &[Card]) -> Option<String> {
    let known: Option<Vec<&Finding>> =
        cards.iter().map(|card| card.finding(Basis::Oracle)).collect();
    let known = known.filter(|known| known.len() > 1)?;
    let least = known.into_iter().reduce(|a, b| if b.recovered < a.recovered { b } else { a })?;
    let (when, percent) = (&least.when, &least.percent);
    Some(format!("{when}, every scheme tried would give back {percent} % or more."))
}

fn worst(cards: &[Card], basis: Basis) -> Option<(&Card, &Finding)> {
    let found = cards.iter().filter_map(|card| Some((card, card.finding(basis)?)));
    found.reduce(|a, b| if b.1.recovered > a.1.recovered { b } else { a })
}

fn headline(level: Level, cards: &[Card]) -> String {
    let at_level = |card: &&Card| card.today().is_some_and(|percent| Level::of(percent) >= level);
    let (n, of) = (cards.iter().filter(at_level).count(), cards.len());
    let under = match (n, of) {
        (_, 1) => String::new(),
        (2, 2) => " under either scheme".to_owned(),
        (n, of) if n == of => format!(" under any of the {of} schemes"),
        (n, of) => format!(" under {n} of {of} schemes"),
    };
    match level {
        Level::Red => format!("Not protected{under}."),
        Level::Orange => format!("Badly protected{under}."),
        Level::Gray => "No attack tried here recovers much.".to_owned(),
    }
}

fn said(document: &Document, (card, finding): (&Card, &Finding)) -> String {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let unit = document.results.first().map_or(LengthUnit::Meter, |row| row.unit);
    let of = match unit {
        LengthUnit::Pixel => "the keypoints of these images",
        LengthUnit::Meter | LengthUnit::KthNeighbor => "the points of this map",
    };
    let what = format!("{} % of {of} {}", finding.percent, words::within(&typed, unit));
    let by = format!("{}, {}", card.scheme.to_uppercase(), finding.briefly);
    match finding.basis {
        Basis::Released => {
            let from = finding.when.trim_start_matches("Today, ");
            format!("An attacker recovers {what} today, {from} ({by}).")
        }
        Basis::Given => format!("An attacker recovers {what} with given neighbors ({by})."),
        Basis::Oracle => {
            let known = finding.when.to_lowercase();
            format!("An attacker would recover {what} {known} ({by}).")
        }
    }
}

const BY_DESCRIPTORS: [&str; 4] = ["similarity", "overlap", "descriptors", "learned"];

/// Returns the next steps, the most urgent first. Options of the command line are in back quotes.
pub(crate) fn next_steps(document: &Document, cards: &[Card]) -> Vec<String> {
    let images = document.results.first().is_some_and(|row| row.unit == LengthUnit::Pixel);
    let tried = |name: &str| document.results.iter().any(|row| row.neighbors.contains(name));
    let with_descriptors = BY_DESCRIPTORS.iter().any(|name| tried(name));
    let has_file = document.options.get("descriptors").is_some_and(|given| !given.is_null());
    let mut steps = Vec::new();
    if sequence::is_sequence(document) {
        if !document.results.iter().any(sequence::uses_lists) {
            steps.push(
                "Try the stronger attack: add `--neighbors descriptors`, which also uses lists of \
                 neighbors within each query."
                    .to_owned(),
            );
        }
        steps.push(
            "Mitigate and measure again: send fewer queries, or withhold the pose. Fewer views of \
             a point give an attacker less to work with."
                .to_owned(),
        );
        steps.extend(sequence::sentences(document));
        return steps;
    }
    if again::is_again(document) {
        steps.push(
            "Publish a map once. To publish a new version, hide new and changed points only, and \
             keep the records of the others."
                .to_owned(),
        );
        steps.extend(again::sentences(document));
        return steps;
    }
    if !with_descriptors {
        let options = match images || has_file {
            true => "`--neighbors descriptors`",
            false => "`--descriptors FILE --neighbors descriptors`",
        };
        steps.push(format!(
            "Try the stronger attack: add {options}. Descriptors show an attacker which {} are \
             neighbors, and no attack here used them.",
            if images { "keypoints" } else { "points" }
        ));
    } else if !tried("learned") && !tried("descriptors") {
        steps.push(
            "Try the stronger attack: add `--neighbors learned`, a network that finds neighbors \
             from SIFT or ALIKED descriptors."
                .to_owned(),
        );
    }
    steps.extend(least(document, cards));
    if with_descriptors && !document.results.iter().any(has_pictures) {
        steps.push("See what an attacker sees: add `--invert` and the photos.".to_owned());
    }
    if images {
        steps.push("Mitigate and measure again: extract fewer keypoints.".to_owned());
    } else if document.options.get("mitigate").is_none() {
        let drop = if has_file { " or `--mitigate drop:0.5`" } else { "" };
        let localizes =
            !document.localization.is_empty() && !document.options.contains_key("hold_out");
        let cost = if localizes { ", and `--localize PHOTOS` to see what that costs" } else { "" };
        steps.push(format!("Mitigate and measure again: add `--mitigate thin:1/4`{drop}{cost}."));
    }
    if document.gates.is_empty() {
        let typed = tables::headline_threshold(document).unwrap_or_default();
        let half = |row: &Row| row.neighbors == "oracle" && row.inlier_ratio == 0.5;
        let ratio = if document.results.iter().any(half) { "@0.5" } else { "" };
        steps.push(format!(
            "Test it in your build: `--gate 'all{ratio}:{typed}<=20'` fails if more than 20 % \
             comes back."
        ));
    }
    steps
}

fn has_pictures(row: &Row) -> bool {
    row.metrics.contains_key("ssim")
}

/// Returns which scheme leaks least. Schemes that publish bearings do not count: what they show is not the points that came back.
fn least(document: &Document, cards: &[Card]) -> Option<String> {
    let hides = |card: &&Card| bearings::said(document, &card.scheme).is_none();
    let cards: Vec<&Card> = cards.iter().filter(hides).collect();
    let share = |card: &Card| card.today().or(card.finding(Basis::Oracle).map(|f| f.recovered));
    let known = cards.iter().filter(|card| card.today().is_some()).count();
    let comparable = cards.iter().filter(|card| known == 0 || card.today().is_some());
    let card = comparable.copied().reduce(|a, b| if share(b) < share(a) { b } else { a })?;
    if cards.len() < 2 {
        return None;
    }
    let shares: Vec<String> = [Basis::Released, Basis::Oracle]
        .iter()
        .filter_map(|&basis| card.finding(basis))
        .map(|found| match found.basis {
            Basis::Released => format!("{} % today", found.percent),
            _ => format!("{} % {}", found.percent, found.when.to_lowercase()),
        })
        .collect();
    let name = card.scheme.to_uppercase();
    let cost =
        document.localization.iter().find(|one| one.scheme == card.scheme && !one.of_queries);
    let cost = cost.filter(|one| !one.is_unknown()).map(|one| match one.cost() {
        Some(cost) => {
            let times = words::significant(cost, 3);
            format!(" Its localization error is {times} times the unprotected one.")
        }
        None => " Most cameras cannot be placed with it.".to_owned(),
    });
    let cost = cost.unwrap_or_default();
    Some(format!("Of the schemes tried, {name} leaks least: {}.{cost}", shares.join(", ")))
}
