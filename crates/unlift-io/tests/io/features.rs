//! Tests features of images: files of h5py and pycolmap, round trips, and malformed files.

use std::fs;
use std::path::Path;

use hdf5_pure::FileBuilder;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift_io::features::{FeatureSource, FeatureWriter, ImageFeatures};

use super::malformed::patched;
use super::{data, fixture, place, shared, shown, write, write_database};

fn made(name: &str, n: usize) -> ImageFeatures {
    let values = |factor: f32| (0..n).map(|at| factor * at as f32).collect();
    let descriptors = (0..n * 128).map(|at| (at * 7 % 251) as u8).collect();
    ImageFeatures {
        name: name.to_owned(),
        size: Some([640, 480]),
        keypoints: (0..n).map(|at| [at as f64 * 1.5, 480.0 - at as f64 / 4.0]).collect(),
        descriptors: Some(Descriptors::try_new(Values::U8(descriptors), 128).unwrap()),
        scores: Some(values(0.5)),
        scales: Some(values(2.0)),
        orientations_deg: Some(values(-3.0)),
        uncertainty_px: Some(1.25),
        upright: n.is_multiple_of(2),
        photo: None,
    }
}

fn all(path: &Path) -> Vec<ImageFeatures> {
    let source = FeatureSource::open(path).unwrap();
    (0..source.names().len()).map(|at| source.get(at).unwrap()).collect()
}

#[test]
#[rustfmt::skip] // One row per line.
fn files_of_h5py_are_read_in_every_type_and_form() {
    let image = |name: &str, size, keypoints, values, dim| ImageFeatures {
        name: name.to_owned(),
        size,
        keypoints,
        descriptors: Descriptors::try_new(values, dim).ok(),
        ..ImageFeatures::default()
    };
    let halves = Values::F32([0, 3, 6, 9, 1, 4, 7, 10, 2, 5, 8, 11].map(|x| x as f32 / 8.0).into());
    let doubles = Values::F32(vec![0.0, 2.0, 4.0, 6.0, 1.0, 3.0, 5.0, 7.0]);
    let half = image("db/half.jpg", Some([640, 480]), vec![[1.5, 2.25], [3.0, 4.0], [100.0, 50.0]], halves, 4);
    let expected = [
        image("big ü.png", Some([10, 20]), vec![[1.0, 2.0], [3.0, 4.0]], Values::U8(vec![1, 3, 5, 2, 4, 6]), 3),
        ImageFeatures { scores: Some(vec![0.5, 0.25, 0.125]), uncertainty_px: Some(1.5), ..half },
        image("db/seq/double.jpg", None, vec![[0.1, 0.2], [0.3, 0.4]], doubles, 4),
    ];
    for file in ["features-latest.h5", "features-earliest.h5"] {
        assert_eq!(all(&data(file)), expected, "{file}");
    }
}

#[test]
fn what_is_written_is_read_again_and_the_bytes_are_the_same() {
    let (dir, path) = place("features.h5");
    // More names than a node of the tree holds, at several depths.
    let mut images: Vec<ImageFeatures> =
        (0..700).map(|at| made(&format!("seq{}/ü {at}.jpg", at % 2), at % 4)).collect();
    images.push(made("at the top.png", 300));
    images.push(ImageFeatures { name: "a/b/c/bare".to_owned(), ..ImageFeatures::default() });
    // A file appears when it is finished.
    let mut writer = FeatureWriter::create(&path).unwrap();
    writer.append(&images[0]).unwrap();
    assert!(!path.exists());
    drop(writer);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    let written = [0, 1].map(|_| {
        let mut writer = FeatureWriter::create(&path).unwrap();
        images.iter().for_each(|image| writer.append(image).unwrap());
        writer.finish().unwrap();
        fs::read(&path).unwrap()
    });
    assert!(written[0] == written[1]);
    images.sort_by(|a, b| a.name.cmp(&b.name));
    assert_eq!(all(&path), images);
}

