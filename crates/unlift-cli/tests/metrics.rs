//! `unlift metrics`, as a user has it.

mod common;

use std::fs;

use common::Place;
use serde_json::Value;

fn place() -> Place {
    let names = ["a/one.png", "a/two.png", "b/one.jpg", "b/two.png", "b/more.png"];
    let place = Place::with_photos(&names);
    for folder in ["a", "b"] {
        fs::rename(place.path("photos").join(folder), place.path(folder)).unwrap();
    }
    fs::copy(place.path("a/two.png"), place.path("b/two.png")).unwrap();
    place
}

#[test]
fn two_pictures_have_three_figures() {
    let place = place();
    let (stdout, stderr) = place.ends("metrics a/one.png b/one.jpg --json", 0);
    let found: Value = serde_json::from_str(&stdout).unwrap();
    let figure = |name: &str| found[name].as_f64().unwrap();
    assert!(stderr.is_empty(), "{stderr}");
    assert!((-1.0..1.0).contains(&figure("ssim")), "{stdout}");
    assert!((1.0..60.0).contains(&figure("psnr")), "{stdout}");
    assert!((0.0..1.5).contains(&figure("lpips")), "{stdout}");
    let (text, _) = place.ends("metrics a/one.png b/one.jpg", 0);
    assert!(text.contains(&format!("SSIM  {:.4}\n", figure("ssim"))), "{text}");
}

#[test]
fn equal_pictures_are_alike_and_have_no_ratio() {
    let place = place();
    let (stdout, _) = place.ends("metrics a/one.png a/one.png --json", 0);
    let found: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((found["ssim"].as_f64(), found["lpips"].as_f64()), (Some(1.0), Some(0.0)));
    assert!(found["psnr"].is_null());
}

#[test]
fn folders_are_compared_by_name_and_what_has_no_partner_is_told() {
    let place = place();
    let (stdout, stderr) = place.ends("metrics a b --json", 0);
    let found: Value = serde_json::from_str(&stdout).unwrap();
    let pictures = found["pictures"].as_array().unwrap();
    assert_eq!(pictures.len(), 2);
    assert_eq!((&pictures[0]["name"], &pictures[1]["name"]), (&"one".into(), &"two".into()));
    let mean = (pictures[0]["ssim"].as_f64().unwrap() + 1.0) / 2.0;
    assert!((found["ssim"].as_f64().unwrap() - mean).abs() < 1e-12);
    assert_eq!(stderr, "unlift: b/more.png: no picture of this name in a\n");
    let (table, _) = place.ends("metrics a b", 0);
    assert!(table.lines().last().unwrap().starts_with("mean"), "{table}");
}

#[test]
fn what_cannot_be_compared_is_one_line() {
    let place = place();
    fs::write(place.path("text.png"), "not a picture").unwrap();
    let complaint = |line: &str, code: i32| place.ends(line, code).1;
    assert_eq!(
        complaint("metrics a b/one.jpg", 2),
        "unlift: a and b/one.jpg: expected two pictures or two folders, found one of each\n"
    );
    assert_eq!(
        complaint("metrics text.png a/one.png", 3),
        "unlift: text.png: expected a JPEG, PNG or WebP image, found text\n"
    );
    fs::create_dir(place.path("empty")).unwrap();
    assert!(
        complaint("metrics a empty", 3)
            .ends_with("unlift: a: expected pictures of the same names as in empty, found none\n")
    );
}
