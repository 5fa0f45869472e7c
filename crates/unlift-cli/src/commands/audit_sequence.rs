//! `unlift audit sequence`: audits several queries with known poses.

use std::time::Instant;

use serde_json::{Map, json};
use unlift::Unit;
use unlift::audit::{Plan, Threshold};
use unlift::neighbors::sources::Named;
use unlift::obfuscate::{Change, Changed, Mitigation};
use unlift_audit::images::{FeatureSource, choice};
use unlift_audit::inversion::Inversion;
use unlift_audit::sequence::{PoseError, SequenceJob, perform};
use unlift_vision::features::photo::Turn;

use super::audits::{self, kind, painter, photos_of_images, thresholds};
use crate::args::AuditSequenceArgs;
use crate::exit::{Outcome, usage};
use crate::output::command_line;
use crate::progress::Progress;
use crate::stderr;
use crate::values::{distinct, image_schemes};

pub fn run(args: &AuditSequenceArgs) -> crate::Result<Outcome> {
    let started = Instant::now();
    let plan = plan(args)?;
    let pose_error = pose_error(args)?;
    if args.paint.invert.is_some() && args.audit.share_safe {
        return Err(usage("--invert: expected without --share-safe, as pictures show the place"));
    }
    let photos = photos_of_images(&args.paint, &args.path)?;
    let inputs = [&args.model, &args.path].into_iter().chain(args.paint.inputs());
    audits::perform(&args.audit, inputs.map(|path| path.as_path()).collect(), |out| {
        let extraction = args.extraction.wanted().extraction(&args.path)?;
        // A model is of the photos as they are stored.
        let source = FeatureSource::open(&args.path, &extraction)?.with_turn(Turn::AsStored);
        let inversion = match photos {
            Some(photos) => {
                let all: Vec<usize> = (0..source.names().len()).collect();
                let first = source.first(&all).and_then(|first| first.descriptors);
                let painter = painter(kind("--invert", first.as_ref())?, args.paint.network())?;
                Some(Inversion::new(painter, photos, source.turn()))
            }
            None => None,
        };
        if let Some(note) = source.passed_over() {
            stderr::note(note);
        }
        let progress = Progress::new(args.audit.quiet);
        let mut queries = args.queries.clone();
        queries.sort_unstable();
        queries.dedup();
        let job = SequenceJob {
            model: &args.model,
            source: &source,
            path: &args.path,
            plan,
            lists: args.neighbors.as_ref().map(Named::of_dimension).transpose()?,
            queries,
            pose_error,
            options: options(args),
            gates: args.audit.gate.clone(),
            inversion: inversion.as_ref(),
            out: args.audit.out.clone(),
            share_safe: args.audit.share_safe,
            progress: &progress,
            command: Some(command_line()),
            started,
        };
        Ok(Some(perform(job, out)?.0))
    })
}

fn plan(args: &AuditSequenceArgs) -> crate::Result<Plan<2>> {
    let usual = Plan::new(Unit::Pixel);
    let mut schemes = image_schemes(&args.schemes, &usual);
    let mitigations = distinct(args.mitigate.clone(), |a, b| a.name() == b.name());
    let changes: Vec<Change> =
        mitigations.into_iter().map(|mitigation| Change::Mitigation(mitigation, None)).collect();
    schemes.extend(Changed::all(&schemes, &changes));
    let of = |label: &str, value: f64| Threshold { label: label.to_owned(), value };
    let few = Plan { thresholds: vec![of("5", 5.0), of("10", 10.0), of("25", 25.0)], ..usual };
    let thresholds = thresholds(&args.audit.thresholds, &few)?;
    let headline = choice::headline(&thresholds);
    Ok(Plan { schemes, thresholds, headline, seed: args.audit.seed, ..few })
}

/// Returns the error of the poses in units of the model.
fn pose_error(args: &AuditSequenceArgs) -> crate::Result<Option<PoseError>> {
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
