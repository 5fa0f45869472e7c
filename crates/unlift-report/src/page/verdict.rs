//! The verdict on every scheme by the strongest attack tried: first from the released data alone, then with
//! known neighbors. The worst scheme comes first. The word "safe" never appears, because an audit shows what
//! the tried attacks recover, and others may recover more.

use serde::Serialize;
use serde_json::{Value, json};
use unlift::Unit;
use unlift::audit::Interval;

use crate::attack::{self, Basis};
use crate::document::{Bound, BreakEven, Row};
use crate::results::Results;
use crate::words;

#[derive(Debug, Clone, Serialize)]
pub(crate) struct Verdict {
    pub banner: Banner,
    pub cards: Vec<Card>,
    /// Schemes that could not be audited.
    pub refusals: Vec<Value>,
    /// What to do next, the most urgent first. Options of the command line are in back quotes.
    pub steps: Vec<String>,
}

/// Judges every scheme by its strongest attacks, for the headline threshold.
pub(crate) fn verdict(results: &Results<'_>) -> Verdict {
    let cards = cards(results);
    let refused = |(scheme, reason): (&str, &str)| json!({ "scheme": scheme, "title": words::scheme_title(scheme), "reason": reason });
    let refusals = results.refused().map(refused).collect();
    let (banner, steps) = (banner(results, &cards), next_steps(results, &cards));
    Verdict { banner, cards, refusals, steps }
}

/// Returns the cards of all schemes, the worst first.
pub(crate) fn cards(results: &Results<'_>) -> Vec<Card> {
    let schemes = results.schemes.iter();
    let mut cards: Vec<Card> = schemes.filter_map(|scheme| card(results, scheme)).collect();
    // By the share from released data alone, then by the larger other share. The sort is stable, so equal
    // shares keep the document's order.
    cards.sort_by(|a, b| {
        let share = |card: &Card, basis| card.finding(basis).map_or(-1.0, |of| of.recovered);
        let others = |card| share(card, Basis::Oracle).max(share(card, Basis::Given));
        let today = share(b, Basis::Released).total_cmp(&share(a, Basis::Released));
        today.then(others(b).total_cmp(&others(a)))
    });
    cards
}

pub(crate) fn card(results: &Results<'_>, scheme: &str) -> Option<Card> {
    let typed = results.headline;
    let alone = results.records_alone(scheme, typed);
    let blind = |row: &Row| row.blind_percent.get(typed).copied().unwrap_or(0.0);
    let floor = |row: &Row| alone.map_or(0.0, |(percent, _)| percent).max(blind(row));
    // A baseline that recovers more than the row replaces it.
    let finding = |basis, row: &Row, own: Option<f64>| {
        let floor = floor(row);
        let (recovered, by, briefly) = match (own, alone) {
            (Some(own), _) if own >= floor => (own, attack::name(row), attack::briefly(row)),
            (_, Some((percent, by))) if percent >= blind(row) => {
                (floor, attack::records_alone(by), attack::records_alone(None))
            }
            _ => (floor, "a blind guess".to_owned(), "a blind guess".to_owned()),
        };
        let is_own = own.is_some_and(|own| own >= floor);
        let estimate = if is_own { row.recovered(typed) } else { row.baseline(typed) };
        let interval = estimate.map(|estimate| estimate.interval);
        let (percent, level) = (words::percent(recovered), Level::of(recovered));
        Finding {
            basis,
            when: when(basis, row),
            recovered,
            interval,
            percent,
            level,
            by,
            briefly,
            floor,
        }
    };
    let first = results.of_scheme(scheme).next()?;
    let of_basis = |basis| {
        let row = results.strongest(scheme, basis)?;
        Some(finding(basis, row, Some(results.share(row))))
    };
    let mut findings: Vec<Finding> = Basis::ALL.into_iter().filter_map(of_basis).collect();
    let is_today = |findings: &[Finding]| findings.iter().any(|of| of.basis == Basis::Released);
    // Baselines need only the released data, so they are attacks of today.
    let tells = alone.is_some() || Level::of(floor(first)) > Level::Gray;
    if tells && !is_today(&findings) {
        findings.insert(0, finding(Basis::Released, first, None));
    }
    if findings.is_empty() {
        return None;
    }
    let refused = results.document.not_audited.iter().filter(|refused| refused.scheme == scheme);
    let refused = refused.filter_map(|refused| {
        let source = attack::plain_source(refused.neighbors.as_deref()?, None);
        Some(format!("Not tried with {source}: {}.", refused.reason.trim_end_matches('.')))
    });
    let baselines = bearings_sentence(results, scheme).into_iter();
    let baselines = baselines.chain([baselines_sentence(results, scheme, alone.map(|of| of.0))]);
    Some(Card {
        scheme: scheme.to_owned(),
        title: words::scheme_title(scheme),
        rule: words::scheme_rule(scheme),
        baselines: baselines.collect::<Vec<_>>().join(" "),
        break_even: lowest(results, scheme).map(|point| break_even(point, results.points())),
        untried_today: !is_today(&findings),
        refused: refused.collect(),
        findings,
    })
}

