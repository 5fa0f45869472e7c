//! `unlift audit images`: photos and files in, one audit out, unusable images named.

use std::fs;

use image::RgbImage;
use unlift::Descriptors;
use unlift::descriptors::Values;

use crate::common::{Place, rows};

const QUICK: &str = "--k 10 --inlier-ratios 1,0.5";

#[test]
fn photos_become_pooled_rows_rows_per_image_and_pictures() {
    let place = Place::with_photos();
    let sources = "--neighbors oracle --neighbors similarity --neighbors overlap";
    let (stdout, stderr) = place.ends(&format!("audit images photos {QUICK} {sources} --out a"), 0);
    assert!(stdout.ends_with("report: a/report.html\n") && stderr.is_empty(), "{stdout}{stderr}");
    let document = place.json("a/audit.json");
    assert_eq!(rows(&document).len(), 3 * (2 + 2));
    for row in rows(&document) {
        assert_eq!(row["unit"], "px");
        let keys: Vec<&String> = row["recovered_percent"].as_object().unwrap().keys().collect();
        assert_eq!(keys, ["1", "5", "10", "25"]);
    }
    let images = document["images"].as_array().expect("images");
    let names: Vec<&str> = images.iter().filter_map(|image| image["name"].as_str()).collect();
    assert_eq!(names, ["a.png", "b/c.jpg", "b/ü d.webp"]);
    let n_points: u64 = images.iter().filter_map(|image| image["n_points"].as_u64()).sum();
    assert_eq!(Some(n_points), document["input"]["n_points"].as_u64());
    assert!(document["break_even"].as_array().unwrap().iter().all(|b| b["threshold"] == "10"));
    let page = place.text("a/report.html");
    assert_eq!(page.matches("/9j/").count(), 3, "a JPEG per image");
    place.ends(&format!("audit images photos {QUICK} --max-images 2 --out b"), 0);
    assert_eq!(place.json("b/audit.json")["images"].as_array().map(Vec::len), Some(2));
}

#[test]
fn broken_images_are_named_counted_and_left_out() {
    let place = Place::with_photos();
    place.write("photos/text.jpg", "no photo");
    place.write("photos/cut.jpg", &place.bytes("photos/b/c.jpg")[..1000]);
    RgbImage::new(1, 1).save(place.path("photos/one.png")).unwrap();
    // An image with too few keypoints to attack counts as usable.
    RgbImage::new(40, 40).save(place.path("photos/plain.png")).unwrap();
    let gate = "--gate cp2d:10<=100 --junit g.xml";
    let (stdout, stderr) = place.ends(&format!("audit images photos {QUICK} {gate} --out a"), 3);
    assert!(stdout.contains("report: a/report.html"));
    let junit = place.text("g.xml");
    assert!(junit.contains("failures=\"0\" errors=\"1\""), "{junit}");
    let total = "unlift: photos: expected 7 images that can be used, found 4\n";
    let each = "unlift: photos/cut.jpg: expected a whole JPEG image, found one that is cut off\n\
                unlift: photos/one.png: expected at least 3 pixels a side, found 1 x 1\n\
                unlift: photos/text.jpg: expected a JPEG, PNG or WebP image, found text\n";
    assert!(stderr.ends_with(&format!("{each}{total}")), "{stderr}");
    let counts = &place.json("a/audit.json")["input"]["images"];
    assert_eq!(["found", "used", "unusable", "too_small"].map(|name| &counts[name]), [7, 4, 3, 1]);
    place.write("photos/notes.txt", "passed over");
    let (stdout, stderr) = place.ends("features photos", 3);
    assert!(stdout.starts_with("4 images, ") && stderr.ends_with(total), "{stdout}{stderr}");
}

#[test]
#[rustfmt::skip] // One row per line.
fn what_cannot_be_audited_is_one_line() {
    let place = Place::with_photos();
    fs::create_dir(place.path("empty")).unwrap();
    let values = (0..90 * 64).map(|i| (f64::from(i) * 0.37).sin() as f32).collect();
    let floats = Descriptors::try_new(Values::F32(values), 64).unwrap();
    for (file, descriptors) in [("bare.h5", None), ("floats.h5", Some(floats))] {
        let place_of = |i: u32| [97 * i % 631, 61 * i % 467].map(f64::from);
        let keypoints = (0..90).map(place_of).collect();
        place.write_features(file, [("a.png".to_owned(), keypoints, descriptors)]);
    }
    place.refuses("audit images", &[
        ("empty", 3, "unlift: empty: expected JPEG, PNG or WebP photos, found none\n"),
        ("nothing", 3, "unlift: nothing: expected a file or folder, found nothing\n"),
        ("bare.h5 --max-features 9", 2, "unlift: --max-features: expected with a folder of photos, found a file\n"),
        ("bare.h5 --neighbors similarity", 2, "unlift: --neighbors similarity: expected descriptors, found none\n"),
        ("floats.h5 --neighbors overlap", 2, "found 64 values each\n  try: --neighbors similarity, which takes descriptors of any kind\n"),
        ("photos --thresholds 5,5.0", 2, "unlift: --thresholds: expected each once, found 5.0 again\n"),
        ("photos --neighbors overlap --inlier-ratios 0.5", 2, "expected with --neighbors oracle, found only overlap\n"),
        ("photos --neighbors geometric", 2, "expected one of oracle, "),
        ("photos --solver tomography", 2, ", found tomography"),
        ("photos --schemes olc", 2, ", found olc (for maps only)"),
        // The error comes before any photo is read.
        ("photos --features aliked --neighbors overlap", 2, "unlift: --neighbors overlap: expected "),
    ]);
    assert!(!place.path("unlift-audit").exists());
    place.ends("audit images floats.h5 --k 10 --neighbors similarity --out a", 0);
}
