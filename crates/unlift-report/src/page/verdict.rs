//! The verdict on every scheme by the strongest attack tried: first from the released data alone, then with
//! known neighbors. The worst scheme comes first. The word "safe" never appears, because an audit shows what
//! the tried attacks recover, and others may recover more.

use std::collections::BTreeMap;

use serde::Serialize;
use unlift::Unit;
use unlift::audit::Interval;

use crate::attack::{Basis, Given};
use crate::document::{Bound, BreakEven, Document, Row};
use crate::page::tables;
use crate::{attack, views, words};

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
    rows.filter(|row| attack::basis(row) == basis).min_by(|a, b| {
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
        let is_rival = row.scheme == scheme && Given::of(row).same_choice(given);
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
        if matches!(attack::basis(row), Basis::Released | Basis::Given) {
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
        let own = own.filter(|own| *own >= floor);
        let (recovered, by, briefly) = match own {
            Some(own) => (own, attack::name(row), attack::briefly(row)),
            None => (floor, by, briefly),
        };
        let estimate = if own.is_some() { row.recovered(typed) } else { row.baseline(typed) };
        let interval = estimate.map(|estimate| estimate.interval);
        let (percent, level) = (words::percent(recovered), Level::of(recovered));
        let when = when(basis, row);
        Finding { basis, when, recovered, interval, percent, level, by, briefly, floor }
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
        baselines: bearings_sentence(document, scheme)
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
    let rank = |point: &BreakEven| match point.bound {
        Bound::BelowTested => 0,
        Bound::Interpolated => 1,
        Bound::AboveTested => 2,
    };
    let of = |point: &&BreakEven| point.scheme == scheme && point.threshold == typed;
    document
        .break_even
        .iter()
        .filter(of)
        .min_by(|a, b| rank(a).cmp(&rank(b)).then(a.inlier_ratio.total_cmp(&b.inlier_ratio)))
}

fn break_even(point: &BreakEven, points: &str) -> String {
    let ratio = words::ratio_percent(point.inlier_ratio);
    match point.bound {
        Bound::Interpolated => {
            format!(
                "Half of the {points} come back as soon as {ratio} % of the neighbors are right."
            )
        }
        Bound::BelowTested => format!(
            "Half of the {points} come back even when only {ratio} % of the neighbors are right."
        ),
        Bound::AboveTested => format!(
            "Less than half of the {points} came back, even with {ratio} % of the neighbors right, the largest share tested."
        ),
    }
}

/// The severity of a share of recovered points. It alone decides colors on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Level {
    /// Less than a fifth came back. There is no green, because another attack may recover more.
    Gray,
    /// A fifth or more came back.
    Orange,
    /// Half or more came back.
    Red,
}

impl Level {
    pub(crate) fn of(percent: f64) -> Self {
        match percent {
            50.0.. => Self::Red,
            20.0.. => Self::Orange,
            _ => Self::Gray,
        }
    }
}

/// The verdict on one scheme.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Card {
    pub scheme: String,
    pub title: String,
    pub rule: &'static str,
    /// One finding per kind of attack that ran: from released data alone, with given lists, with known
    /// neighbors.
    pub findings: Vec<Finding>,
    pub baselines: String,
    pub break_even: Option<String>,
    /// Whether no attack from the released data alone was tried on this scheme.
    pub untried_today: bool,
    /// A sentence per source that could not be tried on the scheme, with the reason.
    pub refused: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Finding {
    #[serde(skip)]
    pub basis: Basis,
    /// "Today, from the released data alone".
    pub when: String,
    pub recovered: f64,
    /// Ends of the 95 % interval; `None` in documents of earlier versions.
    pub interval: Option<Interval>,
    pub percent: String,
    pub level: Level,
    /// The attack: "neighbors by descriptor overlap, 35 listed, 11 % of them right, solver joint".
    pub by: String,
    #[serde(skip)]
    pub briefly: String,
    pub floor: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Refusal {
    pub scheme: String,
    pub title: String,
    pub reason: String,
}

impl Finding {
    /// Returns the upper end of the interval.
    fn highest(&self) -> f64 {
        self.interval.map_or(self.recovered, |interval| interval[1])
    }

    /// Returns "46.6 % (45.9 to 47.3)".
    fn said(&self) -> String {
        match self.interval {
            Some(interval) => format!("{} % ({})", self.percent, words::interval(interval)),
            None => format!("{} %", self.percent),
        }
    }
}

impl Card {
    pub(crate) fn finding(&self, basis: Basis) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.basis == basis)
    }

    /// Returns the percentage recovered from the released data alone; `None` if that was not tried.
    pub(crate) fn today(&self) -> Option<f64> {
        self.finding(Basis::Released).map(|finding| finding.recovered)
    }

    /// Returns the sort key of a card: the share from released data alone, then the larger other share;
    /// -1 if not tried.
    pub(crate) fn badness(&self) -> (f64, f64) {
        let share = |basis| self.finding(basis).map_or(-1.0, |finding| finding.recovered);
        (share(Basis::Released), share(Basis::Oracle).max(share(Basis::Given)))
    }
}

