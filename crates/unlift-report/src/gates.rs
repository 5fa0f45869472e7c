//! The results of the user's gates in words, and as JUnit XML.

use serde_json::{Value, json};

use crate::document::{Document, Error, GateResult};
use crate::{templates, words};

/// Returns what the page says of gates, the failed ones first; `None` without gates.
pub(crate) fn gates(document: &Document) -> Option<Value> {
    let mut gates: Vec<&GateResult> = document.gates.iter().collect();
    let failed = gates.iter().filter(|gate| !gate.passed).count();
    // "2 of 3 gates failed", or "All 3 gates passed".
    let summary = match (failed, gates.len()) {
        (_, 0) => return None,
        (0, 1) => "The gate passed".to_owned(),
        (0, 2) => "Both gates passed".to_owned(),
        (0, n) => format!("All {n} gates passed"),
        (_, 1) => "The gate failed".to_owned(),
        (2, 2) => "Both gates failed".to_owned(),
        (m, n) if m == n => format!("All {n} gates failed"),
        (m, n) => format!("{m} of {n} gates failed"),
    };
    gates.sort_by_key(|gate| gate.passed);
    let gates: Vec<Value> = gates.into_iter().map(entry).collect();
    Some(json!({ "summary": summary, "passed": failed == 0, "gates": gates }))
}

fn entry(gate: &GateResult) -> Value {
    json!({ "gate": gate.gate, "passed": gate.passed, "said": in_words(gate) })
}

/// Returns a line per gate: whether it held, the figure found, and its attack. The text ends with a line break or is empty.
pub fn gate_lines(document: &Document) -> String {
    let line = |gate: &GateResult| {
        let word = if gate.passed { "held" } else { "FAILED" };
        format!("gate {}: {word}, {}\n", gate.gate, briefly(gate))
    };
    document.gates.iter().map(line).collect()
}

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
        "gates": document.gates.iter().map(entry).collect::<Vec<_>>(),
        "failures": document.gates.iter().filter(|gate| !gate.passed).count(),
        "images": unusable,
        // The schema of Jenkins accepts at most three decimals.
        "time": format!("{:.3}", document.run.seconds.total.max(0.0)),
    });
    let source = include_str!("../template/gates.xml");
    Ok(templates::render(&[("gates.xml", source)], &values)? + "\n")
}

/// Returns the reason if a gate failed for another one than the figure, the figure, and its attack.
fn briefly(gate: &GateResult) -> String {
    let of = gate.of.as_ref().map_or_else(String::new, |of| format!(": {of}"));
    let figure = gate.found_percent.map(|figure| match gate.highest_percent {
        _ if is_of_localization(gate) => {
            format!("found {figure:.2} times the unprotected error{of}")
        }
        Some(highest) => {
            format!("found {figure:.1} %, up to {highest:.1} % with its sampling error{of}")
        }
        None => format!("found {figure:.1} %{of}"),
    });
    gate.reason.clone().into_iter().chain(figure).collect::<Vec<_>>().join("; ")
}

/// Returns true if the gate bounds a localization error, whose figures are multiples.
fn is_of_localization(gate: &GateResult) -> bool {
    gate.gate.contains(":localization")
}

/// Returns "88.7 % came back, at most 20 % may; olc, oracle at 0.50, joint, recovered within 0.10 m".
fn in_words(gate: &GateResult) -> String {
    let bound = words::significant(gate.bound_percent, 4);
    let (unit, verb, may) = match gate.gate.contains(":gain") {
        _ if is_of_localization(gate) => (" times", "the unprotected localization error", "may be"),
        true => (" percentage points", "were gained", "may be"),
        false => (" %", "came back", "may"),
    };
    let precise = |figure| beside(figure, gate.bound_percent);
    let figure = match (gate.found_percent, gate.highest_percent.map(precise)) {
        (None, _) => "not known;".to_owned(),
        (Some(figure), None) => format!("{}{unit} {verb},", precise(figure)),
        (Some(figure), Some(highest)) => {
            let figure = words::percent(figure);
            format!(
                "{figure}{unit} {verb} ({highest}{unit} at the upper end of the 95 % interval, which decides),"
            )
        }
    };
    let figure = format!("{figure} at most {bound}{unit} {may}");
    let parts = [gate.reason.clone(), Some(figure), gate.of.clone()];
    parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
}

/// Returns `figure` with one decimal, or more if needed to stay on its side of `bound`: 20.04 must not become
/// 20.0 beside a bound of 20.
fn beside(figure: f64, bound: f64) -> String {
    let texts = (1..=6).map(|digits| format!("{figure:.digits$}"));
    let on_its_side = |text: &String| {
        text.parse::<f64>().is_ok_and(|rounded| (rounded > bound) == (figure > bound))
    };
    texts.into_iter().find(on_its_side).unwrap_or_else(|| figure.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate(text: &str, found_percent: f64, bound_percent: f64) -> GateResult {
        let passed = found_percent <= bound_percent;
        let (gate, found_percent) = (text.to_owned(), Some(found_percent));
        GateResult { gate, found_percent, bound_percent, passed, ..GateResult::default() }
    }

    #[test]
    fn a_failed_gate_never_reads_as_one_that_held() {
        let failed = gate("all:0.10<=20", 20.04, 20.0);
        assert_eq!(in_words(&failed), "20.04 % came back, at most 20 % may");
        let held = in_words(&gate("all:0.10:gain<=20", 19.96, 20.0));
        let gained = "20.0 percentage points were gained, at most 20 percentage points may be";
        assert_eq!(held, gained);
        let of = "olc, oracle at 0.50, joint, recovered within 0.10 m";
        let named = GateResult { of: Some(of.into()), ..failed };
        assert_eq!(briefly(&named), format!("found 20.0 %: {of}"));
        assert_eq!(in_words(&named), format!("20.04 % came back, at most 20 % may; {of}"));
        let sampled =
            GateResult { highest_percent: Some(20.04), ..gate("all:0.10<=20", 19.6, 20.0) };
        assert_eq!(briefly(&sampled), "found 19.6 %, up to 20.0 % with its sampling error");
        assert_eq!(
            in_words(&sampled),
            "19.6 % came back (20.04 % at the upper end of the 95 % interval, which decides), at most 20 % may"
        );
        let unknown = GateResult {
            found_percent: None,
            passed: false,
            reason: Some("ppl+ could not be audited".into()),
            ..gate("ppl+:0.10<=20", 0.0, 20.0)
        };
        assert_eq!(in_words(&unknown), "ppl+ could not be audited; not known; at most 20 % may");
    }
}
