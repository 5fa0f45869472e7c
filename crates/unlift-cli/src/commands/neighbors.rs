//! `unlift neighbors`: makes neighbor lists from the truth, or from released data alone.

use std::path::Path;

use unlift::neighbors::oracle::{Outliers, TrueNeighbors, search};
use unlift::neighbors::{Needs, Source};
use unlift::released::Released;
use unlift::{Error, OneLine};
use unlift_io::atomic::{Kind, Rules};
use unlift_io::stage::{Kind as Stage, has_images, read_released, read_truth, write_neighborhoods};

use super::common::{RELEASED, expect_slots, same_map, with_threads};
use super::image_stages::{list_by_oracle, list_by_source};
use crate::args::{FindArgs, OracleArgs};
use crate::exit::{Outcome, advise, usage};
use crate::output::print;
use crate::progress::Spinner;
use crate::stderr;
use unlift_audit::check_file;

/// Makes lists at one inlier ratio.
pub fn oracle(args: &OracleArgs) -> anyhow::Result<Outcome> {
    let beside = || args.truth.with_file_name(RELEASED);
    let released_path = args.released.clone().unwrap_or_else(beside);
    let rules = Rules::new([args.truth.as_path(), &released_path], args.force);
    let kind = Kind::Stage(Stage::Neighborhoods);
    check_file(&args.out, kind, &rules)?;
    let k = usize::from(args.k);
    let listed = |n: usize| {
        let out = OneLine(args.out.display());
        print(&format!(
            "{n} neighborhoods of {k} at inlier ratio {}, in {out}\n",
            args.inlier_ratio
        ))
    };
    if has_images(&args.truth)? {
        let alive = Spinner::new("searching neighbors");
        let counts = list_by_oracle(args, &released_path, &rules)
            .map_err(|error| without_released(error, args, &released_path))?;
        drop(alive);
        listed(counts.slots)?;
        return Ok(Outcome::Done);
    }
    let (original, secret) = read_truth::<3>(&args.truth)?;
    // Only the released map has the number of points per record.
    let released = read_released::<3>(&released_path)
        .map_err(|error| without_released(error.into(), args, &released_path))?;
    same_map(&released_path, Some(released.fingerprint()), &args.truth, secret.map())?;
    expect_slots(&released_path, &released, &secret)?;
    let alive = Spinner::new("searching neighbors");
    let core = |error| unlift_io::Error::core(&args.truth, error);
    let knn = search(&original).map_err(core)?;
    let near = TrueNeighbors::new(&knn, &secret, released.slots_per_record(), k).map_err(core)?;
    let outliers = Outliers::new(args.oracle_noise, &near, &knn, &secret, args.seed);
    let lists = near.lists(args.inlier_ratio, &outliers.map_err(core)?, args.seed).map_err(core)?;
    check_file(&args.out, kind, &rules)?;
    write_neighborhoods(&args.out, &lists)?;
    drop(alive);
    listed(lists.n_slots())?;
    Ok(Outcome::Done)
}

/// Adds advice to `error` if there is no released map beside the truth.
fn without_released(error: anyhow::Error, args: &OracleArgs, path: &Path) -> anyhow::Error {
    match args.released {
        None if !path.exists() => advise(error, "--released FILE"),
        _ => error,
    }
}

/// Makes lists as an attacker does.
pub fn find(args: &FindArgs) -> anyhow::Result<Outcome> {
    let rules = Rules::new([args.released.as_path()], args.force);
    let kind = Kind::Stage(Stage::Neighborhoods);
    check_file(&args.out, kind, &rules)?;
    let images = has_images(&args.released)?;
    let named = match args.k {
        Some(k) => args.source.clone().with_k(usize::from(k)),
        None => args.source.clone(),
    };
    if images {
        let source = named.of_dimension::<2>().map_err(|_| {
            usage(format!("--source {}: expected with a map, found images", named.name()))
        })?;
        let alive = Spinner::new("finding neighbors");
        let counts = with_threads(args.threads, || {
            list_by_source(&args.released, &*source, args.seed, (&args.out, &rules))
        })?;
        drop(alive);
        return listed(counts.slots, counts.longest, args);
    }
    let released = read_released::<3>(&args.released)?;
    let source = named.of_dimension::<3>()?;
    check_own(&*source, &released)
        .map_err(|error| advise(unlift_io::Error::core(&args.released, error.0), error.1))?;
    if let Some(note) = source.note(released.n_slots()) {
        stderr::note(note);
    }
    let alive = Spinner::new("finding neighbors");
    let lists = with_threads(args.threads, || {
        let lists = source.lists(&released, source.k(&released), args.seed);
        Ok(lists.map_err(|error| unlift_io::Error::core(&args.released, error))?)
    })?;
    check_file(&args.out, kind, &rules)?;
    write_neighborhoods(&args.out, &lists)?;
    drop(alive);
    listed(lists.n_slots(), lists.longest(), args)
}

fn listed(n: usize, k: usize, args: &FindArgs) -> anyhow::Result<Outcome> {
    let (name, out) = (args.source.name(), OneLine(args.out.display()));
    print(&format!("{n} neighborhoods of up to {k} by {name}, in {out}\n"))?;
    Ok(Outcome::Done)
}

/// Returns an error, with advice, if the released map lacks what a source needs.
fn check_own(source: &dyn Source<3>, released: &Released<3>) -> Result<(), (Error, &'static str)> {
    match released.descriptors() {
        None if source.needs() == Needs::Descriptors => {
            let what = format!("descriptors for {}", source.name());
            let way_out =
                "--source geometric, or hide the map with unlift obfuscate --descriptors FILE";
            Err((Error::new(what, "some in the released map", "none"), way_out))
        }
        None => Ok(()),
        Some(descriptors) => source
            .takes(descriptors)
            .map_err(|error| (error, "--source similarity, which takes descriptors of any kind")),
    }
}
