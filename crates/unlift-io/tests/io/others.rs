//! Tests maps of other programs: two cameras and `POINTS`, in each format. The first camera looks along z from
//! (0, 0, -5). The second, at (1, 2, -5), is rotated by 90 degrees about its viewing direction.

use std::fs;

use unlift_io::read::{self, Input};

use super::{POINTS, close, open, refused};

/// Cameras look along -z, and y is up. The last camera was not registered.
pub const BUNDLER: &str = "# Bundle file v0.3\n3 3\n\
    500 0.01 0\n1 0 0\n0 -1 0\n0 0 -1\n0 0 -5\n\
    500 0.01 0\n0 -1 0\n-1 0 0\n0 0 -1\n2 1 -5\n\
    0 0 0\n0 0 0\n0 0 0\n0 0 0\n0 0 0\n\
    0.5 -1.25 3\n255 0 7\n2 0 11 1.5 -2.5 1 12 3.5 4.5\n\
    1000 2 -0.0625\n255 0 7\n2 0 11 1.5 -2.5 1 12 3.5 4.5\n\
    0.125 0.25 0.375\n255 0 7\n2 0 11 1.5 -2.5 1 12 3.5 4.5\n";

pub const NVM: &str = "NVM_V3 \n\n2\n\
    photo0.jpg\t500 1 0 0 0 0 0 -5 0.1 0\n\
    a photo1.jpg\t500 0.7071067811865476 0 0 0.7071067811865476 1 2 -5 0.1 0\n\n3\n\
    0.5 -1.25 3 255 0 7 2 0 11 1.5 -2.5 1 12 3.5 4.5\n\
    1000 2 -0.0625 255 0 7 2 0 11 1.5 -2.5 1 12 3.5 4.5\n\
    0.125 0.25 0.375 255 0 7 2 0 11 1.5 -2.5 1 12 3.5 4.5\n\
    \n\n0\n\n#the last part of NVM file points to the PLY files\n0\n";

pub const OPENSFM: &str = r#"{"cameras": {"v2": {"k1": 0.0}}, "shots": {
    "0.jpg": {"rotation": [0.0, 0.0, 0.0], "translation": [0.0, 0.0, 5.0], "camera": "v2", "gps": null},
    "1.jpg": {"rotation": [0.0, 0.0, 1.5707963267948966], "translation": [2.0, -1.0, 5.0], "camera": "v2"}},
    "points": {"90": {"color": [1, 2, 3], "coordinates": [0.5, -1.25, 3.0]},
    "89": {"coordinates": [1000.0, 2.0, -0.0625]}, "88": {"coordinates": [0.125, 0.25, 0.375]}}}"#;

const NERFSTUDIO: &str = r#"{"w": 640, "ply_file_path": "sparse_pc.ply", "frames": [
    {"transform_matrix": [[1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, -5.0], [0.0, 0.0, 0.0, 1.0]]},
    {"transform_matrix": [[0.0, -1.0, 0.0, 1.0], [-1.0, 0.0, 0.0, 2.0], [0.0, 0.0, -1.0, -5.0], [0.0, 0.0, 0.0, 1.0]]}]}"#;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
    end_header\n0.5 -1.25 3\n1000 2 -0.0625\n0.125 0.25 0.375\n";

fn same(input: &Input, format: &str) {
    assert_eq!((input.format, &input.positions[..]), (format, &POINTS[..]));
    assert_eq!((&input.ids[..], input.cameras.len()), (&[0, 1, 2][..], 2));
    close(input.cameras[0], [0.0, 0.0, -5.0], 1e-12);
    close(input.cameras[1], [1.0, 2.0, -5.0], 1e-12);
    // The mean of the -y of both cameras.
    let up = -std::f64::consts::FRAC_1_SQRT_2;
    close(input.up.unwrap(), [up, up, 0.0], 1e-12);
}

