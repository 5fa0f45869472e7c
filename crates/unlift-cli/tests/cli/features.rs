//! `unlift features` and `unlift models`: photos and files in, one complete file out, and missing
//! networks named.

use crate::common::Place;

#[test]
fn photos_become_one_file_that_is_the_same_for_any_number_of_threads() {
    let place = Place::with_photos();
    // Synthetic photos have faint keypoints.
    for (kind, more) in [("sift", ""), ("aliked", "--min-score 0.05")] {
        let line = format!("features photos --features {kind} {more}");
        let (stdout, stderr) = place.ends(&format!("RAYON_NUM_THREADS=1 {line} --out one.h5"), 0);
        assert!(stdout.starts_with("3 images, ") && stdout.ends_with(" features, in one.h5\n"));
        assert!(stderr.is_empty(), "{stderr}");
        place.ends(&format!("RAYON_NUM_THREADS=4 {line} --out four.h5 --quiet"), 0);
        place.ends("features one.h5 --out copy.h5", 0);
        let [one, four, copy] = ["one.h5", "four.h5", "copy.h5"].map(|name| place.bytes(name));
        assert!(one == four && one == copy, "{kind}");
        let images = place.features("one.h5");
        let names: Vec<&str> = images.iter().map(|image| &*image.name).collect();
        assert_eq!(names, ["a.png", "b/c.jpg", "b/ü d.webp"]);
        for image in &images {
            assert_eq!((image.size, image.uncertainty_px), (Some([128, 96]), Some(1.0)));
            let descriptors = image.descriptors.as_ref().expect("descriptors");
            assert_eq!((descriptors.len(), descriptors.dim()), (image.keypoints.len(), 128));
        }
    }
    assert_eq!(place.n_entries(""), 3 + 1, "nothing else is left");
}

#[test]
#[rustfmt::skip] // One row per line.
fn options_are_those_of_the_extractor() {
    let place = Place::with_photos();
    let count = |options: &str| {
        let (stdout, _) = place.ends(&format!("features photos {options}"), 0);
        stdout.split(' ').nth(2).and_then(|n| n.parse::<usize>().ok()).expect("a number")
    };
    let usual = count("");
    assert!(count("--max-features 5") < usual && count("--max-image-size 64") < usual);
    assert_eq!(place.features("features.h5")[0].uncertainty_px, Some(2.0));
    assert_eq!(count("--features aliked --min-score 0.05 --max-features 5"), 3 * 5);
    place.refuses("features", &[
        ("photos --max-features 0", 2, "expected a whole number from 1 to 4294967295, found 0"),
        ("photos --features aliked --min-score 1", 2, "expected a number from 0 to below 1, found 1"),
        ("photos --features orb", 2, "expected one of sift, aliked, superpoint, found orb"),
        ("photos --min-score 0.1", 2, "unlift: --min-score: expected with --features aliked, found none"),
        ("features.h5 --as-stored --out x.h5", 2, "--as-stored: expected with a folder of photos"),
        ("features.h5 --features aliked --out x.h5", 2, "--features: expected with a folder of photos"),
        ("photos --out photos", 2, "unlift: --out: photos: expected a file, found a folder"),
    ]);
}

#[test]
#[rustfmt::skip] // One row per line.
fn models_are_listed_and_a_missing_or_another_one_is_one_line() {
    let place = Place::with_photos();
    let (stdout, _) = place.ends("UNLIFT_MODELS= XDG_DATA_HOME=data models", 0);
    assert!(stdout.contains("aliked-n16rot\n") && stdout.contains("  here     in the program\n"));
    let missing = "superpoint.onnx: expected in data/unlift/models (https://github.com/";
    assert!(stdout.contains(&format!("  here     no: {missing}")), "{stdout}");
    place.write("aliked-n16rot.onnx", "another");
    place.refuses("XDG_DATA_HOME=data features photos", &[
        ("UNLIFT_MODELS= --features superpoint", 3, missing),
        ("UNLIFT_MODELS=. --features aliked", 3, "unlift: ./aliked-n16rot.onnx: expected SHA-256 "),
        ("UNLIFT_MODELS=nowhere --features aliked", 3, "unlift: UNLIFT_MODELS: expected a folder, found nowhere\n"),
    ]);
    assert!(!place.path("features.h5").exists());
}
