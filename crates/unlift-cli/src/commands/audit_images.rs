//! `unlift audit images`: audits the keypoints of images.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, json};
use unlift::audit::{Measure, NeighborsBy, Plan};
use unlift::obfuscate::{Change, Changed, SchemeOptions};
use unlift::{Descriptors, Unit};
use unlift_audit::images::FeatureSource;
use unlift_audit::images::audit::{ImagesJob, Used, perform};
use unlift_audit::images::choice;
use unlift_audit::images::extraction::sample;
use unlift_audit::images::stream::Needs;
use unlift_audit::inversion::Inversion;
use unlift_audit::{Finished, open_audit};
use unlift_io::atomic::Rules;
use unlift_io::{Error, read};
use unlift_vision::features::Extraction;

use super::common::{all_could_be, with_threads};
use super::gate_files::GateFile;
use super::painter::{kind, painter};
use super::plan::{attack, check_about, check_fit, solvers, summary, thresholds};
use super::protection::protections;
use crate::args::AuditImagesArgs;
use crate::exit::{Outcome, advise, usage};
use crate::output::{command_line, print};
use crate::progress::Progress;
use crate::stderr;
use crate::values::{NeighborSource, distinct};

pub fn run(args: &AuditImagesArgs) -> anyhow::Result<Outcome> {
    let (finished, used) = audit(args)?;
    if let Some(finished) = &finished {
        print(&if args.result.json { summary(finished)? } else { finished.text() })?;
    }
    all_could_be("used", &args.path, used.used, used.unusable)?;
    let passed = finished.is_none_or(|finished| finished.passed());
    Ok(if passed { Outcome::Done } else { Outcome::GateFailed })
}

/// Returns the input paths, which must not be overwritten.
fn inputs(args: &AuditImagesArgs) -> Vec<&Path> {
    let others = args.photos.as_deref().into_iter().chain(args.inverter.as_deref());
    let others = others.chain(args.protect.public_descriptors.as_deref());
    [args.path.as_path()].into_iter().chain(others).collect()
}

/// Audits images and writes the results; returns no results if no image can be used.
fn audit(args: &AuditImagesArgs) -> anyhow::Result<(Option<Finished>, Used)> {
    let started = Instant::now();
    let mut plan = plan(args)?;
    let painted = painted(args)?;
    let rules = Rules::new(inputs(args), args.result.force);
    let gate_file = GateFile::check(&args.result, &rules)?;
    let out = open_audit(&args.result.out, rules, args.result.share_safe)?;
    let (finished, used) = with_threads(args.run.threads, || {
        let extraction = extraction(args, &plan)?;
        let source = FeatureSource::open(&args.path, &extraction).map_err(|error| {
            let map = read::is_project(&args.path);
            let error = anyhow::Error::from(error);
            if map { advise(error, "unlift audit map, as this is a map") } else { error }
        })?;
        if let Some(note) = source.passed_over() {
            stderr::note(note);
        }
        let names = source.names();
        let chosen = choice::evenly(names.len(), args.max_images.map(|n| n.get()));
        check_photos(args, &source, &chosen)?;
        let protects = !args.protect.protect_descriptors.is_empty();
        let first = check_descriptors(&source, &chosen, &plan, (args.invert, protects))?;
        let inversion = match painted {
            Some(photos) => {
                let kind = match source {
                    FeatureSource::Folder(_) => extraction.kind(),
                    _ => kind("--invert", first.as_ref())?,
                };
                let painter = painter(kind, args.inverter.as_deref())?;
                Some(Arc::new(Inversion::new(painter, photos, source.turn())))
            }
            None => None,
        };
        let own = || match source {
            FeatureSource::Folder(_) => Ok(extraction.kind()),
            _ => kind("--protect-descriptors", first.as_ref()),
        };
        let protections = protections(&args.protect, own)?;
        let changes: Vec<Change> = protections.into_iter().map(Change::Protection).collect();
        plan.schemes.extend(Changed::all(&plan.schemes, &changes));
        plan.measures.extend(inversion.iter().map(|one| Arc::clone(one) as Arc<dyn Measure<2>>));
        let progress = Progress::new(args.run.quiet);
        let show = match args.show.as_slice() {
            [] => None,
            wanted => {
                let place = args.path.display().to_string();
                Some(choice::shown(wanted, names, &chosen, &place)?)
            }
        };
        let job = ImagesJob {
            source: &source,
            path: &args.path,
            show,
            chosen,
            plan,
            options: more_options(args),
            gates: args.result.gate.clone(),
            photos: args.photos.clone(),
            out: args.result.out.clone(),
            share_safe: args.result.share_safe,
            inversion,
            progress: &progress,
            command: Some(command_line()),
            started,
        };
        Ok(perform(job, out)?)
    })?;
    if let Some(finished) = &finished {
        gate_file.write(finished)?;
    }
    Ok((finished, used))
}

