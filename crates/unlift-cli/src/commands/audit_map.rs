//! `unlift audit map`: audits a map.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use indexmap::IndexMap;
use serde_json::{Map, Value, json};
use unlift::audit::{Measure, Plan};
use unlift::obfuscate::{Change, Changed, Mitigation, Protection, Scheme, SchemeOptions};
use unlift::recover::Builtin;
use unlift_audit::inversion::MapInversion;
use unlift_audit::localization::Localize;
use unlift_audit::maps::{Tiles, perform};
use unlift_audit::{Job, Prepared, sides_m, sources};
use unlift_io::hash::hash_file;
use unlift_io::read;
use unlift_report::document::Input;

use super::audits::{
    self, kind, map_thresholds, neighbors, painter, protections, solvers, with_oracle,
};
use super::common::open_map;
use crate::args::AuditMapArgs;
use crate::exit::{Outcome, usage};
use crate::output::command_line;
use crate::progress::Progress;
use crate::values::{NeighborSource, all_schemes, distinct};

/// Schemes of `--quick`: the best-known one, and one that hides two points per record.
const QUICK_SCHEMES: [&str; 2] = ["olc", "ppl"];
const QUICK_RATIO: f64 = 0.5;
/// Source of `--quick`: the fastest one, for any descriptors.
const QUICK_SOURCE: &str = "similarity";

pub fn run(args: &AuditMapArgs) -> crate::Result<Outcome> {
    let started = Instant::now();
    audits::perform(&args.audit, inputs(args), |out| {
        let (input, prepared) = open_map(
            &args.path,
            &args.map,
            uses_descriptors(args),
            (args.audit.seed, args.audit.quiet),
        )?;
        let progress = Progress::new(args.audit.quiet);
        let inversion = inversion(args, &prepared, &input, &progress)?;
        check_extent(args, &prepared)?;
        let (mut notes, mut doubts) = (prepared.notes.clone(), prepared.doubts.clone());
        let protections = protected_by(args, &prepared)?;
        let mut plan = plan(args, (&prepared, &input), &protections, (&mut notes, &mut doubts))?;
        plan.measures.extend(inversion.iter().map(|one| Arc::clone(one) as Arc<dyn Measure<3>>));
        let mut job = Job {
            plan,
            inversion,
            notes,
            doubts,
            options: more_options(args),
            gates: args.audit.gate.clone(),
            tiles: args.tile_points.map(|most| Tiles { most: most.get(), only: None }),
            share_safe: args.audit.share_safe,
            progress: &progress,
            command: Some(command_line()),
            ..Job::new(&args.path, &input, &prepared, &args.audit.out, started)?
        };
        if let Some(features) = &args.localize {
            if prepared.cameras.views.is_empty() {
                let expected = "expected a COLMAP model with cameras and tracks";
                return Err(usage(format!("--localize: {expected}, found none")));
            }
            let held_out = Some((features.clone(), args.hold_out.get()));
            job.localize = Some(Localize { cameras: &prepared.cameras, held_out, protections });
        }
        let found = prepared.descriptors_file.as_deref().map(|path| ("descriptors", path));
        let lists = NeighborSource::files(&args.solvers.neighbors).map(|path| ("neighbors", path));
        let hashes = found.into_iter().chain(lists);
        let hashes = hashes.map(|(name, path)| Ok((name.to_owned(), hash_file(path)?)));
        job.input.other_sha256 = hashes.collect::<crate::Result<IndexMap<_, _>>>()?;
        Ok(Some(perform(job, out)?))
    })
}

/// Returns an error if the map has another size than `--expect-extent`.
fn check_extent(args: &AuditMapArgs, prepared: &Prepared) -> crate::Result<()> {
    let extent_m = sides_m(prepared.original.reveal());
    let (Some((low, high)), Some(sides)) = (args.expect_extent, extent_m) else { return Ok(()) };
    if (low..=high).contains(&sides.into_iter().fold(0.0, f64::max)) {
        return Ok(());
    }
    let input = Input { extent_m, scale_m_per_unit: args.map.scale, ..Input::default() };
    let found = input.extent().unwrap_or_default();
    let expected = format!("a longest side of {low} to {high} m");
    Err(usage(format!("--expect-extent: expected {expected}, found {found}")))
}

