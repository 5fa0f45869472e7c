//! `unlift neighbors`: makes neighbor lists from released data alone, or by the oracle.

use unlift::neighbors::oracle::{Outliers, TrueNeighbors, search};
use unlift::neighbors::sources::Named;
use unlift::neighbors::{Needs, Neighborhoods, Source};
use unlift::released::Released;
use unlift::{Error, OneLine};
use unlift_io::outputs::{Kind, Rules};
use unlift_io::stage::{Kind as Stage, has_images, read_released, read_truth, write_neighborhoods};

use super::image_stages::{Counts, Oracle, list_by_oracle, list_by_source};
use crate::args::NeighborsArgs;
use crate::exit::{Outcome, advise, usage};
use crate::output::print;
use crate::progress::Progress;
use crate::stderr;
use crate::values::NeighborSource;
use unlift_audit::check_file;
use unlift_audit::released::{expect_slots, same_map};

/// Entries of the oracle's lists, by default.
const K: u16 = 50;

pub fn run(args: &NeighborsArgs) -> crate::Result<Outcome> {
    let inputs = [Some(args.released.as_path()), args.truth.as_deref()];
    let rules = Rules::new(inputs.into_iter().flatten(), false);
    let kind = Kind::Stage(Stage::Neighborhoods);
    check_file(&args.out, kind, &rules)?;
    let images = has_images(&args.released)?;
    let alive = Progress::uncounted(false, "finding neighbors");
    let (made, name) = match (&args.neighbors, args.truth.as_deref(), args.inlier_ratio) {
        (NeighborSource::Own(named), None, _) => {
            let named = named.clone();
            let named = args.k.map_or(named.clone(), |k| named.with_k(usize::from(k)));
            (by_source(args, &named, images, &rules)?, named.name().to_owned())
        }
        (NeighborSource::Oracle, Some(truth), Some(inlier_ratio)) => {
            let k = usize::from(args.k.unwrap_or(K));
            let oracle = Oracle { truth, inlier_ratio, k };
            let made = match images {
                true => Made::Written(list_by_oracle(args, &oracle, &rules)?),
                false => Made::Lists(by_oracle(args, &oracle)?),
            };
            (made, format!("oracle at inlier ratio {inlier_ratio}"))
        }
        (NeighborSource::Own(named), Some(_), _) => {
            let name = named.name();
            return Err(usage(format!("--truth: expected with --neighbors oracle, found {name}")));
        }
        _ => {
            return Err(usage(
                "--neighbors oracle: expected --truth and --inlier-ratio, found none",
            ));
        }
    };
    let (n, longest) = match made {
        Made::Written(counts) => (counts.slots, counts.longest),
        Made::Lists(lists) => {
            check_file(&args.out, kind, &rules)?;
            write_neighborhoods(&args.out, &lists)?;
            (lists.n_slots(), lists.longest())
        }
    };
    drop(alive);
    let out = OneLine(args.out.display());
    print(&format!("{n} neighborhoods of up to {longest} by {name}, in {out}\n"))?;
    Ok(Outcome::Done)
}

/// The lists of a map, or what was written for images.
enum Made {
    Lists(Neighborhoods),
    Written(Counts),
}

/// Makes lists as an attacker does.
fn by_source(
    args: &NeighborsArgs,
    named: &Named,
    images: bool,
    rules: &Rules,
) -> crate::Result<Made> {
    if images {
        let source = named.of_dimension::<2>().map_err(|_| {
            usage(format!("--neighbors {}: expected with a map, found images", named.name()))
        })?;
        let out = (args.out.as_path(), rules);
        return Ok(Made::Written(list_by_source(&args.released, &*source, args.seed, out)?));
    }
    let released = read_released::<3>(&args.released)?;
    let source = named.of_dimension::<3>()?;
    check_source(&*source, &released)
        .map_err(|error| advise(unlift_io::Error::core(&args.released, error.0), error.1))?;
    if let Some(note) = source.note(released.n_slots()) {
        stderr::note(note);
    }
    let lists = source.lists(&released, source.k(&released), args.seed);
    Ok(Made::Lists(lists.map_err(|error| unlift_io::Error::core(&args.released, error))?))
}

/// Returns an error, with advice, if the released map lacks what a source needs.
fn check_source(
    source: &dyn Source<3>,
    released: &Released<3>,
) -> Result<(), (Error, &'static str)> {
    match released.descriptors() {
        None if source.needs() == Needs::Descriptors => {
            let what = format!("descriptors for {}", source.name());
            let advice =
                "--neighbors geometric, or hide the map with unlift obfuscate --descriptors FILE";
            Err((Error::new(what, "some in the released map", "none"), advice))
        }
        None => Ok(()),
        Some(descriptors) => source.takes(descriptors).map_err(|error| {
            (error, "--neighbors similarity, which takes descriptors of any kind")
        }),
    }
}

/// Makes the lists of a map at one inlier ratio.
fn by_oracle(args: &NeighborsArgs, oracle: &Oracle<'_>) -> crate::Result<Neighborhoods> {
    let (original, secret) = read_truth::<3>(oracle.truth)?;
    // Only the released map has the number of points per record.
    let released = read_released::<3>(&args.released)?;
    same_map(&args.released, Some(released.fingerprint()), oracle.truth, secret.map())?;
    expect_slots(&args.released, &released, &secret)?;
    let lists = || {
        let knn = search(&original)?;
        let near = TrueNeighbors::new(&knn, &secret, released.slots_per_record(), oracle.k)?;
        let outliers = Outliers::new(args.oracle_noise, &near, &knn, &secret, args.seed)?;
        near.lists(oracle.inlier_ratio, &outliers, args.seed)
    };
    Ok(lists().map_err(|error| unlift_io::Error::core(oracle.truth, error))?)
}
