//! `unlift audit again`: audits a map that is released twice.

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, json};
use unlift::audit::Plan;
use unlift::obfuscate::SchemeOptions;
use unlift_audit::again::{AgainJob, Maps, open, perform};
use unlift_audit::{Finished, Preparation, check_thresholds, open_audit};
use unlift_io::atomic::Rules;

use super::common::with_threads;
use super::gate_files::GateFile;
use super::plan::{summary, thresholds};
use crate::args::AuditAgainArgs;
use crate::exit::{Outcome, usage};
use crate::output::{command_line, print};
use crate::progress::{Progress, Spinner};
use crate::values::{all_schemes, distinct};

pub fn run(args: &AuditAgainArgs) -> anyhow::Result<Outcome> {
    let finished = audit(args)?;
    print(&if args.result.json { summary(&finished)? } else { finished.text() })?;
    Ok(if finished.passed() { Outcome::Done } else { Outcome::GateFailed })
}

/// Returns the input paths, which must not be overwritten.
fn inputs(args: &AuditAgainArgs) -> Vec<&Path> {
    let descriptors = [&args.descriptors, &args.descriptors_of_b].into_iter().flatten();
    [&args.a, &args.b].into_iter().chain(descriptors).map(|path| path.as_path()).collect()
}

/// Audits two releases and writes the results.
fn audit(args: &AuditAgainArgs) -> anyhow::Result<Finished> {
    let started = Instant::now();
    let rules = Rules::new(inputs(args), args.result.force);
    let gate_file = GateFile::check(&args.result, &rules)?;
    let out = open_audit(&args.result.out, rules, args.result.share_safe)?;
    let finished = with_threads(args.run.threads, || {
        let maps = maps(args)?;
        let (first, second) = (&maps.first.1, maps.second.as_ref().map(|(_, second)| second));
        let of = |what: &str, texts: &[String]| -> Vec<String> {
            texts.iter().map(|text| format!("{what}: {text}")).collect()
        };
        let mut notes = first.notes.clone();
        notes.extend(second.iter().flat_map(|second| of("second map", &second.notes)));
        let mut doubts = first.doubts.clone();
        doubts.extend(second.iter().flat_map(|second| of("second map", &second.doubts)));
        let points = first.original.reveal();
        let usual = Plan::new(points.unit());
        let thresholds = thresholds(&args.thresholds, &usual)?;
        let typed = !args.thresholds.is_empty();
        let said = check_thresholds(points.positions(), points.unit(), &thresholds, typed)?;
        notes.extend(said.note);
        doubts.extend(said.doubt);
        let schemes = SchemeOptions::usual(points.unit());
        let pairs = match args.schemes.as_slice() {
            [] => all_schemes().into_iter().map(|entry| [entry; 2]).collect(),
            given => distinct(given.to_vec(), |a, b| a.map(|e| e.name) == b.map(|e| e.name)),
        };
        let pairs = pairs
            .into_iter()
            .filter_map(|[a, b]| Some([a.of_dimension(&schemes)?, b.of_dimension(&schemes)?]));
        let progress = Progress::new(args.run.quiet);
        let records_alone = !args.no_records_alone;
        let job = AgainJob {
            maps: &maps,
            paths: [&args.a, &args.b],
            pairs: pairs.collect(),
            plan: Plan { thresholds, seed: args.seed, records_alone, ..usual },
            options: Map::from_iter([("again".to_owned(), json!(args.b.display().to_string()))]),
            notes,
            doubts,
            gates: args.result.gate.clone(),
            out: args.result.out.clone(),
            share_safe: args.result.share_safe,
            progress: &progress,
            command: Some(command_line()),
            started,
        };
        Ok(perform(job, out)?)
    })?;
    gate_file.write(&finished)?;
    Ok(finished)
}

fn maps(args: &AuditAgainArgs) -> anyhow::Result<Maps> {
    let _alive = Spinner::unless(args.run.quiet, "reading the maps");
    let own = args.descriptors.as_deref();
    let others = match (&args.descriptors_of_b, args.a == args.b) {
        (Some(others), _) => Some(others.as_path()),
        (None, true) => own,
        (None, false) if own.is_none() => None,
        (None, false) => {
            let expected = "expected with --descriptors, as A and B differ, found none";
            return Err(usage(format!("--descriptors-of-b: {expected}")));
        }
    };
    let preparation = Preparation { scale: args.scale, ..Preparation::default() };
    let maps = open([(&args.a, own), (&args.b, others)], &preparation)?;
    let dims = [Some(&maps.first), maps.second.as_ref()]
        .map(|map| map.and_then(|(_, prepared)| prepared.descriptors.as_ref()).map(|d| d.dim()));
    match dims {
        [Some(a), Some(b)] if a != b => Err(usage(format!(
            "--descriptors-of-b: expected {a} values per descriptor, as in --descriptors, found {b}"
        ))),
        _ => Ok(maps),
    }
}
