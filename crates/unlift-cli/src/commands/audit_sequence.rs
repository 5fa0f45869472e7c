//! `unlift audit sequence`: audits several queries with known poses.

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, json};
use unlift::Unit;
use unlift::audit::{Plan, Threshold};
use unlift::neighbors::sources::Named;
use unlift::obfuscate::{Change, Changed, Mitigation, SchemeOptions};
use unlift_audit::images::{FeatureSource, choice};
use unlift_audit::inversion::Inversion;
use unlift_audit::sequence::{PoseError, SequenceJob, perform};
use unlift_audit::{Finished, open_audit};
use unlift_io::atomic::Rules;
use unlift_vision::features::photo::Turn;

use super::common::with_threads;
use super::gate_files::GateFile;
use super::painter::{kind, painter};
use super::plan::{summary, thresholds};
use crate::args::AuditSequenceArgs;
use crate::exit::{Outcome, usage};
use crate::output::{command_line, print};
use crate::progress::Progress;
use crate::stderr;
use crate::values::distinct;

pub fn run(args: &AuditSequenceArgs) -> anyhow::Result<Outcome> {
    let finished = audit(args)?;
    print(&if args.result.json { summary(&finished)? } else { finished.text() })?;
    Ok(if finished.passed() { Outcome::Done } else { Outcome::GateFailed })
}

/// Returns the input paths, which must not be overwritten.
fn inputs(args: &AuditSequenceArgs) -> Vec<&Path> {
    vec![&args.model, &args.path]
}

/// Audits a sequence and writes the results.
fn audit(args: &AuditSequenceArgs) -> anyhow::Result<Finished> {
    let started = Instant::now();
    let plan = plan(args)?;
    let pose_error = pose_error(args)?;
    let rules = Rules::new(inputs(args), args.result.force);
    let gate_file = GateFile::check(&args.result, &rules)?;
    let out = open_audit(&args.result.out, rules, args.result.share_safe)?;
    let finished = with_threads(args.run.threads, || {
        // A model is of the photos as they are stored.
        let source =
            FeatureSource::open(&args.path, &args.extraction.wanted().extraction(&args.path)?)?;
        let source = source.with_turn(Turn::AsStored);
        let inversion = inversion(args, &source)?;
        if let Some(note) = source.passed_over() {
            stderr::note(note);
        }
        let progress = Progress::new(args.run.quiet);
        let mut queries = args.queries.clone();
        queries.sort_unstable();
        queries.dedup();
        let job = SequenceJob {
            model: &args.model,
            source: &source,
            path: &args.path,
            plan,
            lists: args.neighbors.as_ref().map(Named::of_dimension).transpose()?,
            held_out_share: args.held_out_share,
            queries,
            pose_error,
            options: options(args),
            gates: args.result.gate.clone(),
            inversion: inversion.as_ref(),
            out: args.result.out.clone(),
            share_safe: args.result.share_safe,
            progress: &progress,
            command: Some(command_line()),
            started,
        };
        Ok(perform(job, out)?.0)
    })?;
    gate_file.write(&finished)?;
    Ok(finished)
}

/// Returns what paints, if pictures are requested.
fn inversion(
    args: &AuditSequenceArgs,
    source: &FeatureSource,
) -> anyhow::Result<Option<Inversion>> {
    if !args.invert {
        return Ok(None);
    }
    let photos = match (&args.photos, args.path.is_dir()) {
        (Some(photos), _) => photos,
        (None, true) => &args.path,
        (None, false) => {
            let expected = "--invert: expected --photos, as PATH is no folder of photos";
            return Err(usage(expected));
        }
    };
    let all: Vec<usize> = (0..source.names().len()).collect();
    let first = source.first(&all).and_then(|first| first.descriptors);
    let painter = painter(kind("--invert", first.as_ref())?, None)?;
    Ok(Some(Inversion::new(painter, photos, source.turn())))
}

fn plan(args: &AuditSequenceArgs) -> anyhow::Result<Plan<2>> {
    let usual = Plan::new(Unit::Pixel);
    let mut schemes = match args.schemes.as_slice() {
        [] => usual.schemes.clone(),
        given => {
            let options = SchemeOptions::usual(Unit::Pixel);
            let entries = distinct(given.to_vec(), |a, b| a.name == b.name);
            entries.iter().filter_map(|entry| entry.of_dimension(&options)).collect()
        }
    };
    let mitigations = distinct(args.mitigate.clone(), |a, b| a.name() == b.name());
    let changes: Vec<Change> =
        mitigations.into_iter().map(|one| Change::Mitigation(one, None)).collect();
    schemes.extend(Changed::all(&schemes, &changes));
    let of = |label: &str, value: f64| Threshold { label: label.to_owned(), value };
    let few = Plan { thresholds: vec![of("5", 5.0), of("10", 10.0), of("25", 25.0)], ..usual };
    let thresholds = thresholds(&args.thresholds, &few)?;
    let headline = choice::headline(&thresholds);
    Ok(Plan { schemes, thresholds, headline, seed: args.seed, ..few })
}

/// Returns the error of the poses in units of the model.
fn pose_error(args: &AuditSequenceArgs) -> anyhow::Result<Option<PoseError>> {
    let Some((cm, angle_deg)) = args.poses else { return Ok(None) };
    let Some(scale) = args.scale else {
        return Err(usage("--poses perturbed: expected --scale, meters per unit of the model"));
    };
    Ok(Some(PoseError { distance: 0.01 * cm / scale, angle_deg }))
}

/// Returns the options that change the images, for the report.
fn options(args: &AuditSequenceArgs) -> Map<String, serde_json::Value> {
    let mut options = Map::new();
    options.insert("model".into(), json!(args.model.display().to_string()));
    if !args.mitigate.is_empty() {
        let names: Vec<String> = args.mitigate.iter().map(Mitigation::name).collect();
        options.insert("mitigate".into(), json!(names));
    }
    args.extraction.record(&mut options);
    options
}
