//! The stages for files of many images, with only a few images in memory at a time.

use std::cell::RefCell;
use std::path::Path;

use rayon::prelude::*;
use unlift::audit::staged::{Pooled, key_of, oracle_lists, oracle_seed};
use unlift::audit::{Row, Threshold};
use unlift::neighbors::{Needs as SourceNeeds, Neighborhoods, Source, of_what_there_is};
use unlift::obfuscate::{SchemeOptions, obfuscate};
use unlift::recover::{Builtin, RecoverOptions, Recovered, Status, recover};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::{Original, Secret};
use unlift::{About, Unit};
use unlift_io::Error;
use unlift_io::atomic::{Access, OutputFile};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_io::stage::{ImageFile, ImageRows, ImageWriter, Kind as Stage};
use unlift_vision::features::Extraction;

use super::common::{RELEASED, TRUTH};
use crate::args::{EvaluateArgs, NeighborsArgs, ObfuscateArgs};
use crate::progress::Stderr;
use unlift_audit::Checked;
use unlift_audit::Progress as _;
use unlift_audit::images::FeatureSource;
use unlift_audit::images::stream::{Needs, Stream, Tally};
use unlift_audit::released::{expect_slots, same_map};

/// Images in memory per thread.
const AT_WORK: usize = 2;

/// Counts over the images of a stage.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub images: usize,
    /// Number of hidden points, or of lists.
    pub slots: usize,
    pub longest: usize,
    /// Number of points that were left out, or recovered.
    pub points: usize,
    pub unusable: usize,
}

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

/// Hides the keypoints of all images of `args.path` and writes both files into `out`.
pub fn hide(args: &ObfuscateArgs, key: &Key, out: &mut OutputSet) -> crate::Result<Counts> {
    let scheme = args.scheme.of_dimension::<2>(&SchemeOptions::usual(Unit::Pixel));
    let scheme = scheme.ok_or_else(|| unlift_audit::Error::failed("not a scheme for images"))?;
    let source = FeatureSource::open(&args.path, &Extraction::default())?;
    let tally = RefCell::new(Tally::default());
    for error in source.refused() {
        tally.borrow_mut().unusable += 1;
        Stderr.say(&error.to_string());
    }
    let all: Vec<usize> = (0..source.names.len()).collect();
    let mut images =
        Stream::new((&source, &args.path), &all, Needs::whatever_there_is(), &tally, &Stderr);
    let staged = |out: &mut OutputSet, name, kind, access| {
        let path = out.stage(name, Kind::Stage(kind))?;
        OutputFile::create(&path, access)
    };
    let mut truth = staged(out, TRUTH, Stage::Truth, Access::Private)?;
    let mut released = staged(out, RELEASED, Stage::Released, Access::Usual)?;
    let mut truths = ImageWriter::start(&mut truth);
    let mut maps = ImageWriter::start(&mut released);
    let mut counts = Counts::default();
    each(
        || images.next().transpose(),
        |image| {
            let key = key_of(key, &image.name);
            let descriptors = image.descriptors.as_ref();
            let hidden = obfuscate(&*scheme, &image.original, descriptors, &key);
            let of_image = |error: unlift::Error| {
                Error::core(&args.path, error.within(&format!("image {}", image.name)))
            };
            let (released, secret) = hidden.map_err(of_image)?;
            Ok((image.name, image.original, released, secret))
        },
        |(name, original, released, secret)| {
            counts.images += 1;
            counts.slots += released.n_slots();
            counts.points += secret.dropped().len();
            truths.truth(&name, &original, &secret)?;
            Ok(maps.released(&name, &released)?)
        },
    )?;
    counts.unusable = tally.borrow().unusable;
    truths.finish()?;
    maps.finish()?;
    truth.commit()?;
    released.commit()?;
    Ok(counts)
}

/// What the oracle needs.
pub struct Oracle<'a> {
    pub truth: &'a Path,
    pub inlier_ratio: f64,
    pub k: usize,
}

/// Writes the oracle's lists for all images to `args.out`, if `rules` allow it.
pub fn list_by_oracle(
    args: &NeighborsArgs,
    oracle: &Oracle<'_>,
    rules: &Rules,
) -> crate::Result<Counts> {
    let mut pairs = Pairs::open(oracle.truth, Some(&args.released))?;
    let how = (args.oracle_noise, oracle.inlier_ratio, oracle.k);
    let work = |pair: Pair| {
        let Pair { name, original, secret, released } = pair;
        let Some(released) = released else { return Ok(None) };
        let seed = oracle_seed(args.seed, &name);
        let lists = oracle_lists(&original, &(released, secret), how, seed);
        let of_image = |error: unlift::Error| {
            Error::core(oracle.truth, error.within(&format!("image {name}")))
        };
        let lists = lists.map_err(of_image)?;
        Ok(Some((name, lists)))
    };
    write((&args.out, rules), Stage::Neighborhoods, || pairs.next(), work, list)
}

