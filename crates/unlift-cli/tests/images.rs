//! `unlift audit images` as a user runs it: photos and files in, one audit out, bad images named.

mod common;

use std::fs;
use std::path::Path;

use common::{Place, photo};
use image::RgbImage;
use serde_json::Value;
use unlift_io::features::{FeatureSource, FeatureWriter, ImageFeatures};

const QUICK: &str = "--k 10 --inlier-ratios 1,0.5";

fn photos() -> Place {
    Place::with_photos(&["a.png", "b.png", "c/d.png"])
}

fn json(place: &Place, file: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(place.path(file)).expect("a file")).expect("JSON")
}

/// The features of `from` once more, each image as `change` leaves it.
fn changed(from: &Path, to: &Path, change: impl Fn(&mut ImageFeatures)) {
    let source = FeatureSource::open(from).unwrap();
    let mut writer = FeatureWriter::create(to).unwrap();
    for at in 0..source.names().len() {
        let mut image = source.get(at).unwrap();
        change(&mut image);
        writer.append(&image).unwrap();
    }
    writer.finish().unwrap();
}

/// The same without their descriptors.
fn without_descriptors(from: &Path, to: &Path) {
    changed(from, to, |image| image.descriptors = None);
}

#[test]
fn photos_become_pooled_rows_rows_per_image_and_pictures() {
    let place = photos();
    let sources = "--neighbors oracle --neighbors similarity --neighbors overlap";
    let (stdout, stderr) = place.ends(&format!("audit images photos {QUICK} {sources} --out a"), 0);
    assert!(stdout.ends_with("report: a/report.html\n") && stderr.is_empty(), "{stdout}{stderr}");
    let document = json(&place, "a/audit.json");
    let counts = &document["input"]["images"];
    assert_eq!((counts["found"].as_u64(), counts["used"].as_u64()), (Some(3), Some(3)));
    let rows = document["results"].as_array().expect("rows");
    // By joint, and by joint-start.
    assert_eq!(rows.len(), 3 * (2 + 2) * 2);
    for row in rows {
        assert_eq!(row["unit"], "px");
        let keys: Vec<&String> = row["recovered_percent"].as_object().unwrap().keys().collect();
        assert_eq!(keys, ["1", "5", "10", "25"]);
        assert!(row["distinct"]["n_places"].as_u64() <= row["n_points"].as_u64());
    }
    let images = document["images"].as_array().expect("images");
    let names: Vec<&str> = images.iter().filter_map(|image| image["name"].as_str()).collect();
    assert_eq!(names, ["a.png", "b.png", "c/d.png"]);
    let n_points: u64 = images.iter().filter_map(|image| image["n_points"].as_u64()).sum();
    assert_eq!(Some(n_points), document["input"]["n_points"].as_u64());
    for (at, row) in rows.iter().enumerate() {
        // Pooled shares lie within those of the images.
        let shares =
            images.iter().filter_map(|i| i["rows"][at]["recovered_percent"]["10"].as_f64());
        let (low, high) = shares.fold((100.0f64, 0.0f64), |(l, h), x| (l.min(x), h.max(x)));
        let pooled = row["recovered_percent"]["10"].as_f64().unwrap();
        assert!((low - 1e-3..=high + 1e-3).contains(&pooled), "{pooled} of {low} to {high}");
    }
    assert!(document["break_even"].as_array().unwrap().iter().all(|b| b["threshold"] == "10"));
    let page = fs::read_to_string(place.path("a/report.html")).unwrap();
    assert!(page.contains("c/d.png") && page.contains("id=\"picture-graph\""));
    assert_eq!(page.matches("/9j/").count(), 3, "a JPEG per image");
}

#[test]
fn neither_threads_nor_where_features_come_from_change_a_byte() {
    let place = photos();
    place.ends("features photos --out f.h5", 0);
    let figures = |line: &str| {
        place.ends(&format!("audit images {line} {QUICK} --solver joint,ransac --out t"), 0);
        let mut document = json(&place, "t/audit.json");
        let page = fs::read_to_string(place.path("t/report.html")).unwrap();
        let data = page.split("id=\"block-").skip(1).map(str::to_owned).next().unwrap();
        let fields = document.as_object_mut().unwrap();
        for field in ["run", "input", "options"] {
            fields.remove(field);
        }
        (document.to_string(), data.split("</script>").next().unwrap().to_owned())
    };
    let one = figures("photos --threads 1");
    assert_eq!(one, figures("photos --threads 2"));
    assert_eq!(one, figures("f.h5 --threads 2 --photos photos"));
}

