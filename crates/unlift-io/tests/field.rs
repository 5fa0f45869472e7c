//! Tests real inputs of users, if they are present, against the right result.

use std::path::{Path, PathBuf};

use unlift_io::features::FeatureSource;
use unlift_io::read::{self, Input};

fn field() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/field");
    if !path.is_dir() {
        println!("skipped: shared/field is not beside the repository");
        return None;
    }
    Some(path)
}

/// Returns true if `found` are `n` of the `expected` points, in any order.
fn same(found: &[[f64; 3]], expected: &[[f64; 3]], n: usize, tolerance: f64) -> bool {
    let near =
        |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance);
    let has = |found: &[f64; 3]| expected.iter().any(|expected| near(found, expected));
    let all = expected.iter().filter(|expected| found.iter().any(|found| near(found, expected)));
    found.len() == n && found.iter().all(has) && (n < expected.len() || all.count() == n)
}

#[test]
fn maps_are_read_as_their_makers_meant_them() {
    let Some(field) = field() else { return };
    let expected = read::open(&field.join("expected.npy")).unwrap().positions;
    assert_eq!(expected.len(), 300);
    let millimeters: Vec<[f64; 3]> = expected.iter().map(|p| p.map(|x| 1000.0 * x)).collect();
    // Input, number of points and of cameras, tolerance, text of a note.
    let rows: &[(&str, usize, usize, f64, &str)] = &[
        ("f02-named-in-comment/hash_id_first.txt", 300, 0, 1e-4, ""),
        ("f02-named-in-comment/hash_normals_first.txt", 300, 0, 1e-4, ""),
        ("f02-named-in-comment/slash_colors_first.txt", 300, 0, 1e-4, ""),
        ("f04-one-not-finite/nan.csv", 299, 0, 1e-4, "1 of 300 points have no place"),
        ("f04-one-not-finite/nan.npy", 299, 0, 1e-4, "1 of 300 points have no place"),
        ("f04-one-not-finite/nan.ply", 299, 0, 1e-4, "1 of 300 points have no place"),
        ("f04-one-not-finite/colmap_point", 299, 2, 1e-4, "1 of 300 points have no place"),
        ("f04-one-not-finite/nan_camera.nvm", 300, 1, 1e-4, "1 of 2 cameras have no place"),
        (
            "f06-cameras-not-needed/missing",
            300,
            2,
            1e-4,
            "2 of 2 images name a camera that is not in",
        ),
        ("f06-cameras-not-needed/spherical", 300, 2, 1e-4, "camera model of COLMAP"),
        ("f07-nvm-names/space.nvm", 300, 2, 1e-4, ""),
        ("f07-nvm-names/tab.nvm", 300, 2, 1e-4, ""),
        ("f08-nvm-models/small_first.nvm", 300, 2, 1e-4, "the largest of 2 models (300 points)"),
        ("f08-nvm-models/unplaced_last.nvm", 300, 2, 1e-4, "2 photos without a pose"),
        ("f09-ply-lists/faces_first.ply", 300, 0, 1e-4, ""),
        ("f09-ply-lists/views.ply", 300, 0, 1e-4, ""),
        ("f09-ply-lists/views_ascii.ply", 300, 0, 1e-4, ""),
        ("f10-integers/short.ply", 300, 0, 0.51, ""),
        ("f12-ply-in-model/sparse/0", 300, 2, 1e-4, "points3D.ply: read"),
        ("f12-ply-in-model/dense-project", 300, 2, 1e-4, ""),
        ("f17-count-line/comment_count.xyz", 300, 0, 1e-4, ""),
        ("f17-count-line/count.xyz", 300, 0, 1e-4, ""),
    ];
    for &(name, n, n_cameras, tolerance, note) in rows {
        let Input { positions, cameras, notes, doubts, .. } =
            read::open(&field.join(name)).unwrap();
        let of = if name.starts_with("f10") { &millimeters } else { &expected };
        assert!(same(&positions, of, n, tolerance), "{name}: {} points", positions.len());
        assert_eq!((cameras.len(), doubts), (n_cameras, Vec::new()), "{name}");
        let said =
            notes.iter().any(|one| one.contains(note)) || (note.is_empty() && notes.is_empty());
        assert!(said, "{name}: {notes:?}");
    }
    let zeros = read::open(&field.join("f16-zeros/zeros.ply")).unwrap();
    assert_eq!(zeros.notes, ["200 of 500 points are at exactly one place, [0.0, 0.0, 0.0]"]);
    let line =
        read::open(&field.join("f02-named-in-comment/trajectory.txt")).unwrap_err().to_string();
    assert!(line.ends_with("found a trajectory, poses of cameras"), "{line}");
}

#[test]
fn features_are_taken_or_told_in_one_line() {
    let Some(field) = field().map(|field| field.join("f15-other-h5")) else { return };
    for (name, found) in [
        ("matches.h5", "found matches of pairs of images"),
        ("keypoints.h5", "found arrays outside any group"),
    ] {
        let line = FeatureSource::open(&field.join(name)).err().unwrap().to_string();
        assert!(line.contains("expected a group per image") && line.ends_with(found), "{line}");
    }
    let links = FeatureSource::open(&field.join("links.h5")).unwrap();
    assert_eq!(links.names(), ["a.jpg", "b.jpg"]);
    assert_eq!(links.get(1).unwrap().keypoints.len(), 300);
    let [told] = links.refused() else { panic!("{:?}", links.refused()) };
    let line = told.to_string();
    assert!(line.contains("image \"c.jpg\"") && line.ends_with("a link to another file"), "{line}");
    let empty = FeatureSource::open(&field.join("empty_image.h5")).unwrap();
    assert_eq!(empty.names().len(), 3);
    for at in 0..3 {
        assert!(empty.get(at).unwrap().keypoints.is_empty(), "{}", empty.names()[at]);
    }
}
