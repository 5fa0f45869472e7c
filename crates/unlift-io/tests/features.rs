//! Tests features of images: files of h5py and pycolmap, and round trips.

use std::fs;
use std::path::{Path, PathBuf};

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift_io::features::{FeatureSource, FeatureWriter, ImageFeatures, decode, encode};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn bytes(image: &ImageFeatures) -> &[u8] {
    match image.descriptors.as_ref().map(Descriptors::values) {
        Some(Values::U8(values)) => values,
        other => panic!("{other:?}"),
    }
}

fn floats(image: &ImageFeatures) -> &[f32] {
    match image.descriptors.as_ref().map(Descriptors::values) {
        Some(Values::F32(values)) => values,
        other => panic!("{other:?}"),
    }
}

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
fn files_of_h5py_are_read_in_every_type_and_form() {
    for file in ["features-latest.h5", "features-earliest.h5"] {
        let source = FeatureSource::open(&data(file)).unwrap();
        assert_eq!(source.names(), ["big ü.png", "db/half.jpg", "db/seq/double.jpg"], "{file}");
        let [big, half, double] = [0, 1, 2].map(|at| source.get(at).unwrap());
        assert_eq!(big.keypoints, [[1.0, 2.0], [3.0, 4.0]]);
        assert_eq!((bytes(&big), big.size), (&[1, 3, 5, 2, 4, 6][..], Some([10, 20])));
        assert_eq!((&big.scores, big.uncertainty_px), (&None, None));
        assert_eq!(half.keypoints, [[1.5, 2.25], [3.0, 4.0], [100.0, 50.0]]);
        let rows = [0.0, 0.375, 0.75, 1.125, 0.125, 0.5, 0.875, 1.25, 0.25, 0.625, 1.0, 1.375];
        assert_eq!(floats(&half), rows);
        assert_eq!(half.scores, Some(vec![0.5, 0.25, 0.125]));
        assert_eq!((half.size, half.uncertainty_px), (Some([640, 480]), Some(1.5)));
        assert_eq!(double.keypoints, [[0.1, 0.2], [0.3, 0.4]]);
        assert_eq!(floats(&double), [0.0, 2.0, 4.0, 6.0, 1.0, 3.0, 5.0, 7.0]);
        assert_eq!(double.size, None);
    }
}

#[test]
fn what_is_written_is_read_again_and_the_bytes_are_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("features.h5");
    // More names than a node of the tree holds, at several depths.
    let mut images: Vec<ImageFeatures> =
        (0..700).map(|at| made(&format!("seq{}/ü {at}.jpg", at % 2), at % 4)).collect();
    images.push(made("at the top.png", 300));
    images.push(ImageFeatures { name: "a/b/c/bare".to_owned(), ..ImageFeatures::default() });
    let mut written = Vec::new();
    for _ in 0..2 {
        let mut writer = FeatureWriter::create(&path).unwrap();
        images.iter().for_each(|image| writer.append(image).unwrap());
        writer.finish().unwrap();
        written.push(fs::read(&path).unwrap());
    }
    assert_eq!(written[0], written[1]);
    images.sort_by(|a, b| a.name.cmp(&b.name));
    assert_eq!(all(&path), images);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "no temporary file");
}

#[test]
fn a_file_appears_when_it_is_finished() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("features.h5");
    let mut writer = FeatureWriter::create(&path).unwrap();
    writer.append(&made("a.jpg", 3)).unwrap();
    assert!(!path.exists());
    drop(writer);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn one_image_is_a_file_of_its_own() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("part");
    fs::write(&path, encode(&made("a/b.jpg", 5), &path).unwrap()).unwrap();
    assert_eq!(decode(&path, "a/b.jpg").unwrap(), made("a/b.jpg", 5));
    let error = decode(&path, "c.jpg").unwrap_err().to_string();
    assert!(error.ends_with("part: expected only the image c.jpg, found 1 images"), "{error}");
}

#[test]
fn names_and_columns_that_do_not_fit_are_refused() {
    let path = Path::new("f.h5");
    let line = |image: &ImageFeatures| encode(image, path).unwrap_err().to_string();
    assert_eq!(
        line(&made("a//b", 1)),
        "f.h5: image \"a//b\": expected a name whose parts are not empty, . or .., found \"a//b\""
    );
    let short = ImageFeatures { scores: Some(vec![1.0]), ..made("a", 2) };
    assert_eq!(line(&short), "f.h5: image \"a\", scores: expected 2, one per keypoint, found 1");
    let dir = tempfile::tempdir().unwrap();
    let mut writer = FeatureWriter::create(&dir.path().join("f.h5")).unwrap();
    writer.append(&made("a/b", 1)).unwrap();
    for name in ["a/b", "a/b/c", "a/b/scores", "a/b/scores/d"] {
        let error = writer.append(&made(name, 1));
        let refused = error.is_err_and(|error| error.to_string().contains("expected a new name"));
        assert_eq!(refused, name != "a/b/c", "{name}");
    }
}