/// The verdict on a whole audit in a few lines.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Banner {
    pub level: Level,
    /// "Do not release this map under any scheme tried."
    pub headline: String,
    /// What the strongest attack recovers, and from which data.
    pub sentence: String,
    /// What known neighbors would give away under every scheme, so that schemes not named above do not look
    /// fine.
    pub every: Option<String>,
    pub unknown: Option<String>,
}

pub(crate) fn banner(document: &Document, cards: &[Card], refusals: &[Refusal]) -> Banner {
    let names: Vec<String> = refusals.iter().map(|one| words::scheme_name(&one.scheme)).collect();
    let unknown = (!refusals.is_empty())
        .then(|| format!("Not audited, so nothing is known: {}.", words::list(&names)));
    let today = worst(cards, Basis::Released);
    let known = worst(cards, Basis::Given).or_else(|| worst(cards, Basis::Oracle));
    // The model may have fewer tracks than an attacker finds links.
    let every = every(cards).filter(|_| !views::is_sequence(document));
    let bearings: Vec<String> =
        cards.iter().filter_map(|card| bearings_sentence(document, &card.scheme)).take(1).collect();
    let (level, headline, mut sentences) = match (today, known) {
        (Some(strongest), _) => {
            let (headline, mut sentences) = decision(document, cards);
            sentences.push(attack_sentence(document, strongest));
            (strongest.1.level, headline, sentences)
        }
        // An untested attack may succeed, so known neighbors decide the color.
        (None, Some(strongest)) => {
            let level = strongest.1.level.min(Level::Orange);
            let headline = "Not tested: what an attacker recovers from the released data alone.";
            (level, headline.to_owned(), vec![attack_sentence(document, strongest)])
        }
        (None, None) => {
            let nothing = "Nothing is known about this protection.";
            (Level::Gray, "No scheme was tested.".to_owned(), vec![nothing.to_owned()])
        }
    };
    let (level, headline) = match level {
        // Few recovered points do not mean that little is seen.
        Level::Gray if !bearings.is_empty() => {
            (Level::Orange, "Bearings of points are published.".to_owned())
        }
        // A small leak is no good result before the main attack was tried.
        Level::Gray if !uses_descriptors(document, None) => (Level::Orange, headline),
        level => (level, headline),
    };
    sentences.splice(0..0, bearings.into_iter().chain(not_tried(document)));
    Banner { level, headline, sentence: sentences.join(" "), every, unknown }
}

