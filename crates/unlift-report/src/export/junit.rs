//! Gates as JUnit XML, the test results that GitLab, Jenkins and others show: a test case per gate.

use crate::document::Document;
use crate::export::escaped;
use crate::page::gates;

/// Returns the gates of `document` as JUnit XML: one test suite with a test case per gate. A gate that did not hold
/// is a failure. Unusable images are an error, because gates do not cover them. The text ends with a line break.
pub fn junit(document: &Document) -> String {
    let gates: Vec<_> = document.gates.iter().map(gates::in_words).collect();
    let failures = gates.iter().filter(|gate| !gate.passed).count();
    let unusable = gates::unusable(document);
    let errors = usize::from(unusable.is_some());
    let tests = gates.len() + errors;
    // The schema of Jenkins accepts at most three decimals.
    let time = format!("{:.3}", document.run.seconds.total.max(0.0));
    let counts = format!("tests=\"{tests}\" failures=\"{failures}\" errors=\"{errors}\"");
    let suite = escaped(document.input.path.as_deref().unwrap_or("unlift audit"));
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <testsuites name=\"unlift\" {counts} time=\"{time}\">\n  \
         <testsuite name=\"{suite}\" {counts} skipped=\"0\" time=\"{time}\">\n"
    );
    for gate in &gates {
        // Test cases are grouped by the scheme at the start of a gate.
        let scheme = gate.gate.split([':', '@']).next().unwrap_or_default();
        let (name, said) = (escaped(&gate.gate), escaped(&gate.said));
        let case =
            format!("    <testcase name=\"{name}\" classname=\"unlift.{}\"", escaped(scheme));
        text.push_str(&match gate.passed {
            true => format!("{case}>\n      <system-out>{said}</system-out>\n    </testcase>\n"),
            false => format!(
                "{case}>\n      <failure message=\"{said}\" type=\"gate\">{name}: {said}</failure>\n    \
                 </testcase>\n"
            ),
        });
    }
    if let Some(said) = unusable {
        text.push_str(&format!(
            "    <testcase name=\"images\" classname=\"unlift.input\">\n      <error message=\"{said}\" \
             type=\"input\">{said}</error>\n    </testcase>\n"
        ));
    }
    text + "  </testsuite>\n</testsuites>\n"
}
