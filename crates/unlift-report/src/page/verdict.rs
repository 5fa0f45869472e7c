//! The verdict on every scheme by the strongest attack tried: first from the released data alone, then with
//! known neighbors. The worst scheme comes first. The word "safe" never appears, because an audit shows what
//! the tried attacks recover, and others may recover more.

use indexmap::IndexMap;
use serde::Serialize;
use serde_json::{Value, json};
use unlift::audit::{Interval, interval_of_largest};
use unlift::recover::Builtin;

use crate::attack::{self, Basis};
use crate::document::{Bound, BreakEven, Localization, Row};
use crate::results::Results;
use crate::words;

#[derive(Debug, Clone, Serialize)]
pub(crate) struct Verdict {
    pub banner: Banner,
    pub cards: Vec<Card>,
    /// Schemes that could not be audited.
    pub refusals: Vec<Value>,
}

pub(crate) fn verdict(results: &Results<'_>) -> Verdict {
    let cards = cards(results);
    let refused = |(scheme, reason): (&str, &str)| json!({ "scheme": scheme, "title": words::scheme_title(scheme), "reason": reason });
    Verdict {
        banner: banner(results, &cards),
        refusals: results.refused().map(refused).collect(),
        cards,
    }
}

/// Returns the cards of all schemes, the worst first.
pub(crate) fn cards(results: &Results<'_>) -> Vec<Card> {
    let schemes = results.schemes.iter();
    let mut cards: Vec<Card> = schemes.filter_map(|scheme| card(results, scheme)).collect();
    // By the share from released data alone, then by the larger other share. The sort is stable, so equal shares keep the document's order.
    cards.sort_by(|a, b| {
        let share = |card: &Card, basis| card.finding(basis).map_or(-1.0, |of| of.recovered);
        let others = |card| share(card, Basis::Oracle).max(share(card, Basis::Given));
        let today = share(b, Basis::Released).total_cmp(&share(a, Basis::Released));
        today.then(others(b).total_cmp(&others(a)))
    });
    cards
}

/// Returns the verdict on a scheme; `None` if it has no row, or if nothing tried tells anything.
pub(crate) fn card(results: &Results<'_>, scheme: &str) -> Option<Card> {
    let first = results.of_scheme(scheme).next()?;
    let alone = results.records_alone(scheme, results.headline);
    let of_basis = |basis| match results.strongest(scheme, basis) {
        Some(row) => Some(finding(results, basis, row, Some(results.share(row)))),
        // Baselines need only the released data, so they are attacks of today.
        None if basis == Basis::Released => Some(finding(results, basis, first, None))
            .filter(|baseline| alone.is_some() || baseline.level > Level::Gray),
        None => None,
    };
    let findings: Vec<Finding> = Basis::ALL.into_iter().filter_map(of_basis).collect();
    let untried_today = findings.first()?.basis != Basis::Released;
    let refused = results.document.not_audited.iter().filter(|refused| refused.scheme == scheme);
    let refused = refused.filter_map(|refused| {
        let source = attack::plain_source(refused.neighbors.as_deref()?, None);
        Some(json!({ "source": source, "reason": refused.reason.trim_end_matches('.') }))
    });
    let alone = alone.map(|(percent, _)| percent);
    let blind = results.blind(scheme, results.headline).unwrap_or(0.0);
    let break_even = break_even(results, scheme)
        .map(|of| json!({ "bound": of.bound, "percent": words::ratio_percent(of.inlier_ratio) }));
    Some(Card {
        scheme: scheme.to_owned(),
        title: words::scheme_title(scheme),
        rule: words::scheme_rule(scheme),
        bearings: bearings_sentence(results, scheme),
        blind: words::percent(blind),
        alone: alone.map(words::percent),
        lists_add: lists_add(results, scheme, alone.unwrap_or(0.0).max(blind)),
        break_even,
        untried_today,
        refused: refused.collect(),
        findings,
    })
}