/// Returns whether to release, by what came back from the released data alone, and the reasons. A small leak decides nothing
/// before attacks by descriptors were tried.
fn decision(document: &Document, cards: &[Card]) -> (String, Vec<String>) {
    let (mut much, mut little, mut undecided) = (Vec::new(), Vec::new(), Vec::new());
    let hides = |card: &&Card| bearings_sentence(document, &card.scheme).is_none();
    // Cards are sorted by their leak, the largest first.
    for card in cards.iter().filter(hides) {
        let name = words::scheme_name(&card.scheme);
        match card.finding(Basis::Released) {
            Some(found) if found.level != Level::Gray => much.push((Some(found), name)),
            Some(found) if uses_descriptors(document, Some(&card.scheme)) => {
                little.push((Some(found), name))
            }
            _ => undecided.push((None, name)),
        }
    }
    let names = |leaks: &[(Option<&Finding>, String)]| {
        words::list(&leaks.iter().map(|leak| leak.1.clone()).collect::<Vec<_>>())
    };
    let (what, of) = match is_of_images(document) {
        true => ("these images", "keypoints"),
        false => ("this map", "points"),
    };
    let not = format!("Do not release {what} under {}.", names(&much));
    let open =
        (!undecided.is_empty()).then(|| format!("Nothing is decided about {}.", names(&undecided)));
    match (little.first().and_then(|leak| leak.0), much.last()) {
        (Some(most), _) => {
            let percent = most.said();
            let little = names(&little);
            let headline =
                format!("Under {little}, no attack tried here recovers more than {percent}.");
            let not = (!much.is_empty()).then_some(not);
            (headline, not.into_iter().chain(open).collect())
        }
        (None, Some((Some(least), name))) if much.len() > 1 => {
            let (percent, part) = (&least.percent, words::part(least.recovered));
            let ends = least.interval.map(|of| words::interval(of) + ", ").unwrap_or_default();
            let all = format!("Do not release {what} under any scheme tried.");
            let headline = if undecided.is_empty() { all } else { not };
            let reason =
                format!("The least leak, {percent} % ({ends}{name}), is {part} of the {of}.");
            (headline, [reason].into_iter().chain(open).collect())
        }
        (None, Some(_)) => (not, open.into_iter().collect()),
        (None, None) => (format!("Not decided: {what} under {}.", names(&undecided)), Vec::new()),
    }
}

fn is_of_images(document: &Document) -> bool {
    document.results.iter().any(|row| row.unit == Unit::Pixel)
}

/// Returns true if an attack on `scheme`, or on any scheme, used descriptors.
fn uses_descriptors(document: &Document, scheme: Option<&str>) -> bool {
    let of_views = views::is_sequence(document) || views::is_again(document);
    let mut rows = document.results.iter().filter(|row| scheme.is_none_or(|it| it == row.scheme));
    of_views || rows.any(|row| BY_DESCRIPTORS.contains(&row.neighbors.as_str()))
}

/// Returns which kinds of attacks on released data were not tried.
fn not_tried(document: &Document) -> Option<String> {
    if views::is_sequence(document) || views::is_again(document) || document.results.is_empty() {
        return None;
    }
    let images = is_of_images(document);
    let alone = images || document.results.iter().any(|row| row.records_alone_percent.is_some());
    let kinds = [
        (!uses_descriptors(document, None)).then_some("attacks by descriptors"),
        (!alone).then_some("the attack on the records alone"),
        images.then_some("several queries with known poses (unlift audit sequence)"),
    ];
    let kinds: Vec<String> = kinds.into_iter().flatten().map(str::to_owned).collect();
    (!kinds.is_empty()).then(|| format!("Not tried: {}.", words::list(&kinds)))
}

/// Returns a sentence on what every scheme would give back with known neighbors, if several were tried so.
fn every(cards: &[Card]) -> Option<String> {
    let known: Option<Vec<&Finding>> =
        cards.iter().map(|card| card.finding(Basis::Oracle)).collect();
    let known = known.filter(|known| known.len() > 1)?;
    let least = known.into_iter().reduce(|a, b| if b.recovered < a.recovered { b } else { a })?;
    let (when, percent) = (&least.when, least.said());
    Some(format!("{when}, every scheme tried would give back {percent} or more."))
}

fn worst(cards: &[Card], basis: Basis) -> Option<(&Card, &Finding)> {
    let found = cards.iter().filter_map(|card| Some((card, card.finding(basis)?)));
    found.reduce(|a, b| if b.1.recovered > a.1.recovered { b } else { a })
}

