//! What an audit says about a release of its map.

use serde_json::Value;

use crate::document::{Document, Input};
use crate::page::verdict::{Finding, Level, card, localizes};
use crate::results::Results;
use crate::words;

/// Returns what the attacks of `document` recover from `input` under `scheme`: "46.6 % (45.9 to 47.3) of the points
/// within 10 cm today, from the released data alone". `input` is what will be released, with the hash of its descriptors if
/// it has some; `public` the origin of the public descriptors of a protection, as in the options of an audit.
///
/// # Errors
/// If the document is about another map, about less than is released, or lacks the scheme: what was expected, and what was found.
pub fn leak(
    document: &Document,
    input: &Input,
    (scheme, public): (&str, Option<&str>),
) -> Result<String, [String; 2]> {
    let wrong = |expected: &str, found: &str| Err([expected.to_owned(), found.to_owned()]);
    match &document.input.sha256 {
        None => return wrong("an audit with the map's hash", "a share-safe one"),
        hash if *hash != input.sha256 => {
            return wrong("an audit of this map", "one of another map");
        }
        Some(_) => {}
    }
    let audited = &document.input;
    if audited.n_points != input.n_points {
        let n = |of: &Input| format!("{} points", of.n_points);
        return wrong(&n(input), &n(audited));
    }
    // Parameters of schemes are lengths in this unit, which depends on the scale, or on K.
    let unit = |of: &Input| of.unit_in_map_units.map(|unit| words::significant(unit, 6));
    if audited.scale_m_per_unit != input.scale_m_per_unit || unit(audited) != unit(input) {
        let length = |of: &Input| {
            let scale = of.scale_m_per_unit.map_or("no".to_owned(), |scale| scale.to_string());
            format!("{scale} scale and a unit of {} map units", unit(of).unwrap_or_default())
        };
        return wrong(&length(input), &length(audited));
    }
    let hash = |of: &Input| of.other_sha256.get("descriptors").cloned();
    match (hash(input), hash(audited)) {
        (Some(released), Some(other)) if released != other => {
            return wrong("an audit with the descriptors that are released", "one with others");
        }
        (Some(_), None) => {
            return wrong("an audit with the descriptors that are released", "one without any");
        }
        _ => {}
    }
    let known = document.options.get("public_descriptors").and_then(Value::as_str);
    if let Some(public) = public
        && known != Some(public)
    {
        let from = |origin: &str| format!("public descriptors: {origin}");
        return wrong(&from(public), &from(known.unwrap_or("none")));
    }
    let results = Results::of(document);
    let Some(card) = card(&results, scheme) else {
        return wrong(&format!("an audit of {scheme}"), &results.schemes.join(", "));
    };
    let (points, within) = (results.points(), results.within(results.headline));
    let finding =
        |of: &Finding| format!("{}: {} of the {points} {within}.", of.when, of.in_words());
    let mut sentences: Vec<String> = card.findings.iter().map(finding).collect();
    if card.today().is_some_and(|today| today.level != Level::Gray) {
        sentences.insert(0, "Do not release this.".to_owned());
    }
    if !localizes(&results, scheme) {
        sentences.push("Most cameras cannot be placed with it.".to_owned());
    }
    if card.untried_today {
        sentences.insert(0, "Not tried: an attack on the released data alone.".to_owned());
    }
    Ok(sentences.join(" "))
}
