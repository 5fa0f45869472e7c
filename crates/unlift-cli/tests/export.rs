//! `unlift export`: what was written is what is read again, on the map, and nothing else is lost.

mod common;

use std::fs;

use common::Place;
use unlift_io::read;

const HIDE: &str = "obfuscate room.csv --scale 0.5 --seed 1 --k 10 --out hidden --scheme";

/// A room whose map is in half meters, hidden by `scheme` and recovered.
fn recovered(scheme: &str) -> Place {
    let place = Place::with_room(400);
    place.ends(&format!("{HIDE} {scheme}"), 0);
    place.ends(
        "neighbors oracle hidden/truth.parquet --inlier-ratio 1 --k 10 --out lists.parquet",
        0,
    );
    place.ends("recover hidden/released.parquet --neighbors lists.parquet --out back.parquet", 0);
    place
}

fn positions(place: &Place, name: &str) -> Vec<[f64; 3]> {
    read::open(&place.path(name)).expect("a map").positions
}

#[test]
fn the_truth_comes_back_in_every_form_and_on_the_map() {
    let place = recovered("olc");
    let room = unlift::synthetic::room(1, 400).points;
    let (told, _) = place.ends("export hidden/truth.parquet --scale 0.5 --out truth.ply", 0);
    assert_eq!(told, "400 points, in truth.ply\n");
    let (told, _) = place.ends("export hidden/truth.parquet --scale 0.5 --out model", 0);
    assert_eq!(told, "a model of 400 points, 0 cameras and 0 images, in model\n");
    for name in ["truth.ply", "model"] {
        let read = positions(&place, name);
        assert_eq!(read.len(), room.len(), "{name}");
        for (read, known) in read.iter().zip(&room) {
            let near = (0..3).all(|c| (read[c] - known[c]).abs() < 1e-9);
            assert!(near, "{name}: {read:?} {known:?}");
        }
    }
    let (_, stderr) = place.ends("export hidden/truth.parquet --out x.stl", 2);
    let wrong = "unlift: --out: expected a name that ends in .ply, .obj or transforms.json, or a folder without an ending, \
                 found x.stl\n";
    assert!(stderr == wrong && !place.path("x.stl").exists(), "{stderr}");
    // Without a scale lengths are those of the file: meters, half as many as units.
    place.ends("export hidden/truth.parquet --out meters.ply", 0);
    let meters = positions(&place, "meters.ply");
    assert!((0..3).all(|c| (meters[7][c] - 0.5 * room[7][c]).abs() < 1e-9));
}

#[test]
fn recovered_points_and_released_lines_are_written() {
    let place = recovered("olc");
    place.ends("export back.parquet --scale 0.5 --out back.ply", 0);
    let (room, back) = (unlift::synthetic::room(1, 400).points, positions(&place, "back.ply"));
    let near = |p: &[f64; 3]| {
        let away = |q: &[f64; 3]| (0..3).map(|c| (p[c] - q[c]).powi(2)).sum::<f64>().sqrt();
        room.iter().map(away).fold(f64::INFINITY, f64::min) < 0.5
    };
    assert!(back.iter().filter(|p| near(p)).count() > 300);
    let (told, _) = place.ends("export hidden/released.parquet --scale 0.5 --out lines.obj", 0);
    let n: usize = told.split(' ').next().and_then(|n| n.parse().ok()).expect("a number");
    let text = fs::read_to_string(place.path("lines.obj")).expect("lines.obj");
    assert!(n > 300 && text.lines().filter(|line| line.starts_with("l ")).count() == n, "{told}");
}

#[test]
fn what_cannot_be_shown_is_told_and_what_is_not_ours_stays() {
    let place = recovered("plane");
    fs::write(place.path("mine.ply"), "mine").unwrap();
    fs::create_dir(place.path("mine")).unwrap();
    fs::write(place.path("mine/points3D.txt"), "# mine").unwrap();
    for (line, code, expected) in [
        ("hidden/released.parquet --out planes.obj", 3, "found planes, which have no end"),
        ("lists.parquet --out lists.ply", 3, "found neighborhoods"),
        ("back.parquet --out back.obj", 3, "expected lines or rays, as --out is .obj"),
        ("back.parquet --cameras room.csv --out back", 3, "expected a COLMAP model with cameras"),
        ("back.parquet --cameras room.csv --out back.ply", 2, "--cameras: expected a folder"),
        (
            "back.parquet --out mine.ply",
            2,
            "mine.ply: expected nothing, or a cloud of an earlier run",
        ),
        (
            "back.parquet --out mine",
            2,
            "points3D.txt: expected nothing, or a model of an earlier run",
        ),
    ] {
        let (_, stderr) = place.ends(&format!("export {line}"), code);
        assert!(stderr.contains(expected), "{line}: {stderr}");
    }
    assert_eq!(fs::read(place.path("mine.ply")).unwrap(), b"mine");
    for name in ["planes.obj", "lists.ply", "back.obj", "back", "back.ply"] {
        assert!(!place.path(name).exists(), "{name}");
    }
    // Ours are replaced.
    for _ in 0..2 {
        place.ends("export back.parquet --out again.ply", 0);
        place.ends("export back.parquet --out again", 0);
    }
}

#[test]
fn nerfstudio_gets_cameras_and_points() {
    let place = recovered("olc");
    let model = place.path("project/sparse/0");
    fs::create_dir_all(&model).unwrap();
    fs::write(model.join("cameras.txt"), "1 PINHOLE 640 480 500 500 320 240\n").unwrap();
    fs::write(model.join("images.txt"), "1 1 0 0 0 -1 -2 3 1 a.jpg\n\n").unwrap();
    fs::write(model.join("points3D.txt"), "1 0 0 0 0 0 0 0\n").unwrap();
    let line =
        "export hidden/truth.parquet --scale 0.5 --cameras project --out nerf/transforms.json";
    for _ in 0..2 {
        let (told, _) = place.ends(line, 0);
        assert_eq!(told, "400 points and 1 images, in nerf/transforms.json\n");
    }
    let map = read::open(&place.path("nerf")).expect("a map");
    assert_eq!((map.format, map.cameras), ("nerfstudio", vec![[1.0, 2.0, -3.0]]));
    let room = unlift::synthetic::room(1, 400).points;
    for (read, known) in map.positions.iter().zip(&room) {
        assert!((0..3).all(|c| (read[c] - known[c]).abs() < 1e-9), "{read:?} {known:?}");
    }
    let refused = |line: &str| place.ends(&format!("export {line}"), 2).1;
    assert_eq!(
        refused("hidden/truth.parquet --out other.json"),
        "unlift: --out: expected transforms.json, as nerfstudio calls it, found other.json\n"
    );
    assert_eq!(
        refused("hidden/truth.parquet --out transforms.json"),
        "unlift: --cameras: expected with --out transforms.json, found none\n"
    );
    // Somebody else's stays.
    fs::write(place.path("nerf/transforms.json"), "{\"frames\": []}").unwrap();
    assert!(
        refused(&line["export ".len()..]).contains("expected nothing, or cameras for nerfstudio")
    );
}
