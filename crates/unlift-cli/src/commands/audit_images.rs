//! `unlift audit images`: audits the keypoints of images.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, json};
use unlift::audit::{Measure, NeighborsBy, Plan};
use unlift::obfuscate::{Change, Changed};
use unlift::{Descriptors, Unit};
use unlift_audit::images::FeatureSource;
use unlift_audit::images::audit::{ImagesJob, Used, perform};
use unlift_audit::images::choice;
use unlift_audit::images::extraction::sample;
use unlift_audit::images::stream::Needs;
use unlift_audit::inversion::Inversion;
use unlift_audit::sources::usual as usual_sources;
use unlift_io::{Error, read};
use unlift_vision::features::Extraction;

use super::audits::{
    self, check_fit, check_oracle, kind, painter, photos_of_images, protections, solvers,
    thresholds, with_oracle,
};
use super::common::all_could_be;
use crate::args::AuditImagesArgs;
use crate::exit::{Outcome, advise, usage};
use crate::output::command_line;
use crate::progress::Progress;
use crate::stderr;
use crate::values::{NeighborSource, distinct, image_schemes};

pub fn run(args: &AuditImagesArgs) -> crate::Result<Outcome> {
    let started = Instant::now();
    let mut plan = plan(args)?;
    let photos = photos_of_images(&args.paint, &args.path)?;
    let more = args.paint.inputs().chain(&args.protect.public_descriptors);
    let inputs = [&args.path].into_iter().chain(more).map(PathBuf::as_path);
    let mut count = Used { used: 0, unusable: 0 };
    let outcome = audits::perform(&args.audit, inputs.collect(), |out| {
        let extraction = extraction(args, &plan)?;
        let source = FeatureSource::open(&args.path, &extraction).map_err(|error| {
            let map = read::is_project(&args.path);
            if map { advise(error, "unlift audit map, as this is a map") } else { error }
        })?;
        if let Some(note) = source.passed_over() {
            stderr::note(note);
        }
        let chosen = choice::evenly(source.names().len(), args.max_images.map(|n| n.get()));
        check_photos(args, &source, &chosen)?;
        let first = check_descriptors(args, &source, &chosen, &mut plan)?;
        let kind_for = |option: &str| match source {
            FeatureSource::Folder(_) => Ok(extraction.kind()),
            _ => kind(option, first.as_ref()),
        };
        let inversion = match photos {
            Some(photos) => {
                let painter = painter(kind_for("--invert")?, args.paint.network())?;
                Some(Arc::new(Inversion::new(painter, photos, source.turn())))
            }
            None => None,
        };
        let protections = protections(&args.protect, || kind_for("--protect-descriptors"))?;
        let changes: Vec<Change> = protections.into_iter().map(Change::Protection).collect();
        plan.schemes.extend(Changed::all(&plan.schemes, &changes));
        plan.measures.extend(inversion.iter().map(|one| Arc::clone(one) as Arc<dyn Measure<2>>));
        let progress = Progress::new(args.audit.quiet);
        let job = ImagesJob {
            source: &source,
            path: &args.path,
            draws: true,
            chosen,
            plan,
            options: more_options(args),
            gates: args.audit.gate.clone(),
            photos: args.paint.photos.clone(),
            out: args.audit.out.clone(),
            share_safe: args.audit.share_safe,
            inversion,
            progress: &progress,
            command: Some(command_line()),
            started,
        };
        let (finished, used) = perform(job, out)?;
        count = used;
        Ok(finished)
    })?;
    all_could_be("used", &args.path, count.used, count.unusable)?;
    Ok(outcome)
}

