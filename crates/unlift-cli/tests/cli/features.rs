//! `unlift features`: photos and files in, one complete file out, unusable images named.

use std::fs;
use std::path::Path;

use image::{GrayImage, ImageFormat};
use unlift::descriptors::Values;
use unlift_io::features::{FeatureSource, ImageFeatures};

use crate::common::Place;

fn photos() -> Place {
    Place::with_photos(&["a.png", "b/c.jpg", "b/ü d.webp"])
}

fn all(place: &Place, name: &str) -> Vec<ImageFeatures> {
    let source = FeatureSource::open(&place.path(name)).unwrap();
    (0..source.names().len()).map(|at| source.get(at).unwrap()).collect()
}

#[test]
fn photos_become_one_file_that_is_the_same_for_any_number_of_threads() {
    let place = photos();
    // Synthetic photos have faint keypoints.
    for (kind, more) in [("sift", ""), ("aliked", "--min-score 0.05")] {
        let line = format!("features photos --type {kind} {more}");
        let (stdout, stderr) = place.ends(&format!("{line} --out one.h5 --threads 1"), 0);
        assert!(stdout.starts_with("3 images, ") && stdout.ends_with(" features, in one.h5\n"));
        assert!(stderr.is_empty(), "{stderr}");
        place.ends(&format!("{line} --out four.h5 --threads 4 --quiet"), 0);
        place.ends("features one.h5 --out copy.h5", 0);
        let [one, four, copy] = ["one.h5", "four.h5", "copy.h5"].map(|name| place.bytes(name));
        assert!(one == four && one == copy, "{kind}");
        assert_eq!(place.names(""), ["copy.h5", "four.h5", "one.h5", "photos"]);

        let images = all(&place, "one.h5");
        let names: Vec<&str> = images.iter().map(|image| &*image.name).collect();
        assert_eq!(names, ["a.png", "b/c.jpg", "b/ü d.webp"]);
        let mut n_features = 0;
        for image in &images {
            let n = image.keypoints.len();
            assert!(n > 10, "{kind}: {n}");
            n_features += n;
            assert_eq!((image.size, image.uncertainty_px), (Some([128, 96]), Some(1.0)));
            let descriptors = image.descriptors.as_ref().expect("descriptors");
            assert_eq!((descriptors.len(), descriptors.dim()), (n, 128));
            let scores = image.scores.as_ref().expect("scores");
            let Values::F32(values) = descriptors.values() else {
                assert_eq!((kind, image.scales.as_ref()), ("sift", Some(scores)));
                continue;
            };
            assert!(scores.iter().all(|score| (0.0..1.0).contains(score)));
            for row in values.chunks_exact(128) {
                let length: f32 = row.iter().map(|value| value * value).sum();
                assert!(
                    (length - 1.0).abs() < 1e-2,
                    "half floats, so nearly of length 1: {length}"
                );
            }
        }
        // Descriptors have 2 bytes per value: with 4 they alone would exceed this size.
        assert!(one.len() < n_features * 128 * 4 || kind == "sift", "{} bytes", one.len());
    }
}

#[test]
fn photos_are_turned_unless_they_are_to_be_left_as_stored() {
    let place = photos();
    let jpeg = place.bytes("photos/b/c.jpg");
    // An EXIF header for a photo that is stored upside down.
    let mut exif =
        b"\xff\xe1\0\x22Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([3, 0, 0, 0, 0, 0, 0]);
    place.write("photos/b/c.jpg", [&jpeg[..2], &exif, &jpeg[2..]].concat());
    place.ends("features photos --out upright.h5 --quiet", 0);
    place.ends("features photos --out stored.h5 --quiet --as-stored", 0);
    place.ends("features stored.h5 --out copy.h5 --quiet", 0);
    let middle = |file: &str, upright: bool| {
        let image = &all(&place, file)[1];
        let n = image.keypoints.len() as f64;
        assert_eq!(image.upright, upright, "{file}");
        image.keypoints.iter().fold([0.0; 2], |s, x| [s[0] + x[0] / n, s[1] + x[1] / n])
    };
    let (a, b) = (middle("upright.h5", true), middle("stored.h5", false));
    middle("copy.h5", false);
    // The blobs are rotated by 180 degrees about the middle of 128 x 96 pixels.
    assert!((a[0] + b[0] - 127.0).abs() < 3.0 && (a[1] + b[1] - 95.0).abs() < 3.0, "{a:?} {b:?}");
}

