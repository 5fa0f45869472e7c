//! Images in memory: number of requests, keypoints at the edge, and error lines.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use unlift::Unit;
use unlift::audit::Plan;
use unlift::recover::Builtin;
use unlift_audit::images::{FeatureSource, Opened};
use unlift_audit::{Audit, Audited, Error, Images, Input, Output, Quiet};
use unlift_io::features::ImageFeatures;

const NAMES: [&str; 5] = ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "e.jpg"];

/// Keypoints on a slanted grid.
fn image(at: usize) -> ImageFeatures {
    let place = |i: usize| [(31 * i % 600) as f64 + 0.25 * at as f64, (17 * i % 440) as f64];
    ImageFeatures {
        name: NAMES[at].to_owned(),
        size: Some([640, 480]),
        keypoints: (0..60 + 10 * at).map(place).collect(),
        ..ImageFeatures::default()
    }
}

/// Audits the five images, each as `get` returns it.
fn audit(
    get: impl Fn(ImageFeatures) -> Result<ImageFeatures, Error> + Send + Sync + 'static,
) -> Result<Audited, Error> {
    let names = NAMES.map(str::to_owned).to_vec();
    let source = FeatureSource::in_memory(names, move |at| get(image(at))).expect("images");
    let opened = Opened::of(source, Path::new("images"), None);
    let plan = Plan {
        inlier_ratios: vec![0.5],
        k: 10,
        solvers: vec![Arc::new(Builtin::Consensus)],
        ..Plan::new(Unit::Pixel)
    };
    let input = Images { opened: &opened, plan, draws: true, photos: None, inversion: None };
    Audit::new(Output::new(Path::new(""))).run(&Input::Images(input), &Quiet)
}

#[test]
fn every_image_is_requested_once_and_three_again_for_pictures() {
    let asked = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&asked);
    let audited = audit(move |image| {
        counted.fetch_add(1, Ordering::Relaxed);
        Ok(image)
    })
    .expect("an audit");
    assert_eq!(asked.load(Ordering::Relaxed), NAMES.len() + 3);
    let images = audited.document.input.images.as_ref().expect("images");
    assert_eq!((images.used, images.unusable), (NAMES.len() as u64, 0));
    let pictures =
        |safe| audited.page(safe).expect("a page").matches("id=\"picture-graph\"").count();
    assert!(pictures(false) > 0 && pictures(true) == 0);
}

#[test]
fn keypoints_that_halves_rounded_out_of_the_image_are_moved_to_its_edge() {
    let with = |x: f64| {
        audit(move |mut image| {
            image.keypoints[7][0] = x;
            Ok(image)
        })
    };
    let note =
        "5 keypoints were at most a pixel outside of their images, and are moved to the edge";
    assert_eq!(with(640.4).expect("an audit").document.notes, [note]);
    let outside = with(641.0).expect_err("an error").to_string();
    assert!(outside.starts_with("images: image a.jpg") && outside.contains("641"), "{outside}");
}

#[test]
fn a_mistake_in_memory_ends_the_audit_in_a_line() {
    let unknown = audit(|image| Ok(ImageFeatures { size: None, ..image }));
    let line = "images: image a.jpg: expected a size in pixels, found none";
    assert_eq!(unknown.expect_err("an error").to_string(), line);
    let gone = audit(|_| Err(Error::request("images: gone"))).expect_err("an error");
    assert!(gone.is_request && gone.to_string() == "images: gone");
}
