//! What an audit says about a release of its map.

use serde_json::Value;

use crate::compare::{Incomparable, different};
use crate::document::{Document, GateResult, Input};
use crate::page::verdict::{Finding, Level, card, is_decided, localizes, pictures};
use crate::results::Results;

/// Returns what the attacks of `document` recover from `input` under `scheme`: "Do not release this. Today, from the released
/// data alone: 46.6 % (45.9 to 47.3) of the points within 10 cm." `input` is what will be released, with the hash of its
/// descriptors if it has some; `public` the origin of the public descriptors of a protection, as in the options of an audit.
///
/// # Errors
/// If the document is about another map, unit or descriptors, if only one of both has descriptors, or if the document lacks the scheme or a gate on it failed.
pub fn leak(
    document: &Document,
    input: &Input,
    scheme: &str,
    public: Option<&str>,
) -> Result<String, Incomparable> {
    let wrong = |place: &str, expected: &str, found: &str| {
        let [place, expected, found] = [place, expected, found].map(str::to_owned);
        Err(Incomparable { place, expected, found })
    };
    let audited = &document.input;
    if audited.sha256.is_none() {
        return wrong("input", "the hash of the map", "a share-safe audit, without hashes");
    }
    if audited.unit_in_map_units.is_none() {
        return wrong("unit", "a length in units of the map", "none");
    }
    if let Some(Incomparable { place, expected, found }) = different(audited, input).first() {
        return wrong(place, &format!("{found}, as of this release"), expected);
    }
    let has_rows = |of: &Input| of.other_sha256.contains_key("descriptors");
    if has_rows(audited) != has_rows(input) {
        let (expected, found) = match has_rows(input) {
            true => ("an audit with the descriptors of this release", "one without"),
            false => ("a release with descriptors, as in the audit", "one without (--descriptors)"),
        };
        return wrong("input", expected, found);
    }
    let known = document.options.get("public_descriptors").and_then(Value::as_str);
    if let Some(public) = public.filter(|&public| known != Some(public)) {
        return wrong("public descriptors", public, known.unwrap_or("none"));
    }
    let covers = |gate: &&GateResult| {
        !gate.passed
            && ["all", scheme].contains(&gate.gate.split([':', '@']).next().unwrap_or("").trim())
    };
    if let Some(gate) = document.gates.iter().find(covers) {
        return wrong(
            "gates",
            "an audit whose gates on this scheme held (all: on every scheme)",
            &gate.gate,
        );
    }
    let results = Results::of(document);
    let Some(card) = card(&results, scheme) else {
        return wrong("schemes", scheme, &results.schemes.join(", "));
    };
    let (points, within) = (results.points(), results.within(results.headline));
    let finding =
        |of: &Finding| format!("{}: {} of the {points} {within}.", of.when, of.in_words());
    let mut sentences: Vec<String> = card.findings.iter().map(finding).collect();
    let verdict = match card.leak() {
        None => Some("Not tried: an attack on the released data alone."),
        Some(leak) if leak.level != Level::Gray => Some("Do not release this."),
        Some(_) if !is_decided(&results, Some(scheme)) => Some(
            "Nothing is decided: figures are doubtful, or the best attack by descriptors was not tried.",
        ),
        Some(_) => None,
    };
    sentences.splice(0..0, verdict.map(str::to_owned).into_iter().chain(results.doubts()));
    sentences.extend(pictures(&[scheme]));
    if !localizes(&results, scheme) {
        sentences.push("Most cameras cannot be placed with it.".to_owned());
    }
    Ok(sentences.join(" "))
}
