//! Results of gates, and a check that each gate applies to a row.

use unlift::Unit;
use unlift::audit::{NotAudited, Plan, Row, Threshold};
use unlift::neighbors::oracle::Noise;
use unlift_report::document::{FEWEST_HELD_OUT, GateResult, Localization, UNPROTECTED};

use super::{Candidate, Figure, Gate};
use crate::Error;

/// Returns the candidates of gates, each with its row and the index of its threshold.
fn candidates<'a, const D: usize>(
    plan: &Plan<D>,
    rows: &'a [Row],
) -> Vec<(Candidate<'a>, &'a Row, usize)> {
    let mut candidates = Vec::new();
    for row in rows {
        for (at, threshold) in plan.thresholds.iter().enumerate() {
            let candidate = Candidate {
                scheme: &row.scheme,
                solver: &row.solver,
                source: &row.neighbors,
                inlier_ratio: row.oracle_noise.is_some().then_some(row.inlier_ratio),
                threshold: threshold.value,
                recovered_percent: row.recovered_percent[at],
                baseline_percent: row.baseline_percent(at),
            };
            candidates.push((candidate, row, at));
        }
    }
    candidates
}

fn in_words(gate: &Gate, found: f64, row: &Row, at: usize, threshold: &Threshold) -> String {
    // If the row's own figure is smaller, a baseline without neighborhoods decides.
    let is_own = gate.figure == Figure::Gain || found == row.recovered_percent[at];
    let attack = match row.best_alone(at) {
        _ if is_own => {
            let noise = row.oracle_noise.filter(|noise| *noise != Noise::Uniform.name());
            let noise = noise.map_or_else(String::new, |noise| format!(" ({noise})"));
            format!("{}{noise} at {:.2}, {}", row.neighbors, row.inlier_ratio, row.solver)
        }
        Some((name, alone)) if found == alone => format!("records alone, {name}"),
        _ => "a blind guess".to_owned(),
    };
    let verb = if gate.figure == Figure::Gain { "gained" } else { "recovered" };
    let unit = match row.unit {
        Unit::Meter => "m",
        Unit::Pixel => "px",
        Unit::KthNeighbor => "x",
    };
    format!("{}, {attack}, {verb} within {} {unit}", row.scheme, threshold.label)
}

