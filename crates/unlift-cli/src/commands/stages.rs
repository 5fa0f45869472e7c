//! The stages `obfuscate`, `neighbors`, `recover` and `evaluate`: of a map, or of many images, of which only a few are in memory at a time.

use std::cell::RefCell;
use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use unlift::audit::doubts::{Checked, exchanged};
use unlift::audit::staged::{Pooled, key_of, oracle_lists, oracle_seed};
use unlift::audit::{Plan, Row, Threshold, measure};
use unlift::evaluate::blind;
use unlift::neighbors::sources::Named;
use unlift::neighbors::{Needs as SourceNeeds, Neighborhoods, of_what_there_is};
use unlift::obfuscate::{Change, Changed, SchemeOptions, obfuscate as hide};
use unlift::recover::{RecoverOptions, Recovered, Status, recover as solve};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::{Original, Secret};
use unlift::{About, OneLine, RowOrder, Unit};
use unlift_audit::changes::{mitigations, protections_of_map};
use unlift_audit::images::FeatureSource;
use unlift_audit::images::stream::{Tally, stream};
use unlift_audit::released::{check_name, expect_truth, same_map};
use unlift_audit::{Progress as _, bail, check_file, refused};
use unlift_io::Error as FileError;
use unlift_io::atomic::{Access, OutputFile};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_io::stage::{
    ImageFile, ImageRows, ImageWriter, Kind as Stage, has_images, read_neighborhoods,
    read_recovered, read_released, read_truth, write_neighborhoods, write_recovered,
    write_released, write_truth,
};
use unlift_report::leak;
use unlift_vision::features::Extraction;

use super::common::{all_could_be, open_map, public, read_document};
use crate::Error;
use crate::args::{EvaluateArgs, NeighborsArgs, ObfuscateArgs, RecoverArgs, public_name};
use crate::output::{self, print, table, tell};
use crate::progress::{Progress, Stderr};
use crate::values::NeighborSource;

const RELEASED: &str = "released.npz";
/// File name of the truth, which only the owner has.
const TRUTH: &str = "truth.npz";

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
        let items = std::iter::from_fn(|| next().transpose());
        let batch = items.take(AT_WORK * rayon::current_num_threads());
        let batch = batch.collect::<crate::Result<Vec<T>>>()?;
        if batch.is_empty() {
            return Ok(());
        }
        let results: Vec<_> = batch.into_par_iter().with_max_len(1).map(&work).collect();
        results.into_iter().try_for_each(|result| done(result?))?;
    }
}

/// Returns what converts an error about an image to one of the file `path`.
pub fn of_image(path: &Path, name: &str) -> impl Fn(unlift::Error) -> FileError {
    move |error| FileError::core(path, error.within(&format!("image {name}")))
}

const GUESSABLE: &str = "unlift: note: whoever guesses the --seed can restore the order of the records and, under cp, \
    the points: do not release this map";

