//! `unlift invert` and `--invert`.

use std::fs;

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift_io::features::{FeatureWriter, ImageFeatures};

use crate::common::Place;

const CHEAP: &str = "--schemes lines2d --inlier-ratios 0.5 --solver joint-start --k 8";

fn place() -> Place {
    Place::with_photos(&["a.png", "b/c.jpg", "d.webp"])
}

#[test]
fn an_audit_of_images_tells_how_alike_pictures_are_and_shows_them() {
    let place = place();
    let metrics = |threads: usize| {
        let line =
            format!("audit images photos --invert {CHEAP} --threads {threads} --out a --force");
        place.ends(&line, 0);
        place.json("a/audit.json")["results"][0]["metrics"].clone()
    };
    let found = metrics(1);
    assert_eq!(found, metrics(4));
    for name in ["ssim", "psnr", "lpips"] {
        let (figure, baseline) = (&found[name], &found[&format!("{name}_baseline")]);
        assert!(figure.is_f64() && baseline.is_f64(), "{found}");
    }
    let page = place.text("a/report.html");
    assert!(page.contains("id=\"inversions\"") && page.contains("data:image/jpeg;base64,"));
    // A photo, its baseline and its recovered picture, for three images.
    assert!(page.matches("<figure").count() >= 9);
    place.ends(&format!("audit images photos --invert {CHEAP} --share-safe --out safe"), 0);
    assert!(!place.text("safe/report.html").contains("id=\"inversions\""));
}

#[test]
fn what_cannot_be_painted_is_told() {
    let place = place();
    place.ends("features photos --out features.h5", 0);
    fs::create_dir(place.path("none")).unwrap();
    fs::rename(place.path("photos"), place.path("some")).unwrap();
    fs::remove_file(place.path("some/b/c.jpg")).unwrap();
    for (line, code, expected) in [
        (
            "images features.h5 --photos none --invert",
            3,
            "unlift: none: expected photos of the images in features.h5, found none\n",
        ),
        (
            "images features.h5 --invert",
            2,
            "unlift: --invert: expected --photos, as PATH is no folder of photos\n",
        ),
        ("map features.h5 --invert", 2, "--photos"),
    ] {
        let told = place.complains(&format!("audit {line} --out x"), code);
        assert!(told.contains(expected), "{told}");
    }
    assert!(!place.path("x").exists());
    // If one photo is missing, the others are painted.
    let line = format!("audit images features.h5 --photos some --invert {CHEAP} --out audit");
    let (_, stderr) = place.ends(&line, 0);
    let note = "note: not painted: image b/c.jpg: some/b/c.jpg: expected a JPEG";
    assert!(stderr.contains(note), "{stderr}");
    assert!(place.json("audit/audit.json")["results"][0]["metrics"]["ssim"].is_f64());
}

#[test]
fn a_network_of_ones_own_paints_what_the_program_has_none_for() {
    let place = place();
    // There is no network for SuperPoint.
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
    for line in ["audit images superpoint.h5 --photos photos --invert", "invert superpoint.h5"] {
        let stderr = place.complains(&format!("{line} --out x"), 3);
        let missing = stderr.contains("inverter-superpoint.onnx: expected in ");
        assert!(missing && stderr.contains("training/inversion"), "{stderr}");
    }
    let models = concat!(env!("CARGO_MANIFEST_DIR"), "/../unlift-vision/models");
    let other =
        format!("invert photos --inverter {models}/lpips-squeeze/lpips-squeeze.onnx --out x");
    let told = place.complains(&other, 3);
    assert!(told.contains("expected an input features of shape (1, 135, any, any)"), "{told}");
    assert!(!place.path("x").exists());
    let own = format!("--inverter {models}/inverter-aliked/inverter-aliked.onnx");
    let line = format!("audit images photos --features aliked --invert {own} {CHEAP} --out own");
    place.ends(&line, 0);
    let document = place.json("own/audit.json");
    assert!(document["results"][0]["metrics"]["ssim"].is_f64(), "{document}");
    assert_eq!(document["options"]["inverter_sha256"].as_str().unwrap().len(), 64, "{document}");
    let (stdout, _) =
        place.ends(&format!("invert photos --features aliked {own} --out pictures"), 0);
    assert_eq!(stdout, "3 pictures, in pictures\n");
}

#[test]
fn keypoints_and_what_came_back_are_painted_to_files() {
    let place = place();
    let (stdout, _) = place.ends("invert photos --out pictures", 0);
    assert_eq!(stdout, "3 pictures, in pictures\n");
    let size = |file: &str| image::image_dimensions(place.path(file)).unwrap();
    assert_eq!(size("pictures/b/c.jpg.png"), (64, 48));
    // Pictures are replaced, other files and inputs are not.
    place.ends("invert photos --out pictures", 0);
    place.write("pictures/a.png.png", "mine");
    let (_, stderr) = place.ends("invert photos --out pictures", 3);
    assert!(stderr.contains("pictures/a.png.png: expected nothing, or a picture of"), "{stderr}");
    assert_eq!(place.text("pictures/a.png.png"), "mine");
    place.ends("invert photos --out pictures --force --max-images 1", 0);

    place.ends("features photos --out features.h5", 0);
    place.ends("obfuscate features.h5 --scheme cp2d --out hidden", 0);
    let released = "hidden/released.parquet";
    assert_eq!(
        place.complains(&format!("invert {released} --out y"), 2),
        "unlift: --recovered: expected what came back of PATH, found none\n"
    );
    place.ends(&format!("neighbors find {released} --source overlap --out lists.parquet"), 0);
    place.ends(&format!("recover {released} --neighbors lists.parquet --out back.parquet"), 0);
    let (stdout, _) =
        place.ends(&format!("invert {released} --recovered back.parquet --out back"), 0);
    assert_eq!(stdout, "3 pictures, in back\n");
    assert_eq!(size("back/d.webp.png"), (64, 48));
}