/// Returns what the attack of a row recovers, or a baseline if that recovers more than `own`.
fn finding(results: &Results<'_>, basis: Basis, row: &Row, own: Option<f64>) -> Finding {
    let typed = results.headline;
    let alone = results.records_alone(&row.scheme, typed);
    let blind = row.blind_percent.get(typed).copied().unwrap_or(0.0);
    let floor = alone.map_or(0.0, |(percent, _)| percent).max(blind);
    // A baseline may recover more than the attack whose interval reaches higher.
    let of_attack = own.and_then(|_| row.recovered(typed));
    let estimates = [row.baseline(typed), of_attack].into_iter().flatten();
    let own = own.filter(|own| *own >= floor);
    let (by, briefly) = match (own, alone) {
        (Some(_), _) => (attack::name(row), attack::briefly(row)),
        (None, Some((percent, by))) if percent >= blind => {
            (attack::records_alone(by), attack::records_alone(None))
        }
        _ => ("a blind guess".to_owned(), "a blind guess".to_owned()),
    };
    let recovered = own.unwrap_or(floor);
    Finding {
        basis,
        scheme: row.scheme.clone(),
        when: when(basis, row),
        recovered,
        interval: interval_of_largest(estimates.map(|of| of.interval)),
        percent: words::percent(recovered),
        level: Level::of(recovered),
        by,
        briefly,
        floor,
    }
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

/// Returns what lists of neighbors add to the larger baseline: "21.3 percentage points (by descriptor overlap)".
fn lists_add(results: &Results<'_>, scheme: &str, floor: f64) -> String {
    // Solvers without neighborhoods do not show what lists add.
    let adds = |row: &&Row| attack::reads_lists(&row.solver) && !attack::intersects(&row.neighbors);
    let added = |row: &Row| {
        let source = attack::lists(row);
        let gain = added(results.share(row) - floor);
        format!("{gain} ({})", source.trim_start_matches("neighbors "))
    };
    let sources = results.by_source(scheme).into_iter();
    words::list(&sources.filter(adds).map(added).collect::<Vec<_>>())
}

/// Returns a gain over a baseline in words; `nothing` only if it is not positive.
fn added(gain: f64) -> String {
    match gain {
        0.05.. => format!("{} percentage points", words::percent(gain)),
        _ if gain > 0.0 => "less than 0.1 percentage points".to_owned(),
        _ => "nothing".to_owned(),
    }
}

/// Returns the smallest share of right neighbors at which half of the points come back.
fn break_even<'a>(results: &Results<'a>, scheme: &str) -> Option<&'a BreakEven> {
    let points = results.document.break_even.iter();
    let points = points.filter(|of| of.scheme == scheme && of.threshold == results.headline);
    let rank = |point: &BreakEven| match point.bound {
        Bound::BelowTested => 0,
        Bound::Interpolated => 1,
        Bound::AboveTested => 2,
    };
    points.min_by(|a, b| rank(a).cmp(&rank(b)).then(a.inlier_ratio.total_cmp(&b.inlier_ratio)))
}

/// The severity of a share of recovered points. It decides the color of a scheme.
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

#[derive(Debug, Clone, Serialize)]
pub(crate) struct Card {
    pub scheme: String,
    pub title: String,
    pub rule: &'static str,
    /// One finding per kind of attack that ran: from released data alone, with given lists, with known neighbors.
    pub findings: Vec<Finding>,
    /// What a scheme that publishes bearings shows.
    pub bearings: Option<String>,
    /// Percent recovered by a blind guess, and by the released records alone.
    pub blind: String,
    pub alone: Option<String>,
    pub lists_add: String,
    pub break_even: Option<Value>,
    /// Whether no attack from the released data alone was tried on this scheme.
    pub untried_today: bool,
    /// The sources that could not be tried on the scheme, and the reasons.
    pub refused: Vec<Value>,
}