fn when(basis: Basis, row: &Row) -> String {
    let is_sequence = attack::queries(&row.neighbors).is_some();
    let text = match basis {
        Basis::Released if is_sequence => "Today, from released queries and their poses",
        Basis::Released if attack::is_again(&row.neighbors) => {
            "Today, from two releases of the map"
        }
        Basis::Released => "Today, from the released data alone",
        Basis::Given => "With neighbors from a given file",
        Basis::Oracle if is_sequence => "With links by the tracks of the model alone",
        Basis::Oracle => return words::capital(&words::if_known(row.inlier_ratio)),
    };
    text.to_owned()
}

/// Returns what the two baselines recover, and what lists of neighbors add to the larger one: "A blind guess recovers
/// 8.1 %, the released records alone 65.2 %. Lists of neighbors add 21.3 percentage points (by descriptor
/// overlap)."
fn baselines_sentence(results: &Results<'_>, scheme: &str, alone: Option<f64>) -> String {
    let blind = results.max(scheme, |row| row.blind_percent.get(results.headline).copied());
    let blind = blind.unwrap_or(0.0);
    let floor = alone.unwrap_or(0.0).max(blind);
    let records = alone
        .map(|alone| format!(", the released records alone {} %", words::percent(alone)))
        .unwrap_or_default();
    let without = format!("A blind guess recovers {} %{records}.", words::percent(blind));
    // Solvers without neighborhoods do not show what lists add.
    let adds = |row: &&Row| attack::reads_lists(&row.solver) && !attack::intersects(&row.neighbors);
    let added = |row: &Row| {
        let source = attack::plain_source(&row.neighbors, row.oracle_noise.as_deref());
        let source = source.trim_start_matches("neighbors ");
        format!("{} ({source})", added(results.share(row) - floor))
    };
    let sources = results.by_source(scheme).into_iter();
    let added: Vec<String> = sources.filter(adds).map(added).collect();
    match added.is_empty() {
        true => without,
        false => format!("{without} Lists of neighbors add {}.", words::list(&added)),
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

fn lowest<'a>(results: &Results<'a>, scheme: &str) -> Option<&'a BreakEven> {
    let rank = |point: &BreakEven| match point.bound {
        Bound::BelowTested => 0,
        Bound::Interpolated => 1,
        Bound::AboveTested => 2,
    };
    let points = results.document.break_even.iter();
    points
        .filter(|point| point.scheme == scheme && point.threshold == results.headline)
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
#[derive(Debug, Clone, Serialize)]
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

#[derive(Debug, Clone, Serialize)]
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

impl Finding {
    /// Returns "46.6 % (45.9 to 47.3)".
    pub(crate) fn in_words(&self) -> String {
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

    /// Returns what was recovered from the released data alone; `None` if that was not tried.
    pub(crate) fn today(&self) -> Option<&Finding> {
        self.finding(Basis::Released)
    }

    fn name(&self) -> String {
        self.scheme.clone()
    }
}

/// The verdict on a whole audit in a few lines.
#[derive(Debug, Clone, Serialize)]
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

pub(crate) fn banner(results: &Results<'_>, cards: &[Card]) -> Banner {
    let names: Vec<String> = results.refused().map(|(scheme, _)| scheme.to_owned()).collect();
    let unknown = (!names.is_empty())
        .then(|| format!("Not audited, so nothing is known: {}.", words::list(&names)));
    let today = worst(cards, Basis::Released);
    let known = worst(cards, Basis::Given).or_else(|| worst(cards, Basis::Oracle));
    // The model may have fewer tracks than an attacker finds links.
    let every = every(cards).filter(|_| !results.is_sequence());
    let bearings = cards.iter().find_map(|card| bearings_sentence(results, &card.scheme));
    let (level, headline, mut sentences) = match (today, known) {
        (Some(strongest), _) => {
            let (headline, mut sentences) = decision(results, cards);
            sentences.push(attack_sentence(results, strongest));
            (strongest.1.level, headline, sentences)
        }
        // An untested attack may succeed, so known neighbors decide the color.
        (None, Some(strongest)) => {
            let level = strongest.1.level.min(Level::Orange);
            let headline = "Not tested: what an attacker recovers from the released data alone.";
            (level, headline.to_owned(), vec![attack_sentence(results, strongest)])
        }
        (None, None) => {
            let nothing = "Nothing is known about this protection.";
            (Level::Gray, "No scheme was tested.".to_owned(), vec![nothing.to_owned()])
        }
    };
    let (level, headline) = match level {
        // Few recovered points do not mean that little is seen.
        Level::Gray if bearings.is_some() => {
            (Level::Orange, "Bearings of points are published.".to_owned())
        }
        // A small leak is no good result before the main attack was tried.
        Level::Gray if !uses_descriptors(results, None) => (Level::Orange, headline),
        level => (level, headline),
    };
    sentences.splice(0..0, bearings.into_iter().chain(not_tried(results)));
    Banner { level, headline, sentence: sentences.join(" "), every, unknown }
}

/// Returns whether to release, by what came back from the released data alone, and the reasons. A small leak decides nothing
/// before attacks by descriptors were tried.
fn decision(results: &Results<'_>, cards: &[Card]) -> (String, Vec<String>) {
    // Cards are sorted by their leak, the largest first.
    let (mut much, mut little, mut undecided) = (Vec::new(), Vec::new(), Vec::new());
    for card in hidden(results, cards) {
        match card.today() {
            Some(leak) if leak.level != Level::Gray => much.push((card, leak)),
            Some(leak) if uses_descriptors(results, Some(&card.scheme)) => {
                little.push((card, leak))
            }
            _ => undecided.push(card.name()),
        }
    }
    let names = |leaks: &[(&Card, &Finding)]| {
        words::list(&leaks.iter().map(|(card, _)| card.name()).collect::<Vec<_>>())
    };
    let (what, points) = match results.is_of_images() {
        true => ("these images", "keypoints"),
        false => ("this map", "points"),
    };
    let not = format!("Do not release {what} under {}.", names(&much));
    let undecided = words::list(&undecided);
    let open = (!undecided.is_empty()).then(|| format!("Nothing is decided about {undecided}."));
    match (little.first(), much.last()) {
        (Some((_, largest)), _) => {
            let places = |(card, _): &(&Card, &Finding)| localizes(results, &card.scheme);
            let but = match little.iter().any(places) {
                true => "",
                false => ", but most cameras cannot be placed with it",
            };
            let headline = format!(
                "Under {}, no attack tried here recovers more than {}{but}.",
                names(&little),
                largest.in_words()
            );
            let not = (!much.is_empty()).then_some(not);
            (headline, not.into_iter().chain(open).collect())
        }
        (None, Some((card, least))) if much.len() > 1 => {
            let ends = least.interval.map(|of| words::interval(of) + ", ").unwrap_or_default();
            let all = format!("Do not release {what} under any scheme tried.");
            let headline = if open.is_none() { all } else { not };
            let reason = format!(
                "The least leak, {} % ({ends}{}), is {} of the {points}.",
                least.percent,
                card.name(),
                words::part(least.recovered)
            );
            (headline, [reason].into_iter().chain(open).collect())
        }
        (None, Some(_)) => (not, open.into_iter().collect()),
        (None, None) => (format!("Not decided: {what} under {undecided}."), Vec::new()),
    }
}

/// Returns the cards whose schemes localize, if there are any, else all.
fn localizing<'c>(results: &Results<'_>, cards: Vec<&'c Card>) -> Vec<&'c Card> {
    let useful: Vec<&Card> =
        cards.iter().copied().filter(|card| localizes(results, &card.scheme)).collect();
    if useful.is_empty() { cards } else { useful }
}

/// Returns false if most cameras cannot be placed under `scheme`.
pub(crate) fn localizes(results: &Results<'_>, scheme: &str) -> bool {
    let mut costs = results.document.localization.iter();
    let cost = costs.find(|of| of.scheme == scheme && !of.of_queries);
    cost.is_none_or(|cost| cost.is_unknown() || cost.cost().is_some())
}

/// Returns the cards of schemes that publish no bearings: what those show is not the points that came back.
fn hidden<'c>(results: &Results<'_>, cards: &'c [Card]) -> impl Iterator<Item = &'c Card> {
    cards.iter().filter(|card| bearings_sentence(results, &card.scheme).is_none())
}

const BY_DESCRIPTORS: [&str; 4] = ["similarity", "overlap", "descriptors", "learned"];

/// Returns true if an attack on `scheme`, or on any scheme, used descriptors.
fn uses_descriptors(results: &Results<'_>, scheme: Option<&str>) -> bool {
    let mut rows = results.rows.iter().filter(|row| scheme.is_none_or(|name| name == row.scheme));
    results.is_sequence()
        || results.is_again()
        || rows.any(|row| BY_DESCRIPTORS.contains(&row.neighbors.as_str()))
}

/// Returns which kinds of attacks on released data were not tried.
fn not_tried(results: &Results<'_>) -> Option<String> {
    if results.is_sequence() || results.is_again() || results.rows.is_empty() {
        return None;
    }
    let images = results.is_of_images();
    let alone = images || results.rows.iter().any(|row| row.records_alone_percent.is_some());
    let kinds = [
        (!uses_descriptors(results, None)).then_some("attacks by descriptors"),
        (!alone).then_some("the attack on the records alone"),
        images.then_some("several queries with known poses (unlift audit sequence)"),
    ];
    let kinds: Vec<String> = kinds.into_iter().flatten().map(str::to_owned).collect();
    (!kinds.is_empty()).then(|| format!("Not tried: {}.", words::list(&kinds)))
}

/// Returns a sentence on what every scheme would give back with known neighbors, if several were tried so.
fn every(cards: &[Card]) -> Option<String> {
    let known = cards.iter().map(|card| card.finding(Basis::Oracle));
    let known = known.collect::<Option<Vec<_>>>().filter(|known| known.len() > 1)?;
    let least = known.into_iter().reduce(|a, b| if b.recovered < a.recovered { b } else { a })?;
    let (when, percent) = (&least.when, least.in_words());
    Some(format!("{when}, every scheme tried would give back {percent} or more."))
}

fn worst(cards: &[Card], basis: Basis) -> Option<(&Card, &Finding)> {
    let findings = cards.iter().filter_map(|card| Some((card, card.finding(basis)?)));
    findings.reduce(|a, b| if b.1.recovered > a.1.recovered { b } else { a })
}

fn attack_sentence(results: &Results<'_>, (card, finding): (&Card, &Finding)) -> String {
    let points = match results.unit {
        Unit::Pixel => "the keypoints of these images",
        Unit::Meter | Unit::KthNeighbor => "the points of this map",
    };
    let within = results.within(results.headline);
    let what = format!("{} of {points} {within}", finding.in_words());
    let by = format!("{}, {}", card.name(), finding.briefly);
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

fn next_steps(results: &Results<'_>, cards: &[Card]) -> Vec<String> {
    let document = results.document;
    let tried = |name: &str| results.rows.iter().any(|row| row.neighbors.contains(name));
    let mut steps = Vec::new();
    let mut add = |step: &str| steps.push(step.to_owned());
    if results.is_sequence() {
        if !tried(attack::SEQUENCE_AND_LISTS) {
            add(
                "Try the stronger attack: add `--neighbors descriptors`, which also uses lists of \
                 neighbors within each query.",
            );
        }
        add(
            "Mitigate and measure again: send fewer queries, or withhold the pose. Fewer views of \
             a point give an attacker less to work with.",
        );
        steps.extend(sequence_sentences(results));
        return steps;
    }
    if results.is_again() {
        add("Publish a map once. To publish a new version, hide new and changed points only, and \
             keep the records of the others.");
        steps.extend(again_sentences(results));
        return steps;
    }
    let images = results.is_of_images();
    let with_descriptors = BY_DESCRIPTORS.iter().any(|name| tried(name));
    let has_file = with_descriptors || document.input.other_sha256.contains_key("descriptors");
    if !with_descriptors {
        let options = match images || has_file {
            true => "`--neighbors descriptors`",
            false => "`--descriptors FILE`",
        };
        add(&format!(
            "Try the stronger attack: add {options}. Descriptors show an attacker which {} are \
             neighbors, and no attack here used them.",
            results.points()
        ));
    } else if !tried("learned") && !tried("descriptors") {
        add("Try the stronger attack: add `--neighbors learned`, a network that finds neighbors \
             from SIFT or ALIKED descriptors.");
    }
    steps.extend(least(results, cards));
    let has_pictures = |row: &Row| row.metrics.contains_key("ssim");
    // The records were made by another program, which alone can change them.
    let is_given = document.options.contains_key("released");
    if with_descriptors && !is_given && !results.rows.iter().any(has_pictures) {
        steps.push("See what an attacker sees: add `--invert` and the photos.".to_owned());
    }
    if images {
        steps.push("Mitigate and measure again: extract fewer keypoints.".to_owned());
    } else if !is_given && document.options.get("mitigate").is_none() {
        let drop = if has_file { " or `--mitigate drop:0.5`" } else { "" };
        let localizes =
            !document.localization.is_empty() && !document.options.contains_key("hold_out");
        let cost = if localizes { ", and `--localize PHOTOS` to see what that costs" } else { "" };
        steps.push(format!("Mitigate and measure again: add `--mitigate thin:1/4`{drop}{cost}."));
    }
    if document.gates.is_empty() {
        steps.extend(gate_step(results, cards));
    }
    steps
}

/// Returns the step that suggests a gate: today's value of the scheme that leaks least, plus two points.
fn gate_step(results: &Results<'_>, cards: &[Card]) -> Option<String> {
    let today = |card: &Card| card.today().map_or(f64::INFINITY, |today| today.recovered);
    // A gate on a changed scheme needs the options of the change.
    let plain = cards.iter().filter(|card| !words::is_changed(&card.scheme));
    let useful = localizing(results, plain.collect()).into_iter();
    let card = useful.min_by(|a, b| today(a).total_cmp(&today(b)))?;
    let (scheme, typed) = (&card.scheme, results.headline);
    let released = results.strongest(scheme, Basis::Released);
    let row = released.or_else(|| results.strongest(scheme, Basis::Oracle))?;
    let attack = match row.neighbors.as_str() {
        "oracle" => format!("@{}", row.inlier_ratio),
        source => format!(":{source}"),
    };
    // A gate on an inlier ratio covers the baselines, too.
    let today = card.today().filter(|_| released.is_none());
    let today = today.map_or(0.0, |today| today.interval.map_or(today.recovered, |of| of[1]));
    let own = row.recovered(typed).map_or(results.share(row), |own| own.interval[1]);
    let limit = (own.max(today) + 2.0).ceil();
    (limit < 100.0).then(|| {
        format!(
            "Test it in your build: `--gate '{scheme}{attack}:{typed}<={limit}'` fails if this attack recovers about two \
             percentage points more than today."
        )
    })
}

/// Returns which scheme leaks least.
fn least(results: &Results<'_>, cards: &[Card]) -> Option<String> {
    let cards: Vec<&Card> = hidden(results, cards).collect();
    let finding = |card: &'_ Card| card.today().or(card.finding(Basis::Oracle)).cloned();
    let share = |card: &Card| finding(card).map(|finding| finding.recovered);
    let is_known = cards.iter().any(|card| card.today().is_some());
    let comparable = cards.iter().filter(|card| !is_known || card.today().is_some());
    let useful = localizing(results, comparable.copied().collect()).into_iter();
    let card = useful.reduce(|a, b| if share(b) < share(a) { b } else { a })?;
    // The banner says what the least leak means where it is too much, or not decided.
    let is_little = finding(card).is_some_and(|finding| finding.level == Level::Gray);
    if cards.len() < 2 || !is_little || !uses_descriptors(results, Some(&card.scheme)) {
        return None;
    }
    let today = card.today().map(|today| format!("{} today", today.in_words()));
    let known = card.finding(Basis::Oracle);
    let known = known.map(|of| format!("{} {}", of.in_words(), of.when.to_lowercase()));
    let shares: Vec<String> = today.into_iter().chain(known).collect();
    let costs = results.document.localization.iter();
    let cost = costs.into_iter().find(|of| of.scheme == card.scheme && !of.of_queries);
    let cost = cost.filter(|cost| !cost.is_unknown()).map(|cost| match cost.cost() {
        Some(cost) => {
            let times = words::significant(cost, 3);
            format!(" Its localization error is {times} times the unprotected one.")
        }
        None => " Most cameras cannot be placed with it.".to_owned(),
    });
    let (name, cost) = (card.name(), cost.unwrap_or_default());
    Some(format!("Of the schemes tried, {name} leaks least: {}.{cost}", shares.join(", ")))
}

/// Returns what a scheme that publishes bearings shows; `None` for others. Recovered points say nothing about it: all bearings
/// meet in the center, so no attack finds ranges, but directions are released as they are.
fn bearings_sentence(results: &Results<'_>, scheme: &str) -> Option<String> {
    let of = |name: &str| results.max(scheme, |row| row.metrics.get(name).copied());
    let real = words::percent(of("real_bearings_percent")?);
    let name = scheme;
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

/// Returns one sentence per scheme: what came back after each number of queries, from released data alone. Where lists of
/// neighbors are used, too, the larger share counts.
pub(crate) fn sequence_sentences(results: &Results<'_>) -> Vec<String> {
    let sentence = |scheme: &&str| {
        let mut largest: Vec<(usize, f64)> = Vec::new();
        for row in results.of_scheme(scheme).filter(|row| attack::basis(row) != Basis::Oracle) {
            let Some(&share) = row.recovered_percent.get(results.headline) else { continue };
            match largest.iter_mut().find(|(k, _)| *k == row.k) {
                Some((_, known)) => *known = share.max(*known),
                None => largest.push((row.k, share)),
            }
        }
        let after =
            |(k, share): &(usize, f64)| format!("after {k} queries {} %", words::percent(*share));
        let shares: Vec<String> = largest.iter().map(after).collect();
        format!(
            "{} of the keypoints came back within {} px ({}).",
            words::capital(&words::list(&shares)),
            results.headline,
            scheme
        )
    };
    results.schemes.iter().map(sentence).collect()
}

/// Returns one sentence per scheme: what came back from two releases, by the stronger links.
pub(crate) fn again_sentences(results: &Results<'_>) -> Vec<String> {
    let sentence = |scheme: &&str| {
        let mut rows = results.of_scheme(scheme);
        let row = results.largest(rows.clone())?;
        let mut text = format!(
            "From two releases under {}, {} % of the points came back {}.",
            scheme,
            words::percent(results.share(row)),
            results.within(results.headline)
        );
        let described = rows.find(|row| row.neighbors == attack::AGAIN).unwrap_or(row);
        let open = described.metrics.get("open_percent").copied().unwrap_or(0.0);
        if open >= 0.05 {
            text.push_str(&format!(
                " Of {} %, both records are known, but leave a line or more.",
                words::percent(open)
            ));
        }
        Some(text)
    };
    results.schemes.iter().filter_map(sentence).collect()
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
