//! The stages `obfuscate`, `neighbors`, `recover` and `evaluate`: of a map, or of many images, of which only a few are in memory at a
//! time.

use std::cell::RefCell;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use unlift::audit::staged::{Pooled, key_of, oracle_lists, oracle_seed};
use unlift::audit::{Plan, Row, Threshold, measure};
use unlift::evaluate::blind;
use unlift::neighbors::oracle::{Outliers, TrueNeighbors, search};
use unlift::neighbors::sources::Named;
use unlift::neighbors::{Needs as SourceNeeds, Neighborhoods, of_what_there_is};
use unlift::obfuscate::{Change, Changed, Scheme, SchemeOptions, obfuscate as hide};
use unlift::recover::{RecoverOptions, Recovered, Status, recover as solve};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::{Original, Secret};
use unlift::{About, OneLine, RowOrder, Unit};
use unlift_audit::changes::{mitigations, protections_of_map};
use unlift_audit::images::FeatureSource;
use unlift_audit::images::stream::{Needs, Stream, Tally};
use unlift_audit::released::{expect_slots, same_map};
use unlift_audit::{Checked, Prepared, Progress as _, check_file, refused};
use unlift_io::Error;
use unlift_io::atomic::{Access, OutputFile};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_io::stage::{
    ImageFile, ImageRows, ImageWriter, Kind as Stage, has_images, read_neighborhoods,
    read_recovered_in, read_released, read_truth, write_neighborhoods, write_recovered,
    write_released, write_truth,
};
use unlift_report::leak;
use unlift_vision::features::Extraction;

use super::common::{all_could_be, open_map, public, read_document};
use crate::args::{EvaluateArgs, NeighborsArgs, ObfuscateArgs, RecoverArgs, public_name};
use crate::exit::{Outcome, advise, usage};
use crate::output::{print, table};
use crate::progress::{Progress, Stderr};
use crate::stderr;
use crate::values::NeighborSource;

const RELEASED: &str = "released.npz";
/// File name of the truth, which only the owner has.
const TRUTH: &str = "truth.npz";

/// Counts over the images of a stage.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    images: usize,
    /// Number of hidden points, or of lists.
    slots: usize,
    longest: usize,
    /// Number of points that were left out, or recovered.
    points: usize,
}

/// Images in memory per thread.
const AT_WORK: usize = 2;

/// Runs `work` in parallel on the items of `next`, and passes the results to `done` in order.
pub fn each<T: Send, U: Send>(
    mut next: impl FnMut() -> crate::Result<Option<T>>,
    work: impl Fn(T) -> crate::Result<U> + Sync,
    mut done: impl FnMut(U) -> crate::Result<()>,
) -> crate::Result<()> {
    loop {
        let mut batch = Vec::new();
        while batch.len() < AT_WORK * rayon::current_num_threads() {
            match next()? {
                Some(item) => batch.push(item),
                None => break,
            }
        }
        if batch.is_empty() {
            return Ok(());
        }
        let results: Vec<_> = batch.into_par_iter().with_max_len(1).map(&work).collect();
        for result in results {
            done(result?)?;
        }
    }
}

/// Returns what converts an error about an image to one of the file `path`.
pub fn of_image(path: &Path, name: &str) -> impl Fn(unlift::Error) -> Error {
    move |error| Error::core(path, error.within(&format!("image {name}")))
}

const GUESSABLE: &str = "unlift: note: whoever guesses the --seed can restore the order of the records and, under cp, \
    the points: do not release this map";