/// Reports a gate without rows before the audit runs. `localizes` is true if the audit measures
/// localization.
pub fn check_gates<const D: usize>(
    gates: &[Gate],
    plan: &Plan<D>,
    localizes: bool,
) -> Result<(), Error> {
    let of_localization = |gate: &&Gate| gate.figure == Figure::Localization;
    if let Some(gate) = gates.iter().find(of_localization).filter(|_| !localizes) {
        let expected = "expected a COLMAP model with cameras and tracks, not in tiles";
        return Err(Error::request(format!("--gate {}: {expected}, found none", gate.typed)));
    }
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

/// Returns the results of all gates. A gate fails if something it applies to was not audited, or if
/// a row it applies to has a doubt; `doubts` has one entry per row, or is empty.
pub fn gate_results<const D: usize>(
    gates: &[Gate],
    plan: &Plan<D>,
    rows: &[Row],
    not_audited: &[NotAudited],
    doubts: &[Option<String>],
    localization: &[Localization],
) -> Result<Vec<GateResult>, Error> {
    let doubtful = rows.iter().zip(doubts).filter_map(|(row, doubt)| Some((row, doubt.as_ref()?)));
    let doubtful: Vec<(Vec<_>, &String)> =
        doubtful.map(|(row, doubt)| (candidates(plan, std::slice::from_ref(row)), doubt)).collect();
    let rows = candidates(plan, rows);
    let result = |gate: &Gate| {
        if gate.figure == Figure::Localization {
            return Ok(of_localization(gate, localization, not_audited));
        }
        let found_percent = gate.worst(rows.iter().map(|(candidate, ..)| *candidate));
        let of = found_percent.and_then(|found| {
            let decides = |candidate| {
                gate.worst([candidate]).is_some_and(|one| one.total_cmp(&found).is_eq())
            };
            let (_, row, at) = rows.iter().find(|(candidate, ..)| decides(*candidate))?;
            Some(in_words(gate, found, row, *at, &plan.thresholds[*at]))
        });
        let is_about = |rows: &[(Candidate<'_>, &Row, usize)]| {
            rows.iter().any(|(candidate, ..)| gate.covers(candidate))
        };
        let doubt = doubtful.iter().find(|(rows, _)| is_about(rows)).map(|(_, doubt)| doubt);
        let reason = not_audited.iter().find(|missing| gate.misses(missing)).map(|missing| {
            let with = missing.neighbors.as_ref().map(|name| format!(" with neighbors by {name}"));
            let (scheme, with) = (&missing.scheme, with.unwrap_or_default());
            format!("{scheme}{with} was not audited: {}", missing.reason)
        });
        let keeps = found_percent.is_some_and(|found| gate.passes(found));
        let reason = reason.or_else(|| doubt.filter(|_| keeps).map(|doubt| doubt.to_string()));
        // A gate without a row must never count as held.
        if found_percent.is_none() && reason.is_none() {
            return Err(Error::request(format!(
                "--gate {}: expected a row, found none",
                gate.typed
            )));
        }
        let passed = reason.is_none() && keeps;
        let (gate, bound_percent) = (gate.typed.clone(), gate.bound_percent);
        Ok(GateResult { gate, found_percent, of, bound_percent, passed, reason })
    };
    gates.iter().map(result).collect()
}

/// Returns the localization error that a gate compares, as a multiple. Few held-out images may fail a gate that the bound passes,
/// because the bound assumes that all matches are found.
fn cost_of_gate(one: &Localization) -> Option<f64> {
    match (&one.held_out, one.measured()) {
        (Some(few), None) => Some(one.cost()?.max(few.multiple?)),
        _ => one.cost(),
    }
}

/// Returns the result of a gate on localization. A scheme without a finite error fails it.
fn of_localization(
    gate: &Gate,
    localization: &[Localization],
    not_audited: &[NotAudited],
) -> GateResult {
    let covered = |scheme: &str| gate.scheme.as_deref().is_none_or(|name| name == scheme);
    let of_map =
        |one: &&Localization| !one.of_queries && one.scheme != UNPROTECTED && covered(&one.scheme);
    let all: Vec<&Localization> = localization.iter().filter(of_map).collect();
    let missing = not_audited.iter().find(|one| one.neighbors.is_none() && covered(&one.scheme));
    let worst = all.iter().max_by(|a, b| {
        let cost = |one: &Localization| cost_of_gate(one).unwrap_or(f64::INFINITY);
        cost(a).total_cmp(&cost(b))
    });
    let reason = match (worst, missing) {
        (_, Some(missing)) => {
            Some(format!("{} was not audited: {}", missing.scheme, missing.reason))
        }
        (None, None) => Some("localization was not measured".to_owned()),
        (Some(one), None) if one.is_unknown() => Some(format!(
            "{} changes descriptors, so its cost is not known without {FEWEST_HELD_OUT} or more held-out images",
            one.scheme
        )),
        (Some(one), None) if cost_of_gate(one).is_none() => {
            Some(format!("{}: most images do not localize", one.scheme))
        }
        (Some(_), None) => None,
    };
    let found_percent = worst.and_then(|one| cost_of_gate(one));
    let by = |one: &Localization| match (&one.held_out, one.measured()) {
        (_, Some(_)) => "held-out images",
        (Some(_), None) => "the larger of the bound and few held-out images",
        (None, None) => "bound",
    };
    GateResult {
        gate: gate.typed.clone(),
        found_percent,
        of: worst.map(|one| format!("{}, {}", one.scheme, by(one))),
        bound_percent: gate.bound_percent,
        passed: reason.is_none() && found_percent.is_some_and(|found| gate.passes(found)),
        reason,
    }
}

#[cfg(test)]
mod tests {
    use unlift_report::document::HeldOut;

    use super::*;

    #[test]
    fn few_held_out_images_fail_a_gate_but_never_pass_one() {
        let gate = Gate::parse("olc:localization<=2").unwrap();
        let passes = |multiple: Option<f64>, n_images: u64, bound: f64| {
            let held_out = HeldOut {
                n_images,
                right_matches: 50.0,
                matches: 60.0,
                center_error: multiple,
                rotation_error_degrees: multiple,
                multiple,
                recall_percent: Default::default(),
            };
            let one = Localization {
                scheme: "olc".to_owned(),
                of_queries: false,
                multiple: Some(bound),
                center_error: Some(bound),
                rotation_error_degrees: Some(bound),
                failed_percent: 0.0,
                changes_descriptors: false,
                held_out: Some(held_out),
            };
            of_localization(&gate, &[one], &[]).passed
        };
        assert!(passes(Some(1.0), 3, 1.5));
        assert!(!passes(Some(3.0), 3, 1.5) && !passes(None, 3, 1.5));
        assert!(!passes(Some(1.0), 3, 2.5), "the bound holds, whatever few images say");
        assert!(passes(Some(1.0), 10, 2.5), "ten images count alone");
    }
}
