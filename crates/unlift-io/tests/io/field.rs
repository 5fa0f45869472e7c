//! Tests inputs of users, if they are beside the repository, against the right result.

use unlift_io::features::FeatureSource;
use unlift_io::read;

use super::{shared, shown};

/// Returns true if `found` are `n` of the `expected` points, in any order.
fn same(found: &[[f64; 3]], expected: &[[f64; 3]], n: usize) -> bool {
    let near = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-4);
    let is_found = |expected: &&[f64; 3]| found.iter().any(|found| near(found, expected));
    found.len() == n && expected.iter().filter(is_found).count() == n
}

/// Input, number of points and of cameras, text of a note or of a doubt.
const MAPS: [(&str, usize, usize, &str); 9] = [
    ("f04-one-not-finite/colmap_point", 299, 2, "1 of 300 points have no place"),
    ("f06-cameras-not-needed/missing", 300, 2, "2 of 2 images name a camera that is not in"),
    ("f08-nvm-models/small_first.nvm", 300, 2, "the largest of 2 models (300 points)"),
    ("f08-nvm-models/unplaced_last.nvm", 300, 2, "2 photos without a pose"),
    ("f12-ply-in-model/sparse/0", 300, 2, "points3D.ply: read"),
    ("turn4/12-small/quoted.csv", 300, 0, ""),
    ("turn4/12-small/paraview.csv", 300, 0, ""),
    ("turn4/12-small/paraview_new.csv", 300, 0, ""),
    ("turn4/12-small/excel_sep.csv", 300, 0, ""),
];

/// Input, and the end of the error line.
#[rustfmt::skip] // One row per line.
const REFUSED: [(&str, &str); 5] = [
    ("f18-packed-splats/compressed.ply", "found packed splats (export them unpacked)"),
    ("turn4/12-small/cloud.ptx", "found a .ptx file (a grid of a scanner; convert it: CloudCompare -O in.ptx -SAVE_CLOUDS)"),
    ("turn4/12-small/killed.h5", "found one that its writer did not close (h5clear -s FILE)"),
    ("f15-other-h5/matches.h5", "found matches of pairs of images"),
    ("f15-other-h5/keypoints.h5", "found arrays outside any group"),
];

#[test]
fn maps_are_read_as_their_makers_meant_them() {
    let Some(field) = shared("field") else { return };
    let expected = read::open(&field.join("expected.npy")).unwrap().positions;
    for (name, n, n_cameras, text) in MAPS {
        let map = read::open(&field.join(name)).unwrap();
        assert_eq!((map.positions.len(), map.cameras.len()), (n, n_cameras), "{name}");
        let all = [map.notes, map.doubts].concat();
        let is_said =
            all.iter().any(|line| line.contains(text)) || (text.is_empty() && all.is_empty());
        assert!(is_said && all.len() < 2, "{name}: {all:?}");
        if name.starts_with('f') {
            assert!(same(&map.positions, &expected, n), "{name}");
        }
    }
    for (name, found) in REFUSED {
        let path = field.join(name);
        let error = match name.ends_with(".h5") {
            true => FeatureSource::open(&path).err().unwrap(),
            false => read::open(&path).unwrap_err(),
        };
        assert!(shown(&field, &error).ends_with(found), "{name}: {error}");
    }
}

#[test]
fn features_are_read_through_links_and_without_keypoints() {
    let Some(field) = shared("field/f15-other-h5") else { return };
    let links = FeatureSource::open(&field.join("links.h5")).unwrap();
    assert_eq!(links.names(), ["a.jpg", "b.jpg"]);
    assert_eq!(links.get(1).unwrap().keypoints.len(), 300);
    let [broken] = links.refused() else { panic!("{:?}", links.refused()) };
    let line = shown(&field, broken);
    let expected = "expected features of an image, found a link to another file";
    assert_eq!(line, format!("links.h5: image \"c.jpg\": {expected}"));
    let empty = FeatureSource::open(&field.join("empty_image.h5")).unwrap();
    assert_eq!(empty.names().len(), 3);
    assert!((0..3).all(|at| empty.get(at).unwrap().keypoints.is_empty()));
}
