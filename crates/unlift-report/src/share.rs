//! Documents that may leave the house: figures only.

use serde_json::Value;

use crate::document::Document;

/// What stands in place of a value that names something on the owner's machine.
const WITHHELD: &str = "(withheld)";

/// Options whose value is a name of the owner's.
const NAMING_OPTIONS: [&str; 8] =
    ["descriptors", "input", "map", "model", "out", "path", "photos", "show"];

impl Document {
    /// A copy without paths, names, hashes of inputs (which confirm a guess of them) and the command line: figures and
    /// plain options only.
    pub fn share_safe(&self) -> Self {
        let mut safe = self.clone();
        safe.input.path = None;
        safe.input.sha256 = None;
        safe.input.other_sha256.clear();
        safe.run.command = None;
        for image in &mut safe.images {
            image.name = None;
        }
        for (name, value) in &mut safe.options {
            withhold(name, value);
        }
        safe
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
            "neighbors": "oracle", "descriptors": "secret.bin", "solver": ["consensus"],
            "delta": "auto", "note": "/home/me/map", "k": 50
        });
        for (name, value) in options.as_object_mut().unwrap() {
            withhold(name, value);
        }
        let expected = json!({
            "neighbors": "oracle", "descriptors": WITHHELD, "solver": ["consensus"],
            "delta": "auto", "note": WITHHELD, "k": 50
        });
        assert_eq!(options, expected);
    }
}
