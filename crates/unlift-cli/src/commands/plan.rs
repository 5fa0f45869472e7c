//! What audits of maps and of images have in common: from arguments to a plan, and the summary.

use serde_json::{Value, json};
use unlift::Descriptors;
use unlift::audit::{Plan, Source, Threshold};
use unlift::neighbors::sources::Joined;
use unlift::recover::Solver;

use crate::args_audit::AttackArgs;
use crate::exit::{advise, usage};
use crate::job::Finished;
use crate::values::distinct;

/// `usual` with what was asked for.
pub fn attack(args: &AttackArgs, usual: Plan) -> Plan {
    let mut plan = usual;
    if !args.inlier_ratios.is_empty() {
        plan.inlier_ratios = distinct(args.inlier_ratios.clone(), |a, b| a == b);
    }
    if !args.oracle_noise.is_empty() {
        plan.oracle_noise = distinct(args.oracle_noise.clone(), |a, b| a == b);
    }
    plan.reference = args.reference;
    plan.delta = args.delta;
    plan.exact_constraints = !args.no_exact_constraints;
    plan.repeats = args.repeats;
    plan
}

/// The recovery methods asked for, each once, else the usual ones.
pub fn solvers(given: &[Solver], usual: &Plan) -> Vec<Solver> {
    match given {
        [] => usual.solvers.clone(),
        given => distinct(given.to_vec(), |a, b| a == b),
    }
}

/// The thresholds asked for, each once, else the usual ones.
pub fn thresholds(given: &[Threshold], usual: &Plan) -> anyhow::Result<Vec<Threshold>> {
    let thresholds = if given.is_empty() { &usual.thresholds } else { given };
    for (at, threshold) in thresholds.iter().enumerate() {
        if thresholds[..at].iter().any(|other| other.value == threshold.value) {
            return Err(usage(format!(
                "--thresholds: expected each once, found {} again",
                threshold.label
            )));
        }
    }
    Ok(thresholds.to_vec())
}

/// A source of the attacker's own, with lists as long as asked for.
pub fn own(joined: Joined, args: &AttackArgs) -> Source {
    Source::Own(match args.source_k {
        Some(k) => joined.with_k(usize::from(k)),
        None => joined,
    })
}

/// Refuses a source that cannot work on descriptors of this kind.
pub fn check_fit(joined: &Joined, descriptors: &Descriptors) -> anyhow::Result<()> {
    joined.check_descriptors(descriptors).map_err(|error| {
        let name = joined.name();
        let (expected, found) = (error.expected(), error.found());
        let error = usage(format!("--neighbors {name}: expected {expected}, found {found}"));
        advise(error, "--neighbors similarity, which takes descriptors of any kind")
    })
}

/// Refuses options that would be about none of the sources.
pub fn check_about(args: &AttackArgs, sources: &[Source]) -> anyhow::Result<()> {
    let names = || sources.iter().map(Source::name).collect::<Vec<_>>().join(", ");
    for (option, given) in [
        ("--inlier-ratios", !args.inlier_ratios.is_empty()),
        ("--oracle-noise", !args.oracle_noise.is_empty()),
    ] {
        if given && !sources.contains(&Source::Oracle) {
            let found = names();
            return Err(usage(format!(
                "{option}: expected with --neighbors oracle, found only {found}"
            )));
        }
    }
    if args.source_k.is_some() && !sources.iter().any(|s| matches!(s, Source::Own(_))) {
        let found = names();
        return Err(usage(format!(
            "--source-k: expected with a source that makes its own lists, found only {found}"
        )));
    }
    Ok(())
}

/// What a script wants to know: the results and where the rest is.
pub fn summary(finished: &Finished) -> anyhow::Result<String> {
    let mut document: Value = serde_json::from_str(&finished.document.to_json()?)?;
    let keep = ["unlift", "schema", "results", "not_audited", "break_even", "gates"];
    if let Some(fields) = document.as_object_mut() {
        fields.retain(|name, _| keep.contains(&name.as_str()));
        fields.insert("report".into(), json!(finished.report.display().to_string()));
    }
    Ok(format!("{document:#}\n"))
}
