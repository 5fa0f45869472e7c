//! What to do next: the facts of which the template speaks.

use serde_json::{Value, json};

use crate::attack::{self, Basis};
use crate::document::{Document, Localization};
use crate::page::verdict::{self, Card, Level, localization, localizing};
use crate::results::Results;
use crate::words;

pub(crate) fn steps(results: &Results<'_>) -> Value {
    let Document { options, input, localization, gates, .. } = results.document;
    let cards = &verdict::cards(results)[..];
    let tried = |name: &str| results.rows.iter().any(|row| row.neighbors.contains(name));
    let with_descriptors = attack::BY_DESCRIPTORS.iter().any(|name| tried(name));
    let has_pictures = results.rows.iter().any(|row| row.metrics.contains_key("ssim"));
    // The program that made the records can alone change them.
    let given = results.given_records();
    json!({
        "is_sequence": results.is_sequence(),
        "after_queries": verdict::sequence_sentences(results),
        "with_lists": tried(attack::SEQUENCE_AND_LISTS),
        "is_again": results.is_again(),
        "from_two_releases": verdict::again_sentences(results),
        "of_images": results.is_of_images(),
        "with_descriptors": with_descriptors,
        "has_descriptors": with_descriptors || input.other_sha256.contains_key("descriptors"),
        "given": given,
        "with_best": tried(attack::BEST),
        "least": least(results, cards),
        "can_invert": with_descriptors && given.is_none() && !has_pictures,
        "can_mitigate": given.is_none() && options.get("mitigate").is_none(),
        "can_localize": !localization.is_empty() && !options.contains_key("hold_out"),
        "gate": if gates.is_empty() { gate(results, cards) } else { None },
        "extent": input.extent_m.map(|sides| {
            let longest = sides.into_iter().fold(0.0, f64::max);
            [0.8, 1.25].map(|times| words::significant(times * longest, 2)).join("..")
        }),
    })
}

/// Returns a gate that suits the build: today's value, plus two points, of the given records or else of the scheme that leaks least.
fn gate(results: &Results<'_>, cards: &[Card]) -> Option<String> {
    let leak = |card: &Card| card.leak().map_or(f64::INFINITY, |leak| leak.recovered);
    let given = results.given_records();
    // A gate on a changed scheme needs the options of the change.
    let plain = cards.iter().filter(|card| {
        given.map_or(!words::is_changed(&card.scheme), |given| given == card.scheme)
    });
    let useful = localizing(results, plain.collect()).into_iter();
    let card = useful.min_by(|a, b| leak(a).total_cmp(&leak(b)))?;
    let (scheme, typed) = (&card.scheme, results.headline);
    let released = results.strongest(scheme, Basis::Released);
    let row = released.or_else(|| results.strongest(scheme, Basis::Oracle))?;
    let attack = match row.neighbors.as_str() {
        "oracle" => format!("@{}", row.inlier_ratio),
        source => format!(":{source}"),
    };
    // The gate covers the baselines, too.
    let today =
        card.today().map_or(0.0, |today| today.interval.map_or(today.recovered, |of| of[1]));
    let own = row.recovered(typed).map_or(results.share(row), |own| own.interval[1]);
    let limit = (own.max(today) + 2.0).ceil();
    (limit < 100.0).then(|| format!("{scheme}{attack}:{typed}<={limit}"))
}

/// Returns which scheme leaks least, and the multiple of the localization error under it, if that is known.
fn least(results: &Results<'_>, cards: &[Card]) -> Option<Value> {
    // The program does not make releases under a scheme of the user's.
    if results.given_records().is_some() {
        return None;
    }
    let cards: Vec<&Card> = verdict::hidden(cards).collect();
    let is_known = cards.iter().any(|card| card.today().is_some());
    let comparable = cards.iter().copied().filter(|card| !is_known || card.leak().is_some());
    let useful = localizing(results, comparable.collect()).into_iter();
    let share = |card: &Card| card.foremost().map(|finding| finding.recovered);
    let card = useful.reduce(|a, b| if share(b) < share(a) { b } else { a })?;
    // The banner says what the least leak means where it is too much, or not decided.
    let is_little = card.foremost().is_some_and(|finding| finding.level == Level::Gray);
    if cards.len() < 2 || !is_little || !verdict::is_decided(results, Some(&card.scheme)) {
        return None;
    }
    let leak = card.leak().map(|leak| match leak.basis {
        Basis::Given => format!("{} with given neighbors", leak.in_words()),
        _ => format!("{} today", leak.in_words()),
    });
    let known = card.finding(Basis::Oracle);
    let known = known.map(|of| format!("{} {}", of.in_words(), of.when.to_lowercase()));
    let shares: Vec<String> = leak.into_iter().chain(known).collect();
    let localization = localization(results, &card.scheme).filter(|cost| !cost.is_unknown());
    let times = localization.and_then(Localization::cost).map(|cost| words::significant(cost, 3));
    let (scheme, shares) = (&card.scheme, shares.join(", "));
    let has_cost = localization.is_some();
    let places = |card: &&Card| verdict::localizes(results, &card.scheme);
    let is_among_useful = places(&card) && !cards.iter().all(places);
    Some(json!({
        "scheme": scheme, "shares": shares, "has_cost": has_cost, "times": times, "is_among_useful": is_among_useful,
    }))
}
