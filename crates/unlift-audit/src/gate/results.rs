//! Gates about an audit: whether each is about a row of it, and how it ended.

use unlift::audit::{NotAudited, Plan, REFERENCE, Row};
use unlift_report::document::GateResult;

use super::{Candidate, Gate};
use crate::Error;

/// Rows as gates see them.
fn candidates<'a, const D: usize>(plan: &Plan<D>, rows: &'a [Row]) -> Vec<Candidate<'a>> {
    let mut candidates = Vec::new();
    // The reference is no attack.
    for row in rows.iter().filter(|row| row.solver != REFERENCE) {
        for (at, threshold) in plan.thresholds.iter().enumerate() {
            candidates.push(Candidate {
                scheme: &row.scheme,
                solver: row.solver,
                source: &row.neighbors,
                inlier_ratio: row.oracle_noise.is_some().then_some(row.inlier_ratio),
                threshold: threshold.value,
                recovered_percent: row.recovered_percent[at],
                baseline_percent: row.baseline_percent(at),
            });
        }
    }
    candidates
}

/// A gate about no row is told before the audit runs, not after.
pub fn check_gates<const D: usize>(gates: &[Gate], plan: &Plan<D>) -> Result<(), Error> {
    let lacking = |gate: &Gate| gate.not_in(plan).map(|part| (gate.typed.clone(), part));
    match gates.iter().find_map(lacking) {
        None => Ok(()),
        Some((gate, (expected, found))) => {
            let (part, names) = expected.split_once(": ").unwrap_or(("row", &expected));
            let error = format!("--gate {gate}: {part}: expected {names}, found {found}");
            Err(match part {
                "threshold" => {
                    Error::request(error).advise("--scale and --thresholds, which change them")
                }
                _ => Error::request(error),
            })
        }
    }
}

/// How every gate ended. One that is about something that could not be audited does not hold.
pub fn gate_results<const D: usize>(
    gates: &[Gate],
    plan: &Plan<D>,
    rows: &[Row],
    not_audited: &[NotAudited],
) -> Result<Vec<GateResult>, Error> {
    let rows = candidates(plan, rows);
    let result = |gate: &Gate| {
        let found_percent = gate.worst(rows.iter().copied());
        let reason = not_audited.iter().find(|missing| gate.misses(missing)).map(|missing| {
            let with = missing.neighbors.as_ref().map(|name| format!(" with neighbors by {name}"));
            let (scheme, with) = (&missing.scheme, with.unwrap_or_default());
            format!("{scheme}{with} was not audited: {}", missing.reason)
        });
        // A gate that is about no row must never count as held.
        if found_percent.is_none() && reason.is_none() {
            return Err(Error::request(format!(
                "--gate {}: expected a row, found none",
                gate.typed
            )));
        }
        let passed = reason.is_none() && found_percent.is_some_and(|found| gate.passes(found));
        let (gate, bound_percent) = (gate.typed.clone(), gate.bound_percent);
        Ok(GateResult { gate, found_percent, bound_percent, passed, reason })
    };
    gates.iter().map(result).collect()
}
