//! A folder of photos as a source of features.

use std::path::Path;

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift_io::Error;
use unlift_io::features::{ImageFeatures, Photos, round_to_half};
use unlift_vision::features::photo::Turn;
use unlift_vision::features::{Extraction, Extractor, Photo};

use super::{FeatureSource, Origin};

/// Opens the photos in `root` and its subfolders.
pub(super) fn open(root: &Path, extraction: &Extraction) -> Result<FeatureSource, crate::Error> {
    let extractor = Extractor::try_new(extraction)?;
    let mut listing = Photos::list(root);
    // "12 .heic, 1 .tiff".
    let others = listing.others.iter().map(|(ending, n)| format!("{n} .{ending}"));
    let others = others.collect::<Vec<_>>().join(", ");
    if listing.photos.is_empty() {
        return Err(match listing.refused.pop() {
            Some(refused) => refused,
            None => {
                let found = if others.is_empty() { "none" } else { &format!("only {others}") };
                Error::new(root, "", "JPEG, PNG or WebP photos", found)
            }
        }
        .into());
    }
    let root = root.display();
    let passed_over = format!("{root}: passed over {others}: only JPEG, PNG and WebP are read");
    let passed_over = (!others.is_empty()).then_some(passed_over);
    let (names, paths) = listing.photos.into_iter().unzip();
    let from = Origin::Photos { paths, extractor, kind: extraction.kind };
    let refused = listing.refused.iter().map(ToString::to_string).collect();
    Ok(FeatureSource { names, refused, passed_over, turn: Turn::Upright, from })
}

/// Converts extracted features to those of files.
pub(super) fn features_of(mut photo: Photo) -> ImageFeatures {
    if let Values::F32(values) = &mut photo.descriptors {
        round_to_half(values);
    }
    ImageFeatures {
        keypoints: photo.keypoints.into_iter().map(|place| place.map(f64::from)).collect(),
        orientations_deg: photo.orientations_deg,
        scores: Some(photo.scores),
        scales: photo.scales,
        // Descriptors that are all equal are rejected; such an image has none.
        descriptors: Descriptors::try_new(photo.descriptors, photo.dim).ok(),
        size: Some(photo.size.map(|side| side as u32)),
        uncertainty_px: Some(photo.noise_px),
        ..ImageFeatures::default()
    }
}
