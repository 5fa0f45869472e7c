//! `unlift audit released`: audits records of a user's scheme.

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, json};
use unlift::audit::{Plan, scheme_called};
use unlift::released::Released;
use unlift::truth::Secret;
use unlift_audit::maps::{self, perform};
use unlift_audit::{Job, Prepared, ordered, read_from_file, unlike_neighbors};
use unlift_io::hash::{hash_file, hash_files};
use unlift_io::read::{self, Input as Points};
use unlift_io::stage::{has_images, published_positions, read_released, read_truth, scheme_name};
use unlift_report::document::Input;

use super::audits::{self, map_thresholds, neighbors, solvers, with_oracle};
use super::common::{expect_slots, same_map};
use crate::args::AuditReleasedArgs;
use crate::exit::{Outcome, advise, usage};
use crate::output::command_line;
use crate::progress::Progress;
use crate::values::{self, NeighborSource};

/// Name of a scheme without a name.
const UNNAMED: &str = "released";

pub fn run(args: &AuditReleasedArgs) -> crate::Result<Outcome> {
    let started = Instant::now();
    audits::perform(&args.audit, inputs(args), |out| {
        let name = name(args)?;
        let (prepared, hidden) = open(args)?;
        let progress = Progress::new(args.audit.quiet);
        let mut notes = prepared.notes.clone();
        let mut doubts = prepared.doubts.clone();
        let plan = plan(args, &name, &prepared, &hidden.0, (&mut notes, &mut doubts))?;
        let published = published_positions(&args.released)?;
        let job = Job {
            read: read_from_file(&published, (&prepared.original, &hidden.1), &plan.thresholds),
            hidden: Some(&hidden),
            plan,
            notes,
            doubts,
            input: provenance(args, &prepared)?,
            options: Map::from_iter([("released".to_owned(), json!(true))]),
            gates: args.audit.gate.clone(),
            out: args.audit.out.clone(),
            share_safe: args.audit.share_safe,
            progress: &progress,
            command: Some(command_line()),
            ..Job::of(&prepared.original, started)
        };
        Ok(Some(perform(job, out)?))
    })
}

/// Returns the input paths, which must not be overwritten.
fn inputs(args: &AuditReleasedArgs) -> Vec<&Path> {
    let stages = [args.released.as_path(), &args.truth].into_iter();
    let lists = NeighborSource::files(&args.solvers.neighbors);
    stages.chain(args.descriptors.as_deref()).chain(lists).collect()
}

/// Returns the name of the scheme, from `--name` or from the file.
fn name(args: &AuditReleasedArgs) -> crate::Result<String> {
    if let Some(name) = &args.name {
        return Ok(name.clone());
    }
    let Some(stated) = scheme_name(&args.released)? else { return Ok(UNNAMED.to_owned()) };
    values::scheme_name(&stated).map_err(|wrong| {
        let (expected, found) = wrong.split_once(", found ").unwrap_or((&wrong, &stated));
        let expected = expected.trim_start_matches("expected ");
        let place = "metadata unlift, scheme";
        advise(unlift_io::Error::new(&args.released, place, expected, found), "--name NAME")
    })
}

/// Reads the original points, the released map and the secret, and checks that they belong
/// together.
fn open(args: &AuditReleasedArgs) -> crate::Result<(Prepared, (Released<3>, Secret))> {
    if has_images(&args.released)? {
        let error = unlift_io::Error::new(&args.released, "", "a released map", "released images");
        return Err(advise(error, "unlift recover and unlift evaluate, which take images, too"));
    }
    let released = read_released::<3>(&args.released)?;
    let (original, secret) = read_truth::<3>(&args.truth)?;
    same_map(&args.released, Some(released.fingerprint()), &args.truth, secret.map())?;
    expect_slots(&args.released, &released, &secret)?;
    let released = described(args, released, &secret)?;
    let slots = secret.slots_per_record();
    let secret = secret.of_map(Some(released.fingerprint()), slots);
    let secret = secret.map_err(|error| unlift_io::Error::core(&args.truth, error))?;
    let notes = released.descriptors().and_then(maps::zeros).into_iter().collect();
    let mut prepared = Prepared { notes, ..Prepared::of(original) };
    if let (Some(rows), Some(order)) = (released.descriptors(), rows_of_originals(&secret)) {
        let points = prepared.original.reveal();
        prepared.doubts.extend(unlike_neighbors(points, &rows.select(&order))?);
    }
    Ok((prepared, (released, secret)))
}

