//! Tests of malformed features: the exact error line of each, and no panic for any cut or changed
//! byte.
//!
//! They use the internal writer, because the public one writes only valid files.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use super::h5::{Array, Numbers, Writer};
use super::{FeatureSource, encode};
use crate::features::ImageFeatures;

/// A name, a shape, values.
type Made = (&'static str, Vec<u64>, Numbers);

/// Creates a file with the image `a.jpg`, which has these arrays, and the valid image `b.jpg`.
fn file(arrays: Vec<Made>) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = Writer::start(&mut out).unwrap();
    for (name, shape, values) in arrays {
        writer.array(&mut out, "a.jpg", name, &Array { shape, values }, &[]).unwrap();
    }
    for (name, shape, values) in [keypoints(), descriptors()] {
        writer.array(&mut out, "b.jpg", name, &Array { shape, values }, &[]).unwrap();
    }
    writer.finish(&mut out).unwrap();
    out.into_inner()
}

fn keypoints() -> Made {
    ("keypoints", vec![3, 2], Numbers::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
}

fn descriptors() -> Made {
    ("descriptors", vec![4, 3], Numbers::U8((0..12).collect()))
}

fn line(bytes: &[u8]) -> String {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("f");
    fs::write(&path, bytes).unwrap();
    let error = match FeatureSource::open(&path) {
        Err(error) => error,
        Ok(source) => {
            if let Some(at) = source.names().iter().position(|name| name == "b.jpg") {
                assert_eq!(source.get(at).unwrap().keypoints.len(), 3);
            }
            let image = source.get(0);
            match image.and_then(|image| image.described(&path).map(drop)) {
                Err(error) => error,
                Ok(()) => return "good".to_owned(),
            }
        }
    };
    shown(dir.path(), &error.to_string())
}

fn shown(dir: &Path, line: &str) -> String {
    let line = line.strip_prefix(dir.to_str().unwrap()).expect("errors begin with the path");
    line.trim_start_matches(['/', '\\']).to_owned()
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_file_of_features_is_refused_with_its_line() {
    let floats = |shape: &[u64], value: f32| {
        let n = shape.iter().product::<u64>() as usize;
        (shape.to_vec(), Numbers::F32((0..n).map(|at| value * (at + 1) as f32).collect()))
    };
    let named = |name, (shape, values): (Vec<u64>, Numbers)| -> Made { (name, shape, values) };
    let good = || file(vec![keypoints(), descriptors()]);
    let patched = |at: usize, byte: u8| { let mut bytes = good(); bytes[at] = byte; bytes };
    let doubles = |name, values: Vec<f64>| -> Made { (name, vec![values.len() as u64], Numbers::F64(values)) };
    let rows: Vec<(&str, Vec<u8>, &str)> = vec![
        ("good", good(), "good"),
        ("empty", vec![], "f: expected features in HDF5, or a COLMAP database (SQLite), found an empty file"),
        ("text", b"hello\nworld".to_vec(),
            "f: expected features in HDF5, or a COLMAP database (SQLite), found a file that begins with \"hello\\nwo\""),
        ("a signature alone", good()[..8].to_vec(),
            "f: expected a whole HDF5 file, found HDF5 format error: unexpected EOF: need 9 bytes, have 8"),
        ("cut in the middle", good()[..900].to_vec(),
            "f: expected a whole HDF5 file of 3640 bytes, found 900 bytes"),
        ("another version", patched(8, 9), "f: expected a whole HDF5 file, found HDF5 format error: unsupported superblock version: 9"),
        ("no image", { let mut out = Cursor::new(Vec::new()); Writer::start(&mut out).unwrap().finish(&mut out).unwrap(); out.into_inner() },
            "f: expected at least one image, found none"),
        ("no keypoints", file(vec![descriptors()]),
            "f: image \"a.jpg\": expected an array keypoints, found only descriptors"),
        ("global descriptors", file(vec![named("global_descriptor", floats(&[4096], 0.5))]),
            "f: expected a group per image with keypoints and descriptors, found global descriptors of whole images"),
        ("no descriptors", file(vec![keypoints()]), "f: image \"a.jpg\": expected descriptors, found none"),
        ("keypoints in one column", file(vec![named("keypoints", floats(&[3, 1], 1.0)), descriptors()]),
            "f: image \"a.jpg\", keypoints: expected shape (N, 2), found (3, 1)"),
        ("flat keypoints", file(vec![named("keypoints", floats(&[6], 1.0)), descriptors()]),
            "f: image \"a.jpg\", keypoints: expected shape (N, 2), found (6,)"),
        ("NaN", file(vec![("keypoints", vec![3, 2], Numbers::F32(vec![1.0, 2.0, 3.0, f32::NAN, 5.0, 6.0])), descriptors()]),
            "f: image \"a.jpg\", keypoints: expected finite coordinates in row 1, found (3, NaN)"),
        ("infinity", file(vec![("keypoints", vec![1, 2], Numbers::F64(vec![f64::INFINITY, 2.0])), descriptors()]),
            "f: image \"a.jpg\", keypoints: expected finite coordinates in row 0, found (inf, 2)"),
        ("(N, D)", file(vec![keypoints(), ("descriptors", vec![3, 4], Numbers::U8((0..12).collect()))]),
            "f: image \"a.jpg\", descriptors: expected shape (D, N) with N = 3, one column per keypoint, found (3, 4), rows and columns exchanged"),
        ("another number of descriptors", file(vec![keypoints(), named("descriptors", floats(&[4, 5], 0.5))]),
            "f: image \"a.jpg\", descriptors: expected shape (D, N) with N = 3, one column per keypoint, found (4, 5)"),
        ("flat descriptors", file(vec![keypoints(), named("descriptors", floats(&[12], 0.5))]),
            "f: image \"a.jpg\", descriptors: expected shape (D, N) with N = 3, one column per keypoint, found (12,)"),
        ("dummies", file(vec![keypoints(), ("descriptors", vec![4, 3], Numbers::U8(vec![0; 12]))]),
            "f: image \"a.jpg\", descriptors: expected real descriptors, found only zeros (dummies)"),
        ("constant", file(vec![keypoints(), ("descriptors", vec![4, 3], Numbers::F32(vec![0.5; 12]))]),
            "f: image \"a.jpg\", descriptors: expected real descriptors, found the same row for every point (dummies)"),
        ("NaN in descriptors", file(vec![keypoints(), named("descriptors", floats(&[4, 3], f32::NAN))]),
            "f: image \"a.jpg\", descriptors: expected a finite value, found NaN (descriptor 0, value 0)"),
        ("wide integers", file(vec![keypoints(), ("descriptors", vec![4, 3], Numbers::I64((0..12).collect()))]),
            "f: image \"a.jpg\", descriptors: expected floats, or unsigned bytes, found other integers"),
        ("scores of others", file(vec![keypoints(), descriptors(), named("scores", floats(&[2], 0.5))]),
            "f: image \"a.jpg\", scores: expected one value per keypoint, (3,), found (2,)"),
        ("a size of one side", file(vec![keypoints(), descriptors(), doubles("image_size", vec![5.0])]),
            "f: image \"a.jpg\", image_size: expected width and height in pixels, found (1,)"),
        ("a negative size", file(vec![keypoints(), descriptors(), doubles("image_size", vec![5.0, -1.0])]),
            "f: image \"a.jpg\", image_size: expected width and height in pixels, found 5 and -1"),
    ];
    let mut wrong = Vec::new();
    for (what, bytes, expected) in rows {
        let found = line(&bytes);
        if found != expected { wrong.push(format!("{what}: {found}")); }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_database_is_refused_with_its_line() {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/project/database.db");
    let filled = "INSERT INTO keypoints SELECT image_id, 8, 2, zeroblob(64) FROM images; ";
    let rows = [
        ("good", "", "good"),
        ("no keypoints", "DELETE FROM keypoints", "f: image \"i2.jpg\": expected keypoints, found none"),
        ("no descriptors", "DELETE FROM descriptors", "f: image \"i2.jpg\": expected descriptors, found none"),
        ("no table of keypoints", "DROP TABLE keypoints", "f: table keypoints: expected a COLMAP database, found no such table: keypoints"),
        ("no image", "PRAGMA foreign_keys=0; DELETE FROM images", "f: expected at least one image, found none"),
        ("three columns", "UPDATE keypoints SET cols = 3, data = zeroblob(96)",
            "f: image \"i2.jpg\": expected keypoints of 2, 4 or 6 columns, found 3 columns"),
        ("cut off", "UPDATE keypoints SET data = zeroblob(60)",
            "f: image \"i2.jpg\": expected 8 keypoints of 8 bytes, found 60 bytes"),
        ("columns of 2^62", "UPDATE keypoints SET cols = 4611686018427387904",
            "f: image \"i2.jpg\": expected sizes of keypoints, found 8 x 4611686018427387904"),
        ("NaN", "UPDATE keypoints SET rows = 1, data = x'000000000000c07f'",
            "f: image \"i2.jpg\": expected a finite number in keypoint 0, found NaN"),
        ("other numbers", "UPDATE keypoints SET rows = 7, data = zeroblob(56)",
            "f: image \"i2.jpg\": expected 7 descriptors, one per keypoint, found 8"),
        ("dummies", "UPDATE descriptors SET data = zeroblob(1024)",
            "f: image \"i2.jpg\": expected real descriptors, found only zeros (dummies)"),
        ("without features", "UPDATE keypoints SET rows = 0, cols = 0, data = x''; UPDATE descriptors SET rows = 0, cols = 0, data = NULL", "good"),
        ("a view that never ends", "DROP TABLE keypoints; CREATE VIEW keypoints AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) \
            SELECT x AS image_id, 1 AS rows, 2 AS cols, zeroblob(8) AS data FROM c",
            "f: table keypoints: expected a table, found a view"),
        ("a view of images", "PRAGMA foreign_keys=0; ALTER TABLE images RENAME TO i; CREATE VIEW Images AS SELECT * FROM i",
            "f: table images: expected a table, found a view"),
        ("a virtual table", "DROP TABLE descriptors; CREATE VIRTUAL TABLE descriptors USING fts3(rows, cols, data)",
            "f: table descriptors: expected a table, found a virtual table"),
        ("blobs that are computed", "DROP TABLE keypoints; CREATE TABLE keypoints (image_id, rows, cols, data AS (zeroblob(900000000))); \
            INSERT INTO keypoints SELECT image_id, 112500000, 2 FROM images",
            "f: table keypoints: expected a COLMAP database, found string or blob too big"),
        ("names that are computed", "PRAGMA foreign_keys=0; DROP TABLE images; CREATE TABLE images (image_id, camera_id, name AS (printf('%.100000000c%d', 'x', image_id))); \
            INSERT INTO images VALUES (1, 1), (2, 1), (3, 1)",
            "f: table images: expected at most 256 MiB in memory of a file of 19 KiB, found 286.1 MiB"),
        ("without a camera", "PRAGMA foreign_keys=0; DELETE FROM cameras", "good"),
    ];
    for (what, statement, expected) in rows {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("f");
        fs::copy(&fixture, &path).unwrap();
        let database = rusqlite::Connection::open(&path).unwrap();
        database.execute_batch(&format!("{filled}{statement}")).unwrap();
        database.close().unwrap();
        assert_eq!(line(&fs::read(&path).unwrap()), expected, "{what}");
    }
}

#[test]
fn no_cut_and_no_changed_byte_makes_a_panic() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let image = ImageFeatures {
        name: "a/b.jpg".to_owned(),
        keypoints: vec![[1.0, 2.0], [3.0, 4.0]],
        uncertainty_px: Some(1.0),
        ..ImageFeatures::default()
    };
    let files = [
        encode(&image, Path::new("f")).unwrap(),
        fs::read(data.join("features-latest.h5")).unwrap(),
        fs::read(data.join("features-earliest.h5")).unwrap(),
    ];
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("f");
    let visit = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        match FeatureSource::open(&path) {
            Err(error) => assert!(!error.to_string().contains('\n')),
            Ok(source) => (0..source.names().len()).for_each(|at| {
                let _ = source.get(at);
            }),
        }
    };
    for file in &files {
        // A part of the bytes of large files, to finish within seconds.
        let step = file.len().div_ceil(500);
        (0..file.len()).step_by(step).for_each(|at| visit(&file[..at]));
        for at in (0..file.len()).step_by(step) {
            for change in [0xff, 0x01, 0x80] {
                let mut changed = file.clone();
                changed[at] ^= change;
                visit(&changed);
            }
        }
    }
}