/// Writes a source's lists for all images of `released` to `out`.
pub fn list_by_source(
    released: &Path,
    source: &dyn Source<2>,
    seed: u64,
    out: (&Path, &Rules),
) -> crate::Result<Counts> {
    let mut images = ImageFile::open(released, Stage::Released)?;
    let work = |rows: ImageRows<'_>| {
        let name = rows.name().to_owned();
        let image = rows.released()?;
        let of_image =
            |error: unlift::Error| Error::core(released, error.within(&format!("image {name}")));
        if image.descriptors().is_none() && source.needs() == SourceNeeds::Descriptors {
            let what = format!("descriptors for {}", source.name());
            return Err(of_image(unlift::Error::new(what, "some", "none")).into());
        }
        if let Some(descriptors) = image.descriptors() {
            source.takes(descriptors).map_err(of_image)?;
        }
        let lists = of_what_there_is(source, &image, seed).map_err(of_image)?;
        Ok(Some((name, lists)))
    };
    write(out, Stage::Neighborhoods, || Ok(images.next_image()?), work, list)
}

/// Recovers all images of `released` with the lists in `neighbors` and writes them to `out`. Calls
/// `note` with the lists of each.
pub fn recover_all(
    (released, neighbors): (&Path, &Path),
    (solver, options): (Builtin, &RecoverOptions),
    out: (&Path, &Rules),
    mut note: impl FnMut(&Neighborhoods, usize),
) -> crate::Result<Counts> {
    let mut images = ImageFile::open(released, Stage::Released)?;
    let mut lists = ImageFile::open(neighbors, Stage::Neighborhoods)?;
    let next = || {
        let Some(rows) = images.next_image()? else {
            lists.expect_end(released)?;
            return Ok(None);
        };
        let name = rows.name().to_owned();
        let image = rows.released()?;
        let (records, slots) = (image.n_records(), image.slots_per_record());
        let of_image = lists.expect(&name, released)?.neighborhoods(records, slots)?;
        same_map(neighbors, of_image.about().map, released, Some(image.fingerprint()))?;
        note(&of_image, slots);
        Ok(Some((name, image, of_image)))
    };
    let work = |(name, image, lists): (String, Released<2>, Neighborhoods)| {
        let recovered = recover(&image, &lists, &solver, options);
        let recovered = recovered
            .map_err(|error| Error::core(released, error.within(&format!("image {name}"))))?;
        Ok(Some((name, recovered)))
    };
    write(out, Stage::Recovered, next, work, |writer, counts, name, recovered: &Recovered<2>| {
        counts.slots += recovered.n_slots();
        counts.points += recovered.status().iter().filter(|&&s| s == Status::Ok).count();
        writer.recovered(name, recovered)
    })
}

pub struct Evaluated {
    pub row: Row,
    /// Without a fingerprint if any image lacks that of its released image.
    pub about: About,
    /// Checks that the compared files belong together.
    pub checked: Checked,
}

/// Computes the row over all images of `args.recovered`.
pub fn evaluate_all(
    args: &EvaluateArgs,
    released: Option<&Path>,
    thresholds: &[Threshold],
) -> crate::Result<Evaluated> {
    let mut pairs = Pairs::open(&args.truth, released)?;
    let mut recovered_file = ImageFile::open(&args.recovered, Stage::Recovered)?;
    let mut pooled = Pooled::new(thresholds);
    let (mut about, mut checked) = (None, Checked::default());
    while let Some(pair) = pairs.next()? {
        let Pair { name, original, secret, released } = pair;
        if secret.n_slots() == 0 {
            pooled.add_unreleased(&secret);
            continue;
        }
        let recovered = recovered_file.expect(&name, &args.truth)?.recovered()?;
        same_map(&args.recovered, recovered.about().map, &args.truth, secret.map())?;
        let added = pooled.add(&recovered, &original, &secret, released.as_ref());
        let of_image = |error: unlift::Error| {
            Error::core(&args.recovered, error.within(&format!("image {name}")))
        };
        added.map_err(of_image)?;
        checked
            .add(&recovered, &original, &secret, released.as_ref())
            .map_err(|error| Error::core(&args.truth, error.within(&format!("image {name}"))))?;
        // One image without a fingerprint suffices for a note.
        if about.is_none_or(|about: About| about.map.is_some()) {
            about = Some(recovered.about());
        }
    }
    recovered_file.expect_end(&args.truth)?;
    let row = pooled.row();
    let row =
        row.ok_or_else(|| Error::new(&args.truth, "", "images with hidden points", "none"))?;
    Ok(Evaluated { row, about: about.unwrap_or_default(), checked })
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

fn list(
    writer: &mut ImageWriter<'_>,
    counts: &mut Counts,
    name: &str,
    lists: &Neighborhoods,
) -> Result<(), Error> {
    counts.slots += lists.n_slots();
    counts.longest = counts.longest.max(lists.longest());
    writer.neighborhoods(name, lists)
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