#[derive(Debug, Clone, Serialize)]
pub(crate) struct Finding {
    #[serde(skip)]
    pub basis: Basis,
    #[serde(skip)]
    pub scheme: String,
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

    /// Returns the strongest attack on released data: one of ours, or one with lists from a given file.
    pub(crate) fn leak(&self) -> Option<&Finding> {
        let today = self.today()?;
        let given = self.finding(Basis::Given).filter(|given| given.recovered > today.recovered);
        Some(given.unwrap_or(today))
    }

    /// Returns what decides where schemes are compared: attacks on released data, else those with known neighbors.
    pub(crate) fn foremost(&self) -> Option<&Finding> {
        self.leak().or_else(|| self.finding(Basis::Oracle))
    }
}

#[derive(Debug, Clone, Serialize)]
pub(crate) struct Banner {
    pub level: Level,
    /// "Do not release this map under any scheme tried."
    pub headline: String,
    /// What the strongest attack recovers, and from which data.
    pub sentence: String,
    /// What known neighbors would give away under every scheme, so that schemes not named above do not look fine.
    pub every: Option<String>,
    pub unknown: Option<String>,
}

pub(crate) fn banner(results: &Results<'_>, cards: &[Card]) -> Banner {
    // Given records are judged; schemes of ours beside them are for comparison.
    let given = results.given_records();
    let judged = cards.iter().filter(|card| given.is_none_or(|name| card.scheme == name));
    let cards = &judged.cloned().collect::<Vec<Card>>()[..];
    let names: Vec<&str> = results.refused().map(|(scheme, _)| scheme).collect();
    let unknown = (!names.is_empty())
        .then(|| format!("Not audited, so nothing is known: {}.", words::list(&names)));
    let today = largest(cards.iter().filter_map(Card::leak));
    let worst = |basis| largest(cards.iter().filter_map(|card| card.finding(basis)));
    let known = worst(Basis::Given).or_else(|| worst(Basis::Oracle));
    // The model may have fewer tracks than an attacker finds links.
    let every = every(cards).filter(|_| !results.is_sequence());
    let bearings = cards.iter().find_map(|card| card.bearings.clone());
    let (mut level, mut headline, reasons) = match (today, known) {
        (Some(finding), _) => {
            let (headline, reasons) = decision(results, cards);
            (finding.level, headline, reasons)
        }
        // An untested attack may succeed, so known neighbors decide the color.
        (None, Some(finding)) => {
            let headline = "Not tested: what an attacker recovers from the released data alone.";
            (finding.level.min(Level::Orange), headline.to_owned(), Vec::new())
        }
        (None, None) => {
            let nothing = "Nothing is known about this protection.";
            (Level::Gray, "No scheme was tested.".to_owned(), vec![nothing.to_owned()])
        }
    };
    if bearings.is_some() && (level == Level::Gray || hidden(cards).next().is_none()) {
        // Few recovered points do not mean that little is seen.
        (level, headline) =
            (level.max(Level::Orange), "Bearings of points are published.".to_owned());
    } else if level == Level::Gray && (!is_decided(results, None) || given.is_some()) {
        // A small leak is no good result before the main attack was tried, or one made for the scheme.
        level = Level::Orange;
    }
    let strongest = today.or(known).map(|strongest| attack_sentence(results, strongest));
    let sentences = bearings.into_iter().chain(results.doubts()).chain(not_tried(results));
    let sentences = sentences.chain(reasons).chain(strongest);
    let sentences: Vec<String> = sentences.collect();
    Banner { level, headline, sentence: sentences.join(" "), every, unknown }
}

