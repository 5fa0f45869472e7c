//! Tests of `audit.json` (round trip, stable text, rules of the format, schema) and of gates as JUnit XML.

use serde_json::{Value, json};
use unlift_report::document::{GateResult, ImageCounts, NotAudited, Spread};
use unlift_report::{Document, junit};

use crate::page::page;
use crate::sample;

#[test]
fn a_document_survives_its_text() {
    let mut document = sample::document(true);
    assert!(!document.to_json().unwrap().contains("\"metrics\""));
    document.not_audited = vec![
        NotAudited::new("star", None, "k: flat"),
        NotAudited::new("plane", Some("geometric"), "no"),
    ];
    document.notes.push("--max-points: 200 of 400 points are audited".to_owned());
    document.gates[0] = GateResult {
        found_percent: None,
        passed: false,
        reason: Some("star was not audited".into()),
        ..document.gates[0].clone()
    };
    document.input.scale_m_per_unit = Some(1.234_567_890_1);
    let row = &mut document.results[0];
    (row.sure_percent, row.sure_unknown) = (None, Some("too few points".into()));
    row.metrics = [("ssim".to_owned(), 0.512_345_6), ("faces".into(), 7.0)].into();
    row.median_error = Some(0.012_345_678_9);
    // Thresholds keep spelling and order.
    row.recovered_percent = [("0.250".to_owned(), 98.0), ("0.10".to_owned(), 93.0)].into();
    row.blind_percent = [("0.250".to_owned(), 2.0), ("0.10".to_owned(), 1.0)].into();
    (row.records_alone_percent, row.records_alone_by) = (None, None);
    let text = document.to_json().unwrap();
    // Null differs from absent; measured numbers are rounded, typed ones are not.
    for field in [
        "\"sure_percent\": null",
        "\"median_error\": 0.0123457,",
        "\"scale_m_per_unit\": 1.2345678901,",
    ] {
        assert!(text.contains(field), "{field}");
    }
    let read = Document::from_json(&text).unwrap();
    assert_eq!(read.to_json().unwrap(), text);
    let row = &read.results[0];
    assert_eq!((row.metrics["ssim"], row.median_error), (0.512_346, Some(0.012_345_7)));
    assert!(row.recovered_percent.keys().eq(["0.250", "0.10"]));
    assert_eq!((&read.not_audited, &read.gates), (&document.not_audited, &document.gates));
    assert_eq!(read.notes, document.notes);
}

#[test]
#[rustfmt::skip] // One row per line.
fn a_broken_rule_names_its_place() {
    type Spoil = fn(&mut Document);
    let rules: [(Spoil, &str); 11] = [
        (|d| d.results[1].median_error = Some(f64::NAN), "results[1]: expected finite numbers, found NaN or infinity"),
        (|d| _ = d.results[1].metrics.insert("faces".into(), f64::INFINITY), "results[1]: expected finite numbers, found NaN or infinity"),
        (|d| d.results[2].recovered_percent[0] = 100.5, "results[2].recovered_percent[\"0.10\"]: expected a number from 0 to 100, found 100.5"),
        (|d| d.results[1] = d.results[0].clone(), "results[1]: expected a combination of its own, found the combination of results[0] again"),
        (|d| d.results[0].n_lost = 5, "results[0].lost: expected a sum of 5, found 12"),
        (|d| d.results[0].records_alone_by = None, "results[0].records_alone_by: expected the thresholds 0.10, 0.25, found nothing"),
        (|d| d.results[0].records_alone_percent.as_mut().unwrap()[1] = 101.0, "results[0].records_alone_percent[\"0.25\"]: expected a number from 0 to 100, found 101"),
        (|d| d.results[0].sure_unknown = Some("few".into()), "results[0].sure_percent: expected null, as sure_unknown says \"few\", found 74.7"),
        (|d| (d.gates[1].passed, d.gates[1].found_percent) = (true, None), "gates[1].passed: expected false where a figure is not known, found true"),
        (|d| d.not_audited.push(NotAudited::new("olc", None, "no")), "not_audited[0].scheme: expected a scheme without rows in results, found olc, which has rows"),
        (
            |d| {
                *d = sample::images();
                _ = d.images[1].rows.pop();
            },
            "images[1].rows: expected 12 rows, as in results, found 11",
        ),
    ];
    for (spoil, expected) in rules {
        let mut document = sample::document(true);
        spoil(&mut document);
        let error = document.to_json().expect_err(expected).to_string();
        assert_eq!(error, format!("audit.json: {expected}"));
    }
    let mut document = sample::images();
    document.images[1].rows.clear();
    let text = document.to_json().expect("an image without keypoints has no rows");
    assert_eq!(Document::from_json(&text).expect("a document").images, document.images);
}