/// Returns the descriptor row of every original, if all are hidden.
fn rows_of_originals(secret: &Secret) -> Option<Vec<u32>> {
    let mut rows = vec![None; secret.n_originals()];
    for (slot, &row) in secret.descriptor_row().iter().enumerate() {
        rows[secret.hidden()[slot].index()] = Some(row);
    }
    rows.into_iter().collect()
}

/// Returns the released map with the descriptors of `--descriptors`, if given.
fn described(
    args: &AuditReleasedArgs,
    released: Released<3>,
    secret: &Secret,
) -> crate::Result<Released<3>> {
    let Some(path) = &args.descriptors else { return Ok(released) };
    if released.descriptors().is_some() {
        let found = args.released.display();
        return Err(usage(format!(
            "--descriptors: expected with a released map without, found some in {found}"
        )));
    }
    // Only the ids of the points are needed.
    let points = Points { ids: (0..secret.n_originals() as u64).collect(), ..Points::default() };
    let of_originals = read::descriptors(path, &points)?;
    let mut of_rows = vec![0; secret.n_slots()];
    for (slot, &row) in secret.descriptor_row().iter().enumerate() {
        of_rows[row as usize] = secret.hidden()[slot].0;
    }
    let described = Released::try_new(
        released.obfuscation().clone(),
        released.slots_per_record(),
        released.origin(),
        released.unit(),
        Some(of_originals.select(&of_rows)),
    );
    let described = described.map_err(|error| unlift_io::Error::core(path, error))?;
    Ok(described.with_bounds(released.bounds()))
}

fn plan(
    args: &AuditReleasedArgs,
    name: &str,
    prepared: &Prepared,
    released: &Released<3>,
    (notes, doubts): (&mut Vec<String>, &mut Vec<String>),
) -> crate::Result<Plan<3>> {
    let (k, points) = (usize::from(args.k), prepared.original.reveal());
    let usual = Plan::new(points.unit()).for_map(prepared.original.len(), k);
    let usual = with_oracle(&args.oracle, usual);
    let thresholds = map_thresholds(&args.audit, prepared, &usual, (notes, doubts))?;
    let requested = (&*args.solvers.neighbors, &args.oracle);
    let map = (prepared, released.descriptors());
    Ok(Plan {
        neighbors: neighbors(requested, map, "in the released map", (points.len(), notes))?,
        schemes: vec![scheme_called(name)],
        k,
        solvers: solvers(&args.solvers.solver, &usual),
        records_alone: !args.solvers.no_records_alone,
        thresholds,
        seed: args.audit.seed,
        ..usual
    })
}

fn provenance(args: &AuditReleasedArgs, prepared: &Prepared) -> crate::Result<Input> {
    let mut others = vec![("truth".to_owned(), hash_file(&args.truth)?)];
    if let Some(path) = &args.descriptors {
        others.push(("descriptors".to_owned(), hash_file(path)?));
    }
    for path in NeighborSource::files(&args.solvers.neighbors) {
        others.push(("neighbors".to_owned(), hash_file(path)?));
    }
    let sha256 = Some(hash_files(&[&args.released])?);
    Ok(Input {
        path: Some(args.released.display().to_string()),
        sha256,
        n_points: prepared.original.len() as u64,
        other_sha256: ordered(others),
        ..Input::default()
    })
}
