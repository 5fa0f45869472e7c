//! Tests that written documents follow the committed JSON Schema.
//!
//! The schema uses few keywords. This file checks only those and rejects others, which compiles
//! faster than a full validator.

use serde_json::{Value, json};
use unlift_report::Document;
use unlift_report::document::{NotAudited, Spread};

use crate::sample;

fn schema() -> Value {
    serde_json::from_str(include_str!("../../audit.schema.json")).expect("the schema is JSON")
}

/// Returns the places where `value` breaks `schema`.
fn breaks(root: &Value, schema: &Value, value: &Value, place: &str) -> Vec<String> {
    let mut found = Vec::new();
    let rules = schema.as_object().expect("a schema is an object");
    for (keyword, rule) in rules {
        let kept = match keyword.as_str() {
            "$schema" | "title" | "$defs" => true,
            "$ref" => {
                let target = rule.as_str().and_then(|name| root.pointer(&name[1..]));
                found.extend(breaks(root, target.expect("a known $ref"), value, place));
                true
            }
            "type" => match rule {
                Value::Array(types) => types.iter().any(|name| is_of(name, value)),
                name => is_of(name, value),
            },
            "const" => value == rule,
            "enum" => rule.as_array().expect("a list").contains(value),
            "minimum" => value.as_f64().is_none_or(|x| x >= rule.as_f64().unwrap()),
            "maximum" => value.as_f64().is_none_or(|x| x <= rule.as_f64().unwrap()),
            "exclusiveMinimum" => value.as_f64().is_none_or(|x| x > rule.as_f64().unwrap()),
            "minItems" => value.as_array().is_none_or(|x| x.len() as u64 >= rule.as_u64().unwrap()),
            "maxItems" => value.as_array().is_none_or(|x| x.len() as u64 <= rule.as_u64().unwrap()),
            "required" => {
                let names = rule.as_array().expect("a list").iter();
                names.map(|name| name.as_str().unwrap()).all(|name| value.get(name).is_some())
            }
            "items" => {
                for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                    found.extend(breaks(root, rule, item, &format!("{place}[{i}]")));
                }
                true
            }
            "properties" | "additionalProperties" => {
                found.extend(break_fields(root, schema, keyword, rule, value, place));
                true
            }
            other => panic!("the schema uses {other}, which this test does not check"),
        };
        if !kept {
            found.push(format!("{place}: {keyword} {rule}, found {value}"));
        }
    }
    found
}

fn break_fields(
    root: &Value,
    schema: &Value,
    keyword: &str,
    rule: &Value,
    value: &Value,
    place: &str,
) -> Vec<String> {
    let mut found = Vec::new();
    for (name, field) in value.as_object().into_iter().flatten() {
        let place = format!("{place}.{name}");
        let named = schema.get("properties").and_then(|properties| properties.get(name));
        match (keyword, named, rule) {
            ("properties", Some(own), _) => found.extend(breaks(root, own, field, &place)),
            ("additionalProperties", None, Value::Bool(false)) => {
                found.push(format!("{place}: unknown"))
            }
            ("additionalProperties", None, rule) => found.extend(breaks(root, rule, field, &place)),
            _ => {}
        }
    }
    found
}

fn is_of(name: &Value, value: &Value) -> bool {
    match name.as_str().expect("a type is a name") {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        other => panic!("unknown type {other}"),
    }
}

fn check(document: &Document) -> Vec<String> {
    let value = serde_json::from_str(&document.to_json().expect("a valid document")).unwrap();
    breaks(&schema(), &schema(), &value, "audit")
}

#[test]
fn documents_keep_the_schema() {
    assert_eq!(check(&sample::document(true)), Vec::<String>::new());
    assert_eq!(check(&sample::document(false).share_safe()), Vec::<String>::new());
    assert_eq!(check(&sample::images()), Vec::<String>::new());
    assert_eq!(check(&sample::images().share_safe()), Vec::<String>::new());
    let mut full = sample::document(true);
    full.results[0].repeats = 3;
    full.results[0].std = Some(Spread { median_error: Some(0.1), ..Spread::default() });
    full.results[0].delta = None;
    full.results[0].metrics.insert("faces found".into(), 0.25);
    (full.results[1].sure_percent, full.results[1].sure_unknown) = (None, Some("few".into()));
    let missing = NotAudited { scheme: "star".into(), neighbors: None, reason: "flat".into() };
    full.not_audited =
        vec![NotAudited { neighbors: Some("geometric".into()), ..missing.clone() }, missing];
    full.gates[0].passed = false;
    (full.gates[0].found_percent, full.gates[0].reason) = (None, Some("not audited".into()));
    full.run.seconds.stages.insert("read".into(), 0.5);
    full.input.other_sha256.insert("descriptors".into(), "00".into());
    assert_eq!(check(&full), Vec::<String>::new());
}

#[test]
fn the_schema_refuses_what_the_format_refuses() {
    let text = sample::document(true).to_json().unwrap();
    let valid: Value = serde_json::from_str(&text).unwrap();
    let spoil = |pointer: &str, with: Value| {
        let mut value = valid.clone();
        *value.pointer_mut(pointer).expect("the place exists") = with;
        breaks(&schema(), &schema(), &value, "audit").len()
    };
    assert_eq!(spoil("/results/0/unit", json!("cm")), 1);
    assert_eq!(spoil("/results/0/recovered_percent/0.10", json!(101)), 1);
    assert_eq!(spoil("/results/0/n_lost", json!(-1)), 1);
    assert_eq!(spoil("/schema", json!(2)), 1);
    assert_eq!(spoil("/run", json!({})), 1);
}

#[test]
fn the_example_of_the_documentation_is_a_document() {
    let docs = include_str!("../../../../docs/formats.md");
    let (_, rest) = docs.split_once("## audit.json").expect("its section");
    let (_, rest) = rest.split_once("```json\n").expect("an example");
    let (example, _) = rest.split_once("```").expect("an end");
    let document = Document::from_json(example).expect("a valid example");
    assert_eq!(check(&document), Vec::<String>::new());
}