#[test]
fn a_file_without_photos_has_frames_and_chosen_images_are_shown() {
    let place = photos();
    place.ends("features photos --out f.h5", 0);
    place.ends(&format!("audit images f.h5 {QUICK} --show b.png --out a"), 0);
    let page = fs::read_to_string(place.path("a/report.html")).unwrap();
    assert!(page.contains("\"name\":\"b.png\"") && !page.contains("\"name\":\"a.png\""));
    assert!(!page.contains("/9j/"));
    // Only the neighborhoods that were asked for are drawn.
    assert!(!page.contains("\"label\":\"overlap, ") && page.contains("\"label\":\"oracle, "));
    let asked = format!(
        "audit images f.h5 {QUICK} --neighbors oracle --neighbors descriptors --show b.png --out c"
    );
    place.ends(&asked, 0);
    let page = fs::read_to_string(place.path("c/report.html")).unwrap();
    assert!(page.contains("\"label\":\"descriptors, ") && !page.contains("\"label\":\"overlap, "));
    without_descriptors(&place.path("f.h5"), &place.path("bare.h5"));
    place.ends(&format!("audit images bare.h5 {QUICK} --show b.png --out b"), 0);
    let page = fs::read_to_string(place.path("b/report.html")).unwrap();
    assert!(
        page.contains("\"label\":\"oracle, 50 % true neighbors\"")
            && !page.contains("\"label\":\"overlap, ")
    );
    let (_, stderr) = place.ends("audit images f.h5 --show x.png", 2);
    assert_eq!(stderr, "unlift: --show: expected an image of f.h5, found x.png\n");
    let (_, stderr) = place.ends("audit images f.h5 --max-features 9", 2);
    assert_eq!(stderr, "unlift: --max-features: expected with a folder of photos, found a file\n");
}

#[test]
fn what_can_be_shared_has_neither_names_nor_pictures() {
    let place = photos();
    let line = format!("audit images photos {QUICK} --share-safe --max-images 2 --out a");
    place.ends(&line, 0);
    for file in ["a/audit.json", "a/report.html"] {
        let text = fs::read_to_string(place.path(file)).unwrap();
        for secret in ["a.png", "c/d.png", "photos\"", "/9j/", "id=\"picture-graph\""] {
            assert!(!text.contains(secret), "{file}: {secret}");
        }
    }
    let document = json(&place, "a/audit.json");
    assert_eq!(document["images"].as_array().map(Vec::len), Some(2));
    assert_eq!(document["images"][0]["name"], Value::Null);
}

#[test]
fn gates_hold_or_fail() {
    let place = photos();
    let line = format!("audit images photos {QUICK} --schemes lines2d --out a");
    let (stdout, _) = place.ends(&format!("{line} --gate lines2d@1:25<=1"), 1);
    assert!(stdout.contains("gate lines2d@1:25<=1: FAILED"), "{stdout}");
    place.ends(&format!("{line} --gate all:25<=100"), 0);
    let (_, stderr) = place.ends(&format!("{line} --gate cp2d:25<=100"), 2);
    assert!(stderr.starts_with("unlift: --gate cp2d:25<=100: scheme: expected one of"), "{stderr}");
}

#[test]
fn broken_images_are_named_counted_and_left_out() {
    let place = photos();
    fs::write(place.path("photos/text.jpg"), "no photo").unwrap();
    let mut whole = std::io::Cursor::new(Vec::new());
    photo(0).write_to(&mut whole, image::ImageFormat::Jpeg).unwrap();
    fs::write(place.path("photos/cut.jpg"), &whole.get_ref()[..1000]).unwrap();
    RgbImage::new(1, 1).save(place.path("photos/one.png")).unwrap();
    // Too few keypoints to be attacked, but an image.
    RgbImage::new(40, 40).save(place.path("photos/plain.png")).unwrap();
    let (stdout, stderr) = place.ends(&format!("audit images photos {QUICK} --out a"), 3);
    assert!(stdout.contains("report: a/report.html"));
    assert_eq!(
        stderr,
        "unlift: photos/cut.jpg: expected a whole JPEG image, found one that is cut off\n\
         unlift: photos/one.png: expected at least 3 pixels a side, found 1 x 1\n\
         unlift: photos/text.jpg: expected a JPEG, PNG or WebP image, found text\n\
         unlift: photos: expected 7 images that can be used, found 4\n"
    );
    let counts = json(&place, "a/audit.json")["input"]["images"].clone();
    let counts = ["found", "used", "unusable", "too_small"].map(|name| counts[name].as_u64());
    assert_eq!(counts, [7, 4, 3, 1].map(Some));
}

