//! Documents that may leave the house: figures only.

use serde_json::Value;

use crate::document::Document;

/// What stands in place of a value that names something on the owner's machine.
const WITHHELD: &str = "(withheld)";

/// Options whose value is a name of the owner's, or tells a file of theirs.
const NAMING_OPTIONS: [&str; 9] =
    ["descriptors", "input", "inverter_sha256", "map", "model", "out", "path", "photos", "show"];

/// Schemes and sources of unlift's. What others say of why they failed may be anything: a line of their data, a path.
const SCHEMES: [&str; 10] =
    ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp", "lines2d", "cp2d", "dcl2d"];
const SOURCES: [&str; 7] =
    ["oracle", "file", "similarity", "overlap", "descriptors", "geometric", "learned"];
/// What stands in place of what they say.
const OWN_FAILED: &str = "its own function failed";
/// Before the reason in that of a gate.
const NOT_AUDITED: &str = " was not audited";

impl Document {
    /// A copy without paths, names, hashes of inputs (which confirm a guess of them), the command line and what schemes and
    /// sources of others say of why they failed: figures and plain options only.
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
            let is_ours = SCHEMES.contains(&&*missing.scheme)
                && source.is_none_or(|source| SOURCES.contains(&source));
            // So are reasons told of solvers of others.
            if !is_ours || missing.reason.contains("solver ") {
                missing.reason = OWN_FAILED.to_owned();
            }
            without_places(&mut missing.reason);
        }
        for reason in safe.gates.iter_mut().filter_map(|gate| gate.reason.as_mut()) {
            // It stands with what was not audited, if it may.
            if let Some((what, _)) = reason.split_once(NOT_AUDITED) {
                *reason = format!("{what}{NOT_AUDITED}");
            }
            without_places(reason);
        }
        safe.notes.iter_mut().for_each(without_places);
        safe
    }
}

/// Withholds a text that may name a file: where its path ends nobody can tell.
fn without_places(text: &mut String) {
    if text.contains(['/', '\\']) {
        *text = WITHHELD.to_owned();
    }
}

fn withhold(option: &str, value: &mut Value) {
    match value {
        Value::String(text) => {
            // `--neighbors oracle+x` is a choice, `--neighbors lists.parquet` a name of the owner's.
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