fn plan(args: &AuditImagesArgs) -> crate::Result<Plan<2>> {
    let usual = with_oracle(&args.oracle, Plan::new(Unit::Pixel));
    let mut sources = match &*args.neighbors {
        [] => usual_sources(true),
        _ => Vec::new(),
    };
    for source in distinct(args.neighbors.clone(), |a, b| a == b) {
        sources.push(match source {
            NeighborSource::Own(named) => NeighborsBy::Source(named.of_dimension()?),
            NeighborSource::Oracle | NeighborSource::File(_) => NeighborsBy::Oracle,
        });
    }
    check_oracle(&args.oracle, &sources)?;
    let thresholds = thresholds(&args.audit.thresholds, &usual)?;
    let headline = choice::headline(&thresholds);
    let plan = Plan {
        neighbors: sources,
        schemes: image_schemes(&args.schemes, &usual),
        k: usize::from(args.k),
        solvers: solvers(&args.solver, &usual),
        thresholds,
        headline,
        seed: args.audit.seed,
        ..usual
    };
    plan.check_for_many().map_err(|error| usage(error.to_string()))?;
    Ok(plan)
}

/// Returns the options of the extractor, checked against the sources of the plan.
fn extraction(args: &AuditImagesArgs, plan: &Plan<2>) -> crate::Result<Extraction> {
    if args.paint.photos.is_some() && args.path.is_dir() {
        return Err(usage("--photos: expected with a file of features, found a folder of photos"));
    }
    let extraction = args.extraction.wanted().extraction(&args.path)?;
    if let (true, Some(rows)) = (args.path.is_dir(), sample(&extraction)) {
        plan.own_sources().try_for_each(|source| check_fit(source, &rows))?;
    }
    Ok(extraction)
}

/// Checks that at least one photo to compare with exists.
fn check_photos(
    args: &AuditImagesArgs,
    source: &FeatureSource,
    chosen: &[usize],
) -> crate::Result<()> {
    let (Some(_), Some(photos)) = (&args.paint.invert, &args.paint.photos) else { return Ok(()) };
    if chosen.iter().any(|&at| photos.join(&source.names()[at]).is_file()) {
        return Ok(());
    }
    let expected = format!("photos of the images in {}", args.path.display());
    Err(Error::new(photos, "", expected, "none").into())
}

/// Checks the first image with keypoints for what the sources need, to get one error instead of one
/// per image. Other errors of single images are reported when they are read. Without descriptors, the
/// sources of a plan that the user left open do without them. Returns the descriptors if they were
/// read.
fn check_descriptors(
    args: &AuditImagesArgs,
    source: &FeatureSource,
    chosen: &[usize],
    plan: &mut Plan<2>,
) -> crate::Result<Option<Descriptors>> {
    let invert = args.paint.invert.is_some();
    let protects = !args.protect.protect_descriptors.is_empty();
    let wanted = invert || protects || Needs::of_plan(plan).descriptors();
    // Extracted features always have descriptors.
    if matches!(source, FeatureSource::Folder(_)) || !wanted {
        return Ok(None);
    }
    let Some(first) = source.first(chosen) else { return Ok(None) };
    if args.neighbors.is_empty() && first.descriptors.is_none() {
        plan.neighbors = usual_sources(false);
    }
    if invert {
        kind("--invert", first.descriptors.as_ref())?;
    }
    for source in plan.own_sources() {
        match &first.descriptors {
            Some(descriptors) => check_fit(source, descriptors)?,
            None if source.needs() == unlift::neighbors::Needs::Descriptors => {
                let name = source.name();
                return Err(usage(format!("--neighbors {name}: expected descriptors, found none")));
            }
            None => {}
        }
    }
    Ok(first.descriptors)
}

/// Returns the options that change the images, for the report.
fn more_options(args: &AuditImagesArgs) -> Map<String, serde_json::Value> {
    let mut options = Map::new();
    args.extraction.record(&mut options);
    args.protect.record(&mut options);
    if let Some(most) = args.max_images {
        options.insert("max_images".into(), json!(most.get()));
    }
    if args.paint.invert.is_some() {
        options.insert("invert".into(), json!(true));
    }
    options
}