/// `unlift obfuscate`
pub fn obfuscate(args: &ObfuscateArgs) -> crate::Result<Outcome> {
    let (map, name, unit) = (&args.map, args.scheme.name, args.map.unit());
    let more = [&map.descriptors, &args.public_descriptors, &args.audit];
    let more = more.into_iter().filter_map(|path| path.as_deref());
    let inputs = [args.path.as_path()].into_iter().chain(more);
    let files = [(RELEASED, Kind::Stage(Stage::Released)), (TRUTH, Kind::Stage(Stage::Truth))];
    let rules = Rules::new(inputs, false);
    let mut out = OutputSet::create(&args.out, rules, Access::Private, &files).map_err(refused)?;
    if args.out.join(RELEASED).exists() {
        stderr::note(
            "--out: an earlier release is replaced: never publish both, as their records meet in the points",
        );
    }
    // All randomness comes from this key.
    let key = || match args.seed {
        Some(seed) => {
            stderr::tell(GUESSABLE);
            Ok(Key::from_seed(seed))
        }
        None => Key::fresh(),
    };
    let folder = OneLine(args.out.display());
    let Some(scheme) = args.scheme.of_dimension::<3>(&SchemeOptions::usual(unit)) else {
        for (option, given) in [
            ("--scale", map.scale.is_some()),
            ("--descriptors", map.descriptors.is_some()),
            ("--max-points", map.max_points.is_some()),
            ("--mitigate", args.mitigate.is_some()),
            ("--protect-descriptors", args.protect_descriptors.is_some()),
            ("--audit", args.audit.is_some()),
        ] {
            if given {
                let found = format!("found {name}, which hides images");
                return Err(usage(format!("{option}: expected with a map, {found}")));
            }
        }
        let scheme = args.scheme.of_dimension::<2>(&SchemeOptions::usual(Unit::Pixel));
        let scheme =
            scheme.ok_or_else(|| unlift_audit::Error::failed("not a scheme for images"))?;
        let (counts, unusable) = hide_images(&args.path, &*scheme, &key()?, &mut out)?;
        out.commit()?;
        let Counts { images, slots, points, .. } = counts;
        print(&format!(
            "{name}: {slots} keypoints of {images} images hidden, {points} dropped, in {folder}\n"
        ))?;
        return all_could_be("used", &args.path, images, unusable);
    };
    let prepared = open_map(&args.path, map, false, (args.seed.unwrap_or(0), false))?;
    for note in prepared.doubts.iter().chain(&prepared.notes) {
        Stderr.say(&format!("note: {note}"));
    }
    let scheme = changed(args, scheme, &prepared)?;
    let name = scheme.name();
    let leak = args.audit.as_deref().map(|path| leak_of(path, args, &prepared, name));
    let leak = leak.transpose()?;
    let hidden = hide(&*scheme, &prepared.original, prepared.descriptors.as_ref(), &key()?);
    let (released, secret) = hidden.map_err(|error| Error::core(&args.path, error))?;
    write_truth(&out.stage(TRUTH, Kind::Stage(Stage::Truth))?, &prepared.original, &secret)?;
    write_released(&out.stage(RELEASED, Kind::Stage(Stage::Released))?, &released)?;
    out.commit()?;
    let (slots, records) = (released.n_slots(), released.n_records());
    let dropped = secret.dropped().len();
    print(&format!(
        "{name}: {slots} points hidden in {records} records, {dropped} dropped, in {folder}\n"
    ))?;
    leak.map_or(Ok(()), |leak| print(&format!("audited: {leak}\n")))?;
    Ok(Outcome::Done)
}

/// Returns `scheme` with the requested mitigation or protection of descriptors.
fn changed(
    args: &ObfuscateArgs,
    scheme: Arc<dyn Scheme<3>>,
    prepared: &Prepared,
) -> crate::Result<Arc<dyn Scheme<3>>> {
    let public = |kind| public(args.public_descriptors.as_deref(), kind);
    let protections = protections_of_map(args.protect_descriptors.as_slice(), prepared, public)?;
    let mut changes = mitigations(args.mitigate.as_slice(), prepared, false)?;
    changes.extend(protections.into_iter().map(Change::Protection));
    Ok(match changes.pop() {
        Some(change) => Arc::new(Changed::new(scheme, change)),
        None => scheme,
    })
}

/// Returns what the audit at `path` says about this release.
fn leak_of(
    path: &Path,
    args: &ObfuscateArgs,
    prepared: &Prepared,
    scheme: &str,
) -> crate::Result<String> {
    let document = read_document(path)?;
    let public = || public_name(args.public_descriptors.as_deref());
    let public = args.protect_descriptors.as_ref().map(|_| public());
    leak(&document, &prepared.about(&args.path)?, scheme, public)
        .map_err(|wrong| Error::new(path, wrong.place, wrong.expected, wrong.found).into())
}

