//! `unlift audit sequence`: a model and features in, rows by number of queries out.

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::geometry::camera::{Camera, Intrinsics, Pose};

use crate::common::{Place, random, recovered, row, rows};

const N_IMAGES: usize = 6;
const N_POINTS: usize = 80;

/// Creates the COLMAP model of a walk in `model`, and the features of its images, without noise, in `f.h5`.
fn walk() -> Place {
    let place = Place::empty();
    let point = |at: usize| {
        let [a, b, c] = [random(3 * at), random(3 * at + 1), random(3 * at + 2)];
        [2.0 * a - 1.0, 1.4 * b - 0.7, 3.0 + 2.0 * c]
    };
    let points: Vec<[f64; 3]> = (0..N_POINTS).map(point).collect();
    let values =
        (0..N_POINTS * 128).map(|at| (random(at * at % 7919 + at) * 255.0) as u8).collect();
    let descriptors = Descriptors::try_new(Values::U8(values), 128).unwrap();
    let (mut images, mut features) = (String::new(), Vec::new());
    for at in 0..N_IMAGES {
        // The camera walks to the right, up and down, and turns about its axis.
        let turn = 0.1 * at as f64;
        let center = [0.2 * at as f64 - 0.5, 0.1 * (at % 3) as f64, 0.0];
        let pose = Pose { center, ..Pose::IDENTITY.moved(&[0.0, 0.0, turn, 0.0, 0.0, 0.0]) };
        let ([x, y, z], (sin, cos)) = (pose.translation(), (turn / 2.0).sin_cos());
        images += &format!("{} {cos} 0 0 {sin} {x} {y} {z} 1 {at}.png\n\n", at + 1);
        let intrinsics = Intrinsics { focal: [500.0; 2], principal: [319.5, 239.5] };
        let camera = Camera { intrinsics, pose };
        let keypoints = points.iter().filter_map(|point| camera.project(point)).collect();
        features.push((format!("{at}.png"), keypoints, Some(descriptors.clone())));
    }
    place.write_features("f.h5", features);
    let track: String = (1..=N_IMAGES).map(|id| format!(" {id} 0")).collect();
    let lines = points.iter().enumerate();
    let lines = lines.map(|(at, [x, y, z])| format!("{} {x} {y} {z} 9 9 9 0{track}\n", at + 1));
    place.write("model/points3D.txt", lines.collect::<String>());
    place.write("model/images.txt", images);
    place.write("model/cameras.txt", "1 SIMPLE_PINHOLE 640 480 500 320 240\n");
    place
}

#[test]
fn keypoints_come_back_by_the_number_of_queries_of_images_that_fit() {
    let place = walk();
    let line = "audit sequence model f.h5 --queries 2,3,5,9 --schemes lines2d,cp2d --out a";
    let (stdout, stderr) = place.ends(line, 0);
    assert!(stderr.contains("6 images: no rows for [9] queries"), "{stderr}");
    assert!(stdout.contains("After 2 queries 0.0 %, "), "{stdout}");
    assert!(stdout.contains("Not tried: neighbors by descriptors within"), "{stdout}");
    let document = place.json("a/audit.json");
    let share = |scheme, neighbors: &str| recovered(row(&document, scheme, neighbors), "5");
    for by in ["sequence", "tracks"] {
        assert_eq!(share("lines2d", &format!("{by}@2")), 0.0);
        assert!(share("lines2d", &format!("{by}@3")) > 95.0, "{by}");
        assert!(share("lines2d", &format!("{by}@5")) > 95.0, "{by}");
        assert!(share("cp2d", &format!("{by}@5")) > 90.0, "{by}");
    }
    assert_eq!(rows(&document).len(), 2 * 3 * 2);
    let images = place.text("model/images.txt").replace(" 1 5.png", " 2 5.png");
    place.write("model/images.txt", images);
    let cameras = "1 SIMPLE_PINHOLE 640 480 500 320 240\n2 SIMPLE_PINHOLE 320 240 250 160 120\n";
    place.write("model/cameras.txt", cameras);
    let (_, stderr) = place.ends(line, 3);
    assert!(stderr.contains("5.png: expected 320 x 240 pixels, as its camera"), "{stderr}");
    assert!(stderr.contains("f.h5: expected 6 images that can be used, found 5"), "{stderr}");
    let images = &place.json("a/audit.json")["input"]["images"];
    assert_eq!([&images["used"], &images["unusable"]], [5, 1]);
}

#[test]
#[rustfmt::skip] // One row per line.
fn lists_and_changed_descriptors_have_rows_of_their_own() {
    let place = walk();
    let audit = "audit sequence model f.h5 --queries 2,5 --schemes lines2d --thresholds 5";
    let audit = format!("{audit} --neighbors similarity --mitigate noise:0.5");
    place.ends(&format!("{audit} --gate lines2d:sequence+lists@5:5<=100"), 0);
    let (text, _) = place.ends(&format!("{audit} --gate lines2d:5<=100"), 1);
    assert!(text.contains("neighbors by descriptors, the best source, were not tried"), "{text}");
    let document = place.json("unlift-audit/audit.json");
    let share = |scheme, by| recovered(row(&document, scheme, by), "5");
    let alone = share("lines2d", "sequence@5");
    // These descriptors say nothing about neighbors, so lists must not move what the queries fix.
    assert!(share("lines2d", "sequence+lists@5") >= alone);
    assert!(share("lines2d_noise0.5", "sequence@5") < alone - 20.0);
    let shuffled = place.features("f.h5").into_iter().enumerate().map(|(at, image)| {
        let order: Vec<u32> = (0..N_POINTS).map(|row| ((row + 17 * at) % N_POINTS) as u32).collect();
        (image.name, image.keypoints, image.descriptors.map(|rows| rows.select(&order)))
    });
    place.write_features("g.h5", shuffled);
    place.refuses("audit sequence model", &[
        ("g.h5", 3, "g.h5: expected descriptors of the model's keypoints"),
        ("f.h5 --mitigate thin:1/4", 2, "expected noise:DEVIATION or drop:SHARE"),
        ("f.h5 --neighbors oracle", 2, "expected a source that reads released data"),
    ]);
}
