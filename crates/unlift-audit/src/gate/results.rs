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

/// How every gate ended. One that is about something that could not be audited does not hold, nor one about a row whose
/// figures may be too small; `doubts` says why they may, per row, or is empty.
pub fn gate_results<const D: usize>(
    gates: &[Gate],
    plan: &Plan<D>,
    rows: &[Row],
    not_audited: &[NotAudited],
    doubts: &[Option<String>],
) -> Result<Vec<GateResult>, Error> {
    let doubtful = rows.iter().zip(doubts).filter_map(|(row, doubt)| Some((row, doubt.as_ref()?)));
    let doubtful: Vec<(Vec<Candidate<'_>>, &String)> =
        doubtful.map(|(row, doubt)| (candidates(plan, std::slice::from_ref(row)), doubt)).collect();
    let rows = candidates(plan, rows);
    let result = |gate: &Gate| {
        let found_percent = gate.worst(rows.iter().copied());
        let is_about = |rows: &[Candidate<'_>]| rows.iter().any(|row| gate.covers(row));
        let doubt = doubtful.iter().find(|(rows, _)| is_about(rows)).map(|(_, doubt)| doubt);
        let reason = not_audited.iter().find(|missing| gate.misses(missing)).map(|missing| {
            let with = missing.neighbors.as_ref().map(|name| format!(" with neighbors by {name}"));
            let (scheme, with) = (&missing.scheme, with.unwrap_or_default());
            format!("{scheme}{with} was not audited: {}", missing.reason)
        });
        let keeps = found_percent.is_some_and(|found| gate.passes(found));
        let reason = reason.or_else(|| doubt.filter(|_| keeps).map(|doubt| doubt.to_string()));
        // A gate that is about no row must never count as held.
        if found_percent.is_none() && reason.is_none() {
            return Err(Error::request(format!(
                "--gate {}: expected a row, found none",
                gate.typed
            )));
        }
        let passed = reason.is_none() && keeps;
        let (gate, bound_percent) = (gate.typed.clone(), gate.bound_percent);
        Ok(GateResult { gate, found_percent, bound_percent, passed, reason })
    };
    gates.iter().map(result).collect()
}
