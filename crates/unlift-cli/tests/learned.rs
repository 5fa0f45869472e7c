//! Learned features and the models they need, as a user has them.

mod common;

use std::fs;
use std::process::Command;

use common::Place;
use serde_json::Value;
use unlift::descriptors::Values;
use unlift_io::features::FeatureSource;

/// Made-up photos have faint keypoints.
const FAINT: &str = "--min-score 0.05";

fn photos() -> Place {
    Place::with_photos(&["a.png", "b/c.jpg", "d.webp"])
}

#[test]
fn aliked_of_photos_is_one_file_that_is_the_same_for_any_number_of_threads() {
    let place = photos();
    let line = format!("features photos --type aliked {FAINT}");
    let (stdout, stderr) = place.ends(&format!("{line} --out one.h5 --threads 1"), 0);
    assert!(stdout.starts_with("3 images, ") && stderr.is_empty(), "{stdout}{stderr}");
    place.ends(&format!("{line} --out four.h5 --threads 4"), 0);
    assert_eq!(fs::read(place.path("one.h5")).unwrap(), fs::read(place.path("four.h5")).unwrap());
    place.ends("features one.h5 --out copy.h5", 0);
    assert_eq!(fs::read(place.path("one.h5")).unwrap(), fs::read(place.path("copy.h5")).unwrap());

    let source = FeatureSource::open(&place.path("one.h5")).unwrap();
    assert_eq!(source.names(), ["a.png", "b/c.jpg", "d.webp"]);
    let mut features = 0;
    for at in 0..3 {
        let image = source.get(at).unwrap();
        let n = image.keypoints.len();
        assert!(n > 10, "{n}");
        features += n as u64;
        assert_eq!((image.size, image.uncertainty_px), (Some([128, 96]), Some(1.0)));
        let scores = image.scores.expect("scores");
        assert!(scores.iter().all(|score| (0.0..1.0).contains(score)));
        let descriptors = image.descriptors.expect("descriptors");
        assert_eq!((descriptors.len(), descriptors.dim()), (n, 128));
        let Values::F32(values) = descriptors.values() else { panic!("expected floats") };
        for row in values.chunks_exact(128) {
            let length: f32 = row.iter().map(|value| value * value).sum();
            assert!((length - 1.0).abs() < 1e-2, "half floats, so nearly of length 1: {length}");
        }
    }
    // Two bytes a number of a descriptor: with four each, descriptors alone were longer than the whole file.
    let size = fs::metadata(place.path("one.h5")).unwrap().len();
    assert!(size < features * 128 * 4, "{size} bytes, {features} features");
    place.ends(&format!("{line} --out few.h5 --max-features 5"), 0);
    let few = FeatureSource::open(&place.path("few.h5")).unwrap();
    assert_eq!(few.get(0).unwrap().keypoints.len(), 5);
}

#[test]
fn images_are_audited_with_aliked_and_the_file_gives_the_same_figures() {
    let place = photos();
    let usual = "--k 5 --inlier-ratios 1 --neighbors oracle --neighbors similarity";
    let line = format!("audit images photos --features aliked {FAINT} {usual} --out a");
    let (stdout, stderr) = place.ends(&line, 0);
    assert!(stdout.ends_with("report: a/report.html\n") && stderr.is_empty(), "{stdout}{stderr}");
    let rows = |folder: &str| {
        let text = fs::read_to_string(place.path(folder).join("audit.json")).unwrap();
        let document: Value = serde_json::from_str(&text).unwrap();
        (document["results"].clone(), document["options"].clone())
    };
    let (of_photos, options) = rows("a");
    assert_eq!(options["features"], "aliked");
    assert!(of_photos.as_array().is_some_and(|rows| rows.len() == 3 * 2 * 2), "{of_photos}");
    place.ends(&format!("features photos --type aliked {FAINT} --out f.h5"), 0);
    place.ends(&format!("audit images f.h5 {usual} --out b"), 0);
    let without_time = |rows: &Value| {
        let mut rows = rows.clone();
        for row in rows.as_array_mut().expect("rows") {
            row.as_object_mut().expect("a row").remove("seconds");
        }
        rows
    };
    assert_eq!(without_time(&of_photos), without_time(&rows("b").0));
}

