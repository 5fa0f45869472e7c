//! Tests of gates as JUnit XML and SARIF: the whole text, which was validated by the schemas of Jenkins (`junit-10.xsd`)
//! and SARIF 2.1.0.

use serde_json::json;
use unlift_report::document::{Document, ImageCounts};
use unlift_report::{junit, sarif};

use crate::sample;

/// Returns an audit with a failed gate, a gate that held, and an unusable image.
fn document() -> Document {
    let mut document = sample::document(true);
    document.gates[0].of = Some("olc, \"oracle\" at 0.50".into());
    document.input.path = Some("maps/room <1>".into());
    document.input.images = Some(ImageCounts { found: 3, used: 2, unusable: 1, too_small: 0 });
    document
}

#[test]
fn gates_are_test_cases() {
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
    assert_eq!(junit(&document()), expected);
}

#[test]
fn gates_are_rules_and_failed_ones_results() {
    let mut document = document();
    // SARIF lists a rule once, even if its gate was given twice.
    document.gates.push(document.gates[0].clone());
    let rule = |gate: &str| {
        json!({
            "id": gate,
            "shortDescription": { "text": format!("{gate}: at most 20 % may come back") },
            "help": { "text": "report.html of the audit shows what came back, and by which attack." },
            "defaultConfiguration": { "level": "error" },
            "properties": { "tags": ["privacy"] },
        })
    };
    let unusable = "1 of 3 images could not be used, and are in no figure";
    let expected = |uri: &str, line: usize, id: &str| {
        json!({
            "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
            "version": "2.1.0",
            "runs": [{
                "tool": { "driver": {
                    "name": "unlift",
                    "version": "0.1.0",
                    "informationUri": env!("CARGO_PKG_REPOSITORY"),
                    "rules": [rule("ppl@0.5:0.10<=20"), rule("plane@0.1:0.10<=20")],
                }},
                "invocations": [{
                    "executionSuccessful": false,
                    "toolExecutionNotifications": [{ "level": "error", "message": { "text": unusable } }],
                }],
                "results": [{
                    "ruleId": "ppl@0.5:0.10<=20",
                    "ruleIndex": 0,
                    "level": "error",
                    "message": {
                        "text": "ppl@0.5:0.10<=20: 89.1 % came back, at most 20 % may; olc, \"oracle\" at 0.50",
                    },
                    "locations": [{ "physicalLocation": {
                        "artifactLocation": { "uri": uri },
                        "region": { "startLine": line },
                    }}],
                }],
                "automationDetails": { "id": id },
            }],
        })
    };
    let found = |document: &Document, asked_at| -> serde_json::Value {
        serde_json::from_str(&sarif(document, asked_at)).expect("JSON")
    };
    let of_map = "maps/room%20%3C1%3E";
    assert_eq!(found(&document, None), expected(of_map, 1, &format!("unlift/{of_map}/")));
    document.input.path = None;
    let asked_at = Some(("ci/unlift.toml", 8));
    assert_eq!(
        found(&document, asked_at),
        expected("ci/unlift.toml", 8, "unlift/ci/unlift.toml/8/")
    );
}