#[test]
fn names_and_columns_that_do_not_fit_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let mut writer = FeatureWriter::create(&dir.path().join("f.h5")).unwrap();
    let deep = |n: usize| made(&format!("{}x.jpg", "b/".repeat(n - 1)), 2);
    writer.append(&deep(64)).unwrap();
    writer.append(&made("a/b", 1)).unwrap();
    let empty =
        "image \"a//b\": expected a name whose parts are not empty, . or .., found \"a//b\"";
    let short = ImageFeatures { scores: Some(vec![1.0]), ..made("c", 2) };
    for (image, line) in [
        (made("a//b", 1), empty),
        (short, "image \"c\", scores: expected 2, one per keypoint, found 1"),
        (made("a/b", 1), "expected a new name"),
        (made("a/b/c", 1), "expected a new name"),
        (made("a", 1), "expected a new name"),
        (deep(65), "expected a name of at most 64 parts, found 65"),
        // A name of 20,000 folders overflowed the stack.
        (deep(20_000), "expected a name of at most 64 parts, found 20000"),
    ] {
        let error = writer.append(&image).unwrap_err().to_string();
        assert!(error.contains(line), "{error}");
    }
}

#[test]
fn databases_come_in_the_same_convention() {
    let (_dir, path) = place("database.db");
    let atan = (-4f32).atan2(3.0).to_degrees();
    for (row, shape) in [
        (&[10.5, 20.25][..], (None, None)),
        (&[10.5, 20.25, 5.0, 1.0], (Some(5.0), Some(1f32.to_degrees()))),
        (&[10.5, 20.25, 3.0, 4.0, -4.0, 3.0], (Some(5.0), Some(atan))),
    ] {
        let bytes = row.iter().flat_map(|x: &f32| x.to_le_bytes());
        let (n, hex) = (row.len(), bytes.map(|byte| format!("{byte:02x}")).collect::<String>());
        let rows = format!("SELECT image_id, 8, {n}, x'{}' FROM images", hex.repeat(8));
        write_database(&path, "project/database.db", &format!("INSERT INTO keypoints {rows}"));
        let images = all(&path);
        let image = &images[2];
        assert_eq!([&*images[0].name, &image.name], ["i2.jpg", "küche/ä 0.jpg"]);
        assert_eq!((&image.keypoints, image.size), (&vec![[10.0, 19.75]; 8], Some([640, 480])));
        let descriptors = image.descriptors.as_ref().unwrap();
        assert!(matches!(descriptors.values(), Values::U8(bytes) if bytes.len() == 8 * 128));
        let last = |values: &Option<Vec<f32>>| values.as_ref().map(|values| values[7]);
        assert_eq!((last(&image.scales), last(&image.orientations_deg)), shape);
    }
}

/// The name and the shape of an array of floats, and the step between its values; without one, wide integers.
type Array = (&'static str, &'static [u64], Option<f32>);

const KEYPOINTS: Array = ("keypoints", &[3, 2], Some(1.0));
const DESCRIPTORS: Array = ("descriptors", &[4, 3], Some(0.5));

/// Returns a file with the image `a.jpg`, which has these arrays, and the valid image `b.jpg`.
fn file(arrays: &[Array]) -> Vec<u8> {
    let mut builder = FileBuilder::new();
    for (image, arrays) in [("a.jpg", arrays), ("b.jpg", &[KEYPOINTS, DESCRIPTORS])] {
        let mut group = builder.create_group(image);
        for &(name, shape, step) in arrays {
            let n = shape.iter().product::<u64>();
            let dataset = group.create_dataset(name);
            match step {
                Some(step) => {
                    dataset.with_f32_data(&(1..=n).map(|at| step * at as f32).collect::<Vec<_>>())
                }
                None => dataset.with_i64_data(&vec![7; n as usize]),
            };
            dataset.with_shape(shape);
        }
        builder.add_group(group.finish());
    }
    builder.finish().unwrap()
}

