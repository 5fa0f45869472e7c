//! The results of gates as JUnit XML.

use serde_json::json;

use crate::document::{Document, Error};
use crate::{gates, templates};

/// Returns the gates of `document` as JUnit XML, the test results that GitLab, Jenkins and others show: one test suite
/// with a test case per gate. A gate that did not hold is a failure. Unusable images are an error, because gates do
/// not cover them. The text ends with a line break.
///
/// # Errors
/// [`Error::Template`] if the text cannot be rendered (a bug of this crate).
pub fn junit(document: &Document) -> Result<String, Error> {
    let unusable = document.input.images.filter(|images| images.unusable > 0);
    let values = json!({
        "suite": document.input.path.as_deref().unwrap_or("unlift audit"),
        "gates": document.gates.iter().map(gates::entry).collect::<Vec<_>>(),
        "failures": document.gates.iter().filter(|gate| !gate.passed).count(),
        "images": unusable,
        // The schema of Jenkins accepts at most three decimals.
        "time": format!("{:.3}", document.run.seconds.total.max(0.0)),
    });
    let source = include_str!("../../template/gates.xml");
    Ok(templates::render(&[("gates.xml", source)], &values)? + "\n")
}