/// Returns whether to release, by what came back from the released data alone, and the reasons. A small leak decides nothing
/// before the best attack by descriptors was tried, or if figures are doubtful.
fn decision(results: &Results<'_>, cards: &[Card]) -> (String, Vec<String>) {
    let (mut much, mut little, mut undecided) = (Vec::new(), Vec::new(), Vec::new());
    for card in hidden(cards) {
        match card.leak() {
            Some(leak) if leak.level != Level::Gray => much.push(leak),
            Some(leak) if is_decided(results, Some(&card.scheme)) => little.push(leak),
            _ => undecided.push(card.scheme.as_str()),
        }
    }
    let schemes: Vec<&str> = cards.iter().map(|card| &*card.scheme).collect();
    much.sort_by(|a, b| b.recovered.total_cmp(&a.recovered));
    let names = |leaks: &[&Finding]| {
        words::list(&leaks.iter().map(|leak| leak.scheme.as_str()).collect::<Vec<_>>())
    };
    let what = results.subject();
    let not = format!("Do not release {what} under {}.", names(&much));
    let undecided = words::list(&undecided);
    let why = match results.document.doubts.is_empty() {
        true => "the best attack by descriptors was not tried",
        false => "figures are doubtful",
    };
    let open = format!("Nothing is decided about {undecided}, as {why}.");
    let open = (!undecided.is_empty()).then_some(open);
    if let Some(largest) = largest(little.iter().copied()) {
        let useless = little.iter().filter(|leak| !localizes(results, &leak.scheme));
        let useless: Vec<&Finding> = useless.copied().collect();
        let but = match useless.as_slice() {
            [] => String::new(),
            all if all.len() == little.len() => {
                ", but most cameras cannot be placed with it".to_owned()
            }
            some => format!(", but most cameras cannot be placed under {}", names(some)),
        };
        let under = format!(
            "Under {}, no attack tried here on released data recovers more than {} of the {} {}{but}.",
            names(&little),
            largest.in_words(),
            results.points(),
            results.within(results.headline)
        );
        let more = open.into_iter().chain(pictures(&schemes));
        return match much.is_empty() {
            true => (under, more.collect()),
            false => (not, [under].into_iter().chain(more).collect()),
        };
    }
    let Some(least) = much.last() else {
        return (format!("Nothing is decided about {what} under {undecided}."), Vec::new());
    };
    let headline = match much.len() > 1 && open.is_none() {
        true => format!("Do not release {what} under any scheme tried."),
        false => not,
    };
    let reason = (much.len() > 1).then(|| {
        let ends = least.interval.map(|of| words::interval(of) + ", ").unwrap_or_default();
        let (percent, part) = (&least.percent, words::part(least.recovered));
        let mut reason = format!(
            "The least leak{}, {percent} % ({ends}{}), is {part} of the {}",
            if open.is_some() { " of these" } else { "" },
            least.scheme,
            results.points()
        );
        let useful = much.iter().rev().find(|leak| localizes(results, &leak.scheme));
        if let Some(useful) = useful.filter(|useful| useful.scheme != least.scheme) {
            reason +=
                ", but most cameras cannot be placed under it; of the schemes that place them, ";
            reason += &format!("{} leaks least, {} %", useful.scheme, useful.percent);
        }
        reason + "."
    });
    (headline, reason.into_iter().chain(open).chain(pictures(&schemes)).collect())
}

/// Returns what is seen of the scene without an attack under those of the `schemes` that release rays from two centers.
pub(crate) fn pictures(schemes: &[&str]) -> Option<String> {
    let has_rays =
        |name: &&str| words::facts(name).is_some_and(|of| ["ray", "ray-voxel"].contains(&of.name));
    let rays: Vec<&str> = schemes.iter().copied().filter(has_rays).collect();
    let sentence = "show the scene from two published centers, without any attack.";
    (!rays.is_empty()).then(|| format!("The rays of {} {sentence}", words::list(&rays)))
}

/// Returns the cards whose schemes localize, if there are any, else all.
pub(crate) fn localizing<'c>(results: &Results<'_>, cards: Vec<&'c Card>) -> Vec<&'c Card> {
    let (useful, useless): (Vec<_>, Vec<_>) =
        cards.into_iter().partition(|card| localizes(results, &card.scheme));
    if useful.is_empty() { useless } else { useful }
}

