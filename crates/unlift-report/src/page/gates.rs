//! The results of the user's gates in words; failed gates come first on the page.

use serde::Serialize;

use crate::document::{Document, GateResult};
use crate::words;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Gates {
    /// "2 of 3 gates failed", or "All 3 gates passed".
    pub summary: String,
    pub passed: bool,
    /// Failed gates first, else in the given order.
    pub gates: Vec<GateWords>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct GateWords {
    pub gate: String,
    pub passed: bool,
    /// `PASS` or `FAIL`.
    pub word: &'static str,
    /// "88.7 % came back, at most 20 % may; olc, oracle at 0.50, joint, recovered within 0.10 m".
    pub said: String,
}

pub(crate) fn gates(document: &Document) -> Option<Gates> {
    let all = &document.gates;
    let failed = all.iter().filter(|gate| !gate.passed).count();
    let summary = match (failed, all.len()) {
        (_, 0) => return None,
        (0, 1) => "The gate passed".to_owned(),
        (0, n) => format!("All {n} gates passed"),
        (_, 1) => "The gate failed".to_owned(),
        (m, n) if m == n => format!("All {n} gates failed"),
        (m, n) => format!("{m} of {n} gates failed"),
    };
    let mut gates: Vec<GateWords> = all.iter().map(in_words).collect();
    gates.sort_by_key(|gate| gate.passed);
    Some(Gates { summary, passed: failed == 0, gates })
}

/// Returns a sentence if images could not be used, because gates do not cover them.
pub(crate) fn unusable(document: &Document) -> Option<String> {
    let images = document.input.images.as_ref().filter(|images| images.unusable > 0)?;
    let (unusable, found) = (images.unusable, images.used + images.unusable);
    Some(format!("{unusable} of {found} images could not be used, and are in no figure"))
}

/// Returns a line per gate: whether it held, the figure found, and its attack. The text ends with a line break
/// or is empty.
pub fn gate_lines(document: &Document) -> String {
    let line = |gate: &GateResult| {
        let word = if gate.passed { "held" } else { "FAILED" };
        format!("gate {}: {word}, {}\n", gate.gate, gate_found(gate))
    };
    document.gates.iter().map(line).collect()
}

/// Returns the figure found for a gate, its attack, and the reason if the gate failed for another reason.
fn gate_found(gate: &GateResult) -> String {
    let of = gate.of.as_ref().map_or_else(String::new, |of| format!(": {of}"));
    let found = gate.found_percent.map(|found| match is_of_localization(gate) {
        true => format!("found {found:.2} times the unprotected error{of}"),
        false => match gate.highest_percent {
            Some(highest) => {
                format!("found {found:.1} %, up to {highest:.1} % with its sampling error{of}")
            }
            None => format!("found {found:.1} %{of}"),
        },
    });
    let found: Vec<String> = found.into_iter().chain(gate.reason.clone()).collect();
    found.join("; ")
}

/// Returns true if the gate bounds a localization error, whose figures are multiples.
pub(crate) fn is_of_localization(gate: &GateResult) -> bool {
    gate.gate.contains(":localization")
}

pub(crate) fn in_words(gate: &GateResult) -> GateWords {
    let bound = words::significant(gate.bound_percent, 4);
    let (unit, verb) = match gate.gate.contains(":gain") {
        _ if is_of_localization(gate) => {
            (" times", ("the unprotected localization error", "may be"))
        }
        true => (" percentage points", ("were gained", "may be")),
        false => (" %", ("came back", "may")),
    };
    let found = gate.found_percent.map(|found| {
        let highest = gate.highest_percent.map(|highest| {
            let highest = beside(highest, gate.bound_percent);
            format!(" ({highest}{unit} at the upper end of the 95 % interval, which decides)")
        });
        let found = match &highest {
            Some(_) => words::percent(found),
            None => beside(found, gate.bound_percent),
        };
        let highest = highest.unwrap_or_default();
        format!("{found}{unit} {}{highest}, at most {bound}{unit} {}", verb.0, verb.1)
    });
    let found = found.unwrap_or_else(|| format!("not known; at most {bound}{unit} {}", verb.1));
    let word = if gate.passed { "PASS" } else { "FAIL" };
    let said = [Some(found), gate.of.clone(), gate.reason.clone()];
    let said: Vec<String> = said.into_iter().flatten().collect();
    GateWords { gate: gate.gate.clone(), passed: gate.passed, word, said: said.join("; ") }
}

/// Returns `found` with one decimal, or more if needed to stay on its side of `bound`: 20.04 must not become
/// 20.0 beside a bound of 20.
fn beside(found: f64, bound: f64) -> String {
    let texts = (1..=6).map(|digits| format!("{found:.digits$}"));
    let on_its_side = |text: &String| {
        text.parse::<f64>().is_ok_and(|rounded| (rounded > bound) == (found > bound))
    };
    texts.into_iter().find(on_its_side).unwrap_or_else(|| found.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate(text: &str, found_percent: f64, bound_percent: f64) -> GateResult {
        let passed = found_percent <= bound_percent;
        serde_json::from_value(serde_json::json!({
            "gate": text, "found_percent": found_percent, "bound_percent": bound_percent, "passed": passed
        }))
        .expect("a gate")
    }

    #[test]
    fn a_failed_gate_never_reads_as_one_that_held() {
        let failed = in_words(&gate("all:0.10<=20", 20.04, 20.0));
        assert_eq!(
            (failed.word, failed.said.as_str()),
            ("FAIL", "20.04 % came back, at most 20 % may")
        );
        let held = in_words(&gate("all:0.10:gain<=20", 19.96, 20.0));
        let said = "20.0 percentage points were gained, at most 20 percentage points may be";
        assert_eq!((held.word, held.said.as_str()), ("PASS", said));
        let of = "olc, oracle at 0.50, joint, recovered within 0.10 m";
        let named = GateResult { of: Some(of.into()), ..gate("all:0.10<=20", 20.04, 20.0) };
        assert_eq!(gate_found(&named), format!("found 20.0 %: {of}"));
        assert_eq!(in_words(&named).said, format!("20.04 % came back, at most 20 % may; {of}"));
        let sampled =
            GateResult { highest_percent: Some(20.04), ..gate("all:0.10<=20", 19.6, 20.0) };
        assert_eq!(gate_found(&sampled), "found 19.6 %, up to 20.0 % with its sampling error");
        assert_eq!(
            in_words(&sampled).said,
            "19.6 % came back (20.04 % at the upper end of the 95 % interval, which decides), at most 20 % may"
        );
        let unknown = GateResult {
            found_percent: None,
            passed: false,
            reason: Some("ppl+ could not be audited".into()),
            ..gate("ppl+:0.10<=20", 0.0, 20.0)
        };
        let unknown = in_words(&unknown);
        assert_eq!(unknown.word, "FAIL");
        assert_eq!(unknown.said, "not known; at most 20 % may; ppl+ could not be audited");
    }
}