/// Returns the error line about the file or its first image, or `good`.
fn line(bytes: &[u8]) -> String {
    let (dir, path) = write("f", bytes);
    let first = FeatureSource::open(&path).and_then(|source| {
        if let Some(at) = source.names().iter().position(|name| name == "b.jpg") {
            assert_eq!(source.get(at).unwrap().keypoints.len(), 3);
        }
        source.get(0)?.described(&path).map(drop)
    });
    first.map_or_else(|error| shown(dir.path(), &error), |()| "good".to_owned())
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_file_of_features_is_refused_with_its_line() {
    // `a.jpg` has this array, and keypoints and descriptors unless it is one of them.
    let with = |name, shape: &'static [u64], step: Option<f32>| {
        let others = [KEYPOINTS, DESCRIPTORS].into_iter().filter(|array| array.0 != name);
        file(&others.chain([(name, shape, step)]).collect::<Vec<_>>())
    };
    let good = file(&[KEYPOINTS, DESCRIPTORS]);
    let mut outside = FileBuilder::new();
    outside.create_dataset("keypoints").with_f32_data(&[1.0, 2.0]);
    let rows: Vec<(&str, Vec<u8>, &str)> = vec![
        ("good", good.clone(), "good"),
        ("empty", vec![], "f: expected features in HDF5, or a COLMAP database (SQLite), found an empty file"),
        ("text", b"hello\nworld".to_vec(), "f: expected features in HDF5, or a COLMAP database (SQLite), found a file that begins with \"hello\\nwo\""),
        ("no image", FileBuilder::new().finish().unwrap(), "f: expected at least one image, found none"),
        ("no keypoints", file(&[DESCRIPTORS]), "f: image \"a.jpg\": expected an array keypoints, found only descriptors"),
        ("global descriptors", file(&[("global_descriptor", &[2], Some(0.5))]), "f: expected a group per image with keypoints and descriptors, found global descriptors of whole images"),
        ("matches", file(&[("matches0", &[2], Some(0.5))]), "f: expected a group per image with keypoints and descriptors, found matches of pairs of images"),
        ("outside any group", outside.finish().unwrap(), "f: expected a group per image with keypoints and descriptors, found arrays outside any group"),
        ("not closed by its writer", patched(fixture("features-latest.h5"), 11, &[1]), "f: expected a whole HDF5 file, found one that its writer did not close (h5clear -s FILE)"),
        ("no descriptors", file(&[KEYPOINTS]), "f: image \"a.jpg\": expected descriptors, found none"),
        ("keypoints in one column", with("keypoints", &[3, 1], Some(1.0)), "f: image \"a.jpg\", keypoints: expected shape (N, 2), found (3, 1)"),
        ("infinite", with("keypoints", &[3, 2], Some(f32::INFINITY)), "f: image \"a.jpg\", keypoints: expected finite coordinates in row 0, found (inf, inf)"),
        ("(N, D)", with("descriptors", &[3, 4], Some(0.5)), "f: image \"a.jpg\", descriptors: expected shape (D, N) with N = 3, one column per keypoint, found (3, 4), rows and columns exchanged"),
        ("dummies", with("descriptors", &[4, 3], Some(0.0)), "f: image \"a.jpg\": descriptors: expected real descriptors, found only zeros (dummies)"),
        ("wide integers", with("descriptors", &[4, 3], None), "f: image \"a.jpg\", descriptors: expected floats, or unsigned bytes, found other integers"),
        ("scores of others", with("scores", &[2], Some(0.5)), "f: image \"a.jpg\", scores: expected one value per keypoint, (3,), found (2,)"),
        ("a size of one side", with("image_size", &[1], Some(5.0)), "f: image \"a.jpg\", image_size: expected width and height in pixels, found (5,)"),
        ("a negative size", with("image_size", &[2], Some(-1.0)), "f: image \"a.jpg\", image_size: expected width and height in pixels, found (-1, -2)"),
    ];
    for (what, bytes, expected) in rows {
        assert_eq!(line(&bytes), expected, "{what}");
    }
    let cut = line(&good[..good.len() - 1]);
    assert_eq!(cut, format!("f: expected a whole HDF5 file of {} bytes, found {} bytes", good.len(), good.len() - 1));
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_database_is_refused_with_its_line() {
    let filled = "INSERT INTO keypoints SELECT image_id, 8, 2, zeroblob(64) FROM images; ";
    let rows = [
        ("good", "", "good"),
        ("no keypoints", "DELETE FROM keypoints", "f: image \"i2.jpg\": expected keypoints, found none"),
        ("no descriptors", "DELETE FROM descriptors", "f: image \"i2.jpg\": expected descriptors, found none"),
        ("no table of keypoints", "DROP TABLE keypoints", "f: table keypoints: expected a COLMAP database, found no such table: keypoints"),
        ("three columns", "UPDATE keypoints SET cols = 3, data = zeroblob(96)", "f: image \"i2.jpg\": expected keypoints of 2, 4 or 6 columns, found 3 columns"),
        ("cut off", "UPDATE keypoints SET data = zeroblob(60)", "f: image \"i2.jpg\": expected 8 keypoints of 8 bytes, found 60 bytes"),
        ("columns of 2^62", "UPDATE keypoints SET cols = 4611686018427387904", "f: image \"i2.jpg\": expected sizes of keypoints, found 8 x 4611686018427387904"),
        ("NaN", "UPDATE keypoints SET rows = 1, data = x'000000000000c07f'", "f: image \"i2.jpg\": expected a finite number in keypoint 0, found NaN"),
        ("other numbers", "UPDATE keypoints SET rows = 7, data = zeroblob(56)", "f: image \"i2.jpg\": expected 7 descriptors, one per keypoint, found 8"),
        ("without features", "UPDATE keypoints SET rows = 0, cols = 0, data = x''; UPDATE descriptors SET rows = 0, cols = 0, data = NULL", "good"),
        ("a view that never ends", "DROP TABLE keypoints; CREATE VIEW keypoints AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) \
            SELECT x AS image_id, 1 AS rows, 2 AS cols, zeroblob(8) AS data FROM c", "f: table keypoints: expected a table, found a view"),
        ("a virtual table", "DROP TABLE descriptors; CREATE VIRTUAL TABLE descriptors USING fts3(rows, cols, data)", "f: table descriptors: expected a table, found a virtual table"),
        ("blobs that are computed", "DROP TABLE keypoints; CREATE TABLE keypoints (image_id, rows, cols, data AS (zeroblob(900000000))); \
            INSERT INTO keypoints SELECT image_id, 112500000, 2 FROM images", "f: table keypoints: expected a COLMAP database, found string or blob too big"),
        ("names that are computed", "PRAGMA foreign_keys=0; DROP TABLE images; CREATE TABLE images (image_id, camera_id, name AS (printf('%.100000000c%d', 'x', image_id))); \
            INSERT INTO images VALUES (1, 1), (2, 1), (3, 1)", "f: table images: expected at most 256 MiB in memory of a file of 19 KiB, found 286.1 MiB"),
        ("without a camera", "PRAGMA foreign_keys=0; DELETE FROM cameras", "good"),
    ];
    for (what, statement, expected) in rows {
        let (_dir, path) = place("f");
        write_database(&path, "project/database.db", &format!("{filled}{statement}"));
        assert_eq!(line(&fs::read(&path).unwrap()), expected, "{what}");
    }
}

/// h5py writes a soft link in this form by default.
#[test]
fn a_link_in_a_group_of_the_old_form_is_refused_with_a_way_out() {
    let mut file = fs::read(data("features-earliest.h5")).unwrap();
    // The first entry of each leaf becomes a link, whose target is the text at byte 8 of the heap.
    for leaf in 0..file.len() - 32 {
        if file[leaf..].starts_with(b"SNOD") {
            file[leaf + 8 + 16] = 2;
            file[leaf + 8 + 24..leaf + 8 + 28].copy_from_slice(&[8, 0, 0, 0]);
        }
    }
    let line = line(&file);
    assert!(line.ends_with("in the old form (write it with libver=\"latest\" of h5py)"), "{line}");
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
