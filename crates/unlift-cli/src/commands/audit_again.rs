//! `unlift audit again`: audits a map that is released twice.

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, json};
use unlift::audit::Plan;
use unlift::obfuscate::SchemeOptions;
use unlift_audit::Preparation;
use unlift_audit::again::{AgainJob, Maps, open, perform};

use super::audits::{self, map_thresholds};
use crate::args::AuditAgainArgs;
use crate::exit::{Outcome, usage};
use crate::output::command_line;
use crate::progress::Progress;
use crate::values::{all_schemes, distinct};

pub fn run(args: &AuditAgainArgs) -> crate::Result<Outcome> {
    let started = Instant::now();
    let inputs = [&args.a, &args.b].into_iter().chain(&args.descriptors);
    audits::perform(&args.audit, inputs.map(|path| path.as_path()).collect(), |out| {
        let maps = maps(args)?;
        let (first, second) = (&maps.first.1, maps.second.as_ref().map(|(_, second)| second));
        let of = |texts: &[String]| -> Vec<String> {
            texts.iter().map(|text| format!("second map: {text}")).collect()
        };
        let (mut notes, mut doubts) = (first.notes.clone(), first.doubts.clone());
        notes.extend(second.iter().flat_map(|second| of(&second.notes)));
        doubts.extend(second.iter().flat_map(|second| of(&second.doubts)));
        let unit = first.original.reveal().unit();
        let usual = Plan::new(unit);
        let thresholds = map_thresholds(&args.audit, first, &usual, (&mut notes, &mut doubts))?;
        let pairs = match args.schemes.as_slice() {
            [] => all_schemes().into_iter().map(|entry| [entry; 2]).collect(),
            given => distinct(given.to_vec(), |a, b| a.map(|e| e.name) == b.map(|e| e.name)),
        };
        let schemes = SchemeOptions::usual(unit);
        let pairs = pairs
            .into_iter()
            .filter_map(|[a, b]| Some([a.of_dimension(&schemes)?, b.of_dimension(&schemes)?]));
        let progress = Progress::new(args.audit.quiet);
        let records_alone = !args.no_records_alone;
        let job = AgainJob {
            maps: &maps,
            paths: [&args.a, &args.b],
            pairs: pairs.collect(),
            plan: Plan { thresholds, seed: args.audit.seed, records_alone, ..usual },
            options: Map::from_iter([("again".to_owned(), json!(args.b.display().to_string()))]),
            notes,
            doubts,
            gates: args.audit.gate.clone(),
            out: args.audit.out.clone(),
            share_safe: args.audit.share_safe,
            progress: &progress,
            command: Some(command_line()),
            started,
        };
        Ok(Some(perform(job, out)?))
    })
}

fn maps(args: &AuditAgainArgs) -> crate::Result<Maps> {
    let _alive = Progress::uncounted(args.audit.quiet, "reading the maps");
    let descriptors: [Option<&Path>; 2] = match (args.descriptors.as_slice(), args.a == args.b) {
        ([], _) => [None, None],
        ([both], true) => [Some(both), Some(both)],
        ([a, b], _) => [Some(a), Some(b)],
        (given, _) => {
            let expected = "expected one file for A and one for B, as A and B differ";
            let n = given.len();
            return Err(usage(format!("--descriptors: {expected}, found {n}")));
        }
    };
    let preparation = Preparation { scale: args.scale, ..Preparation::default() };
    let maps = open([(&args.a, descriptors[0]), (&args.b, descriptors[1])], &preparation)?;
    let dims = [Some(&maps.first), maps.second.as_ref()]
        .map(|map| map.and_then(|(_, prepared)| prepared.descriptors.as_ref()).map(|d| d.dim()));
    match dims {
        [Some(a), Some(b)] if a != b => Err(usage(format!(
            "--descriptors: expected {a} values per descriptor of B, as of A, found {b}"
        ))),
        _ => Ok(maps),
    }
}
