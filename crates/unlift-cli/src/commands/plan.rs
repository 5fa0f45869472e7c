//! Plans and summaries that audits of maps and of images share.

use std::sync::Arc;

use serde_json::{Value, json};
use unlift::audit::{NeighborsBy, Plan, Threshold};
use unlift::neighbors::{Needs, Source};
use unlift::recover::{Builtin, Solver};
use unlift::{Descriptors, ErrorKind};

use crate::args::AttackArgs;
use crate::exit::{advise, usage};
use crate::values::{NeighborSource, distinct};
use unlift_audit::{Finished, Prepared, by_point};

/// Returns the plan `usual` with the options of the attack.
pub fn attack<const D: usize>(args: &AttackArgs, usual: Plan<D>) -> Plan<D> {
    let mut plan = usual;
    if !args.inlier_ratios.is_empty() {
        plan.inlier_ratios = distinct(args.inlier_ratios.clone(), |a, b| a == b);
    }
    if !args.oracle_noise.is_empty() {
        plan.oracle_noise = distinct(args.oracle_noise.clone(), |a, b| a == b);
    }
    plan.delta = args.delta;
    plan.repeats = args.repeats;
    plan
}

/// Returns the requested solvers, each once, or the default.
pub fn solvers<const D: usize>(given: &[Builtin], usual: &Plan<D>) -> Vec<Arc<dyn Solver<D>>> {
    match given {
        [] => usual.solvers.clone(),
        given => Builtin::list(&distinct(given.to_vec(), |a, b| a == b)),
    }
}

/// Returns the requested thresholds, or the default. A repeated threshold is an error.
pub fn thresholds<const D: usize>(
    given: &[Threshold],
    usual: &Plan<D>,
) -> anyhow::Result<Vec<Threshold>> {
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

/// Returns the sources of an audit of a map, each once, and checks that options and descriptors fit
/// them. The file had `n_read` points. Notes for the user are added to `notes`; `lacking` makes the
/// error of a source without descriptors.
pub fn neighbors(
    (asked, args): (&[NeighborSource], &AttackArgs),
    (prepared, descriptors): (&Prepared, Option<&Descriptors>),
    lacking: impl Fn(String) -> anyhow::Error,
    (n_read, notes): (usize, &mut Vec<String>),
) -> anyhow::Result<Vec<NeighborsBy<3>>> {
    let mut sources = Vec::new();
    for source in distinct(asked.to_vec(), |a, b| a == b) {
        sources.push(match source {
            NeighborSource::Oracle => NeighborsBy::Oracle,
            NeighborSource::File(path) => {
                NeighborsBy::Given(by_point(&path, prepared, n_read, notes)?)
            }
            NeighborSource::Own(named) => {
                let by = NeighborsBy::Source(named.of_dimension()?);
                if let Some(source) = by.source() {
                    match descriptors {
                        Some(descriptors) => check_fit(source, descriptors)?,
                        None if source.needs() == Needs::Descriptors => {
                            let name = source.name();
                            return Err(lacking(format!(
                                "--neighbors {name}: expected descriptors"
                            )));
                        }
                        None => {}
                    }
                    notes.extend(source.note(prepared.original.len()));
                }
                by
            }
        });
    }
    let files = sources.iter().filter(|by| matches!(by, NeighborsBy::Given(_))).count();
    if files > 1 {
        return Err(usage(format!("--neighbors: expected at most one file, found {files}")));
    }
    check_about(args, &sources)?;
    Ok(sources)
}

/// Returns an error if a source does not support this kind of descriptors.
pub fn check_fit<const D: usize>(
    source: &dyn Source<D>,
    descriptors: &Descriptors,
) -> anyhow::Result<()> {
    source.takes(descriptors).map_err(|error| {
        let name = source.name();
        // Errors of another kind are about the source's model and name its path.
        if error.kind() != ErrorKind::Descriptors {
            return usage(format!("--neighbors {name}: {error}"));
        }
        let (expected, found) = (error.expected(), error.found());
        let error = usage(format!("--neighbors {name}: expected {expected}, found {found}"));
        advise(error, "--neighbors similarity, which takes descriptors of any kind")
    })
}

/// Returns an error for an option that applies to none of the sources.
pub fn check_about<const D: usize>(
    args: &AttackArgs,
    sources: &[NeighborsBy<D>],
) -> anyhow::Result<()> {
    let names = || sources.iter().map(NeighborsBy::name).collect::<Vec<_>>().join(", ");
    for (option, given) in [
        ("--inlier-ratios", !args.inlier_ratios.is_empty()),
        ("--oracle-noise", !args.oracle_noise.is_empty()),
    ] {
        if given && !sources.iter().any(NeighborsBy::is_oracle) {
            let found = names();
            return Err(usage(format!(
                "{option}: expected with --neighbors oracle, found only {found}"
            )));
        }
    }
    Ok(())
}

/// Returns the summary of `--json`: results and paths.
pub fn summary(finished: &Finished) -> anyhow::Result<String> {
    let mut document: Value = serde_json::from_str(&finished.document.to_json()?)?;
    let keep = ["unlift", "schema", "results", "not_audited", "break_even", "gates"];
    if let Some(fields) = document.as_object_mut() {
        fields.retain(|name, _| keep.contains(&name.as_str()));
        fields.insert("report".into(), json!(finished.report.display().to_string()));
    }
    Ok(format!("{document:#}\n"))
}