/// Hides the keypoints of all images of `path`, each under a key of its own, and writes both files into `out`. Also returns the
/// number of images that could not be used.
fn hide_images(
    path: &Path,
    scheme: &dyn Scheme<2>,
    key: &Key,
    out: &mut OutputSet,
) -> crate::Result<(Counts, usize)> {
    let source = FeatureSource::open(path, &Extraction::default())?;
    let tally = RefCell::new(Tally::default());
    tally.borrow_mut().unusable += source.refused.len();
    source.refused.iter().for_each(|line| Stderr.say(line));
    let all: Vec<usize> = (0..source.names.len()).collect();
    let mut images =
        Stream::new((&source, path), &all, Needs::whatever_there_is(), &tally, &Stderr);
    let mut staged =
        |name, kind, access| OutputFile::create(&out.stage(name, Kind::Stage(kind))?, access);
    let mut truth = staged(TRUTH, Stage::Truth, Access::Private)?;
    let mut released = staged(RELEASED, Stage::Released, Access::Usual)?;
    let mut truths = ImageWriter::start(&mut truth);
    let mut maps = ImageWriter::start(&mut released);
    let mut counts = Counts::default();
    each(
        || images.next().transpose(),
        |image| {
            let key = key_of(key, &image.name);
            let hidden = hide(scheme, &image.original, image.descriptors.as_ref(), &key);
            Ok((hidden.map_err(of_image(path, &image.name))?, image))
        },
        |((released, secret), image)| {
            counts.images += 1;
            counts.slots += released.n_slots();
            counts.points += secret.dropped().len();
            truths.truth(&image.name, &image.original, &secret)?;
            Ok(maps.released(&image.name, &released)?)
        },
    )?;
    let unusable = tally.borrow().unusable;
    truths.finish()?;
    maps.finish()?;
    truth.commit()?;
    released.commit()?;
    Ok((counts, unusable))
}

