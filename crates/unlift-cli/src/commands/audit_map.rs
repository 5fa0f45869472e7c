//! `unlift audit map`: audits a map.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use indexmap::IndexMap;
use serde_json::{Map, Value, json};
use unlift::audit::{Measure, Plan};
use unlift::obfuscate::{Change, Changed, Mitigation, Protection, Scheme, SchemeOptions};
use unlift_audit::inversion::MapInversion;
use unlift_audit::localization::Localize;
use unlift_audit::maps::{Tiles, perform};
use unlift_audit::{Finished, Job, Prepared, check_thresholds, open_audit, sources};
use unlift_io::atomic::Rules;
use unlift_io::hash::hash_stage;
use unlift_io::read;

use super::common::{open_map, with_threads};
use super::gate_files::GateFile;
use super::painter::{kind, painter};
use super::plan::{attack, neighbors, solvers, summary, thresholds};
use super::protection::protections;
use crate::args::AuditMapArgs;
use crate::exit::{Outcome, advise, usage};
use crate::output::{command_line, print};
use crate::progress::Progress;
use crate::values::{NeighborSource, all_schemes, distinct};

/// Schemes of `--quick`: the best-known one, and one that hides two points per record.
const QUICK_SCHEMES: [&str; 2] = ["olc", "ppl"];
const QUICK_RATIO: f64 = 0.5;
/// Source of `--quick`: the fastest one, for any descriptors.
const QUICK_SOURCE: &str = "similarity";

pub fn run(args: AuditMapArgs) -> anyhow::Result<Outcome> {
    let json = args.result.json;
    let finished = audit(&args)?;
    print(&if json { summary(&finished)? } else { finished.text() })?;
    Ok(if finished.passed() { Outcome::Done } else { Outcome::GateFailed })
}

/// Audits a map and writes the results.
fn audit(args: &AuditMapArgs) -> anyhow::Result<Finished> {
    let started = Instant::now();
    let rules = Rules::new(inputs(args), args.result.force);
    let gate_file = GateFile::check(&args.result, &rules)?;
    let out = open_audit(&args.result.out, rules, args.result.share_safe)?;
    let finished = with_threads(args.run.threads, || {
        let (input, prepared) = open_map(&args.path, &args.map, args.colors, args.run.quiet)?;
        let progress = Progress::new(args.run.quiet);
        let (path, result) = (&args.path, &args.result);
        let inversion = inversion(args, &prepared, &input, &progress)?;
        let (mut notes, mut doubts) = (prepared.notes.clone(), prepared.doubts.clone());
        if args.colors {
            notes.push("pictures assume that the obfuscated map keeps the points' colors".into());
        }
        let protections = protected_by(args, &prepared)?;
        let said = (&mut notes, &mut doubts);
        let mut plan = plan(args, (&prepared, &input), &protections, said)?;
        plan.measures.extend(inversion.iter().map(|one| Arc::clone(one) as Arc<dyn Measure<3>>));
        let mut job = Job {
            plan,
            inversion,
            notes,
            doubts,
            options: more_options(args),
            gates: result.gate.clone(),
            tiles: args.tile_points.map(|most| Tiles { most: most.get(), only: None }),
            share_safe: result.share_safe,
            progress: &progress,
            command: Some(command_line()),
            ..Job::new(path, &input, &prepared, &result.out, started)?
        };
        if let Some(features) = &args.localize {
            if prepared.cameras.views.is_empty() || args.tile_points.is_some() {
                let expected = "expected a COLMAP model with cameras and tracks, not in tiles";
                return Err(usage(format!("--localize: {expected}, found none")));
            }
            let held_out = Some((features.clone(), args.hold_out.get()));
            job.localize = Some(Localize { cameras: &prepared.cameras, held_out, protections });
        }
        job.input.other_sha256 = others(args)?;
        Ok(perform(job, out)?)
    })?;
    gate_file.write(&finished)?;
    Ok(finished)
}

/// Returns the painter of pictures, if requested.
fn inversion(
    args: &AuditMapArgs,
    prepared: &Prepared,
    input: &read::Input,
    progress: &Progress,
) -> anyhow::Result<Option<Arc<MapInversion>>> {
    let (true, Some(photos)) = (args.invert, &args.photos) else { return Ok(None) };
    let Some(model) = &input.model else {
        return Err(usage("--invert: expected a COLMAP model with cameras, found only points"));
    };
    let Some(descriptors) = &prepared.descriptors else {
        return Err(usage("--invert: expected descriptors (--descriptors FILE), found none"));
    };
    let kind = kind("--invert", Some(descriptors))?;
    let painter = painter(kind, args.inverter.as_deref())?;
    if args.colors && !painter.takes_colors() {
        let found = format!("those of {}", kind.name());
        return Err(usage(format!("--colors: expected SIFT descriptors, found {found}")));
    }
    let scale = 1.0 / prepared.unit_in_map_units;
    let most = args.max_photos.get();
    Ok(Some(Arc::new(MapInversion::open(painter, model, photos, scale, most, progress)?)))
}

/// Returns the input paths, which must not be overwritten.
fn inputs(args: &AuditMapArgs) -> Vec<&Path> {
    let beside = beside(args).map(|(_, path)| path);
    let of_pictures = args.photos.iter().chain(&args.inverter).chain(&args.localize);
    let of_pictures = of_pictures.chain(&args.protect.public_descriptors);
    let of_pictures = of_pictures.map(PathBuf::as_path);
    [args.path.as_path()].into_iter().chain(beside).chain(of_pictures).collect()
}

