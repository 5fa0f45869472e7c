//! Images in memory: same figures as from a file, number of requests, and error lines.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use unlift::audit::Plan;
use unlift::descriptors::Values;
use unlift::recover::Builtin;
use unlift::{Descriptors, Unit};
use unlift_audit::images::audit::Images;
use unlift_audit::images::{FeatureSource, Opened};
use unlift_audit::{Audit, Audited, Error, Input, Output, Quiet};
use unlift_io::features::{FeatureWriter, ImageFeatures};
use unlift_io::outputs::Rules;
use unlift_vision::features::Extraction;

const NAMES: [&str; 5] = ["a.jpg", "b.jpg", "c.jpg", "d.jpg", "e.jpg"];

/// Keypoints on a slanted grid, and bytes that change along it.
fn image(at: usize) -> ImageFeatures {
    let n = 60 + 10 * at;
    let place = |i: usize| [(31 * i % 600) as f64 + 0.25 * at as f64, (17 * i % 440) as f64];
    let bytes = (0..128 * n).map(|i| ((i * i + 7 * at) % 90) as u8).collect();
    ImageFeatures {
        name: NAMES[at].to_owned(),
        size: Some([640, 480]),
        keypoints: (0..n).map(place).collect(),
        descriptors: Some(Descriptors::try_new(Values::U8(bytes), 128).expect("descriptors")),
        ..ImageFeatures::default()
    }
}

fn audit(source: FeatureSource) -> Result<Audited, Error> {
    audit_at(source, Path::new("images"), Path::new("")).map(|(audited, _)| audited)
}

fn audit_at(source: FeatureSource, path: &Path, out: &Path) -> Result<(Audited, Output), Error> {
    let opened = Opened::of(source, path, None);
    let plan = Plan {
        inlier_ratios: vec![0.5],
        k: 10,
        solvers: vec![Arc::new(Builtin::Consensus)],
        ..Plan::new(Unit::Pixel)
    };
    let input = Images { opened: &opened, plan, draws: true, photos: None, inversion: None };
    let output = Output::new(out);
    let audited = Audit::new(Input::Images(input), output.clone()).run(&Quiet)?;
    let images = audited.document.input.images.as_ref().expect("images");
    assert_eq!((images.used, images.unusable), (NAMES.len() as u64, 0));
    Ok((audited, output))
}

fn in_memory(
    get: impl Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync + 'static,
) -> FeatureSource {
    let names = NAMES.map(str::to_owned).to_vec();
    FeatureSource::in_memory(names, get).expect("images")
}

#[test]
fn images_in_memory_have_the_figures_of_a_file() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let path = place.path().join("features.h5");
    let mut writer = FeatureWriter::create(&path).expect("a file");
    (0..NAMES.len()).for_each(|at| writer.append(&image(at)).expect("an image"));
    writer.finish().expect("a file");
    let file = FeatureSource::open(&path, &Extraction::default()).expect("it");
    let (of_file, _) = audit_at(file, &path, Path::new("")).expect("an audit");

    let asked = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&asked);
    let memory = in_memory(move |at| {
        counted.fetch_add(1, Ordering::Relaxed);
        Ok(image(at))
    });
    let out = place.path().join("audit");
    let (of_memory, output) = audit_at(memory, Path::new("images"), &out).expect("an audit");
    assert_eq!(of_memory.document.results, of_file.document.results);
    assert_eq!(of_memory.document.images, of_file.document.images);
    assert!(!of_file.document.results.is_empty());
    let input = |audited: &Audited| audited.document.input.clone();
    assert_eq!(input(&of_memory).path, None);
    assert_ne!(input(&of_memory).sha256, input(&of_file).sha256);
    // Three images are drawn.
    assert_eq!(asked.load(Ordering::Relaxed), NAMES.len() + 3);

    let files = output.open(Rules::new([], false)).expect("a folder");
    let page = fs::read_to_string(of_memory.write(files).expect("files").report).expect("a page");
    let pictures = |page: &str| page.matches("id=\"picture-graph\"").count();
    assert!(pictures(&page) > 0 && pictures(&of_memory.page(false).expect("a page")) > 0);
    assert_eq!(pictures(&of_memory.page(true).expect("a page")), 0);
}

#[test]
fn keypoints_that_halves_rounded_out_of_the_image_are_moved_to_its_edge() {
    let with = |x: f64| {
        in_memory(move |at| {
            let mut image = image(at);
            image.keypoints[7][0] = x;
            Ok(image)
        })
    };
    let document = audit(with(640.4)).expect("an audit").document;
    let note =
        "5 keypoints were at most a pixel outside of their images, and are moved to the edge";
    assert_eq!(document.notes, [note]);
    assert!(audit(with(641.0)).is_err());
}

#[test]
fn a_mistake_in_memory_ends_the_audit_in_a_line() {
    let line = |wrong: fn(ImageFeatures) -> ImageFeatures| {
        let images = in_memory(move |at| Ok(if at == 1 { wrong(image(at)) } else { image(at) }));
        audit(images).expect_err("an error").to_string()
    };
    assert_eq!(
        line(|image| ImageFeatures { size: None, ..image }),
        "images: image b.jpg: expected a size in pixels, found none"
    );
    let outside = line(|mut image| {
        image.keypoints[3] = [700.0, 0.0];
        image
    });
    assert!(outside.starts_with("images: image b.jpg") && outside.contains("700"), "{outside}");
    let images = in_memory(|_| Err(Error::request("images: gone")));
    let gone = audit(images).expect_err("an error");
    assert!(gone.is_request() && gone.to_string() == "images: gone");
}