#[test]
fn options_are_those_of_the_extractor() {
    let place = photos();
    let count = |options: &str| {
        let (stdout, _) = place.ends(&format!("features photos {options}"), 0);
        stdout.split(' ').nth(2).and_then(|n| n.parse::<usize>().ok()).expect("a number")
    };
    let usual = count("");
    assert!(count("--first-octave 0") < usual && count("--max-features 5") < usual);
    assert!(count("--first-octave -1 --max-image-size 64") < usual);
    assert_eq!(all(&place, "features.h5")[0].uncertainty_px, Some(2.0));
    assert_eq!(count("--type aliked --min-score 0.05 --max-features 5"), 3 * 5);
    for (line, expected) in [
        ("photos --first-octave 1", "1 is not in -1..=0"),
        ("photos --max-features 0", "expected a whole number from 1 to 4294967295, found 0"),
        ("photos --type orb", "expected one of sift, aliked, superpoint, found orb"),
        ("photos --min-score 0.1", "unlift: --min-score: expected with --type aliked, found none"),
        (
            "photos --type aliked --first-octave 0",
            "unlift: --first-octave: expected with --type sift, found --type aliked",
        ),
        (
            "features.h5 --max-features 9 --out x.h5",
            "--max-features: expected with a folder of photos, found a file",
        ),
        (
            "features.h5 --as-stored --out x.h5",
            "--as-stored: expected with a folder of photos, found a file",
        ),
        (
            "features.h5 --type aliked --out x.h5",
            "--type: expected with a folder of photos, found a file",
        ),
        ("photos --out photos", "unlift: --out: photos: expected a file, found a folder"),
    ] {
        let stderr = place.complains(&format!("features {line}"), 2);
        assert!(stderr.contains(expected), "{line}: {stderr}");
    }
}

#[test]
fn a_broken_photo_is_one_line_and_the_rest_is_written() {
    let place = photos();
    let jpeg = place.bytes("photos/b/c.jpg");
    place.write("photos/cut.jpg", &jpeg[..jpeg.len() / 2]);
    place.write("photos/note.jpg", "not a photo");
    place.write("photos/empty.PNG", "");
    place.write("photos/notes.txt", "passed over");
    place.write("photos/.hidden.jpg", "passed over");
    GrayImage::new(1, 1).save_with_format(place.path("photos/one.webp"), ImageFormat::Png).unwrap();
    GrayImage::new(40, 40).save(place.path("photos/flat.png")).unwrap();
    GrayImage::new(3000, 4).save(place.path("photos/strip.png")).unwrap();
    let told = "unlift: photos/cut.jpg: expected a whole JPEG image, found one that is cut off\n\
        unlift: photos/empty.PNG: expected a JPEG, PNG or WebP image, found an empty file\n\
        unlift: photos/note.jpg: expected a JPEG, PNG or WebP image, found text\n\
        unlift: photos/one.webp: expected at least 3 pixels a side, found 1 x 1\n\
        unlift: photos: expected 9 images that can be used, found 5\n";
    for kind in ["sift", "aliked"] {
        let (stdout, stderr) = place.ends(&format!("features photos --type {kind}"), 3);
        assert!(stdout.starts_with("5 images, "), "{stdout}");
        assert_eq!(stderr, told, "{kind}");
        let images = all(&place, "features.h5");
        assert_eq!(images[3].keypoints.len(), 0, "flat.png has no features");
    }
}

#[test]
fn what_cannot_be_used_at_all_leaves_no_file() {
    let place = photos();
    fs::create_dir(place.path("empty")).unwrap();
    place.write("bad/a.jpg", "text");
    for (path, expected) in [
        ("empty", "empty: expected JPEG, PNG or WebP photos, found none"),
        ("bad", "bad: expected 1 images that can be used, found 0"),
        (
            "bad/a.jpg",
            "bad/a.jpg: expected features in HDF5, or a COLMAP database (SQLite), found a file that begins \
             with \"text\"",
        ),
        ("nothing", "nothing: expected a file or folder, found nothing"),
    ] {
        let stderr = place.complains(&format!("features {path}"), 3);
        assert_eq!(stderr.lines().last(), Some(&*format!("unlift: {expected}")));
    }
    assert_eq!(place.names(""), ["bad", "empty", "photos"]);
}

#[test]
fn features_of_a_database_are_copied() {
    let place = Place::empty();
    let fixture = "../unlift-io/tests/data/project/database.db";
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join(fixture);
    fs::copy(fixture, place.path("d.db")).unwrap();
    let database = rusqlite::Connection::open(place.path("d.db")).unwrap();
    let fill = "INSERT INTO keypoints SELECT image_id, 8, 2, zeroblob(64) FROM images; \
                DELETE FROM descriptors WHERE image_id = 1; \
                UPDATE images SET name = '../x.jpg' WHERE image_id = 2";
    database.execute_batch(fill).unwrap();
    database.close().unwrap();
    let (stdout, stderr) = place.ends("features d.db --out d.h5", 3);
    assert_eq!(stdout, "1 images, 8 features, in d.h5\n");
    assert_eq!(
        stderr,
        "unlift: d.h5: image \"../x.jpg\": expected a name whose parts are not empty, . or .., \
         found \"../x.jpg\"\n\
         unlift: d.db: image \"i3.jpg\": expected descriptors, found none\n\
         unlift: d.db: expected 3 images that can be used, found 1\n"
    );
}