/// Returns the protections of descriptors, if requested.
fn protected_by(args: &AuditMapArgs, prepared: &Prepared) -> anyhow::Result<Vec<Protection>> {
    if let (Some(one), None) = (args.protect.protect_descriptors.first(), &prepared.descriptors) {
        let expected = "expected descriptors (--descriptors FILE), found none";
        return Err(usage(format!("--protect-descriptors {}: {expected}", one.name())));
    }
    let own = || kind("--protect-descriptors", prepared.descriptors.as_ref());
    protections(&args.protect, own)
}

const NO_RECORDS_ALONE: &str =
    "--no-records-alone: the attack on the records alone was not tried; it may recover more";

fn plan(
    args: &AuditMapArgs,
    (prepared, input): (&Prepared, &read::Input),
    protections: &[Protection],
    (notes, doubts): (&mut Vec<String>, &mut Vec<String>),
) -> anyhow::Result<Plan<3>> {
    let k = usize::from(args.map.k);
    if args.solvers.no_records_alone {
        notes.push(NO_RECORDS_ALONE.to_owned());
    }
    let unit = prepared.original.reveal().unit();
    let n_points = prepared.original.len();
    let at_once = args.tile_points.map_or(n_points, |most| n_points.min(most.get()));
    let usual = Plan::new(unit).for_map(at_once, k);
    let mut entries = if args.schemes.is_empty() { all_schemes() } else { args.schemes.clone() };
    let mut asked = args.neighbors.clone();
    if args.quick {
        entries.retain(|entry| QUICK_SCHEMES.contains(&entry.name));
        if prepared.descriptors.is_some() {
            asked.push(NeighborSource::Own(sources::named(QUICK_SOURCE)?));
        }
    }
    let entries = distinct(entries, |a, b| a.name == b.name);
    let options = SchemeOptions::usual(unit);
    let mut schemes: Vec<Arc<dyn Scheme<3>>> =
        entries.iter().filter_map(|entry| entry.of_dimension(&options)).collect();
    let mut changes = mitigations(args, prepared)?;
    changes.extend(protections.iter().cloned().map(Change::Protection));
    schemes.extend(Changed::all(&schemes, &changes));
    let thresholds = thresholds(&args.thresholds, &usual)?;
    let points = prepared.original.reveal();
    let typed = !args.thresholds.is_empty();
    let said = check_thresholds(points.positions(), points.unit(), &thresholds, typed)?;
    notes.extend(said.note);
    doubts.extend(said.doubt);
    let asked = (&*asked, &args.attack);
    let descriptors = prepared.descriptors.as_ref();
    let lacking = |text: String| {
        let error = usage(format!("{text} (--descriptors FILE), found none"));
        match &input.database {
            Some(database) => advise(error, format!("--descriptors {}", database.display())),
            None => error,
        }
    };
    let usual = attack(&args.attack, usual);
    let inlier_ratios = if args.quick { vec![QUICK_RATIO] } else { usual.inlier_ratios.clone() };
    Ok(Plan {
        neighbors: neighbors(asked, (prepared, descriptors), lacking, (input.n_rows(), notes))?,
        inlier_ratios,
        schemes,
        k,
        solvers: solvers(&args.solvers.solver, &usual),
        records_alone: !args.solvers.no_records_alone,
        thresholds,
        seed: args.map.seed.unwrap_or(0),
        ..usual
    })
}

/// Returns the mitigations of the command line.
fn mitigations(args: &AuditMapArgs, prepared: &Prepared) -> anyhow::Result<Vec<Change>> {
    let tracks = Some(&prepared.cameras.tracks).filter(|tracks| !tracks.is_empty());
    for mitigation in &args.mitigate {
        let name = mitigation.name();
        if mitigation.needs_tracks() && (tracks.is_none() || args.tile_points.is_some()) {
            let expected = "expected a COLMAP model with tracks, not in tiles";
            return Err(usage(format!("--mitigate {name}: {expected}, found none")));
        }
        if mitigation.changes_descriptors() && prepared.descriptors.is_none() {
            let expected = "expected descriptors (--descriptors FILE)";
            return Err(usage(format!("--mitigate {name}: {expected}, found none")));
        }
    }
    let with = |one: &Mitigation| Change::Mitigation(one.clone(), tracks.cloned());
    Ok(args.mitigate.iter().map(with).collect())
}

/// Returns the files that are read beside the map, by their role.
fn beside(args: &AuditMapArgs) -> impl Iterator<Item = (&'static str, &Path)> {
    let lists = args.neighbors.iter().filter_map(|source| match source {
        NeighborSource::File(path) => Some(("neighbors", path.as_path())),
        NeighborSource::Oracle | NeighborSource::Own(_) => None,
    });
    args.map.descriptors.iter().map(|path| ("descriptors", path.as_path())).chain(lists)
}

fn others(args: &AuditMapArgs) -> anyhow::Result<IndexMap<String, String>> {
    beside(args).map(|(name, path)| Ok((name.to_owned(), hash_stage(path)?))).collect()
}

/// Returns the options that change the points, for the report.
fn more_options(args: &AuditMapArgs) -> Map<String, Value> {
    let mut options = Map::new();
    if let Some(most) = args.map.max_points {
        options.insert("max_points".into(), json!(most.get()));
    }
    if !args.mitigate.is_empty() {
        let names: Vec<String> = args.mitigate.iter().map(Mitigation::name).collect();
        options.insert("mitigate".into(), json!(names));
    }
    args.protect.record(&mut options);
    if args.localize.is_some() {
        options.insert("hold_out".into(), json!(args.hold_out.get()));
    }
    if args.invert {
        options.insert("invert".into(), json!(true));
        options.insert("max_photos".into(), json!(args.max_photos.get()));
        if args.colors {
            options.insert("colors".into(), json!(true));
        }
    }
    options
}