pub(crate) fn localization<'a>(results: &Results<'a>, scheme: &str) -> Option<&'a Localization> {
    let mut all = results.document.localization.iter();
    all.find(|of| of.scheme == scheme && !of.of_queries)
}

/// Returns false if most cameras cannot be placed under `scheme`, or without its change if its own cost is not known.
pub(crate) fn localizes(results: &Results<'_>, scheme: &str) -> bool {
    let known = |name: &str| localization(results, name).filter(|cost| !cost.is_unknown());
    let plain = scheme.split_once('_').map_or(scheme, |(plain, _)| plain);
    known(scheme).or_else(|| known(plain)).is_none_or(|cost| cost.cost().is_some())
}

/// Returns the cards of schemes that publish no bearings: what those show is not the points that came back.
pub(crate) fn hidden(cards: &[Card]) -> impl Iterator<Item = &Card> {
    cards.iter().filter(|card| card.bearings.is_none())
}

/// Returns true if an attack on `scheme`, or on any scheme, is such a row.
fn tried(results: &Results<'_>, scheme: Option<&str>, is_such: impl Fn(&Row) -> bool) -> bool {
    let mut rows = results.rows.iter().filter(|row| scheme.is_none_or(|name| name == row.scheme));
    rows.any(is_such)
}

/// Returns true if the lists of such an attack are by one of the `sources`.
fn uses(results: &Results<'_>, scheme: Option<&str>, sources: &[&str]) -> bool {
    tried(results, scheme, |row| sources.contains(&row.neighbors.as_str()))
}

/// Returns true if such an attack is that of the strongest solver.
fn has_joint(results: &Results<'_>, scheme: Option<&str>) -> bool {
    tried(results, scheme, |row| row.solver == Builtin::Joint.name())
}

/// Returns the best sources for descriptors. Of images, it is the network wherever there is one.
fn best(results: &Results<'_>) -> &'static [&'static str] {
    if results.is_of_images() { &[attack::BEST, "learned"] } else { &[attack::BEST] }
}

/// Returns true if the best lists within each query were used, too.
fn has_lists(results: &Results<'_>) -> bool {
    let lists = results.document.options.get("lists").and_then(|by| by.as_str());
    lists.is_some_and(|by| best(results).contains(&by))
}

/// Returns true if a small leak of `scheme`, or of any scheme, says something: the best attack was tried, and no figure is doubtful.
pub(crate) fn is_decided(results: &Results<'_>, scheme: Option<&str>) -> bool {
    // Two releases are not attacked by lists within one of them.
    let is_best = match results.is_sequence() {
        true => has_lists(results),
        false => {
            uses(results, scheme, best(results))
                && has_joint(results, scheme)
                && !results.is_again()
        }
    };
    // A doubt about another scheme begins with its name. A user's scheme may be called as other doubts begin.
    let of_others = |doubt: &String| {
        let of = doubt.split_once(": ").map_or("", |(of, _)| of);
        scheme.is_some_and(|name| name != of) && words::facts(of).is_some()
    };
    is_best && results.document.doubts.iter().all(of_others)
}

/// Returns which kinds of attacks on released data were not tried.
pub(crate) fn not_tried(results: &Results<'_>) -> Option<String> {
    if results.is_again() {
        return Some("Not tried: attacks on one release alone (unlift audit map).".to_owned());
    }
    if results.is_sequence() {
        return (!has_lists(results)).then(|| {
            "Not tried: neighbors by descriptors within each query (--neighbors descriptors)."
                .to_owned()
        });
    }
    if results.rows.is_empty() {
        return None;
    }
    let images = results.is_of_images();
    let alone = images || results.rows.iter().any(|row| row.records_alone_percent.is_some());
    let kinds = [
        match [&attack::BY_DESCRIPTORS[..], best(results)].map(|of| uses(results, None, of)) {
            [false, _] => Some("attacks by descriptors"),
            [true, false] => Some("the best attack by descriptors (--neighbors descriptors)"),
            [true, true] => None,
        },
        (!has_joint(results, None)).then_some("the strongest solver (--solver joint)"),
        (!alone).then_some("the attack on the records alone"),
        images.then_some("several queries with known poses (unlift audit sequence)"),
        (!images && !results.rows.iter().any(|row| attack::is_oracle(&row.neighbors)))
            .then_some("lists with known neighbors (--neighbors oracle)"),
    ];
    let named = results.document.options.get("name").and_then(|name| name.as_str());
    let is_own = |name: &str| words::scheme_rule(name).is_empty() || named == Some(name);
    let own = results.schemes.iter().filter(|scheme| is_own(scheme));
    let own: Vec<String> = own.map(|scheme| format!("an attack made for {scheme}")).collect();
    let kinds = kinds.into_iter().flatten().chain(own.iter().map(String::as_str));
    let kinds: Vec<&str> = kinds.collect();
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

fn largest<'c>(findings: impl Iterator<Item = &'c Finding>) -> Option<&'c Finding> {
    findings.reduce(|a, b| if b.recovered > a.recovered { b } else { a })
}