/// Writes a file of images: applies `work` to the items of `next`, and writes the results by `add`.
fn write<T: Send, U: Send>(
    (out, rules): (&Path, &Rules),
    kind: Stage,
    next: impl FnMut() -> crate::Result<Option<T>>,
    work: impl Fn(T) -> crate::Result<Option<(String, U)>> + Sync,
    mut add: impl FnMut(&mut ImageWriter<'_>, &mut Counts, &str, &U) -> Result<(), Error>,
) -> crate::Result<Counts> {
    let mut output = OutputFile::create(out, Access::Private)?;
    let mut writer = ImageWriter::start(&mut output);
    let mut counts = Counts::default();
    each(next, work, |made| {
        let Some((name, made)) = made else { return Ok(()) };
        counts.images += 1;
        Ok(add(&mut writer, &mut counts, &name, &made)?)
    })?;
    writer.finish()?;
    // Check again, because another program may have written a file here.
    rules.check(out, Kind::Stage(kind))?;
    output.commit()?;
    Ok(counts)
}

/// Entries of the oracle's lists, by default.
const K: u16 = 50;

/// `unlift neighbors`
pub fn neighbors(args: &NeighborsArgs) -> crate::Result<Outcome> {
    let inputs = [Some(args.released.as_path()), args.truth.as_deref()];
    let rules = &Rules::new(inputs.into_iter().flatten(), false);
    check_file(&args.out, Kind::Stage(Stage::Neighborhoods), rules)?;
    let images = has_images(&args.released)?;
    let alive = Progress::uncounted(false, "finding neighbors");
    let (counts, name) = match (&args.neighbors, args.truth.as_deref(), args.inlier_ratio) {
        (NeighborSource::Own(named), None, _) => {
            let named = named.clone();
            let named = args.k.map_or(named.clone(), |k| named.with_k(usize::from(k)));
            let counts = match images {
                true => images_by_source(args, &named, rules)?,
                false => write_lists(args, rules, &map_by_source(args, &named)?)?,
            };
            (counts, named.name().to_owned())
        }
        (NeighborSource::Oracle, Some(truth), Some(ratio)) => {
            let counts = match images {
                true => images_by_oracle(args, truth, ratio, rules)?,
                false => write_lists(args, rules, &map_by_oracle(args, truth, ratio)?)?,
            };
            (counts, format!("oracle at inlier ratio {ratio}"))
        }
        (NeighborSource::Own(named), Some(_), _) => {
            let name = named.name();
            return Err(usage(format!("--truth: expected with --neighbors oracle, found {name}")));
        }
        _ => {
            let expected = "expected --truth and --inlier-ratios, found none";
            return Err(usage(format!("--neighbors oracle: {expected}")));
        }
    };
    drop(alive);
    let (n, longest, out) = (counts.slots, counts.longest, OneLine(args.out.display()));
    print(&format!("{n} neighborhoods of up to {longest} by {name}, in {out}\n"))?;
    Ok(Outcome::Done)
}

/// Writes the lists of a map.
fn write_lists(
    args: &NeighborsArgs,
    rules: &Rules,
    lists: &Neighborhoods,
) -> crate::Result<Counts> {
    check_file(&args.out, Kind::Stage(Stage::Neighborhoods), rules)?;
    write_neighborhoods(&args.out, lists)?;
    let (slots, longest) = (lists.n_slots(), lists.longest());
    Ok(Counts { slots, longest, ..Counts::default() })
}

/// Adds the lists of an image to a file.
fn add_lists(
    writer: &mut ImageWriter<'_>,
    counts: &mut Counts,
    name: &str,
    lists: &Neighborhoods,
) -> Result<(), Error> {
    counts.slots += lists.n_slots();
    counts.longest = counts.longest.max(lists.longest());
    writer.neighborhoods(name, lists)
}

/// Makes the lists of a map as an attacker does.
fn map_by_source(args: &NeighborsArgs, named: &Named) -> crate::Result<Neighborhoods> {
    let released = read_released::<3>(&args.released)?;
    let source = named.of_dimension::<3>()?;
    let of_map = |error| Error::core(&args.released, error);
    match released.descriptors() {
        None if source.needs() == SourceNeeds::Descriptors => {
            let what = format!("descriptors for {}", source.name());
            let error = unlift::Error::new(what, "some in the released map", "none");
            let advice =
                "--neighbors geometric, or hide the map with unlift obfuscate --descriptors FILE";
            return Err(advise(of_map(error), advice));
        }
        None => {}
        Some(descriptors) => source.takes(descriptors).map_err(|error| {
            let advice = "--neighbors similarity, which takes descriptors of any kind";
            advise(of_map(error), advice)
        })?,
    }
    if let Some(note) = source.note(released.n_slots()) {
        stderr::note(note);
    }
    Ok(source.lists(&released, source.k(&released), args.seed).map_err(of_map)?)
}

/// Makes the lists of a map at one inlier ratio.
fn map_by_oracle(args: &NeighborsArgs, truth: &Path, ratio: f64) -> crate::Result<Neighborhoods> {
    let (original, secret) = read_truth::<3>(truth)?;
    // Only the released map has the number of points per record.
    let released = read_released::<3>(&args.released)?;
    same_map(&args.released, Some(released.fingerprint()), truth, secret.map())?;
    expect_slots(&args.released, &released, &secret)?;
    let k = usize::from(args.k.unwrap_or(K));
    let lists = || {
        let knn = search(&original)?;
        let near = TrueNeighbors::new(&knn, &secret, released.slots_per_record(), k)?;
        let outliers = Outliers::new(args.oracle_noise, &near, &knn, &secret, args.seed)?;
        near.lists(ratio, &outliers, args.seed)
    };
    Ok(lists().map_err(|error| Error::core(truth, error))?)
}

/// Writes a source's lists for all images.
fn images_by_source(args: &NeighborsArgs, named: &Named, rules: &Rules) -> crate::Result<Counts> {
    let source = named.of_dimension::<2>().map_err(|_| {
        usage(format!("--neighbors {}: expected with a map, found images", named.name()))
    })?;
    let mut images = ImageFile::open(&args.released, Stage::Released)?;
    let work = |rows: ImageRows<'_>| {
        let name = rows.name().to_owned();
        let image = rows.released()?;
        let wrong = of_image(&args.released, &name);
        if image.descriptors().is_none() && source.needs() == SourceNeeds::Descriptors {
            let what = format!("descriptors for {}", source.name());
            return Err(wrong(unlift::Error::new(what, "some", "none")).into());
        }
        image.descriptors().map_or(Ok(()), |rows| source.takes(rows)).map_err(&wrong)?;
        let lists = of_what_there_is(&*source, &image, args.seed).map_err(wrong)?;
        Ok(Some((name, lists)))
    };
    let next = || Ok(images.next_image()?);
    write((&args.out, rules), Stage::Neighborhoods, next, work, add_lists)
}

/// Writes the oracle's lists for all images.
fn images_by_oracle(
    args: &NeighborsArgs,
    truth: &Path,
    ratio: f64,
    rules: &Rules,
) -> crate::Result<Counts> {
    let mut pairs = Pairs::open(truth, Some(&args.released))?;
    let how = (args.oracle_noise, ratio, usize::from(args.k.unwrap_or(K)));
    let work = |pair: Pair| {
        let Pair { name, original, secret, released } = pair;
        let Some(released) = released else { return Ok(None) };
        let seed = oracle_seed(args.seed, &name);
        let lists = oracle_lists(&original, &(released, secret), how, seed);
        let lists = lists.map_err(of_image(truth, &name))?;
        Ok(Some((name, lists)))
    };
    write((&args.out, rules), Stage::Neighborhoods, || pairs.next(), work, add_lists)
}