fn database(columns: usize) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("database.db");
    fs::copy(data("project/database.db"), &path).unwrap();
    let database = rusqlite::Connection::open(&path).unwrap();
    let row = [10.5f32, 20.25, 3.0, 4.0, -4.0, 3.0];
    let row = if columns == 4 { [10.5, 20.25, 5.0, 1.0, 0.0, 0.0] } else { row };
    let blob: Vec<u8> = row[..columns].iter().flat_map(|x| x.to_le_bytes()).collect();
    let insert = "INSERT INTO keypoints SELECT image_id, 8, ?1, ?2 FROM images";
    database.execute(insert, rusqlite::params![columns as i64, blob.repeat(8)]).unwrap();
    database.close().unwrap();
    (dir, path)
}

#[test]
fn databases_come_in_the_same_convention() {
    for columns in [2, 4, 6] {
        let (_dir, path) = database(columns);
        let images = all(&path);
        let names: Vec<&str> = images.iter().map(|image| &*image.name).collect();
        assert_eq!(names, ["i2.jpg", "i3.jpg", "küche/ä 0.jpg"]);
        let image = &images[2];
        assert_eq!((&image.keypoints, image.size), (&vec![[10.0, 19.75]; 8], Some([640, 480])));
        assert_eq!(bytes(image).len(), 8 * 128);
        let shape = |values: &Option<Vec<f32>>| values.as_ref().map(|values| values[7]);
        let expected = match columns {
            2 => (None, None),
            4 => (Some(5.0), Some(1f32.to_degrees())),
            _ => (Some(5.0), Some((-4f32).atan2(3.0).to_degrees())),
        };
        assert_eq!((shape(&image.scales), shape(&image.orientations_deg)), expected);
    }
}

#[test]
fn a_database_in_floats_is_read_as_floats() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("database.db");
    fs::copy(data("project/floats.db"), &path).unwrap();
    let database = rusqlite::Connection::open(&path).unwrap();
    let insert = "INSERT INTO keypoints SELECT image_id, 8, 2, zeroblob(64) FROM images";
    database.execute_batch(insert).unwrap();
    database.close().unwrap();
    let images = all(&path);
    assert!(images.iter().all(|image| floats(image).len() == 8 * 4));
    assert_eq!(images[0].keypoints[0], [-0.5, -0.5]);
}

fn shared(name: &str) -> Option<PathBuf> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/redkitchen");
    let path = Path::new(folder).join(name);
    if !path.is_file() {
        eprintln!("skipped: {name} is not beside the repository");
        return None;
    }
    Some(path)
}

#[test]
fn real_features_make_the_round_trip() {
    for (name, n_images, n_keypoints) in
        [("features-sift.h5", 6, 13_202), ("features-sift-f16.h5", 1, 1404)]
    {
        let Some(path) = shared(name) else { continue };
        let images = all(&path);
        let total: usize = images.iter().map(|image| image.keypoints.len()).sum();
        assert_eq!((images.len(), total), (n_images, n_keypoints));
        let (size, uncertainty) = (images[0].size, images[0].uncertainty_px);
        assert_eq!((size, uncertainty), (Some([640, 480]), Some(1.0)));
        let dir = tempfile::tempdir().unwrap();
        let copy = dir.path().join("copy.h5");
        let mut writer = FeatureWriter::create(&copy).unwrap();
        images.iter().for_each(|image| writer.append(image).unwrap());
        writer.finish().unwrap();
        assert_eq!(all(&copy), images);
    }
}

/// A fuzzer found this file: a reader allocated 4 GiB before reading.
#[test]
fn chunks_beyond_the_end_of_the_file_are_refused() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/features");
    let source = FeatureSource::open(&corpus.join("found-chunk-of-4-gib")).unwrap();
    let refused = (0..source.names().len()).filter_map(|at| source.get(at).err());
    let lines: Vec<String> = refused.map(|error| error.to_string()).collect();
    let expected = "expected chunks within the 13504 bytes of the file, found one that ends at ";
    assert!(lines.iter().any(|line| line.contains(expected)), "{lines:?}");
}

/// A name of 20,000 folders overflowed the stack, and one of 10,000 made a file that could not be
/// read.
#[test]
fn names_are_as_deep_as_can_be_read() {
    let deep = |n: usize| made(&format!("{}x.jpg", "a/".repeat(n - 1)), 2);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.h5");
    fs::write(&path, encode(&deep(64), &path).unwrap()).unwrap();
    assert_eq!(all(&path)[0].name, deep(64).name);
    for n in [65, 20_000] {
        let error = encode(&deep(n), &path).unwrap_err().to_string();
        assert!(
            error.ends_with(&format!("expected a name of at most 64 parts, found {n}")),
            "{error}"
        );
    }
}