pub fn obfuscate(args: &ObfuscateArgs) -> crate::Result<()> {
    let (map, unit) = (&args.map, args.map.unit());
    let more = [&map.descriptors, &args.public_descriptors, &args.audit];
    let more = more.into_iter().filter_map(|path| path.as_deref());
    let inputs = [args.path.as_path()].into_iter().chain(more);
    let files = [(RELEASED, Kind::Stage(Stage::Released)), (TRUTH, Kind::Stage(Stage::Truth))];
    let rules = Rules::new(inputs, false);
    let mut out = OutputSet::create(&args.out, rules, Access::Private, &files).map_err(refused)?;
    let replaces = args.out.join(RELEASED).exists();
    let Some(scheme) = args.scheme.of_dimension::<3>(&SchemeOptions::usual(unit)) else {
        return obfuscate_images(args, out);
    };
    let audit = args.audit.as_deref().map(read_document).transpose()?;
    let even = audit.as_ref().is_some_and(|audit| audit.input.n_points.is_multiple_of(2));
    let prepared = open_map(&args.path, map, (even, false), (args.seed.unwrap_or(0), false))?;
    prepared.remarks.doubts.iter().chain(&prepared.remarks.notes).for_each(output::note);
    let public = |kind| public(args.public_descriptors.as_deref(), kind);
    let protections = protections_of_map(args.protect_descriptors.as_slice(), &prepared, public)?;
    let mut changes = mitigations(args.mitigate.as_slice(), &prepared, false)?;
    changes.extend(protections.into_iter().map(Change::Protection));
    let scheme = match changes.pop() {
        Some(change) => Arc::new(Changed::new(scheme, change)),
        None => scheme,
    };
    let name = scheme.name();
    let leak = match args.audit.as_ref().zip(audit) {
        Some((path, audit)) => {
            let public = public_name(args.public_descriptors.as_deref());
            let public = args.protect_descriptors.as_ref().map(|_| public);
            let leak = leak(&audit, &prepared.about(&args.path)?, name, public);
            Some(leak.map_err(|of| FileError::new(path, of.place, of.expected, of.found))?)
        }
        None => None,
    };
    if let (None, Some(file)) = (&prepared.descriptors, prepared.input.beside.first()) {
        let file = file.display();
        output::note(format!("no descriptors are released (--descriptors {file})"));
    }
    if replaces {
        output::note(
            "--out: an earlier release is replaced: never publish both, as their records meet in the points",
        );
    }
    let hidden = hide(&*scheme, &prepared.original, prepared.descriptors.as_ref(), &key(args)?);
    let (released, secret) = hidden.map_err(|error| FileError::core(&args.path, error))?;
    write_truth(&out.stage(TRUTH, Kind::Stage(Stage::Truth))?, &prepared.original, &secret)?;
    let path = out.stage(RELEASED, Kind::Stage(Stage::Released))?;
    write_released(&path, &released, Some(name).filter(|name| check_name(name).is_ok()))?;
    out.commit()?;
    let (slots, records) = (released.n_slots(), released.n_records());
    let (dropped, folder) = (secret.dropped().len(), OneLine(args.out.display()));
    print(&format!(
        "{name}: {slots} points hidden in {records} records, {dropped} dropped, in {folder}\n"
    ))?;
    let Some(leak) = leak else { return Ok(()) };
    let key = match args.seed {
        None => " The key of this release is another: attack it, too (unlift audit released).",
        Some(_) => "",
    };
    print(&format!("audited: {leak}{key}\n"))
}

/// Returns the key from which all randomness comes.
fn key(args: &ObfuscateArgs) -> Result<Key, unlift::Error> {
    let Some(seed) = args.seed else { return Key::fresh() };
    tell(GUESSABLE);
    Ok(Key::from_seed(seed))
}

/// Hides the keypoints of all images, each under a key of its own, and writes both files into `out`.
fn obfuscate_images(args: &ObfuscateArgs, mut out: OutputSet) -> crate::Result<()> {
    let (map, path, name) = (&args.map, &args.path, args.scheme.name);
    for (option, given) in [
        ("--scale", map.scale.is_some()),
        ("--descriptors", map.descriptors.is_some()),
        ("--max-points", map.max_points.is_some()),
        ("--mitigate", args.mitigate.is_some()),
        ("--protect-descriptors", args.protect_descriptors.is_some()),
        ("--audit", args.audit.is_some()),
    ] {
        if given {
            bail!("{option}: expected with a map, found {name}, which hides images");
        }
    }
    let scheme = args.scheme.of_dimension::<2>(&SchemeOptions::usual(Unit::Pixel));
    let scheme = scheme.ok_or_else(|| Error::failed("not a scheme for images"))?;
    let key = key(args)?;
    let source = FeatureSource::open(path, &Extraction::default())?;
    let tally = RefCell::new(Tally::default());
    tally.borrow_mut().unusable = source.refused.len();
    source.refused.iter().for_each(|line| Stderr.say(line));
    let all: Vec<usize> = (0..source.names.len()).collect();
    let mut images = stream((&source, path), &all, None, &tally, &Stderr);
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
            let key = key_of(&key, &image.name);
            let hidden = hide(&*scheme, &image.original, image.descriptors.as_ref(), &key);
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
    truths.finish()?;
    maps.finish()?;
    truth.commit()?;
    released.commit()?;
    out.commit()?;
    let Counts { images: n, slots, points, .. } = counts;
    let folder = OneLine(args.out.display());
    print(&format!(
        "{name}: {slots} keypoints of {n} images hidden, {points} dropped, in {folder}\n"
    ))?;
    all_could_be("used", path, n, tally.borrow().unusable)
}