/// `unlift recover`
pub fn recover(args: &RecoverArgs) -> crate::Result<Outcome> {
    let rules = Rules::new([args.released.as_path(), &args.neighbors], false);
    let kind = Kind::Stage(Stage::Recovered);
    check_file(&args.out, kind, &rules)?;
    let alive = Progress::uncounted(false, "recovering");
    let options = RecoverOptions { seed: args.seed, ..RecoverOptions::default() };
    let out = OneLine(args.out.display());
    if has_images(&args.released)? {
        let Counts { points, slots, images, .. } = recover_images(args, &options, &rules)?;
        drop(alive);
        print(&format!(
            "{points} of {slots} keypoints of {images} images have a position, in {out}\n"
        ))?;
        return Ok(Outcome::Done);
    }
    let released = read_released::<3>(&args.released)?;
    let (records, slots) = (released.n_records(), released.slots_per_record());
    let lists = read_neighborhoods(&args.neighbors, records, slots)?;
    let map = Some(released.fingerprint());
    same_map(&args.neighbors, lists.about().map, &args.released, map)?;
    for note in notes_on_lists(&lists, slots) {
        alive.say(&format!("note: {}: {note}", args.neighbors.display()));
    }
    let recovered = solve(&released, &lists, &args.solver, &options);
    let recovered = recovered.map_err(|error| Error::core(&args.released, error))?;
    check_file(&args.out, kind, &rules)?;
    write_recovered(&args.out, &recovered)?;
    drop(alive);
    let (n, slots) = (n_recovered(&recovered), recovered.n_slots());
    let (delta, unit) = (recovered.delta(), recovered.unit().name());
    print(&format!(
        "{n} of {slots} points have a position, with delta {delta:.4} {unit}, in {out}\n"
    ))?;
    Ok(Outcome::Done)
}

fn n_recovered<const D: usize>(recovered: &Recovered<D>) -> usize {
    recovered.status().iter().filter(|&&status| status == Status::Ok).count()
}

/// Recovers all images, and writes them.
fn recover_images(
    args: &RecoverArgs,
    options: &RecoverOptions,
    rules: &Rules,
) -> crate::Result<Counts> {
    let mut images = ImageFile::open(&args.released, Stage::Released)?;
    let mut lists = ImageFile::open(&args.neighbors, Stage::Neighborhoods)?;
    // The same note about several images is printed once.
    let mut printed = HashSet::new();
    let next = || {
        let Some(rows) = images.next_image()? else {
            lists.expect_end(&args.released)?;
            return Ok(None);
        };
        let name = rows.name().to_owned();
        let image = rows.released()?;
        let (records, slots) = (image.n_records(), image.slots_per_record());
        let lists = lists.expect(&name, &args.released)?.neighborhoods(records, slots)?;
        let map = Some(image.fingerprint());
        same_map(&args.neighbors, lists.about().map, &args.released, map)?;
        for note in notes_on_lists(&lists, slots) {
            let what = note.split(|c: char| c.is_ascii_digit()).next_back().unwrap_or_default();
            if printed.insert(what.to_owned()) {
                stderr::note(format_args!("{}: {note}", args.neighbors.display()));
            }
        }
        Ok(Some((name, image, lists)))
    };
    let work = |(name, image, lists): (String, Released<2>, Neighborhoods)| {
        let recovered = solve(&image, &lists, &args.solver, options);
        let recovered = recovered.map_err(of_image(&args.released, &name))?;
        Ok(Some((name, recovered)))
    };
    let out = (args.out.as_path(), rules);
    write(out, Stage::Recovered, next, work, |writer, counts, name, recovered: &Recovered<2>| {
        counts.slots += recovered.n_slots();
        counts.points += n_recovered(recovered);
        writer.recovered(name, recovered)
    })
}

