//! Pictures of what came back, as a user has them.

mod common;

use std::fs;

use common::Place;
use serde_json::Value;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift_io::features::{FeatureWriter, ImageFeatures};

const CHEAP: &str = "--schemes lines2d --inlier-ratios 0.5 --solver joint-start --k 8";

fn place() -> Place {
    Place::with_photos(&["a.png", "b/c.jpg", "d.webp"])
}

fn document(place: &Place, folder: &str) -> Value {
    let text = fs::read_to_string(place.path(folder).join("audit.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn an_audit_of_images_tells_how_alike_pictures_are_and_shows_them() {
    let place = place();
    place.ends(&format!("audit images photos --invert {CHEAP} --threads 1 --out one"), 0);
    place.ends(&format!("audit images photos --invert {CHEAP} --threads 4 --out four"), 0);
    let metrics = |folder: &str| document(&place, folder)["results"][0]["metrics"].clone();
    let found = metrics("one");
    assert_eq!(found, metrics("four"));
    for name in ["ssim", "psnr", "lpips"] {
        let (figure, baseline) = (&found[name], &found[&format!("{name}_baseline")]);
        assert!(figure.is_f64() && baseline.is_f64(), "{found}");
    }
    let page = fs::read_to_string(place.path("one/report.html")).unwrap();
    assert!(page.contains("id=\"inversions\"") && page.contains("data:image/jpeg;base64,"));
    // A photo, its baseline and what came back, of three images.
    assert!(page.matches("<figure").count() >= 9);

    let line = format!("audit images photos --invert {CHEAP} --share-safe --out safe");
    place.ends(&line, 0);
    let page = fs::read_to_string(place.path("safe/report.html")).unwrap();
    assert!(!page.contains("id=\"inversions\""));
}

#[test]
fn a_photo_that_is_missing_is_told_and_the_others_go_on() {
    let place = place();
    place.ends("features photos --out features.h5", 0);
    fs::rename(place.path("photos"), place.path("some")).unwrap();
    fs::remove_file(place.path("some/b/c.jpg")).unwrap();
    let line = format!("audit images features.h5 --photos some --invert {CHEAP} --out audit");
    let (_, stderr) = place.ends(&line, 0);
    let note = "note: not painted: image b/c.jpg: some/b/c.jpg: expected a JPEG";
    assert!(stderr.contains(note), "{stderr}");
    assert!(document(&place, "audit")["results"][0]["metrics"]["ssim"].is_f64());

    fs::create_dir(place.path("none")).unwrap();
    let line = format!("audit images features.h5 --photos none --invert {CHEAP} --out x");
    let (_, stderr) = place.ends(&line, 3);
    assert_eq!(stderr, "unlift: none: expected photos of the images in features.h5, found none\n");
}

#[test]
fn what_cannot_be_painted_is_a_usage_error() {
    let place = place();
    place.ends("features photos --out features.h5", 0);
    let complaint = |line: &str| place.ends(line, 2).1;
    assert_eq!(
        complaint("audit images features.h5 --invert --out x"),
        "unlift: --invert: expected --photos, as PATH is no folder of photos\n"
    );
    assert!(complaint("audit map features.h5 --invert --out x").contains("--photos"));
    assert!(!place.path("x").exists());
}

#[test]
fn a_network_of_ones_own_paints_what_the_program_has_none_for() {
    let place = place();
    // Of SuperPoint there is none.
    let mut writer = FeatureWriter::create(&place.path("superpoint.h5")).unwrap();
    let values = (0..40 * 256).map(|i| f32::from(u8::from(i % 256 == i / 256))).collect();
    let image = ImageFeatures {
        name: "a.png".to_owned(),
        size: Some([320, 240]),
        keypoints: (0..40).map(|i| [f64::from(7 * i), f64::from(5 * i)]).collect(),
        descriptors: Some(Descriptors::try_new(Values::F32(values), 256).unwrap()),
        ..ImageFeatures::default()
    };
    writer.append(&image).unwrap();
    writer.finish().unwrap();
    let missing = "inverter-superpoint.onnx: expected in ";
    for line in ["audit images superpoint.h5 --photos photos --invert", "invert superpoint.h5"] {
        let (_, stderr) = place.ends(&format!("{line} --out x"), 3);
        assert!(stderr.contains(missing) && stderr.contains("training/inversion"), "{stderr}");
    }
    // As many columns, whatever it makes of them.
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/../unlift-nn/models");
    let own = format!("--inverter {models}/inverter-sift/inverter-sift.onnx");
    place.ends(
        &format!("audit images photos --features aliked --invert {own} {CHEAP} --out own"),
        0,
    );
    let document = document(&place, "own");
    assert!(document["results"][0]["metrics"]["ssim"].is_f64(), "{document}");
    assert_eq!(document["options"]["inverter_sha256"].as_str().unwrap().len(), 64, "{document}");
    let (stdout, _) = place.ends(&format!("invert photos {own} --out pictures"), 0);
    assert_eq!(stdout, "3 pictures, in pictures\n");

    let other =
        format!("invert photos --inverter {models}/lpips-squeeze/lpips-squeeze.onnx --out y");
    let (_, stderr) = place.ends(&other, 3);
    assert!(stderr.contains("expected an input features of shape (1, 131, any, any)"), "{stderr}");
    assert!(!place.path("x").exists() && !place.path("y").exists());
}

#[test]
fn keypoints_and_what_came_back_are_painted_to_files() {
    let place = place();
    let (stdout, _) = place.ends("invert photos --out pictures", 0);
    assert_eq!(stdout, "3 pictures, in pictures\n");
    let size = |file: &str| image::image_dimensions(place.path(file)).unwrap();
    assert_eq!(size("pictures/b/c.jpg.png"), (64, 48));
    // Again over its own pictures, never over others or what is read.
    place.ends("invert photos --out pictures", 0);
    let (table, _) = place.ends("metrics photos pictures", 0);
    assert!(table.lines().count() == 4 && table.contains("mean"), "{table}");
    fs::write(place.path("pictures/a.png.png"), "mine").unwrap();
    let (_, stderr) = place.ends("invert photos --out pictures", 3);
    assert!(stderr.contains("pictures/a.png.png: expected nothing, or a picture of"), "{stderr}");
    assert_eq!(fs::read(place.path("pictures/a.png.png")).unwrap(), b"mine");
    place.ends("invert photos --out pictures --force --max-images 1", 0);

    place.ends("features photos --out features.h5", 0);
    place.ends("obfuscate features.h5 --scheme cp2d --out hidden", 0);
    let released = "hidden/released.parquet";
    assert_eq!(
        place.ends(&format!("invert {released} --out y"), 2).1,
        "unlift: --recovered: expected what came back of PATH, found none\n"
    );
    place.ends(&format!("neighbors find {released} --source overlap --out lists.parquet"), 0);
    place.ends(&format!("recover {released} --neighbors lists.parquet --out back.parquet"), 0);
    let (stdout, _) =
        place.ends(&format!("invert {released} --recovered back.parquet --out back"), 0);
    assert_eq!(stdout, "3 pictures, in back\n");
    assert_eq!(size("back/d.webp.png"), (64, 48));
}