fn attack_sentence(results: &Results<'_>, finding: &Finding) -> String {
    let (points, subject) = (results.points(), results.subject());
    let within = results.within(results.headline);
    let what = format!("{} of the {points} of {subject} {within}", finding.in_words());
    let by = format!("{}, {}", finding.scheme, finding.briefly);
    let (recovers, from) = match finding.basis {
        Basis::Released => ("recovers", finding.when.replacen("Today", "today", 1)),
        Basis::Given => ("recovers", "with given neighbors".to_owned()),
        Basis::Oracle => ("would recover", finding.when.to_lowercase()),
    };
    format!("The strongest attack tried {recovers} {what} {from} ({by}).")
}

/// Returns what a scheme that publishes bearings shows; `None` for others. Recovered points say nothing about it: all bearings
/// meet in the center, so no attack finds ranges, but directions are released as they are.
fn bearings_sentence(results: &Results<'_>, scheme: &str) -> Option<String> {
    let of = |name: &str| results.max(scheme, |row| row.metrics.get(name).copied());
    let real = words::percent(of("real_bearings_percent")?);
    let text = format!(
        "{scheme} publishes bearings: whoever stands in the center sees the scene. {real} % of the bearings are real"
    );
    Some(match of("decoys_area").map(|area| words::percent(100.0 * area)) {
        Some(order) => format!(
            "{text}; by descriptors, an attacker tells a decoy from a real bearing in {order} % of pairs (50 % would be chance)."
        ),
        None => format!("{text}."),
    })
}

/// Returns one sentence per scheme: what came back after each number of queries, from released data alone. Where lists of
/// neighbors are used, too, the larger share counts.
pub(crate) fn sequence_sentences(results: &Results<'_>) -> Vec<String> {
    let sentence = |scheme: &&str| {
        let mut largest: IndexMap<usize, f64> = IndexMap::new();
        for row in results.of_scheme(scheme).filter(|row| attack::basis(row) != Basis::Oracle) {
            if let Some(&share) = row.recovered_percent.get(results.headline) {
                let known = largest.entry(row.k).or_insert(share);
                *known = known.max(share);
            }
        }
        let after =
            |(k, share): (usize, f64)| format!("after {k} queries {} %", words::percent(share));
        let shares: Vec<String> = largest.into_iter().map(after).collect();
        format!(
            "{} of the keypoints came back within {} px ({scheme}).",
            words::capital(&words::list(&shares)),
            results.headline
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
            "From two releases under {scheme}, {} % of the points came back {}.",
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