/// Returns notes on lists that another program wrote.
fn notes_on_lists(lists: &Neighborhoods, slots_per_record: usize) -> Vec<String> {
    let mut notes = Vec::new();
    let n = lists.n_slots();
    let empty = (0..n).filter(|&slot| lists.of(slot).is_empty()).count();
    if empty > 0 {
        notes.push(format!(
            "{empty} of {n} lists are empty: solvers that read lists recover nothing there"
        ));
    }
    if lists.about().map.is_none() {
        notes.push("does not name its released map; assumed to be this one".to_owned());
    }
    if lists.about().order == RowOrder::Unstated && slots_per_record > 1 {
        let names = RowOrder::STATED.map(|order| order.name().unwrap_or_default()).join(", ");
        notes.push(format!(
            "does not state what its rows are counted by (metadata rows_by: {names}): figures of what is recovered \
             will be upper bounds"
        ));
    }
    notes
}

/// What was compared.
struct Evaluated {
    row: Row,
    /// Without a fingerprint if any image lacks that of its released image.
    about: About,
    slots_per_record: usize,
    /// Checks that the compared files belong together.
    checked: Checked,
}

/// `unlift evaluate`
pub fn evaluate(args: &EvaluateArgs) -> crate::Result<Outcome> {
    // The released map beside the truth, for the blind baseline.
    let released = Some(args.truth.with_file_name(RELEASED)).filter(|path| path.exists());
    let images = has_images(&args.truth)?;
    let (unit, thresholds, evaluated) = match images {
        true => {
            let thresholds = thresholds(args, Unit::Pixel);
            let evaluated = evaluate_images(args, released.as_deref(), &thresholds)?;
            (Unit::Pixel, thresholds, evaluated)
        }
        false => {
            let (original, secret) = read_truth::<3>(&args.truth)?;
            let unit = original.reveal().unit();
            let thresholds = thresholds(args, unit);
            let released = released.as_ref();
            let evaluated = evaluate_map(args, released, (&original, &secret), &thresholds)?;
            (unit, thresholds, evaluated)
        }
    };
    let Evaluated { row, about, slots_per_record, checked } = evaluated;
    let mut notes = Vec::new();
    if about.map.is_none() {
        notes.push("does not name its released map; assumed to be that of the truth".to_owned());
    }
    if about.order == RowOrder::Unstated && slots_per_record > 1 {
        let note = "does not state what its rows are counted by: each position is compared with the nearer point of its \
                    record, so the figures are upper bounds";
        notes.push(note.to_owned());
    }
    notes.extend(checked.notes(&thresholds, unit).map_err(|error| {
        let error = Error::core(&args.recovered, error).into();
        let advice = || {
            format!("put {RELEASED} beside the truth: records identify a map better than points")
        };
        if released.is_some() { error } else { advise(error, advice()) }
    })?);
    for note in &notes {
        stderr::note(format_args!("{}: {note}", args.recovered.display()));
    }
    print(&match args.json {
        true => format!("{:#}\n", unlift_audit::evaluated(&row, &notes)?),
        false => as_table(&row),
    })?;
    Ok(Outcome::Done)
}

fn thresholds(args: &EvaluateArgs, unit: Unit) -> Vec<Threshold> {
    match args.thresholds.as_slice() {
        [] => Plan::<3>::new(unit).thresholds,
        given => given.to_vec(),
    }
}

fn evaluate_map(
    args: &EvaluateArgs,
    released: Option<&PathBuf>,
    (original, secret): (&Original<3>, &Secret),
    thresholds: &[Threshold],
) -> crate::Result<Evaluated> {
    let recovered = read_recovered_in::<3>(&args.recovered, original.reveal().unit())?;
    let about = recovered.about();
    same_map(&args.recovered, about.map, &args.truth, secret.map())?;
    let released = released.map(|path| {
        let released = read_released::<3>(path)?;
        same_map(path, Some(released.fingerprint()), &args.truth, secret.map())?;
        expect_slots(path, &released, secret)?;
        Ok::<_, Error>(released)
    });
    let released = released.transpose()?;
    let mut checked = Checked::default();
    let added = checked.add(&recovered, original, secret, released.as_ref());
    added.map_err(|error| Error::core(&args.truth, error))?;
    let baseline = released.map(|released| blind(&released, original, secret));
    let (row, _) = measure(&recovered, original, secret, baseline.as_ref(), thresholds)
        .map_err(|error| Error::core(&args.recovered, error))?;
    Ok(Evaluated { row, about, slots_per_record: secret.slots_per_record(), checked })
}

