//! `unlift features`: photos and files in, one complete file out, unusable images named.

use image::GrayImage;

use crate::common::Place;

fn photos() -> Place {
    Place::with_photos(&["a.png", "b/c.jpg", "b/ü d.webp"])
}

#[test]
fn photos_become_one_file_that_is_the_same_for_any_number_of_threads() {
    let place = photos();
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
        assert_eq!(place.names(""), ["copy.h5", "four.h5", "one.h5", "photos"]);
        let images = place.features("one.h5");
        let names: Vec<&str> = images.iter().map(|image| &*image.name).collect();
        assert_eq!(names, ["a.png", "b/c.jpg", "b/ü d.webp"]);
        for image in &images {
            assert_eq!((image.size, image.uncertainty_px), (Some([128, 96]), Some(1.0)));
            let descriptors = image.descriptors.as_ref().expect("descriptors");
            assert_eq!((descriptors.len(), descriptors.dim()), (image.keypoints.len(), 128));
        }
    }
}

#[test]
#[rustfmt::skip] // One row per line.
fn options_are_those_of_the_extractor() {
    let place = photos();
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
        ("photos --features orb", 2, "expected one of sift, aliked, superpoint, found orb"),
        ("photos --min-score 0.1", 2, "unlift: --min-score: expected with --features aliked, found none"),
        ("features.h5 --max-features 9 --out x.h5", 2, "--max-features: expected with a folder of photos"),
        ("features.h5 --as-stored --out x.h5", 2, "--as-stored: expected with a folder of photos"),
        ("features.h5 --features aliked --out x.h5", 2, "--features: expected with a folder of photos"),
        ("photos --out photos", 2, "unlift: --out: photos: expected a file, found a folder"),
    ]);
}

#[test]
fn a_broken_photo_is_one_line_and_the_rest_is_written() {
    let place = photos();
    let jpeg = place.bytes("photos/b/c.jpg");
    place.write("photos/cut.jpg", &jpeg[..jpeg.len() / 2]);
    place.write("photos/note.jpg", "not a photo");
    place.write("photos/notes.txt", "passed over");
    GrayImage::new(40, 40).save(place.path("photos/flat.png")).unwrap();
    let (stdout, stderr) = place.ends("features photos", 3);
    assert!(stdout.starts_with("4 images, "), "{stdout}");
    assert!(stderr.ends_with("unlift: photos: expected 6 images that can be used, found 4\n"));
}
