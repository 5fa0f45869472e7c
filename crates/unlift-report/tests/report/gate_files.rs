//! Tests of gates as JUnit XML: the whole text, which was validated by the schema of Jenkins (`junit-10.xsd`).

use unlift_report::document::{Document, ImageCounts};
use unlift_report::junit;

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
