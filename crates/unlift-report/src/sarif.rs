//! Gates as SARIF 2.1.0, which GitHub shows as alerts: a rule per gate, a result per failed gate.

use serde_json::{Value, json};

use crate::document::Document;
use crate::gates::{self, GateWords};

/// The location of results if the document names no map.
const UNNAMED: &str = "audit.json";
const REPOSITORY: &str = env!("CARGO_PKG_REPOSITORY");

/// Returns the gates of `document` as a SARIF log of one run. Results point to `asked_at` (the file and line that request
/// the audit), else to the map. The text ends with a line break.
pub fn sarif(document: &Document, asked_at: Option<(&str, usize)>) -> String {
    let mut gates: Vec<GateWords> = Vec::new();
    for gate in document.gates.iter().map(gates::in_words) {
        // SARIF lists a rule once, even if its gate was given twice.
        if gates.iter().all(|known| known.gate != gate.gate) {
            gates.push(gate);
        }
    }
    let path = document.input.path.as_deref();
    let of_map = path.map(uri);
    let (at, line) = match asked_at {
        Some((file, line)) => (uri(file), line),
        None => (of_map.clone().unwrap_or_else(|| UNNAMED.to_owned()), 1),
    };
    let unusable = gates::unusable(document);
    let mut invocation = json!({ "executionSuccessful": unusable.is_none() });
    if let Some(said) = unusable {
        let notification = json!({ "level": "error", "message": { "text": said } });
        invocation["toolExecutionNotifications"] = json!([notification]);
    }
    let failed = gates.iter().enumerate().filter(|(_, gate)| !gate.passed);
    let mut run = json!({
        "tool": { "driver": {
            "name": "unlift",
            "version": document.unlift,
            "informationUri": REPOSITORY,
            "rules": gates.iter().map(rule).collect::<Vec<_>>(),
        }},
        "invocations": [invocation],
        "results": failed.map(|(rule, gate)| result(rule, gate, (&at, line))).collect::<Vec<_>>(),
    });
    // Two audits of one commit replace each other's alerts unless each has a category; the slash ends the category.
    let category = of_map.or_else(|| asked_at.map(|_| format!("{at}/{line}")));
    if let Some(category) = category {
        run["automationDetails"] = json!({ "id": format!("unlift/{category}/") });
    }
    let log = json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [run],
    });
    format!("{log:#}\n")
}

fn rule(gate: &GateWords) -> Value {
    json!({
        "id": gate.gate,
        "shortDescription": { "text": format!("{}: {}", gate.gate, gate.allowed) },
        "help": { "text": "report.html of the audit shows what came back, and by which attack." },
        "defaultConfiguration": { "level": "error" },
        "properties": { "tags": ["privacy"] },
    })
}

fn result(rule: usize, gate: &GateWords, (uri, line): (&str, usize)) -> Value {
    json!({
        "ruleId": gate.gate,
        "ruleIndex": rule,
        "level": "error",
        "message": { "text": format!("{}: {}", gate.gate, gate.said) },
        // GitHub rejects results without a line.
        "locations": [{ "physicalLocation": {
            "artifactLocation": { "uri": uri },
            "region": { "startLine": line },
        }}],
    })
}

/// Returns a path as a URI reference (RFC 3986): an absolute path as `file:`, a relative one unchanged.
fn uri(path: &str) -> String {
    let path = match std::path::MAIN_SEPARATOR {
        '\\' => path.replace('\\', "/"),
        _ => path.to_owned(),
    };
    let mut out = String::new();
    let drive = path.as_bytes().get(1) == Some(&b':') && cfg!(windows);
    if path.starts_with('/') || drive {
        out.push_str(if drive { "file:///" } else { "file://" });
    }
    for &byte in path.as_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => {
                out.push(char::from(byte));
            }
            // A colon is escaped, too, because text before it would be a URI scheme.
            _ => out.push_str(&format!("%{byte:02X}")),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn paths_become_references() {
        assert_eq!(uri("maps/room 1.ply"), "maps/room%201.ply");
        assert_eq!(uri("/maps/ü"), "file:///maps/%C3%BC");
        assert_eq!(uri("a:b\\c"), "a%3Ab%5Cc");
    }
}