#[test]
fn every_form_gives_the_same_points_and_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let small = r#"{"shots": {}, "points": {"1": {"coordinates": [1, 2, 3]}}}"#;
    let of_parts = "read, the largest of 2 reconstructions (3 points)";
    let several = format!("[{small}, {OPENSFM}]");
    let models = NVM.replacen(
        "\n\n",
        "\n1\na 1 1 0 0 0 0 0 0 0 0\n1\n9 9 9\n1\nb 1 1 0 0 0 0 0 0 0 0\n0\n",
        1,
    );
    let of_models = "read, the largest of 2 models (3 points)1 photos without a pose";
    fs::create_dir(folder.path().join("nerf")).unwrap();
    fs::write(folder.path().join("nerf/sparse_pc.ply"), PLY).unwrap();
    for (name, text, format, note) in [
        ("bundler/bundle.out", BUNDLER, "Bundler", "1 of 3 cameras have no place"),
        ("nvm/scene.nvm", NVM, "NVM", ""),
        ("nvm/models.nvm", &models, "NVM", of_models),
        ("sfm/reconstruction.json", &several, "OpenSfM", of_parts),
        ("json/map.json", OPENSFM, "OpenSfM", ""),
        ("nerf/transforms.json", NERFSTUDIO, "nerfstudio", ""),
    ] {
        let path = folder.path().join(name);
        let parent = path.parent().unwrap();
        fs::create_dir_all(parent).unwrap();
        fs::write(&path, text).unwrap();
        let input = read::open(&path).unwrap();
        same(&input, format);
        assert_eq!(input.notes.concat(), note);
        assert_eq!(input.files.len(), 1 + usize::from(format == "nerfstudio"));
        // Folders are known by the usual names.
        let is_project = !["nvm", "json"].iter().any(|of| parent.ends_with(of));
        assert_eq!(read::is_project(parent), is_project, "{name}");
        if is_project {
            same(&read::open(parent).unwrap(), format);
        }
    }
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_file_is_refused_with_its_line() {
    let no_camera = BUNDLER.lines().take(16).collect::<Vec<_>>().join("\n");
    let deep = format!("[{{\"x\": {}1{}}}]", "[".repeat(500), "]".repeat(500));
    let short = format!("[{}]", OPENSFM.replace("[0.125, 0.25, 0.375]", "[0.125, 0.25]"));
    let no_distortion = NVM.replace(" 0.1 0\n", "\n").replace("1 0 0 0 0 0 -5", "1 0 0 0 0 0");
    // The name, the content, and the error line, in which `…` is any text.
    for (name, text, expected) in [
        ("a.out", "what else is called so\n".into(), "a.out:1: expected numbers of cameras and points, as Bundler writes them, found \"what else is called so\""),
        ("a.out", no_camera, "a.out:17: expected camera 2, found end of file"),
        ("a.out", "1 18446744073709551615\n1 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 0\n".into(), "a.out:7: expected point 0, found end of file"),
        ("a.out", "0 1\n1 nan 2\n0 0 0\n0\n".into(), "a.out: expected a point with a place, found 1 without one"),
        ("a.nvm", "NVM_V2\n".into(), "a.nvm:1: expected NVM_V3…"),
        ("a.nvm", no_distortion, "a.nvm:…camera 0: name, focal length, quaternion, center, distortion"),
        ("a.json", "[{\"id\": 0, \"position\": [1, 2, 3]}]".into(), "a.json: expected a map of OpenSfM or nerfstudio, found other JSON"),
        ("a.json", "{\"images\": [], \"categories\": [], \"points\": [[1, 2]]}".into(), "a.json:1: expected a map of OpenSfM or nerfstudio, found …"),
        ("a.json", short, "a.json:…invalid length 2, expected an array of length 3"),
        ("a.json", "[".into(), "a.json:…EOF while parsing"),
        // Unused values are skipped at any depth.
        ("a.json", deep, "a.json: expected a map of OpenSfM or nerfstudio, found other JSON"),
        ("transforms.json", NERFSTUDIO.replace("sparse_pc", "../elsewhere"), "transforms.json: ply_file_path: expected a path within the folder, found ../elsewhere.ply"),
        ("transforms.json", NERFSTUDIO.replace("\"sparse_pc.ply\"", "null"), "transforms.json: …a point cloud beside the cameras, found none"),
        ("transforms.json", NERFSTUDIO.replace("sparse_pc", "none"), "none.ply: expected…"),
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
    let ply = format!("{}3 0 1 2\n", PLY.replacen("end_header", faces, 1));
    for (name, text, all, few) in [
        ("a.out", BUNDLER, "\n3 3\n", "\n3 2\n"),
        ("a.nvm", NVM, "\n3\n", "\n2\n"),
        ("a.ply", &ply, "vertex 3", "vertex 2"),
    ] {
        let told = "2 points are declared, and 1 more seem to follow, which are not read: results are about a part of the map";
        assert!(open(name, text).doubts.is_empty(), "{name}");
        assert_eq!(open(name, text.replacen(all, few, 1)).doubts, [told], "{name}");
    }
}

/// Python writes NaN and Infinity, which JSON does not allow.
#[test]
fn json_with_numbers_that_are_none_has_points_left_out() {
    let point = |x: &str| format!(r#""{x} NaN \" I": {{"coordinates": [{x}, 2.0, 3.0]}}"#);
    let points = ["1.0", "NaN", "-1.5", "Infinity", "-Infinity", "4.0"].map(point).join(", ");
    let text = format!(r#"[{{"shots": {{}}, "points": {{{points}}}}}]"#);
    let input = open("reconstruction.json", text);
    assert_eq!(input.positions, [[1.0, 2.0, 3.0], [-1.5, 2.0, 3.0], [4.0, 2.0, 3.0]]);
}