#[test]
fn options_that_do_not_fit_are_one_line() {
    let place = photos();
    for (line, expected) in [
        (
            "features photos --min-score 0.1",
            "unlift: --min-score: expected with --type aliked, found none",
        ),
        (
            "features photos --type aliked --first-octave 0",
            "unlift: --first-octave: expected with --type sift, found --type aliked",
        ),
        (
            "audit images photos --features aliked --neighbors overlap",
            "unlift: --neighbors overlap: expected ",
        ),
    ] {
        let (_, stderr) = place.ends(line, 2);
        assert!(stderr.starts_with(expected), "{stderr}");
    }
    place.ends("features photos --type aliked --out f.h5", 0);
    let (_, stderr) = place.ends("features f.h5 --type aliked --out g.h5", 2);
    assert_eq!(stderr, "unlift: --type: expected with a folder of photos, found a file\n");
    let (_, stderr) = place.ends("features photos --type orb", 2);
    assert!(stderr.contains("expected one of sift, aliked, superpoint, found orb"), "{stderr}");
}

#[test]
fn photos_with_nothing_to_see_are_empty_and_tiny_ones_are_told() {
    let place = photos();
    fs::remove_dir_all(place.path("photos")).unwrap();
    fs::create_dir(place.path("photos")).unwrap();
    image::GrayImage::new(40, 40).save(place.path("photos/black.png")).unwrap();
    image::GrayImage::new(1, 1).save(place.path("photos/one.png")).unwrap();
    image::GrayImage::new(3000, 4).save(place.path("photos/strip.png")).unwrap();
    let (stdout, stderr) = place.ends("features photos --type aliked", 3);
    assert_eq!(stdout, "2 images, 0 features, in features.h5\n");
    assert_eq!(
        stderr,
        "unlift: photos/one.png: expected at least 3 pixels a side, found 1 x 1\n\
         unlift: photos: expected 3 images that can be used, found 2\n"
    );
}

/// `unlift` with this folder of models and none of the user's own.
fn with_models(place: &Place, folder: &str, line: &str) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_unlift"))
        .args(line.split_whitespace())
        .current_dir(place.path(""))
        .env("UNLIFT_MODELS", folder)
        .env("XDG_DATA_HOME", "data")
        .output()
        .expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}

#[test]
fn models_are_listed_with_where_they_are() {
    let place = photos();
    let (code, stdout, _) = with_models(&place, "", "models");
    assert_eq!(code, 0);
    assert!(stdout.contains("aliked-n16rot\n") && stdout.contains("  here     in the program\n"));
    let missing = "  here     no: superpoint.onnx: expected in data/unlift/models \
                   (https://github.com/magicleap/SuperPointPretrainedNetwork), found nothing\n";
    assert!(stdout.contains(missing), "{stdout}");
    let (_, stdout, _) = with_models(&place, "", "models --json");
    let list: Value = serde_json::from_str(&stdout).unwrap();
    let list = list.as_array().expect("a list");
    let (there, missing): (Vec<&Value>, Vec<&Value>) =
        list.iter().partition(|model| model["here"] == true);
    let names: Vec<&str> = there.iter().filter_map(|model| model["name"].as_str()).collect();
    let carried = [
        "aliked-n16rot",
        "inverter-aliked",
        "inverter-sift",
        "lpips-squeeze",
        "neighbors-aliked",
        "neighbors-sift",
        "yolox-nano",
    ];
    assert_eq!(names, carried);
    assert!(there.iter().all(|model| model["carried"] == true));
    let names: Vec<&str> = missing.iter().filter_map(|model| model["name"].as_str()).collect();
    let yours = ["inverter-superpoint", "neighbors-superpoint", "superpoint"];
    assert_eq!(names, yours);
    let ([.., superpoint], aliked) = (&missing[..], there[0]) else { panic!("{missing:?}") };
    assert_eq!(aliked["sha256"].as_str().map(str::len), Some(64));
    assert_eq!((&superpoint["here"], &superpoint["sha256"]), (&Value::Bool(false), &Value::Null));
}

#[test]
fn a_model_that_is_missing_or_another_one_is_one_line() {
    let place = photos();
    let (code, _, stderr) = with_models(&place, "", "features photos --type superpoint");
    assert_eq!(code, 3);
    assert_eq!(
        stderr,
        "unlift: superpoint.onnx: expected in data/unlift/models \
         (https://github.com/magicleap/SuperPointPretrainedNetwork), found nothing\n"
    );
    fs::write(place.path("aliked-n16rot.onnx"), "another").unwrap();
    let (code, _, stderr) = with_models(&place, ".", "features photos --type aliked");
    assert_eq!(code, 3);
    assert!(stderr.starts_with("unlift: ./aliked-n16rot.onnx: expected SHA-256 "), "{stderr}");
    let (code, _, stderr) = with_models(&place, "nowhere", "features photos --type aliked");
    assert_eq!((code, &*stderr), (3, "unlift: UNLIFT_MODELS: expected a folder, found nowhere\n"));
    assert!(!place.path("features.h5").exists() && !place.path("features.h5.parts").exists());
}