/// Computes the row over all images.
fn evaluate_images(
    args: &EvaluateArgs,
    released: Option<&Path>,
    thresholds: &[Threshold],
) -> crate::Result<Evaluated> {
    let mut pairs = Pairs::open(&args.truth, released)?;
    let mut file = ImageFile::open(&args.recovered, Stage::Recovered)?;
    let (mut pooled, mut checked) = (Pooled::new(thresholds), Checked::default());
    let mut about: Option<About> = None;
    while let Some(Pair { name, original, secret, released }) = pairs.next()? {
        if secret.n_slots() == 0 {
            pooled.add_unreleased(&secret);
            continue;
        }
        let recovered = file.expect(&name, &args.truth)?.recovered()?;
        same_map(&args.recovered, recovered.about().map, &args.truth, secret.map())?;
        let added = pooled.add(&recovered, &original, &secret, released.as_ref());
        added.map_err(of_image(&args.recovered, &name))?;
        let added = checked.add(&recovered, &original, &secret, released.as_ref());
        added.map_err(of_image(&args.truth, &name))?;
        // One image without a fingerprint suffices for a note.
        if about.is_none_or(|about| about.map.is_some()) {
            about = Some(recovered.about());
        }
    }
    file.expect_end(&args.truth)?;
    let none = || Error::new(&args.truth, "", "images with hidden points", "none");
    let row = pooled.row().ok_or_else(none)?;
    Ok(Evaluated { row, about: about.unwrap_or_default(), slots_per_record: 1, checked })
}

/// Iterator over images of a truth file and of the released file.
struct Pairs<'a> {
    truth: (&'a Path, ImageFile<'a>),
    released: Option<(&'a Path, ImageFile<'a>)>,
}

struct Pair {
    name: String,
    original: Original<2>,
    secret: Secret,
    /// `None` if no record was released, or there is no released file.
    released: Option<Released<2>>,
}

impl<'a> Pairs<'a> {
    fn open(truth: &'a Path, released: Option<&'a Path>) -> crate::Result<Self> {
        let images = ImageFile::open(truth, Stage::Truth)?;
        let open = |path| Ok::<_, Error>((path, ImageFile::open(path, Stage::Released)?));
        Ok(Self { truth: (truth, images), released: released.map(open).transpose()? })
    }

    fn next(&mut self) -> crate::Result<Option<Pair>> {
        let truth = self.truth.0;
        let Some(rows) = self.truth.1.next_image()? else {
            if let Some((_, released)) = &mut self.released {
                released.expect_end(truth)?;
            }
            return Ok(None);
        };
        let name = rows.name().to_owned();
        let (original, secret) = rows.truth()?;
        let released = match &mut self.released {
            Some((path, images)) if secret.n_slots() > 0 => {
                let image = images.expect(&name, truth)?.released()?;
                same_map(path, Some(image.fingerprint()), truth, secret.map())?;
                expect_slots(path, &image, &secret)?;
                Some(image)
            }
            _ => None,
        };
        Ok(Some(Pair { name, original, secret, released }))
    }
}

/// Formats a percentage; one above zero never reads as zero.
fn percent(share: f64) -> String {
    if share > 0.0 && share < 0.05 { "under 0.1 %".to_owned() } else { format!("{share:.1} %") }
}

fn as_table(row: &Row) -> String {
    let unit = row.unit.name();
    let mut lines = vec![vec!["released points".to_owned(), row.n_points.to_string()]];
    let mut add = |what: String, figure: String| lines.push(vec![what, figure]);
    row.dropped
        .iter()
        .for_each(|(reason, n)| add(format!("not released: {reason}"), n.to_string()));
    for (what, shares) in [("", &row.recovered_percent), ("blind, ", &row.blind_percent)] {
        for (label, share) in shares {
            add(format!("{what}within {label} {unit}"), percent(*share));
        }
    }
    row.lost.iter().for_each(|(reason, n)| add(format!("lost: {reason}"), n.to_string()));
    let median = row.median_error.map_or("-".to_owned(), |error| format!("{error:.4}"));
    add(format!("median error, {unit}"), median);
    for (what, share) in [
        ("axes named", row.axis_accuracy_percent),
        ("exact: the published value", row.exact_percent),
        ("descriptors assigned", row.assignment_accuracy_percent),
        ("attacker 90 % sure", row.sure_percent),
        ("of these within", row.sure_correct_percent),
    ] {
        share.into_iter().for_each(|share| add(what.to_owned(), percent(share)));
    }
    table(&lines, &[])
}