/// Returns the painter of pictures, if requested.
fn inversion(
    args: &AuditMapArgs,
    prepared: &Prepared,
    input: &read::Input,
    progress: &Progress,
) -> crate::Result<Option<Arc<MapInversion>>> {
    if args.paint.invert.is_none() {
        return Ok(None);
    }
    let Some(photos) = &args.paint.photos else {
        return Err(usage("--invert: expected --photos, the folder of the map's photos"));
    };
    let Some(model) = &input.model else {
        return Err(usage("--invert: expected a COLMAP model with cameras, found only points"));
    };
    let Some(descriptors) = &prepared.descriptors else {
        return Err(usage("--invert: expected descriptors (--descriptors FILE), found none"));
    };
    let kind = kind("--invert", Some(descriptors))?;
    let painter = painter(kind, args.paint.network())?;
    let scale = 1.0 / prepared.unit_in_map_units;
    let max_images = args.max_images.get();
    Ok(Some(Arc::new(MapInversion::open(painter, model, photos, scale, max_images, progress)?)))
}

/// Returns the input paths, which must not be overwritten.
fn inputs(args: &AuditMapArgs) -> Vec<&Path> {
    let beside = NeighborSource::files(&args.solvers.neighbors);
    let beside = beside.chain(args.map.descriptors.as_deref());
    let more = args.paint.inputs().chain(&args.localize).chain(&args.protect.public_descriptors);
    [args.path.as_path()].into_iter().chain(beside).chain(more.map(|path| path.as_path())).collect()
}

/// Returns the protections of descriptors, if requested.
fn protected_by(args: &AuditMapArgs, prepared: &Prepared) -> crate::Result<Vec<Protection>> {
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
) -> crate::Result<Plan<3>> {
    let k = usize::from(args.map.k);
    if args.solvers.no_records_alone {
        notes.push(NO_RECORDS_ALONE.to_owned());
    }
    let unit = prepared.original.reveal().unit();
    let n_points = prepared.original.len();
    let at_once = args.tile_points.map_or(n_points, |most| n_points.min(most.get()));
    let mut usual = Plan::new(unit).for_map(at_once, k);
    if args.full {
        usual.inlier_ratios = Plan::<3>::new(unit).inlier_ratios;
        usual.solvers = Builtin::list(&[Builtin::Joint, Builtin::Consensus, Builtin::Ransac]);
    }
    let usual = with_oracle(&args.oracle, usual);
    let mut entries = if args.schemes.is_empty() { all_schemes() } else { args.schemes.clone() };
    let mut requested = args.solvers.neighbors.clone();
    if args.quick {
        requested.push(NeighborSource::Oracle);
        entries.retain(|entry| QUICK_SCHEMES.contains(&entry.name));
        if prepared.descriptors.is_some() {
            requested.push(NeighborSource::Own(sources::named(QUICK_SOURCE)?));
        }
    }
    let entries = distinct(entries, |a, b| a.name == b.name);
    let options = SchemeOptions::usual(unit);
    let mut schemes: Vec<Arc<dyn Scheme<3>>> =
        entries.iter().filter_map(|entry| entry.of_dimension(&options)).collect();
    let mut changes = mitigations(args, prepared)?;
    changes.extend(protections.iter().cloned().map(Change::Protection));
    schemes.extend(Changed::all(&schemes, &changes));
    let thresholds = map_thresholds(&args.audit, prepared, &usual, (notes, doubts))?;
    let inlier_ratios = if args.quick { vec![QUICK_RATIO] } else { usual.inlier_ratios.clone() };
    let descriptors = prepared.descriptors.as_ref();
    let requested = (requested.as_slice(), &args.oracle);
    let lacking = "(--descriptors FILE)";
    Ok(Plan {
        neighbors: neighbors(requested, (prepared, descriptors), lacking, (input.n_rows(), notes))?,
        inlier_ratios,
        schemes,
        k,
        solvers: solvers(&args.solvers.solver, &usual),
        records_alone: !args.solvers.no_records_alone,
        thresholds,
        seed: args.audit.seed,
        ..usual
    })
}

/// Returns the mitigations of the command line.
fn mitigations(args: &AuditMapArgs, prepared: &Prepared) -> crate::Result<Vec<Change>> {
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
    let with = |mitigation: &Mitigation| Change::Mitigation(mitigation.clone(), tracks.cloned());
    Ok(args.mitigate.iter().map(with).collect())
}

/// Returns true if the audit uses descriptors, which may lie beside the model.
fn uses_descriptors(args: &AuditMapArgs) -> bool {
    let needs = |source: &NeighborSource| match source {
        NeighborSource::Own(named) => named.name() != "geometric",
        NeighborSource::Oracle | NeighborSource::File(_) => false,
    };
    let neighbors = &args.solvers.neighbors;
    neighbors.is_empty()
        || neighbors.iter().any(needs)
        || args.paint.invert.is_some()
        || args.mitigate.iter().any(Mitigation::changes_descriptors)
        || !args.protect.protect_descriptors.is_empty()
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
    if args.paint.invert.is_some() {
        options.insert("invert".into(), json!(true));
        options.insert("max_images".into(), json!(args.max_images.get()));
    }
    options
}