/// Writes a file of images: applies `work` to the items of `next`, and writes the results by `add`.
fn write<T: Send, U: Send>(
    (out, rules): (&Path, &Rules),
    kind: Stage,
    next: impl FnMut() -> crate::Result<Option<T>>,
    work: impl Fn(T) -> crate::Result<Option<(String, U)>> + Sync,
    mut add: impl FnMut(&mut ImageWriter<'_>, &mut Counts, &str, &U) -> Result<(), FileError>,
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

pub fn neighbors(args: &NeighborsArgs) -> crate::Result<()> {
    let inputs = [Some(args.released.as_path()), args.truth.as_deref()];
    let rules = &Rules::new(inputs.into_iter().flatten(), false);
    check_file("--out", &args.out, Kind::Stage(Stage::Neighborhoods), rules)?;
    let images = has_images(&args.released)?;
    let alive = Progress::uncounted(false, "finding neighbors");
    let (counts, name) = match (&args.neighbors, args.truth.as_deref(), args.inlier_ratio) {
        (NeighborSource::Own(named), None, _) => {
            let of_k = |k| named.clone().with_k(usize::from(k));
            let named = args.k.map_or_else(|| named.clone(), of_k);
            let by_source = if images { images_by_source } else { map_by_source };
            (by_source(args, &named, rules)?, named.name().to_owned())
        }
        (NeighborSource::Oracle, Some(truth), Some(ratio)) => {
            let by_oracle = if images { images_by_oracle } else { map_by_oracle };
            (by_oracle(args, truth, ratio, rules)?, format!("oracle at inlier ratio {ratio}"))
        }
        (NeighborSource::Own(named), Some(_), _) => {
            bail!("--truth: expected with --neighbors oracle, found {}", named.name())
        }
        _ => bail!("--neighbors oracle: expected --truth and --inlier-ratios, found none"),
    };
    drop(alive);
    let (n, longest, out) = (counts.slots, counts.longest, OneLine(args.out.display()));
    print(&format!("{n} neighborhoods of up to {longest} by {name}, in {out}\n"))
}

fn write_lists(
    args: &NeighborsArgs,
    rules: &Rules,
    lists: &Neighborhoods,
) -> crate::Result<Counts> {
    check_file("--out", &args.out, Kind::Stage(Stage::Neighborhoods), rules)?;
    write_neighborhoods(&args.out, lists)?;
    let (slots, longest) = (lists.n_slots(), lists.longest());
    Ok(Counts { slots, longest, ..Counts::default() })
}

fn add_lists(
    writer: &mut ImageWriter<'_>,
    counts: &mut Counts,
    name: &str,
    lists: &Neighborhoods,
) -> Result<(), FileError> {
    counts.slots += lists.n_slots();
    counts.longest = counts.longest.max(lists.longest());
    writer.neighborhoods(name, lists)
}

fn map_by_source(args: &NeighborsArgs, named: &Named, rules: &Rules) -> crate::Result<Counts> {
    let released = read_released::<3>(&args.released)?;
    let source = named.of_dimension::<3>()?;
    let of_map = |error| FileError::core(&args.released, error);
    source.supports(&released).map_err(|error| {
        let error = Error::from(of_map(error));
        match (source.needs(), released.descriptors()) {
            (SourceNeeds::Nothing, _) => error,
            (_, Some(_)) => {
                error.advise("--neighbors similarity, which takes descriptors of any kind")
            }
            (_, None) => error.advise(
                "--neighbors geometric, or hide the map with unlift obfuscate --descriptors FILE",
            ),
        }
    })?;
    source.note(released.n_slots()).iter().for_each(output::note);
    let lists = source.lists(&released, source.k(&released), args.seed).map_err(of_map)?;
    write_lists(args, rules, &lists)
}

fn map_by_oracle(
    args: &NeighborsArgs,
    truth: &Path,
    ratio: f64,
    rules: &Rules,
) -> crate::Result<Counts> {
    let (original, secret) = read_truth::<3>(truth)?;
    let released = read_released::<3>(&args.released)?;
    expect_truth(&args.released, &released, truth, &secret)?;
    let how = (args.oracle_noise, ratio, usize::from(args.k.unwrap_or(K)));
    let lists = oracle_lists(&original, &(released, secret), how, args.seed);
    write_lists(args, rules, &lists.map_err(|error| FileError::core(truth, error))?)
}

fn images_by_source(args: &NeighborsArgs, named: &Named, rules: &Rules) -> crate::Result<Counts> {
    let Ok(source) = named.of_dimension::<2>() else {
        bail!("--neighbors {}: expected with a map, found images", named.name());
    };
    let mut images = ImageFile::open(&args.released, Stage::Released)?;
    let work = |rows: ImageRows<'_>| {
        let name = rows.name().to_owned();
        let image = rows.released()?;
        let lists = of_what_there_is(&*source, &image, args.seed);
        let lists = lists.map_err(of_image(&args.released, &name))?;
        Ok(Some((name, lists)))
    };
    let next = || Ok(images.next_image()?);
    write((&args.out, rules), Stage::Neighborhoods, next, work, add_lists)
}

fn images_by_oracle(
    args: &NeighborsArgs,
    truth: &Path,
    ratio: f64,
    rules: &Rules,
) -> crate::Result<Counts> {
    let next = pairs(truth, Some(&args.released))?;
    let how = (args.oracle_noise, ratio, usize::from(args.k.unwrap_or(K)));
    let work = |Pair { name, original, secret, released }: Pair| {
        let Some(released) = released else { return Ok(None) };
        let seed = oracle_seed(args.seed, &name);
        let lists = oracle_lists(&original, &(released, secret), how, seed);
        let lists = lists.map_err(of_image(truth, &name))?;
        Ok(Some((name, lists)))
    };
    write((&args.out, rules), Stage::Neighborhoods, next, work, add_lists)
}

pub fn recover(args: &RecoverArgs) -> crate::Result<()> {
    let rules = Rules::new([args.released.as_path(), &args.neighbors], false);
    let kind = Kind::Stage(Stage::Recovered);
    check_file("--out", &args.out, kind, &rules)?;
    let alive = Progress::uncounted(false, "recovering");
    let what = if has_images(&args.released)? {
        let Counts { points, slots, images, .. } = recover_images(args, &rules, &alive)?;
        format!("{points} of {slots} keypoints of {images} images have a position")
    } else {
        let released = read_released::<3>(&args.released)?;
        let (records, slots) = (released.n_records(), released.slots_per_record());
        let lists = read_neighborhoods(&args.neighbors, records, slots)?;
        check_lists(args, &released, &lists, &mut HashSet::new(), &alive)?;
        let recovered = recovered(args, &released, &lists)
            .map_err(|error| FileError::core(&args.released, error))?;
        check_file("--out", &args.out, kind, &rules)?;
        write_recovered(&args.out, &recovered)?;
        let (n, slots) = (n_recovered(&recovered), recovered.n_slots());
        let (delta, unit) = (recovered.delta(), recovered.unit().name());
        format!("{n} of {slots} points have a position, with delta {delta:.4} {unit}")
    };
    drop(alive);
    print(&format!("{what}, in {}\n", OneLine(args.out.display())))
}

fn recovered<const D: usize>(
    args: &RecoverArgs,
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Result<Recovered<D>, unlift::Error> {
    let options = RecoverOptions { seed: args.seed, ..RecoverOptions::default() };
    solve(released, lists, &args.solver, &options)
}

fn n_recovered<const D: usize>(recovered: &Recovered<D>) -> usize {
    recovered.status().iter().filter(|&&status| status == Status::Ok).count()
}

fn recover_images(args: &RecoverArgs, rules: &Rules, alive: &Progress) -> crate::Result<Counts> {
    let mut images = ImageFile::open(&args.released, Stage::Released)?;
    let mut lists = ImageFile::open(&args.neighbors, Stage::Neighborhoods)?;
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
        check_lists(args, &image, &lists, &mut printed, alive)?;
        Ok(Some((name, image, lists)))
    };
    let work = |(name, image, lists): (String, Released<2>, Neighborhoods)| {
        let recovered = recovered(args, &image, &lists);
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

/// Checks that `lists` are of `released`, and prints notes on lists that another program wrote. A note that is in `printed` differs at
/// most in its numbers from an earlier one, and is not repeated.
fn check_lists<const D: usize>(
    args: &RecoverArgs,
    released: &Released<D>,
    lists: &Neighborhoods,
    printed: &mut HashSet<String>,
    alive: &Progress,
) -> crate::Result<()> {
    let About { map, order, .. } = lists.about();
    same_map(&args.neighbors, map, &args.released, Some(released.fingerprint()))?;
    let mut note = |numbers: String, note: &str| {
        if printed.insert(note.to_owned()) {
            alive.say(&format!("note: {}: {numbers}{note}", args.neighbors.display()));
        }
    };
    let n = lists.n_slots();
    let empty = (0..n).filter(|&slot| lists.of(slot).is_empty()).count();
    if empty > 0 {
        let numbers = format!("{empty} of {n} ");
        note(numbers, "lists are empty: solvers that read lists recover nothing there");
    }
    if map.is_none() {
        note(String::new(), "does not name its released map; assumed to be this one");
    }
    if order == RowOrder::Unstated && released.slots_per_record() > 1 {
        let names = RowOrder::STATED.map(|order| order.name().unwrap_or_default()).join(", ");
        let text = format!(
            "does not state what its rows are counted by (metadata rows_by: {names}): figures of what is recovered \
             will be upper bounds"
        );
        note(String::new(), &text);
    }
    Ok(())
}

struct Evaluated {
    row: Row,
    /// Without a fingerprint if any image lacks that of its released image.
    about: About,
    slots_per_record: usize,
    checked: Checked,
}

pub fn evaluate(args: &EvaluateArgs) -> crate::Result<()> {
    // The released map beside the truth, for the blind baseline.
    let released = Some(args.truth.with_file_name(RELEASED)).filter(|path| path.exists());
    let released = released.as_deref();
    let Evaluated { row, about, slots_per_record, checked } = match has_images(&args.truth)? {
        true => evaluate_images(args, released)?,
        false => evaluate_map(args, released)?,
    };
    let mut notes = Vec::new();
    if about.map.is_none() {
        notes.push("does not name its released map; assumed to be that of the truth".to_owned());
    }
    if about.order == RowOrder::Unstated && slots_per_record > 1 {
        let note = "does not state what its rows are counted by: each position is compared with the nearer point of its \
                    record, so the figures are upper bounds";
        notes.push(note.to_owned());
    }
    notes.extend(checked.notes(&thresholds(args, row.unit), row.unit).map_err(|error| {
        let error = Error::from(FileError::core(&args.recovered, error));
        if released.is_some() {
            return error;
        }
        error.advise(format!(
            "put {RELEASED} beside the truth: records identify a map better than points"
        ))
    })?);
    notes.extend(exchanged(&row));
    for note in &notes {
        output::note(format_args!("{}: {note}", args.recovered.display()));
    }
    print(&match args.json {
        true => format!("{:#}\n", unlift_audit::evaluated(&row, &notes)?),
        false => as_table(&row),
    })
}

/// Returns the requested thresholds, by default those of an audit in `unit`.
fn thresholds(args: &EvaluateArgs, unit: Unit) -> Vec<Threshold> {
    match args.thresholds.as_slice() {
        [] => Plan::<3>::new(unit).thresholds,
        given => given.to_vec(),
    }
}

fn evaluate_map(args: &EvaluateArgs, released: Option<&Path>) -> crate::Result<Evaluated> {
    let (original, secret) = read_truth::<3>(&args.truth)?;
    let unit = original.reveal().unit();
    let thresholds = thresholds(args, unit);
    let recovered = read_recovered::<3>(&args.recovered, Some(unit))?;
    let about = recovered.about();
    same_map(&args.recovered, about.map, &args.truth, secret.map())?;
    let released = released.map(|path| {
        let released = read_released::<3>(path)?;
        expect_truth(path, &released, &args.truth, &secret)?;
        Ok::<_, FileError>(released)
    });
    let released = released.transpose()?;
    let mut checked = Checked::default();
    let added = checked.add(&recovered, &original, &secret, released.as_ref());
    added.map_err(|error| FileError::core(&args.truth, error))?;
    let baseline = released.map(|released| blind(&released, &original, &secret));
    let (row, _) = measure(&recovered, &original, &secret, baseline.as_ref(), &thresholds)
        .map_err(|error| FileError::core(&args.recovered, error))?;
    Ok(Evaluated { row, about, slots_per_record: secret.slots_per_record(), checked })
}

fn evaluate_images(args: &EvaluateArgs, released: Option<&Path>) -> crate::Result<Evaluated> {
    let thresholds = thresholds(args, Unit::Pixel);
    let mut next = pairs(&args.truth, released)?;
    let mut file = ImageFile::open(&args.recovered, Stage::Recovered)?;
    let (mut pooled, mut checked) = (Pooled::new(&thresholds), Checked::default());
    let mut about: Option<About> = None;
    while let Some(Pair { name, original, secret, released }) = next()? {
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
    let none = || FileError::new(&args.truth, "", "images with hidden points", "none");
    let row = pooled.row().ok_or_else(none)?;
    Ok(Evaluated { row, about: about.unwrap_or_default(), slots_per_record: 1, checked })
}

/// An image with its truth.
struct Pair {
    name: String,
    original: Original<2>,
    secret: Secret,
    /// `None` if no record was released, or there is no released file.
    released: Option<Released<2>>,
}

/// Returns a function that reads the next image of a truth file and of the released file.
fn pairs<'a>(
    truth: &'a Path,
    released: Option<&'a Path>,
) -> crate::Result<impl FnMut() -> crate::Result<Option<Pair>>> {
    let mut images = ImageFile::open(truth, Stage::Truth)?;
    let open = |path| Ok::<_, FileError>((path, ImageFile::open(path, Stage::Released)?));
    let mut released = released.map(open).transpose()?;
    Ok(move || {
        let Some(rows) = images.next_image()? else {
            if let Some((_, released)) = &mut released {
                released.expect_end(truth)?;
            }
            return Ok(None);
        };
        let name = rows.name().to_owned();
        let (original, secret) = rows.truth()?;
        let released = match &mut released {
            Some((path, released)) if secret.n_slots() > 0 => {
                let image = released.expect(&name, truth)?.released()?;
                expect_truth(path, &image, truth, &secret)?;
                Some(image)
            }
            _ => None,
        };
        Ok(Some(Pair { name, original, secret, released }))
    })
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
