//! `unlift features`: writes the keypoints and descriptors of images to one file.

use unlift::OneLine;
use unlift_audit::images::{FeatureSource, Wanted};
use unlift_audit::{Progress as _, bail, check_file};
use unlift_io::features::{FeatureWriter, ImageFeatures};
use unlift_io::outputs::{Kind, Rules};
use unlift_vision::features::in_order;
use unlift_vision::features::photo::Turn;

use super::common::all_could_be;
use crate::args::FeaturesArgs;
use crate::output::print;
use crate::progress::Progress;

pub fn run(args: &FeaturesArgs) -> crate::Result<()> {
    let rules = Rules::new([args.images.as_path()], false);
    check_file("--out", &args.out, Kind::Features, &rules)?;
    if args.as_stored && args.images.is_file() {
        bail!("--as-stored: expected with a folder of photos, found a file");
    }
    let wanted = Wanted { max_image_size: args.max_image_size, ..args.extraction.wanted() };
    let extraction = wanted.extraction(&args.images)?;
    let turn = if args.as_stored { Turn::AsStored } else { Turn::Upright };
    let source = FeatureSource::open(&args.images, &extraction)?.with_turn(turn);
    let progress = Progress::new(args.quiet);
    source.passed_over.iter().for_each(|note| progress.note(note));
    source.refused.iter().for_each(|line| progress.say(line));
    let (mut n_images, mut n_features, mut n_failed) = (0, 0, source.refused.len());
    let names = &source.names;
    let all: Vec<usize> = (0..names.len()).collect();
    let mut writer = FeatureWriter::create(&args.out)?;
    let read = |&at: &usize| -> crate::Result<ImageFeatures> {
        let image = source.get(at)?;
        // A photo without features is no error.
        if source.is_file() {
            image.described(&args.images)?;
        }
        Ok(image)
    };
    progress.show(0, names.len(), "reading images");
    in_order(&all, read, |at, result| -> crate::Result<()> {
        progress.show(at + 1, names.len(), &names[at]);
        match result.and_then(|image| Ok(writer.check(&image).map(|()| image)?)) {
            Ok(image) => {
                writer.append(&image)?;
                n_images += 1;
                n_features += image.keypoints.len();
            }
            Err(error) => {
                n_failed += 1;
                progress.say(&error.to_string());
            }
        }
        Ok(())
    })?;
    if n_images > 0 {
        rules.check(&args.out, Kind::Features)?;
        writer.finish()?;
        drop(progress);
        let out = OneLine(args.out.display());
        print(&format!("{n_images} images, {n_features} features, in {out}\n"))?;
    }
    all_could_be("used", &args.images, n_images, n_failed)
}
