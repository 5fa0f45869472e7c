//! Clouds of scanners: LAS, PCD, E57.

#[path = "../made/mod.rs"]
mod made;

use unlift_io::read::{self, Input};

use super::write;
use made::POINTS;

fn same(input: &Input, format: &str, tolerance: f64) {
    assert_eq!((input.format, input.positions.len()), (format, 3));
    assert_eq!(input.ids, [0, 1, 2]);
    for (found, expected) in input.positions.iter().zip(POINTS) {
        super::close(*found, expected, tolerance);
    }
}

#[test]
fn las_of_every_version_and_size_of_points() {
    for (minor, record) in [(0, 20), (2, 20), (3, 34), (4, 20), (4, 25)] {
        let (_dir, path) = write("a.LAS", made::las(minor, record));
        let input = read::open(&path).unwrap();
        same(&input, "LAS", 1e-9);
        assert!(input.skipped.is_empty() && input.files == [path], "{minor} {record}");
    }
}

#[test]
fn pcd_reads_the_same_in_every_form() {
    for (data, format) in
        [("ascii", "PCD ascii"), ("binary", "PCD binary"), ("binary_compressed", "PCD compressed")]
    {
        let (_dir, path) = write("a.pcd", made::pcd(data));
        let input = read::open(&path).unwrap();
        same(&input, format, 0.0);
        assert_eq!(input.skipped, ["1 of 4 points have no place"], "{data}");
    }
}

#[test]
fn e57_brings_its_scans_into_one_frame() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.e57");
    made::e57(&path);
    let input = read::open(&path).unwrap();
    same(&input, "E57", 1e-12);
    assert_eq!(input.skipped, ["1 of 4 points have no place", "read, all 2 scans, in one frame"]);
}