/// A share-safe document contains no text from schemes, sources or solvers of others.
#[test]
fn what_others_say_of_why_they_failed_is_kept_back() {
    let mut document = sample::document(true);
    document.not_audited = vec![
        NotAudited::new("mine", None, "mine: expected records or lists, found KeyError: 'secret'"),
        NotAudited::new("plane", Some("near"), "near: expected records or lists, found secret"),
        NotAudited::new("plane", Some("oracle"), "solver mine: expected positions, found secret"),
        NotAudited::new(
            "plane",
            Some("learned"),
            "/home/secret/x.onnx: expected a network, found none",
        ),
        NotAudited::new("plane", Some("geometric"), "k: expected at most 3, found 50"),
    ];
    document.gates[0].reason = Some("mine was not audited: mine: found secret".into());
    document.notes = vec!["/secret/rigs.bin: cut off".into(), "5 of 9 descriptors".into()];
    let page = page(&document, None, true);
    let safe = document.share_safe();
    let json = safe.to_json().expect("a document");
    assert!(!page.contains("secret") && !json.contains("secret"), "{json}");
    let reasons = safe.not_audited.iter().map(|missing| missing.reason.as_str());
    let failed = "its own function failed";
    let expected = [failed, failed, failed, "(withheld)", "k: expected at most 3, found 50"];
    assert_eq!(reasons.collect::<Vec<_>>(), expected);
    assert_eq!(safe.gates[0].reason.as_deref(), Some("mine was not audited"));
    assert_eq!(safe.notes, ["(withheld)", "5 of 9 descriptors"]);
}

/// The text was validated by the schema of Jenkins (`junit-10.xsd`).
#[test]
fn gates_are_test_cases() {
    let mut document = sample::document(true);
    document.gates[0].of = Some("olc, \"oracle\" at 0.50".into());
    document.input.path = Some("maps/room <1>".into());
    document.input.images = Some(ImageCounts { found: 3, used: 2, unusable: 1, too_small: 0 });
    let expected = r#"<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="unlift" tests="3" failures="1" errors="1" time="41.700">
  <testsuite name="maps/room &lt;1&gt;" tests="3" failures="1" errors="1" skipped="0" time="41.700">
    <testcase name="ppl@0.5:0.10&lt;=20" classname="unlift.ppl">
      <failure message="89.1 % came back, at most 20 % may; olc, &quot;oracle&quot; at 0.50" type="gate">ppl@0.5:0.10&lt;=20: 89.1 % came back, at most 20 % may; olc, &quot;oracle&quot; at 0.50</failure>
    </testcase>
    <testcase name="plane@0.1:0.10&lt;=20" classname="unlift.plane">
      <system-out>11.8 % came back, at most 20 % may</system-out>
    </testcase>
    <testcase name="images" classname="unlift.input">
      <error message="1 of 3 images could not be used, and are in no figure" type="input">1 of 3 images could not be used, and are in no figure</error>
    </testcase>
  </testsuite>
</testsuites>
"#;
    assert_eq!(junit(&document).unwrap(), expected);
}

