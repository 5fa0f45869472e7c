//! Inlier ratios of `learned` on a photo outside the training data.

use std::path::Path;

use unlift::descriptors::Values;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::oracle::{self, TrueNeighbors};
use unlift::neighbors::{Overlap, Similarity, Source};
use unlift::obfuscate::lines2d::Lines2d;
use unlift::obfuscate::obfuscate;
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{Descriptors, PointSet, Unit};
use unlift_vision::features::{AlikedOptions, Extraction, Extractor, Found};
use unlift_vision::network::Learned;

const K: usize = 20;

/// Returns the inlier ratio among the first K entries of every list, by `learned` and by `other`;
/// `None` without the photo.
fn ratios(extraction: &Extraction, other: &dyn Source<2>) -> Option<[f64; 2]> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let photo = shared.join("data/redkitchen/images/frame-000500.color.jpg");
    if !photo.is_file() {
        eprintln!("{} is not here: skipped", photo.display());
        return None;
    }
    let photo = Extractor::try_new(extraction).unwrap().read(&photo).unwrap();
    let (places, values, dim) = match photo.found {
        Found::Sift(found) => {
            let places: Vec<_> = found.keypoints.iter().map(|k| [k.x - 0.5, k.y - 0.5]).collect();
            (places, Values::U8(found.descriptors.concat()), 128)
        }
        Found::Learned(found) => (found.keypoints, Values::F32(found.descriptors), found.dim),
    };
    let points = places.iter().map(|place| place.map(f64::from)).collect();
    let points = PointSet::try_new(points, Unit::Pixel).unwrap();
    let high = photo.size.map(|side| side as f64 - 0.5);
    let original = Original::within(points, Bounds::try_new([-0.5; 2], high).unwrap()).unwrap();
    let descriptors = Descriptors::try_new(values, dim).unwrap();
    let key = Key::from_seed(1);
    let (released, secret) = obfuscate(&Lines2d, &original, Some(&descriptors), &key).unwrap();
    let search = oracle::search(&original).unwrap();
    let near = TrueNeighbors::new(&search, &secret, 1, K).unwrap();
    let ratio = |source: &dyn Source<2>| {
        near.measured_inlier_ratio(&source.lists(&released, K, 0).unwrap())
    };
    Some([ratio(&Learned::default()), ratio(other)])
}

#[test]
fn the_network_names_more_neighbors_than_patches_and_likeness_do() {
    let aliked = Extraction::Aliked(AlikedOptions { min_score: 0.02, ..Default::default() });
    let kinds: [(_, &dyn Source<2>, f64); 2] =
        [(Extraction::default(), &Overlap, 0.03), (aliked, &Similarity, 0.2)];
    for (extraction, other, more) in kinds {
        let Some([learned, others]) = ratios(&extraction, other) else { return };
        assert!(learned > others + more, "learned {learned:.3}, {} {others:.3}", other.name());
    }
}
