//! Tests the bytes of exported clouds and lines.

use std::fs;
use unlift::Unit;
use unlift::released::{Lines, Obfuscation, Rays, Released};
use unlift_io::clouds;

#[test]
fn recovered_points_are_colored_and_lost_ones_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recovered.ply");
    let points = [Some([1.0, 2.0, 3.0]), None, Some([4e6, 5.0, 6.0])];
    clouds::write_recovered(&path, &points, &[0.0, f64::NAN, 1.0], 0.5).unwrap();
    let header = "ply\nformat binary_little_endian 1.0\ncomment unlift\nelement vertex 2\n\
        property double x\nproperty double y\nproperty double z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\n\
        property float error\nend_header\n";
    let mut expected = header.as_bytes().to_vec();
    for (point, color, error) in
        [([1.0, 2.0, 3.0], [0x44, 0x01, 0x54], 0.0), ([4e6, 5.0, 6.0], [0xfd, 0xe7, 0x25], 1.0)]
    {
        expected.extend(point.iter().flat_map(|x: &f64| x.to_le_bytes()));
        expected.extend(color);
        expected.extend((error as f32).to_le_bytes());
    }
    assert_eq!(fs::read(&path).unwrap(), expected);
}

#[test]
fn points_are_read_back_by_our_reader() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.ply");
    let points = [[1.0, 2.0, 3.0], [-0.1, 1e-9, 4e6]];
    clouds::write_points(&path, &points).unwrap();
    assert_eq!(unlift_io::read::open(&path).unwrap().positions, points);
    clouds::write_points(&path, &[[1.0, 2.0]]).unwrap();
    assert_eq!(unlift_io::read::open(&path).unwrap().positions, [[1.0, 2.0, 0.0]], "in the plane");
}

#[test]
fn lines_are_pairs_of_vertices() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lines.obj");
    let segments = [[[0.0, 0.5, 1.0], [1.0, 2.0, 3.0]], [[0.1, 0.0, 0.0], [4e6, 0.0, 0.0]]];
    clouds::write_lines(&path, &segments).unwrap();
    let expected = "# unlift\nv 0 0.5 1\nv 1 2 3\nl 1 2\nv 0.1 0 0\nv 4000000 0 0\nl 3 4\n";
    assert_eq!(fs::read_to_string(&path).unwrap(), expected);
}

#[test]
fn records_are_clipped_in_the_frame_of_the_map() {
    let origin = [1e6, 0.0, 0.0];
    let (low, high) = ([1e6 - 1.0, -1.0, -1.0], [1e6 + 1.0, 1.0, 1.0]);
    let along = [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
    let lines = Lines::through(&[[0.5, 0.0, 0.0], [2.0, 0.0, 0.0]], &along).unwrap();
    let released =
        |obfuscation| Released::try_new(obfuscation, 1, origin, Unit::Meter, None).unwrap();
    assert_eq!(
        clouds::record_segments(&released(Obfuscation::Lines(lines)), &low, &high),
        [[[1e6 + 0.5, 0.0, -1.0], [1e6 + 0.5, 0.0, 1.0]]]
    );
    let rays = Rays::try_new(&[[0.0; 3]], vec![0], &along[..1]).unwrap();
    assert_eq!(
        clouds::record_segments(&released(Obfuscation::Rays(rays)), &low, &high),
        [[[1e6, 0.0, 0.0], [1e6, 0.0, 1.0]]]
    );
}

#[test]
fn what_is_not_finite_or_not_as_long_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    let nan = [0.0, f64::NAN, 0.0];
    for (result, line) in [
        (
            clouds::write_points(&path, &[nan]),
            "point 0: expected finite coordinates, found [0.0, NaN, 0.0]",
        ),
        (clouds::write_recovered(&path, &[Some([0.0; 3])], &[], 1.0), "expected 1 errors, found 0"),
        (
            clouds::write_lines(&path, &[[[0.0; 3], nan]]),
            "segment 0: expected finite coordinates, found [[0.0, 0.0, 0.0], [0.0, NaN, 0.0]]",
        ),
    ] {
        let found = result.unwrap_err().to_string();
        assert!(found.ends_with(&format!("a: {line}")), "{found}");
    }
    assert!(!path.exists());
}
