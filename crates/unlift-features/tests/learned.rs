//! What the network of neighborhoods is worth on a photo that it never saw.

use std::path::Path;

use unlift::descriptors::Values;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::oracle::{self, TrueNeighbors};
use unlift::neighbors::{Overlap, Source};
use unlift::obfuscate::lines2d::Lines2d;
use unlift::obfuscate::obfuscate;
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{Descriptors, PointSet, Unit};
use unlift_features::{Sift, load};
use unlift_nn::Learned;

const K: usize = 20;

#[test]
fn the_network_names_more_neighbors_than_patches_do() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let photo = shared.join("data/redkitchen/images/frame-000500.color.jpg");
    if !photo.is_file() {
        eprintln!("{} is not here: skipped", photo.display());
        return;
    }
    let image = load::read(&photo).unwrap();
    let features = Sift::default().extract(&image);
    let places = features.keypoints.iter().map(|k| [k.x, k.y].map(|x| f64::from(x) - 0.5));
    let points = PointSet::try_new(places.collect(), Unit::Pixel).unwrap();
    let high = [image.width(), image.height()].map(|side| side as f64 - 0.5);
    let original = Original::within(points, Bounds::try_new([-0.5; 2], high).unwrap()).unwrap();
    let descriptors = Descriptors::try_new(Values::U8(features.descriptors.concat()), 128).unwrap();
    let key = Key::from_seed(1);
    let (released, secret) = obfuscate(&Lines2d, &original, Some(&descriptors), &key).unwrap();
    let search = oracle::search(&original).unwrap();
    let near = TrueNeighbors::new(&search, &secret, 1, K).unwrap();
    let ratio = |source: &dyn Source<2>| {
        near.measured_inlier_ratio(&source.lists(&released, K, 0).unwrap())
    };
    let (learned, overlap) = (ratio(&Learned::default()), ratio(&Overlap));
    eprintln!("learned {learned:.3}, overlap {overlap:.3}");
    assert!(learned > overlap + 0.03, "learned {learned:.3}, overlap {overlap:.3}");
}
