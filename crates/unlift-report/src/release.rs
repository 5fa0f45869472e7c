//! What an audit says about a release of its map.

use crate::document::{Document, Input};
use crate::page::verdict::{Finding, card};
use crate::results::Results;

/// Returns what the attacks of `document` recover from `input` under `scheme`: "46.6 % (45.9 to 47.3) of the points
/// within 10 cm today, from the released data alone". `input` is what will be released, with the hash of its descriptors if
/// it has some.
///
/// # Errors
/// If the document is about another map, about less than is released, or lacks the scheme: what was expected, and what was found.
pub fn leak(document: &Document, input: &Input, scheme: &str) -> Result<String, [String; 2]> {
    let wrong = |expected: &str, found: &str| Err([expected.to_owned(), found.to_owned()]);
    match &document.input.sha256 {
        None => return wrong("an audit with the map's hash", "a share-safe one"),
        hash if *hash != input.sha256 => {
            return wrong("an audit of this map", "one of another map");
        }
        Some(_) if document.input.n_points != input.n_points => {
            let n = |of: &Input| format!("{} points", of.n_points);
            return wrong(&n(input), &n(&document.input));
        }
        Some(_) => {}
    }
    let hash = |of: &Input| of.other_sha256.get("descriptors").cloned();
    if hash(input).is_some_and(|released| hash(&document.input) != Some(released)) {
        return wrong("an audit with the descriptors that are released", "one without them");
    }
    let results = Results::of(document);
    let Some(card) = card(&results, scheme) else {
        return wrong(&format!("an audit of {scheme}"), &results.schemes.join(", "));
    };
    let (points, within) = (results.points(), results.within(results.headline));
    let finding =
        |of: &Finding| format!("{}: {} of the {points} {within}.", of.when, of.in_words());
    let mut sentences: Vec<String> = card.findings.iter().map(finding).collect();
    if card.untried_today {
        sentences.insert(0, "Not tried: an attack on the released data alone.".to_owned());
    }
    Ok(sentences.join(" "))
}
