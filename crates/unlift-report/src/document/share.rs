//! Documents that may be shared: figures only.

use serde_json::Value;
use unlift::neighbors::sources;
use unlift::obfuscate;

use crate::document::Document;

const WITHHELD: &str = "(withheld)";

/// Options whose value may identify a file of the owner.
const NAMING_OPTIONS: [&str; 10] = [
    "again",
    "descriptors",
    "input",
    "inverter_sha256",
    "map",
    "model",
    "out",
    "path",
    "photos",
    "show",
];

/// Further sources of unlift. A reason from another scheme or source may contain anything: a line of data, a path.
const SOURCES: [&str; 4] = ["oracle", "file", "descriptors", "learned"];
const OWN_FAILED: &str = "its own function failed";
const NOT_AUDITED: &str = " was not audited";

impl Document {
    /// Returns a copy without paths, names, the command line, hashes of inputs (a hash confirms a guess of the input), and
    /// reasons from schemes and sources of others.
    pub fn share_safe(&self) -> Self {
        let mut safe = self.clone();
        safe.input.path = None;
        safe.input.sha256 = None;
        safe.input.other_sha256.clear();
        safe.run.command = None;
        for image in &mut safe.images {
            image.name = None;
        }
        for tile in &mut safe.tiles {
            tile.bounds = None;
        }
        for (name, value) in &mut safe.options {
            withhold(name, value);
        }
        for missing in &mut safe.not_audited {
            let source = missing.neighbors.as_deref();
            let is_source = |name: &str| {
                SOURCES.contains(&name) || sources::SOURCES.iter().any(|entry| entry.name == name)
            };
            let is_ours = obfuscate::all().any(|entry| entry.name == missing.scheme)
                && source.is_none_or(is_source);
            // A reason may also come from the solver of another author.
            if !is_ours || missing.reason.contains("solver ") {
                missing.reason = OWN_FAILED.to_owned();
            }
            without_places(&mut missing.reason);
        }
        for reason in safe.gates.iter_mut().filter_map(|gate| gate.reason.as_mut()) {
            // `not_audited` keeps the reason, if it may be shared.
            if let Some((what, _)) = reason.split_once(NOT_AUDITED) {
                *reason = format!("{what}{NOT_AUDITED}");
            }
            without_places(reason);
        }
        safe.notes.iter_mut().chain(&mut safe.doubts).for_each(without_places);
        safe
    }
}

/// Withholds a text that may contain a path, because the end of a path cannot be found.
fn without_places(text: &mut String) {
    if text.contains(['/', '\\']) {
        *text = WITHHELD.to_owned();
    }
}

fn withhold(option: &str, value: &mut Value) {
    match value {
        Value::String(text) => {
            // `--neighbors oracle+x` is a choice, `--neighbors lists.npz` a file of the owner.
            let is_choice = |c: char| c.is_ascii_lowercase() || c == '+';
            let names = NAMING_OPTIONS.contains(&option)
                || (option == "neighbors" && !text.chars().all(is_choice))
                || text.contains(['/', '\\']);
            if names {
                *text = WITHHELD.to_owned();
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| withhold(option, item)),
        Value::Object(fields) => {
            fields.iter_mut().for_each(|(name, field)| withhold(name, field));
        }
        Value::Null | Value::Bool(_) | Value::Number(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn names_are_withheld_and_choices_stay() {
        let mut options = json!({
            "neighbors": "oracle", "descriptors": "secret.bin", "inverter_sha256": "00ff", "solver": ["consensus"],
            "delta": "auto", "note": "/home/me/map", "k": 50
        });
        for (name, value) in options.as_object_mut().unwrap() {
            withhold(name, value);
        }
        let expected = json!({
            "neighbors": "oracle", "descriptors": WITHHELD, "inverter_sha256": WITHHELD, "solver": ["consensus"],
            "delta": "auto", "note": WITHHELD, "k": 50
        });
        assert_eq!(options, expected);
    }
}
