//! `unlift invert` and `--invert`.

use crate::common::Place;

#[test]
fn an_audit_of_images_tells_how_alike_pictures_are_and_shows_them() {
    let place = Place::with_photos();
    let metrics = |threads: usize| {
        let line = "audit images photos --invert --schemes lines2d --inlier-ratios 0.5 --solver consensus --k 8 --out a";
        place.ends(&format!("RAYON_NUM_THREADS={threads} {line}"), 0);
        place.json("a/audit.json")["results"][0]["metrics"].clone()
    };
    let found = metrics(1);
    assert_eq!(found, metrics(4));
    for name in ["ssim", "psnr", "lpips"] {
        let (figure, baseline) = (&found[name], &found[&format!("{name}_baseline")]);
        assert!(figure.is_f64() && baseline.is_f64(), "{found}");
    }
    assert_eq!(found["reidentified_by_chance"], 0.333333);
    assert!(found["reidentified"].is_f64() && found["reidentified_baseline"].is_f64(), "{found}");
    // A photo, its baseline and its recovered picture, for three images.
    assert!(place.text("a/report.html").matches("<figure").count() >= 9);
}

#[test]
fn keypoints_and_what_came_back_are_painted_to_files() {
    let place = Place::with_photos();
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

    place.ends("features photos --out features.h5", 0);
    place.ends("obfuscate features.h5 --schemes cp2d --out hidden", 0);
    let released = "hidden/released.npz";
    let line = "unlift: RECOVERED: expected what came back of PATH, found none\n";
    assert_eq!(place.complains(&format!("invert {released} --out y"), 2), line);
    place.ends(&format!("neighbors {released} --neighbors overlap --out lists.npz"), 0);
    place.ends(&format!("recover {released} --neighbors lists.npz --out back.npz"), 0);
    let (stdout, _) = place.ends(&format!("invert {released} back.npz --out back"), 0);
    assert_eq!(stdout, "3 pictures, in back\n");
    assert_eq!(size("back/b/ü d.webp.png"), (64, 48));
}