fn attack_sentence(document: &Document, (card, finding): (&Card, &Finding)) -> String {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let unit = document.results.first().map_or(Unit::Meter, |row| row.unit);
    let of = match unit {
        Unit::Pixel => "the keypoints of these images",
        Unit::Meter | Unit::KthNeighbor => "the points of this map",
    };
    let what = format!("{} of {of} {}", finding.said(), words::within(&typed, unit));
    let by = format!("{}, {}", words::scheme_name(&card.scheme), finding.briefly);
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
    let images = is_of_images(document);
    let tried = |name: &str| document.results.iter().any(|row| row.neighbors.contains(name));
    let with_descriptors = BY_DESCRIPTORS.iter().any(|name| tried(name));
    let has_file = with_descriptors || document.input.other_sha256.contains_key("descriptors");
    let mut steps = Vec::new();
    if views::is_sequence(document) {
        if !document.results.iter().any(views::uses_lists) {
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
        steps.extend(views::sequence_sentences(document));
        return steps;
    }
    if views::is_again(document) {
        steps.push(
            "Publish a map once. To publish a new version, hide new and changed points only, and \
             keep the records of the others."
                .to_owned(),
        );
        steps.extend(views::again_sentences(document));
        return steps;
    }
    if !with_descriptors {
        let options = match images || has_file {
            true => "`--neighbors descriptors`",
            false => "`--descriptors FILE`",
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
        steps.extend(gate_step(document, cards));
    }
    steps
}

/// Returns the step that suggests a gate: today's value of the scheme that leaks least, plus two points.
fn gate_step(document: &Document, cards: &[Card]) -> Option<String> {
    let typed = tables::headline_threshold(document)?;
    let card = cards.iter().min_by(|a, b| {
        let key = |card: &Card| card.today().unwrap_or(f64::INFINITY);
        key(a).total_cmp(&key(b))
    })?;
    let released = strongest(document, &card.scheme, Basis::Released);
    let row = released.or_else(|| strongest(document, &card.scheme, Basis::Oracle))?;
    let attack = match row.neighbors.as_str() {
        "oracle" => format!("@{}", row.inlier_ratio),
        source => format!(":{source}"),
    };
    // A gate on an inlier ratio covers the baselines, too.
    let today = card.finding(Basis::Released).filter(|_| released.is_none());
    let today = today.map_or(0.0, Finding::highest);
    let own = row.recovered(&typed).map_or(share(row, &typed), |own| own.interval[1]);
    let limit = (own.max(today) + 2.0).ceil().min(100.0);
    let scheme = &card.scheme;
    Some(format!(
        "Test it in your build: `--gate '{scheme}{attack}:{typed}<={limit}'` fails if two points more come back \
         than today."
    ))
}

fn has_pictures(row: &Row) -> bool {
    row.metrics.contains_key("ssim")
}

/// Returns which scheme leaks least. Schemes that publish bearings do not count: what they show is not the points that came back.
fn least(document: &Document, cards: &[Card]) -> Option<String> {
    let hides = |card: &&Card| bearings_sentence(document, &card.scheme).is_none();
    let cards: Vec<&Card> = cards.iter().filter(hides).collect();
    let finding =
        |card: &Card| card.finding(Basis::Released).or(card.finding(Basis::Oracle)).cloned();
    let share = |card: &Card| finding(card).map(|finding| finding.recovered);
    let known = cards.iter().filter(|card| card.today().is_some()).count();
    let comparable = cards.iter().filter(|card| known == 0 || card.today().is_some());
    let card = comparable.copied().reduce(|a, b| if share(b) < share(a) { b } else { a })?;
    // The banner says what the least leak means where it is too much, or not decided.
    let is_little = finding(card).is_some_and(|finding| finding.level == Level::Gray);
    if cards.len() < 2 || !is_little || !uses_descriptors(document, Some(&card.scheme)) {
        return None;
    }
    let shares: Vec<String> = [Basis::Released, Basis::Oracle]
        .iter()
        .filter_map(|&basis| card.finding(basis))
        .map(|found| match found.basis {
            Basis::Released => format!("{} today", found.said()),
            _ => format!("{} {}", found.said(), found.when.to_lowercase()),
        })
        .collect();
    let name = words::scheme_name(&card.scheme);
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

/// Returns what a scheme that publishes bearings shows; `None` for others. Recovered points say nothing about it: all bearings
/// meet in the center, so no attack finds ranges, but directions are released as they are.
pub(crate) fn bearings_sentence(document: &Document, scheme: &str) -> Option<String> {
    let rows = document.results.iter().filter(|row| row.scheme == scheme);
    let of = |name: &str| {
        let values = rows.clone().filter_map(|row| row.metrics.get(name).copied());
        values.max_by(f64::total_cmp)
    };
    let real = words::percent(of("real_bearings_percent")?);
    let name = words::scheme_name(scheme);
    let text = format!(
        "{name} publishes bearings: whoever stands in the center sees the scene. {real} % of the bearings are real"
    );
    Some(match of("decoys_area") {
        Some(area) => {
            let order = words::percent(100.0 * area);
            format!(
                "{text}; by descriptors, an attacker tells a decoy from a real bearing in {order} % of pairs (50 % would be chance)."
            )
        }
        None => format!("{text}."),
    })
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