fn plan(args: &AuditImagesArgs) -> anyhow::Result<Plan<2>> {
    let usual = Plan::new(Unit::Pixel);
    let mut sources = Vec::new();
    for source in distinct(args.neighbors.clone(), |a, b| a == b) {
        match source {
            NeighborSource::Own(named) => sources.push(NeighborsBy::Source(named.of_dimension()?)),
            NeighborSource::Oracle | NeighborSource::File(_) => sources.push(NeighborsBy::Oracle),
        }
    }
    check_about(&args.attack, &sources)?;
    let schemes = match args.schemes.as_slice() {
        [] => usual.schemes.clone(),
        given => {
            let options = SchemeOptions::usual(Unit::Pixel);
            let entries = distinct(given.to_vec(), |a, b| a.name == b.name);
            entries.iter().filter_map(|entry| entry.of_dimension(&options)).collect()
        }
    };
    let thresholds = thresholds(&args.thresholds, &usual)?;
    let headline = choice::headline(&thresholds);
    let plan = Plan {
        neighbors: sources,
        schemes,
        k: usize::from(args.k),
        solvers: solvers(&args.solver, &usual),
        thresholds,
        headline,
        seed: args.seed,
        ..attack(&args.attack, usual)
    };
    plan.check_for_many().map_err(|error| usage(error.to_string()))?;
    Ok(plan)
}

/// Returns the options of the extractor, checked against the sources of the plan.
fn extraction(args: &AuditImagesArgs, plan: &Plan<2>) -> anyhow::Result<Extraction> {
    if args.photos.is_some() && args.path.is_dir() {
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
) -> anyhow::Result<()> {
    let (true, Some(photos)) = (args.invert, &args.photos) else { return Ok(()) };
    if chosen.iter().any(|&at| photos.join(&source.names()[at]).is_file()) {
        return Ok(());
    }
    let expected = format!("photos of the images in {}", args.path.display());
    Err(Error::new(photos, "", expected, "none").into())
}

/// Returns the folder of photos for painted pictures, if requested.
fn painted(args: &AuditImagesArgs) -> anyhow::Result<Option<&Path>> {
    match (&args.photos, args.path.is_dir()) {
        _ if !args.invert => Ok(None),
        (Some(photos), _) => Ok(Some(photos)),
        (None, true) => Ok(Some(&args.path)),
        (None, false) => Err(usage("--invert: expected --photos, as PATH is no folder of photos")),
    }
}

/// Checks the first image with keypoints for what the sources need, to get one error instead of one
/// per image. Other errors of single images are reported when they are read. Returns the
/// descriptors if they were read.
fn check_descriptors(
    source: &FeatureSource,
    chosen: &[usize],
    plan: &Plan<2>,
    (invert, protects): (bool, bool),
) -> anyhow::Result<Option<Descriptors>> {
    // Extracted features always have descriptors.
    let wanted = invert || protects || Needs::of_plan(plan).descriptors();
    if matches!(source, FeatureSource::Folder(_)) || !wanted {
        return Ok(None);
    }
    let Some(first) = source.first(chosen) else { return Ok(None) };
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
    if args.invert {
        options.insert("invert".into(), json!(true));
    }
    if !args.show.is_empty() {
        options.insert("show".into(), json!(args.show));
    }
    options
}
