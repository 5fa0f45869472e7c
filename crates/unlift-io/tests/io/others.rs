//! Tests maps of other programs: two cameras and three points, in each format.

use std::fs;

use unlift_io::read::{self, Input};

use super::{POINTS, close, open, refused};

/// The first camera looks along z. The second is rotated by 90 degrees about its viewing direction.
const CENTERS: [[f64; 3]; 2] = [[0.0, 0.0, -5.0], [1.0, 2.0, -5.0]];

/// `x_cam = R x + t` with y down: `R` row by row, and `t = -R c`.
const ROTATIONS: [[[f64; 3]; 3]; 2] = [
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
];
/// The up directions of the photos: -y of the camera.
const UP: [[f64; 3]; 2] = [[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]];

fn translation(at: usize) -> [f64; 3] {
    ROTATIONS[at].map(|row| -(0..3).map(|c| row[c] * CENTERS[at][c]).sum::<f64>())
}

fn words(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

pub fn bundler() -> String {
    let mut text = "# Bundle file v0.3\n3 3\n".to_owned();
    for (at, rotation) in ROTATIONS.iter().enumerate() {
        text += "500 0.01 0\n";
        // Bundler's cameras look along -z, and y is up.
        for (row, sign) in rotation.iter().zip([1.0, -1.0, -1.0]) {
            text += &format!("{}\n", words(&row.map(|x| sign * x)));
        }
        let t = translation(at);
        text += &format!("{}\n", words(&[t[0], -t[1], -t[2]]));
    }
    // A camera that was not registered.
    text += "0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n";
    for point in POINTS {
        text += &format!("{}\n255 0 7\n2 0 11 1.5 -2.5 1 12 3.5 4.5\n", words(&point));
    }
    text
}

pub fn nvm() -> String {
    let half = 0.5_f64.sqrt();
    let quaternions = [[1.0, 0.0, 0.0, 0.0], [half, 0.0, 0.0, half]];
    let mut text = "NVM_V3 \n\n2\n".to_owned();
    for at in 0..2 {
        let (q, c) = (words(&quaternions[at]), words(&CENTERS[at]));
        text += &format!("photo{at}.jpg\t500 {q} {c} 0.1 0\n");
    }
    text += "\n3\n";
    for point in POINTS {
        text += &format!("{} 255 0 7 2 0 11 1.5 -2.5 1 12 3.5 4.5\n", words(&point));
    }
    text + "\n\n0\n\n#the last part of NVM file points to the PLY files\n0\n"
}

pub fn opensfm(points: &[[f64; 3]]) -> String {
    // A rotation by 90 degrees about z, as axis times angle.
    let vectors = [[0.0; 3], [0.0, 0.0, std::f64::consts::FRAC_PI_2]];
    let shots = [0, 1].map(|at| {
        let (r, t) = (vectors[at], translation(at));
        format!(r#""{at}.jpg": {{"rotation": {r:?}, "translation": {t:?}, "camera": "v2", "gps": null}}"#)
    });
    let point = |(at, point): (usize, &[f64; 3])| {
        format!(r#""{}": {{"color": [1, 2, 3], "coordinates": {point:?}}}"#, 90 - at)
    };
    let points: Vec<String> = points.iter().enumerate().map(point).collect();
    let (shots, points) = (shots.join(", "), points.join(", "));
    format!(
        r#"{{"cameras": {{"v2": {{"k1": 0.0}}}}, "shots": {{{shots}}}, "points": {{{points}}}}}"#
    )
}

fn nerfstudio(cloud: &str) -> String {
    let frames = [0, 1].map(|at| {
        // From camera (y up, looking along -z) to world: columns of the rotation, two of them
        // negated.
        let r = &ROTATIONS[at];
        let row = |c: usize| [r[0][c], -r[1][c], -r[2][c], CENTERS[at][c]];
        let rows = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
        format!(r#"{{"file_path": "{at}.png", "transform_matrix": {rows:?}}}"#)
    });
    format!(r#"{{"w": 640, "frames": [{}], "ply_file_path": {cloud}}}"#, frames.join(", "))
}

fn ply() -> String {
    let axes = ["x", "y", "z"].map(|axis| format!("property double {axis}\n")).concat();
    let rows = POINTS.map(|point| words(&point) + "\n").concat();
    format!("ply\nformat ascii 1.0\nelement vertex 3\n{axes}end_header\n{rows}")
}

fn same(input: &Input, format: &str) {
    assert_eq!((input.format, &input.positions[..]), (format, &POINTS[..]));
    assert_eq!((&input.ids[..], input.cameras.len()), (&[0, 1, 2][..], 2));
    input.cameras.iter().zip(CENTERS).for_each(|(&camera, center)| close(camera, center, 1e-12));
    close(
        input.up.unwrap(),
        std::array::from_fn(|c| (UP[0][c] + UP[1][c]) / 2.0_f64.sqrt()),
        1e-12,
    );
}

#[test]
fn every_form_gives_the_same_points_and_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        path
    };
    let input = read::open(&put("bundler/bundle.out", &bundler())).unwrap();
    same(&input, "Bundler");
    assert_eq!(input.notes, ["1 of 3 cameras have no place"]);
    let input = read::open(&put("scene.nvm", &nvm())).unwrap();
    same(&input, "NVM");
    assert!(input.notes.is_empty());
    let several = format!("[{}, {}]", opensfm(&POINTS[..1]), opensfm(&POINTS));
    let input = read::open(&put("sfm/reconstruction.json", &several)).unwrap();
    same(&input, "OpenSfM");
    assert_eq!(input.notes, ["read, the largest of 2 reconstructions (3 points)"]);
    same(&read::open(&put("map.json", &opensfm(&POINTS))).unwrap(), "OpenSfM");
    put("nerf/sparse_pc.ply", &ply());
    let input = read::open(&put("nerf/transforms.json", &nerfstudio("\"sparse_pc.ply\""))).unwrap();
    same(&input, "nerfstudio");
    assert_eq!(input.files.len(), 2);
    for (name, format) in [("bundler", "Bundler"), ("sfm", "OpenSfM"), ("nerf", "nerfstudio")] {
        assert!(read::is_project(&folder.path().join(name)));
        same(&read::open(&folder.path().join(name)).unwrap(), format);
    }
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_file_is_refused_with_its_line() {
    let cut = |text: String, n: usize| text.lines().take(n).collect::<Vec<_>>().join("\n");
    let deep = format!("[{{\"x\": {}1{}}}]", "[".repeat(500), "]".repeat(500));
    let short = format!("[{}]", opensfm(&POINTS).replace("[0.125, 0.25, 0.375]", "[0.125, 0.25]"));
    let no_distortion = nvm().replace(" 0.1 0\n", "\n").replace("1 0 0 0 0 0 -5", "1 0 0 0 0 0");
    // The name, the content, and the error line, in which `…` is any text.
    for (name, text, expected) in [
        ("a.out", "what else is called so\n".into(), "a.out:1: expected numbers of cameras and points, as Bundler writes them, found \"what else is called so\""),
        ("a.out", cut(bundler(), 16), "a.out:17: expected camera 2, found end of file"),
        ("a.out", "1 18446744073709551615\n1 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 0\n".into(), "a.out:7: expected point 0, found end of file"),
        ("a.out", "0 1\n1 nan 2\n0 0 0\n0\n".into(), "a.out: expected a point with a place, found 1 without one"),
        ("a.nvm", "NVM_V2\n".into(), "a.nvm:1: expected NVM_V3…"),
        ("a.nvm", no_distortion, "a.nvm:…camera 0: name, focal length, quaternion, center, distortion"),
        ("a.json", "{}".into(), "a.json: expected a map of OpenSfM or nerfstudio, found other JSON"),
        ("a.json", "[{\"id\": 0, \"position\": [1, 2, 3]}]".into(), "a.json: expected a map of OpenSfM or nerfstudio, found other JSON"),
        ("a.json", "{\"images\": [], \"categories\": [], \"points\": [[1, 2]]}".into(), "a.json:1: expected a map of OpenSfM or nerfstudio, found …"),
        ("a.json", r#"{"points": [[1, 2, 3]]}"#.into(), "a.json:1: expected a map of OpenSfM or nerfstudio, found other JSON (…"),
        ("a.json", r#"{"frames": [{}]}"#.into(), "a.json:1: expected a map of OpenSfM or nerfstudio, found other JSON (…"),
        ("a.json", short, "a.json:…invalid length 2, expected an array of length 3"),
        ("a.json", "[".into(), "a.json:…EOF while parsing"),
        // Unused values are skipped at any depth.
        ("a.json", deep, "a.json: expected a map of OpenSfM or nerfstudio, found other JSON"),
        ("transforms.json", nerfstudio("\"../elsewhere.ply\""), "transforms.json: ply_file_path: expected a path within the folder, found ../elsewhere.ply"),
        ("transforms.json", nerfstudio("null"), "transforms.json: …a point cloud beside the cameras, found none"),
        ("transforms.json", nerfstudio("\"none.ply\""), "none.ply: expected…"),
    ] {
        let line = refused(name, &text);
        match expected.split_once('…') {
            Some((begin, end)) => assert!(line.starts_with(begin) && line.contains(end), "{text}: {line}"),
            None => assert_eq!(line, expected, "{text}"),
        }
    }
}

#[test]
fn files_with_more_points_than_they_declare_are_doubted() {
    let faces = "element face 1\nproperty list uchar int vertex_indices\nend_header";
    let ply = format!("{}3 0 1 2\n", ply().replacen("end_header", faces, 1));
    for (name, text, all, few) in [
        ("a.out", bundler(), "\n3 3\n", "\n3 2\n"),
        ("a.nvm", nvm(), "\n3\n", "\n2\n"),
        ("a.ply", ply, "vertex 3", "vertex 2"),
    ] {
        let told = "2 points are declared, and 1 more seem to follow, which are not read: results are about a part of the map";
        assert!(open(name, &text).doubts.is_empty(), "{name}");
        assert_eq!(open(name, text.replacen(all, few, 1)).doubts, [told], "{name}");
    }
}

/// Python writes NaN and Infinity, which JSON does not allow.
#[test]
fn json_with_numbers_that_are_none_has_points_left_out() {
    let point = |x: &str| format!(r#"{{"coordinates": [{x}, 2.0, 3.0]}}"#);
    let points: Vec<String> = ["1.0", "NaN", "-1.5", "Infinity", "-Infinity", "4.0"]
        .iter()
        .enumerate()
        .map(|(at, x)| format!("\"{at} NaN \\\" I\": {}", point(x)))
        .collect();
    let text = format!(r#"[{{"shots": {{}}, "points": {{{}}}}}]"#, points.join(", "));
    let input = open("reconstruction.json", text);
    assert_eq!(input.positions, [[1.0, 2.0, 3.0], [-1.5, 2.0, 3.0], [4.0, 2.0, 3.0]]);
}