/// Returns the places where `value` breaks `schema`, which uses few keywords; others are rejected.
fn breaks(root: &Value, schema: &Value, value: &Value, place: &str) -> Vec<String> {
    let mut found = Vec::new();
    let is = |name: &Value| match name.as_str().expect("a type is a name") {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        other => panic!("unknown type {other}"),
    };
    let bound = |rule: &Value| rule.as_f64().expect("a number");
    let number = |test: &dyn Fn(f64) -> bool| value.as_f64().is_none_or(test);
    let length = |test: &dyn Fn(f64) -> bool| value.as_array().is_none_or(|x| test(x.len() as f64));
    for (keyword, rule) in schema.as_object().expect("a schema is an object") {
        let kept = match keyword.as_str() {
            "$schema" | "title" | "$defs" | "properties" => true,
            "$ref" => {
                let target = root.pointer(&rule.as_str().expect("a path")[1..]);
                found.extend(breaks(root, target.expect("a known $ref"), value, place));
                true
            }
            "type" => rule.as_array().map_or_else(|| is(rule), |types| types.iter().any(is)),
            "const" => value == rule,
            "enum" => rule.as_array().expect("a list").contains(value),
            "minimum" => number(&|x| x >= bound(rule)),
            "maximum" => number(&|x| x <= bound(rule)),
            "exclusiveMinimum" => number(&|x| x > bound(rule)),
            "minItems" => length(&|x| x >= bound(rule)),
            "maxItems" => length(&|x| x <= bound(rule)),
            "required" => {
                let mut names = rule.as_array().expect("a list").iter();
                names.all(|name| value.get(name.as_str().expect("a name")).is_some())
            }
            "items" => {
                for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                    found.extend(breaks(root, rule, item, &format!("{place}[{i}]")));
                }
                true
            }
            "additionalProperties" => true,
            other => panic!("the schema uses {other}, which this test does not check"),
        };
        if !kept {
            found.push(format!("{place}: {keyword} {rule}, found {value}"));
        }
    }
    let more = schema.get("additionalProperties");
    for (name, field) in value.as_object().into_iter().flatten() {
        let place = format!("{place}.{name}");
        match schema.get("properties").and_then(|properties| properties.get(name)).or(more) {
            Some(Value::Bool(false)) => found.push(format!("{place}: unknown")),
            Some(rule) if rule.is_object() => found.extend(breaks(root, rule, field, &place)),
            _ => {}
        }
    }
    found
}

fn schema() -> Value {
    serde_json::from_str(include_str!("../../audit.schema.json")).expect("the schema is JSON")
}

#[test]
fn documents_keep_the_schema() {
    let mut full = sample::document(true);
    full.results[0].repeats = 3;
    full.results[0].std = Some(Spread { median_error: Some(0.1), ..Spread::default() });
    full.results[0].metrics.insert("faces found".into(), 0.25);
    (full.results[1].sure_percent, full.results[1].sure_unknown) = (None, Some("few".into()));
    full.not_audited =
        [Some("geometric"), None].map(|by| NotAudited::new("star", by, "flat")).into();
    full.gates[0].passed = false;
    (full.gates[0].found_percent, full.gates[0].reason) = (None, Some("not audited".into()));
    full.run.seconds.stages.insert("read".into(), 0.5);
    full.input.other_sha256.insert("descriptors".into(), "00".into());
    let docs = include_str!("../../../../docs/formats.md");
    let (_, rest) = docs.split_once("## audit.json").expect("its section");
    let (_, rest) = rest.split_once("```json\n").expect("an example");
    let (example, _) = rest.split_once("```").expect("an end");
    for document in [
        sample::document(true),
        sample::document(false).share_safe(),
        sample::images(),
        sample::images().share_safe(),
        full,
        Document::from_json(example).expect("a valid example"),
    ] {
        let value = serde_json::from_str(&document.to_json().expect("a valid document")).unwrap();
        assert_eq!(breaks(&schema(), &schema(), &value, "audit"), Vec::<String>::new());
    }
}

#[test]
fn the_schema_refuses_what_the_format_refuses() {
    let valid: Value = serde_json::from_str(&sample::document(true).to_json().unwrap()).unwrap();
    for (pointer, wrong) in [
        ("/results/0/unit", json!("cm")),
        ("/results/0/recovered_percent/0.10", json!(101)),
        ("/results/0/n_lost", json!(-1)),
        ("/schema", json!(2)),
        ("/run", json!({})),
    ] {
        let mut value = valid.clone();
        *value.pointer_mut(pointer).expect("the place exists") = wrong;
        assert_eq!(breaks(&schema(), &schema(), &value, "audit").len(), 1, "{pointer}");
    }
}
