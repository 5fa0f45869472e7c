//! `unlift features`: writes the keypoints and descriptors of images to one file.

use std::path::{Path, PathBuf};

use unlift::OneLine;
use unlift_io::Error;
use unlift_io::atomic::{Kind, Rules};
use unlift_io::features::{FeatureWriter, ImageFeatures};
use unlift_vision::features::Extraction;
use unlift_vision::features::in_order;
use unlift_vision::features::photo::Turn;

use super::common::{all_could_be, with_threads};
use crate::args::FeaturesArgs;
use crate::exit::{Outcome, line, usage};
use crate::output::print;
use crate::progress::Progress;
use unlift_audit::images::extraction::Wanted;
use unlift_audit::images::parts::Parts;
use unlift_audit::images::{FeatureSource, Folder, is_photo};
use unlift_audit::{check_file, refused};

#[derive(Default)]
struct Tally {
    images: usize,
    features: usize,
    resumed: usize,
    failed: usize,
}

pub fn run(args: &FeaturesArgs) -> anyhow::Result<Outcome> {
    let rules = Rules::new([args.images.as_path()], args.force);
    let target = check_file(&args.out, Kind::Features, &rules)?;
    check_no_photo(&args.images, &target)?;
    let extraction = extraction(args)?;
    let tally = with_threads(args.threads, || {
        let turn = if args.as_stored { Turn::AsStored } else { Turn::Upright };
        let source = FeatureSource::open(&args.images, &extraction)?.with_turn(turn);
        let mut progress = Progress::new(args.quiet);
        let mut tally = Tally::default();
        if let Some(note) = source.passed_over() {
            progress.say(&format!("unlift: note: {note}"));
        }
        for error in source.refused() {
            tally.failed += 1;
            progress.say(&line(&anyhow::anyhow!("{error}")));
        }
        match &source {
            FeatureSource::Folder(folder) => {
                extract(folder, (args, &rules, &target), &mut tally, &mut progress)?;
            }
            _ => copy(&source, (args, &rules), &mut tally, &mut progress)?,
        }
        Ok(tally)
    })?;
    if tally.images > 0 {
        let resumed = match tally.resumed {
            0 => String::new(),
            n => format!(" ({n} images of an earlier run)"),
        };
        let (images, features) = (tally.images, tally.features);
        let out = OneLine(args.out.display());
        print(&format!("{images} images, {features} features{resumed}, in {out}\n"))?;
    }
    all_could_be("used", &args.images, tally.images, tally.failed)
}

/// Refuses an output file that the next run would read as a photo.
fn check_no_photo(images: &Path, target: &Path) -> anyhow::Result<()> {
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let (Ok(images), Ok(folder)) = (images.canonicalize(), folder.canonicalize()) else {
        return Ok(());
    };
    if folder.starts_with(images) && is_photo(target) {
        let expected = "expected a name that is not read as a photo";
        return Err(usage(format!("--out: {}: {expected}", target.display())));
    }
    Ok(())
}

fn extraction(args: &FeaturesArgs) -> anyhow::Result<Extraction> {
    let wanted = Wanted {
        option: "--type",
        kind: args.kind,
        max_features: args.max_features,
        min_score: args.min_score,
        max_image_size: args.max_image_size,
        first_octave: args.first_octave,
    };
    if args.as_stored && args.images.is_file() {
        return Err(usage("--as-stored: expected with a folder of photos, found a file"));
    }
    Ok(wanted.extraction(&args.images)?)
}

/// The part of one photo, written in this run or in an earlier one.
enum Done {
    Now(PathBuf),
    Earlier(PathBuf),
}

/// Extracts the features of each photo into a part, then joins the parts into the file.
fn extract(
    folder: &Folder,
    (args, rules, target): (&FeaturesArgs, &Rules, &Path),
    tally: &mut Tally,
    progress: &mut Progress,
) -> anyhow::Result<()> {
    let parts = Parts::open(target, folder).map_err(refused)?;
    let names = folder.names();
    let all: Vec<usize> = (0..names.len()).collect();
    let extract = |at: usize| -> anyhow::Result<Done> {
        let key = parts.key(&names[at], folder.path(at))?;
        if let Some(part) = parts.earlier(&key) {
            return Ok(Done::Earlier(part));
        }
        Ok(Done::Now(parts.write(&key, &folder.get(at)?).map_err(Fatal)?))
    };
    progress.show(0, names.len(), "reading images");
    let steps = progress.steps();
    // Progress is reported here, because results arrive in batches.
    let one = |&at: &usize| {
        let done = extract(at);
        steps.add(1.0, &names[at]);
        done
    };
    let mut finished = Vec::with_capacity(names.len());
    in_order(&all, one, |at, result| {
        match result {
            Ok(Done::Now(part)) => finished.push((&names[at][..], part)),
            Ok(Done::Earlier(part)) => {
                tally.resumed += 1;
                finished.push((&names[at][..], part));
            }
            // A full disk concerns all photos.
            Err(error) if error.is::<Fatal>() => return Err(error),
            Err(error) => {
                tally.failed += 1;
                progress.say(&line(&error));
            }
        }
        Ok(())
    })?;
    if finished.is_empty() {
        parts.remove();
        return Ok(());
    }
    // Check again, because another program may have written a file here.
    check_file(&args.out, Kind::Features, rules)?;
    tally.images = finished.len();
    // Joining is much faster and needs its own estimate.
    let joining = progress.again();
    parts.join(&finished, |at, image| {
        tally.features += image.keypoints.len();
        joining.show(at + 1, finished.len(), "joining");
    })?;
    Ok(())
}

/// An error that ends the run.
#[derive(Debug)]
struct Fatal(Error);

impl std::fmt::Display for Fatal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Fatal {}

fn copy(
    source: &FeatureSource,
    (args, rules): (&FeaturesArgs, &Rules),
    tally: &mut Tally,
    progress: &mut Progress,
) -> anyhow::Result<()> {
    let names = source.names();
    let all: Vec<usize> = (0..names.len()).collect();
    let mut writer = FeatureWriter::create(&args.out)?;
    let one = |&at: &usize| -> anyhow::Result<ImageFeatures> {
        let image = source.get(at)?;
        image.described(&args.images)?;
        Ok(image)
    };
    progress.show(0, names.len(), "reading images");
    in_order(&all, one, |at, result| -> anyhow::Result<()> {
        progress.show(at + 1, names.len(), &names[at]);
        let usable = result.and_then(|image| {
            writer.check(&image)?;
            Ok(image)
        });
        match usable {
            Ok(image) => {
                writer.append(&image)?;
                tally.images += 1;
                tally.features += image.keypoints.len();
            }
            Err(error) => {
                tally.failed += 1;
                progress.say(&line(&error));
            }
        }
        Ok(())
    })?;
    if tally.images > 0 {
        check_file(&args.out, Kind::Features, rules)?;
        writer.finish()?;
    }
    Ok(())
}
