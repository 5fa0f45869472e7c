//! `unlift features` as a user runs it: photos and files in, one whole file out, bad ones named.

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::Place;
use image::{GrayImage, ImageFormat, Luma};
use unlift_io::features::{FeatureSource, ImageFeatures};

fn photos() -> Place {
    Place::with_photos(&["a.png", "b/c.jpg", "b/ü d.webp"])
}

/// The names of what is in the folder, sorted.
fn left(place: &Place) -> Vec<String> {
    let entries = fs::read_dir(place.path("")).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn lines(text: &str) -> Vec<&str> {
    text.lines().collect()
}

fn all(path: &Path) -> Vec<ImageFeatures> {
    let source = FeatureSource::open(path).unwrap();
    (0..source.names().len()).map(|at| source.get(at).unwrap()).collect()
}

#[test]
fn photos_become_one_file_that_is_the_same_for_any_number_of_threads() {
    let place = photos();
    let (stdout, stderr) = place.ends("features photos --out one.h5 --threads 1", 0);
    assert!(stdout.starts_with("3 images, ") && stdout.ends_with(" features, in one.h5\n"));
    assert!(stderr.is_empty(), "{stderr}");
    place.ends("features photos --out four.h5 --threads 4 --quiet", 0);
    assert_eq!(fs::read(place.path("one.h5")).unwrap(), fs::read(place.path("four.h5")).unwrap());
    assert_eq!(left(&place), ["four.h5", "one.h5", "photos"]);

    let images = all(&place.path("one.h5"));
    let names: Vec<&str> = images.iter().map(|image| &*image.name).collect();
    assert_eq!(names, ["a.png", "b/c.jpg", "b/ü d.webp"]);
    for image in &images {
        let n = image.keypoints.len();
        assert!(n > 10, "{n}");
        assert_eq!((image.size, image.uncertainty_px), (Some([128, 96]), Some(1.0)));
        assert_eq!(image.descriptors.as_ref().map(|d| (d.len(), d.dim())), Some((n, 128)));
        assert!(image.scores.is_some() && image.scales == image.scores);
    }
}

#[test]
fn photos_are_turned_unless_they_are_to_be_left_as_stored() {
    let place = photos();
    let path = place.path("photos/b/c.jpg");
    // An EXIF header that says that the photo stands on its head.
    let jpeg = fs::read(&path).unwrap();
    let mut exif =
        b"\xff\xe1\0\x22Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([3, 0, 0, 0, 0, 0, 0]);
    fs::write(&path, [&jpeg[..2], &exif, &jpeg[2..]].concat()).unwrap();
    place.ends("features photos --out upright.h5 --quiet", 0);
    place.ends("features photos --out stored.h5 --quiet --as-stored", 0);
    place.ends("features stored.h5 --out copy.h5 --quiet", 0);
    let middle = |file: &str| {
        let source = FeatureSource::open(&place.path(file)).unwrap();
        let image = source.get(1).unwrap();
        let n = image.keypoints.len() as f64;
        let sum = image.keypoints.iter().fold([0.0; 2], |s, x| [s[0] + x[0] / n, s[1] + x[1] / n]);
        assert_eq!(image.upright, source.is_upright());
        (source.is_upright(), sum)
    };
    let ((upright, a), (as_stored, b), (copy, _)) =
        (middle("upright.h5"), middle("stored.h5"), middle("copy.h5"));
    assert_eq!([upright, as_stored, copy], [true, false, false]);
    // The same blobs, turned by half about the middle of 128 x 96 pixels.
    assert!((a[0] + b[0] - 127.0).abs() < 3.0 && (a[1] + b[1] - 95.0).abs() < 3.0, "{a:?} {b:?}");
    let (_, stderr) = place.ends("features stored.h5 --as-stored", 2);
    assert!(
        stderr.contains("--as-stored: expected with a folder of photos, found a file"),
        "{stderr}"
    );
}

#[test]
fn keypoints_are_in_the_convention_of_hloc() {
    let place = photos();
    // A blob whose middle is the pixel in column 30 and row 34.
    let blob = GrayImage::from_fn(64, 64, |x, y| {
        let (dx, dy) = (f64::from(x) - 30.0, f64::from(y) - 34.0);
        Luma([(255.0 * (-(dx * dx + dy * dy) / 50.0).exp()) as u8])
    });
    fs::create_dir(place.path("blob")).unwrap();
    blob.save(place.path("blob/a.png")).unwrap();
    place.ends("features blob", 0);
    let [x, y] = all(&place.path("features.h5"))[0].keypoints[0];
    assert!((x - 30.0).abs() < 0.1 && (y - 34.0).abs() < 0.1, "({x}, {y})");
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
    assert_eq!(all(&place.path("features.h5"))[0].uncertainty_px, Some(2.0));
    place.ends("features photos --first-octave 1", 2);
    place.ends("features photos --max-features 0", 2);
    let (_, stderr) = place.ends("features features.h5 --max-features 9 --out copy.h5", 2);
    assert_eq!(
        lines(&stderr),
        ["unlift: --max-features: expected with a folder of photos, found a file"]
    );
}

#[test]
fn a_broken_photo_is_one_line_and_the_rest_is_written() {
    let place = photos();
    let jpeg = fs::read(place.path("photos/b/c.jpg")).unwrap();
    fs::write(place.path("photos/cut.jpg"), &jpeg[..jpeg.len() / 2]).unwrap();
    fs::write(place.path("photos/note.jpg"), "not a photo").unwrap();
    fs::write(place.path("photos/empty.PNG"), "").unwrap();
    fs::write(place.path("photos/notes.txt"), "passed over").unwrap();
    fs::write(place.path("photos/.hidden.jpg"), "passed over").unwrap();
    GrayImage::new(1, 1).save_with_format(place.path("photos/one.webp"), ImageFormat::Png).unwrap();
    GrayImage::new(40, 40).save(place.path("photos/flat.png")).unwrap();
    let (stdout, stderr) = place.ends("features photos", 3);
    assert!(stdout.starts_with("4 images, "), "{stdout}");
    assert_eq!(
        lines(&stderr),
        [
            "unlift: photos/cut.jpg: expected a whole JPEG image, found one that is cut off",
            "unlift: photos/empty.PNG: expected a JPEG, PNG or WebP image, found an empty file",
            "unlift: photos/note.jpg: expected a JPEG, PNG or WebP image, found text",
            "unlift: photos/one.webp: expected at least 3 pixels a side, found 1 x 1",
            "unlift: photos: expected 8 images that can be used, found 4",
        ]
    );
    let images = all(&place.path("features.h5"));
    assert_eq!((images.len(), images[3].keypoints.len()), (4, 0), "flat.png has no features");
}

#[test]
fn what_cannot_be_used_at_all_leaves_no_file() {
    let place = photos();
    fs::create_dir(place.path("empty")).unwrap();
    fs::create_dir(place.path("bad")).unwrap();
    fs::write(place.path("bad/a.jpg"), "text").unwrap();
    let last =
        |line: &str, code| place.ends(line, code).1.lines().last().expect("a line").to_owned();
    assert_eq!(
        last("features empty", 3),
        "unlift: empty: expected JPEG, PNG or WebP photos, found none"
    );
    assert_eq!(last("features bad", 3), "unlift: bad: expected 1 images that can be used, found 0");
    assert_eq!(
        last("features bad/a.jpg", 3),
        "unlift: bad/a.jpg: expected features in HDF5, or a COLMAP database (SQLite), found a file \
         that begins with \"text\""
    );
    assert_eq!(
        last("features nothing", 3),
        "unlift: nothing: expected a file or folder, found nothing"
    );
    assert_eq!(
        last("features photos --out photos", 2),
        "unlift: --out: photos: expected a file, found a folder"
    );
    assert_eq!(left(&place), ["bad", "empty", "photos"]);
}

#[test]
fn a_run_that_was_interrupted_goes_on_and_gives_the_same_bytes() {
    let place = photos();
    place.ends("features photos --out whole.h5", 0);
    // What earlier runs may have left.
    let parts = place.path("again.h5.parts");
    fs::create_dir(&parts).unwrap();
    fs::write(parts.join(".joined.h5.unlift-0aZ9xy.partial"), "half").unwrap();
    fs::write(parts.join("0123456789abcdef0123456789abcdef.part.h5"), "of other options").unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_unlift"))
        .args(["features", "photos", "--out", "again.h5", "--threads", "1"])
        .current_dir(place.path(""))
        .spawn()
        .expect("the program starts");
    // Killed at any moment: before, between or after the images.
    while fs::read_dir(&parts).is_ok_and(|entries| entries.count() < 4)
        && child.try_wait().expect("a state").is_none()
    {
        std::thread::yield_now();
    }
    child.kill().expect("it can be killed");
    child.wait().expect("it ends");
    let (stdout, _) = place.ends("features photos --out again.h5", 0);
    assert!(stdout.starts_with("3 images, "), "{stdout}");
    let [again, whole] = ["again.h5", "whole.h5"].map(|name| fs::read(place.path(name)).unwrap());
    assert_eq!(again, whole);
    assert_eq!(left(&place), ["again.h5", "photos", "whole.h5"]);
}

#[cfg(unix)]
#[test]
fn a_part_that_has_changed_is_made_again() {
    let place = photos();
    place.ends("features photos --out whole.h5", 0);
    let whole = fs::read(place.path("whole.h5")).unwrap();
    // Room for each part and not for all of them, in blocks of 512 bytes: the parts are left.
    let blocks = whole.len() / 512 * 2 / 3;
    let line = "exec \"$0\" features photos --out again.h5 --quiet";
    let stopped = Command::new("sh")
        .args(["-c", &format!("ulimit -f {blocks}; {line}"), env!("CARGO_BIN_EXE_unlift")])
        .current_dir(place.path(""))
        .output()
        .expect("a shell");
    assert_eq!(
        String::from_utf8_lossy(&stopped.stderr),
        "unlift: again.h5: expected space to write, found a limit on the size of files\n"
    );
    assert_eq!(left(&place), ["again.h5.parts", "photos", "whole.h5"]);
    let parts = fs::read_dir(place.path("again.h5.parts")).unwrap();
    let mut parts: Vec<_> = parts.map(|entry| entry.unwrap().path()).collect();
    parts.sort();
    assert_eq!(parts.len(), 3);
    // Somewhere among the descriptors, where every value is one.
    let mut bytes = fs::read(&parts[1]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 60].iter_mut().for_each(|byte| *byte ^= 1);
    fs::write(&parts[1], bytes).unwrap();
    let (stdout, _) = place.ends("features photos --out again.h5", 0);
    assert!(stdout.contains(" (2 images of an earlier run), "), "{stdout}");
    assert_eq!(fs::read(place.path("again.h5")).unwrap(), whole);
    assert_eq!(left(&place), ["again.h5", "photos", "whole.h5"]);
}

/// Another photo of the same length and time, put there between two runs.
#[cfg(unix)]
#[test]
fn a_photo_put_in_place_of_another_is_extracted_again() {
    let place = photos();
    common::photo(7).save(place.path("other.jpg")).unwrap();
    let first = &place.path("photos/b/c.jpg");
    let other = fs::read(place.path("other.jpg")).unwrap();
    let whole = fs::read(first).unwrap();
    let put = |bytes: &[u8]| {
        let mut padded = bytes.to_vec();
        padded.resize(whole.len().max(other.len()) + 10, 0);
        fs::write(first, padded).unwrap();
        fs::File::options()
            .write(true)
            .open(first)
            .unwrap()
            .set_modified(std::time::UNIX_EPOCH)
            .unwrap();
    };
    put(&whole);
    place.ends("features photos --out whole.h5", 0);
    let blocks = fs::read(place.path("whole.h5")).unwrap().len() / 512 * 2 / 3;
    let line = "exec \"$0\" features photos --out again.h5 --quiet";
    let stopped = Command::new("sh")
        .args(["-c", &format!("ulimit -f {blocks}; {line}"), env!("CARGO_BIN_EXE_unlift")])
        .current_dir(place.path(""))
        .output()
        .expect("a shell");
    assert!(!stopped.status.success() && place.path("again.h5.parts").exists());
    put(&other);
    place.ends("features photos --out again.h5", 0);
    place.ends("features photos --out fresh.h5", 0);
    let read = |name| fs::read(place.path(name)).unwrap();
    assert!(read("again.h5") == read("fresh.h5") && read("fresh.h5") != read("whole.h5"));
}

#[test]
fn features_of_a_file_are_copied() {
    let place = photos();
    place.ends("features photos --out a.h5", 0);
    place.ends("features a.h5 --out b.h5", 0);
    assert_eq!(fs::read(place.path("a.h5")).unwrap(), fs::read(place.path("b.h5")).unwrap());

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
        lines(&stderr),
        [
            "unlift: d.h5: image \"../x.jpg\": expected a name of parts that are not empty, . or .., \
             found \"../x.jpg\"",
            "unlift: d.db: image \"i3.jpg\": expected descriptors, found none",
            "unlift: d.db: expected 3 images that can be used, found 1",
        ]
    );
}