#[test]
fn images_of_other_kinds_are_told() {
    let place = photos();
    for name in ["a.HEIC", "b.heic", "c/d.tiff", ".e.heic", "notes.txt"] {
        fs::write(place.path("photos").join(name), "").unwrap();
    }
    let note = "2 .heic, 1 .tiff: only JPEG, PNG and WebP are read\n";
    let line = format!("audit images photos {QUICK} --max-images 1 --out a");
    let (_, stderr) = place.ends(&line, 0);
    assert_eq!(stderr, format!("unlift: note: photos: passed over {note}"));
    let (_, stderr) = place.ends("features photos --out f.h5", 0);
    assert_eq!(stderr, format!("unlift: note: photos: passed over {note}"));
    fs::create_dir(place.path("raw")).unwrap();
    fs::write(place.path("raw/1.heic"), "").unwrap();
    let (_, stderr) = place.ends("features raw --out g.h5", 3);
    assert_eq!(stderr, "unlift: raw: expected JPEG, PNG or WebP photos, found only 1 .heic\n");
}

#[test]
fn what_cannot_be_audited_is_one_line() {
    let place = photos();
    fs::create_dir(place.path("empty")).unwrap();
    place.ends("features photos --out f.h5", 0);
    without_descriptors(&place.path("f.h5"), &place.path("bare.h5"));
    for (line, code, expected) in [
        ("empty", 3, "unlift: empty: expected JPEG, PNG or WebP photos, found none\n"),
        ("nothing", 3, "unlift: nothing: expected a file or folder, found nothing\n"),
        (
            "bare.h5 --neighbors similarity",
            2,
            "unlift: --neighbors similarity: expected descriptors, found none\n",
        ),
        (
            "photos --thresholds 5,5.0",
            2,
            "unlift: --thresholds: expected each once, found 5.0 again\n",
        ),
        (
            "photos --neighbors overlap --inlier-ratios 0.5",
            2,
            "unlift: --inlier-ratios: expected with --neighbors oracle, found only overlap\n",
        ),
    ] {
        assert_eq!(place.ends(&format!("audit images {line}"), code).1, expected);
    }
    for line in ["--neighbors geometric", "--solver tomography", "--schemes olc"] {
        place.ends(&format!("audit images photos {line}"), 2);
    }
    // By the oracle, keypoints are enough.
    place.ends(&format!("audit images bare.h5 {QUICK} --out a"), 0);
    assert!(!place.path("unlift-audit").exists());
}

#[test]
fn learned_descriptors_are_no_sift() {
    let place = photos();
    place.ends("features photos --out f.h5", 0);
    changed(&place.path("f.h5"), &place.path("floats.h5"), |image| {
        let n = image.keypoints.len();
        let values = (0..64 * n).map(|i| (i as f32 * 0.37).sin()).collect();
        let values = unlift::descriptors::Values::F32(values);
        image.descriptors = Some(unlift::Descriptors::try_new(values, 64).unwrap());
    });
    let (_, stderr) = place.ends("audit images floats.h5 --neighbors overlap", 2);
    assert_eq!(
        stderr,
        "unlift: --neighbors overlap: expected SIFT descriptors (128 values each, none negative), \
         found 64 values each\n  \
         try: --neighbors similarity, which takes descriptors of any kind\n"
    );
    place.ends("audit images floats.h5 --k 10 --neighbors similarity --out a", 0);
}

/// Schemes and attacks take the declared size for the true one: with twice the sides a third comes back of `dcl2d`.
#[test]
fn a_declared_size_that_is_too_large_lets_no_gate_hold() {
    let place = photos();
    place.ends("features photos --out f.h5", 0);
    let gate = format!("{QUICK} --schemes dcl2d,cp2d --gate all:25<=100 --share-safe");
    place.ends(&format!("audit images f.h5 {gate} --out right"), 0);
    let right = json(&place, "right/audit.json");
    assert!(right["notes"].is_null(), "{}", right["notes"]);
    for (factor, name) in [(2, "twice"), (10, "ten")] {
        changed(&place.path("f.h5"), &place.path("wide.h5"), |image| {
            image.size = image.size.map(|size| size.map(|side| factor * side));
        });
        place.ends(&format!("audit images wide.h5 {gate} --out {name}"), 1);
        let wide = json(&place, &format!("{name}/audit.json"));
        let reason = wide["gates"][0]["reason"].as_str().expect("a reason");
        assert!(reason.starts_with("sizes: keypoints fill"), "{reason}");
        assert_eq!(wide["notes"][0], reason);
        // What publishes coordinates is attacked by these.
        let of = |document: &Value| {
            let rows = document["results"].as_array().expect("rows").iter();
            let found = rows.filter(|row| row["scheme"] == "cp2d" && row["solver"] == "joint");
            found.map(|row| row["recovered_percent"]["25"].as_f64().unwrap()).sum::<f64>()
        };
        assert!((of(&wide) - of(&right)).abs() < 5.0, "{} {}", of(&wide), of(&right));
        fs::remove_file(place.path("wide.h5")).unwrap();
    }
}
