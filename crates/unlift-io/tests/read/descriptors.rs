//! Tests descriptors of an input's points.

use std::fs;

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift_io::features::{FeatureWriter, ImageFeatures};
use unlift_io::read::{self, Input, colmap};

use super::{data, write};

#[test]
fn descriptors_through_the_tracks_are_those_of_the_binary_form() {
    let input = read::open(&data("project")).unwrap();
    let joined = read::descriptors(&data("project/descriptors.bin"), &input).unwrap();
    assert_eq!((joined.len(), joined.dim()), (6, 128));
    let mean = read::descriptors(input.database.as_ref().unwrap(), &input).unwrap();
    assert_eq!(mean, joined);
}

#[test]
fn descriptors_follow_the_ids_of_the_input() {
    let all = read::open(&data("project")).unwrap();
    let some = Input {
        ids: vec![all.ids[4], all.ids[1]],
        positions: vec![all.positions[4], all.positions[1]],
        ..all.clone()
    };
    for file in ["descriptors.bin", "database.db", "floats.db"] {
        let path = data("project").join(file);
        let expected = read::descriptors(&path, &all).unwrap().select(&[4, 1]);
        assert_eq!(read::descriptors(&path, &some).unwrap(), expected, "{file}");
    }
}

fn row(id: u32, at: u32) -> [f32; 3] {
    [id as f32, at as f32 - 2.0, 1.0]
}

/// Writes hloc's features of the images of the project. The image `odd` has an extra keypoint.
fn features(path: &std::path::Path, odd: &str) {
    let images = colmap::read_images(&data("project/sparse/0/images.bin")).unwrap();
    let mut writer = FeatureWriter::create(path).unwrap();
    for image in images {
        let name = String::from_utf8(image.name).unwrap();
        let n = image.n_points2d as u32 + u32::from(name == odd);
        let values = (0..n).flat_map(|at| row(image.id, at)).collect();
        let descriptors = Some(Descriptors::try_new(Values::F32(values), 3).unwrap());
        let keypoints = (0..n).map(|at| [f64::from(at), 1.0]).collect();
        writer
            .append(&ImageFeatures { name, keypoints, descriptors, ..Default::default() })
            .unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn features_of_hloc_are_descriptors_of_the_points_that_they_made() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("features.h5");
    let input = read::open(&data("project")).unwrap();
    features(&path, "");
    let found = read::descriptors(&path, &input).unwrap();
    let points = colmap::read_points(&data("project/sparse/0/points3D.bin"), true).unwrap();
    let tracks = points.tracks.unwrap();
    let mut of_point = [0.0; 3];
    for at in 0..points.ids.len() {
        let rows = || tracks.row(at).iter().map(|&(id, index)| row(id, index));
        let sum: [f32; 3] = std::array::from_fn(|c| rows().map(|row| row[c]).sum());
        let length = sum.iter().map(|x| x * x).sum::<f32>().sqrt();
        found.read_row(at, &mut of_point);
        super::close(of_point.map(f64::from), sum.map(|x| f64::from(x / length)), 1e-6);
    }
    features(&path, "küche/ä 0.jpg");
    let line = read::descriptors(&path, &input).unwrap_err().to_string();
    let told = "keypoints, as the model has, found";
    assert!(line.contains("küche/ä 0.jpg") && line.contains(told), "{line}");
    let cloud = read::open(&data("cloud.ply")).unwrap();
    let line = read::descriptors(&path, &cloud).unwrap_err().to_string();
    let told = "whose tracks lead to images, found ply binary little endian points";
    assert!(line.ends_with(told), "{line}");
}

/// The descriptors of the project as floats of norm 1, exact in half floats.
fn unit_floats(input: &Input) -> Vec<f32> {
    let bytes = read::descriptors(&data("project/descriptors.bin"), input).unwrap();
    let Values::U8(bytes) = bytes.values() else { panic!("bytes expected") };
    bytes.iter().map(|&byte| f32::from(byte) / 512.0).collect()
}

fn p3desc(ids: &[u64], dtype: u32) -> Vec<u8> {
    let mut file = b"P3DESC01".to_vec();
    file.extend((ids.len() as u64).to_le_bytes());
    file.extend(128u32.to_le_bytes());
    file.extend(dtype.to_le_bytes());
    ids.iter().for_each(|id| file.extend(id.to_le_bytes()));
    file
}

#[test]
fn binary_descriptors_may_be_floats_of_16_or_32_bits() {
    let input = read::open(&data("project")).unwrap();
    let floats = unit_floats(&input);
    for dtype in [2, 3] {
        // An extra point, and another order of rows: points are joined by id.
        let mut file = p3desc(&[1000, 11, 9, 6, 4, 3, 2], dtype);
        let rows = std::iter::once(&[0.5; 128][..]).chain(floats.chunks(128).rev());
        for value in rows.flatten() {
            match dtype {
                2 => file.extend(half::f16::from_f32(*value).to_le_bytes()),
                _ => file.extend(value.to_le_bytes()),
            }
        }
        let (_dir, path) = write("d.bin", file);
        let read = read::descriptors(&path, &input).unwrap();
        assert_eq!(read.values(), &Values::F32(floats.clone()), "512ths of bytes fit a half");
    }
}

#[test]
fn arrays_of_descriptors_have_a_row_per_point_in_its_order() {
    let all = read::open(&data("project")).unwrap();
    let floats = unit_floats(&all);
    let expected = Values::F32(floats.clone());
    let array = |descr: &str, fortran: &str, values: Vec<u8>| {
        let text =
            format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': (6, 128), }}");
        let mut file = b"\x93NUMPY\x01\0".to_vec();
        file.extend(118u16.to_le_bytes());
        file.extend(format!("{text:117}\n").bytes());
        file.extend(values);
        write("d.npy", file)
    };
    let bytes = |of: fn(f32) -> Vec<u8>| floats.iter().flat_map(|&x| of(x)).collect::<Vec<u8>>();
    for (descr, values) in [
        ("<f2", bytes(|x| half::f16::from_f32(x).to_le_bytes().to_vec())),
        (">f2", bytes(|x| half::f16::from_f32(x).to_be_bytes().to_vec())),
        ("<f4", bytes(|x| x.to_le_bytes().to_vec())),
        (">f8", bytes(|x| f64::from(x).to_be_bytes().to_vec())),
    ] {
        let (_dir, path) = array(descr, "False", values);
        assert_eq!(read::descriptors(&path, &all).unwrap().values(), &expected, "{descr}");
    }
    let columns = (0..128).flat_map(|c| floats.chunks(128).map(move |row| row[c]));
    let (_dir, path) = array("<f4", "True", columns.flat_map(f32::to_le_bytes).collect());
    assert_eq!(read::descriptors(&path, &all).unwrap().values(), &expected, "by columns");
    let of_bytes = read::descriptors(&data("project/descriptors.bin"), &all).unwrap();
    let Values::U8(values) = of_bytes.values() else { panic!("bytes expected") };
    let (_dir, path) = array("|u1", "False", values.clone());
    assert_eq!(read::descriptors(&path, &all).unwrap(), of_bytes);
}

#[test]
fn float_descriptors_keep_their_type_and_get_norm_1() {
    let input = read::open(&data("project")).unwrap();
    let floats = read::descriptors(&data("project/floats.db"), &input).unwrap();
    assert_eq!((floats.len(), floats.dim()), (6, 4));
    let Values::F32(values) = floats.values() else {
        panic!("floats expected");
    };
    for row in values.chunks(4) {
        let norm2: f32 = row.iter().map(|x| x * x).sum();
        // Four values rounded to 24 bits.
        assert!((norm2 - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_database_without_types_is_read_as_bytes() {
    let dir = tempfile::tempdir().unwrap();
    // A URI would misread this name.
    let path = dir.path().join("a?b#c%20 d.db");
    fs::copy(data("project/database.db"), &path).unwrap();
    let database = rusqlite::Connection::open(&path).unwrap();
    database.execute_batch("ALTER TABLE descriptors DROP COLUMN type").unwrap();
    database.close().unwrap();
    let input = read::open(&data("project")).unwrap();
    let expected = read::descriptors(&data("project/descriptors.bin"), &input).unwrap();
    assert_eq!(read::descriptors(&path, &input).unwrap(), expected);
    let left: Vec<_> = fs::read_dir(dir.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "reading writes no journal: {left:?}");
}

#[test]
fn a_database_in_write_ahead_mode_is_read_whole() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("database.db");
    fs::copy(data("project/database.db"), &path).unwrap();
    let writer = rusqlite::Connection::open(&path).unwrap();
    writer
        .execute_batch(
            "PRAGMA journal_mode=WAL; UPDATE images SET name = 'gone' WHERE image_id = 1",
        )
        .unwrap();
    let input = read::open(&data("project")).unwrap();
    let error = read::descriptors(&path, &input).unwrap_err().to_string();
    assert!(error.contains("no such image"), "the journal counts: {error}");
}

/// The file contains uncommitted rows, and the journal beside it the rows to restore.
#[test]
fn a_database_with_a_transaction_that_was_not_done_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("database.db");
    fs::copy(data("project/database.db"), &path).unwrap();
    let writer = rusqlite::Connection::open(&path).unwrap();
    let begin = "PRAGMA journal_mode=DELETE; PRAGMA cache_size=2; BEGIN; UPDATE images SET name = name || 'x'; \
                 CREATE TABLE pad(x);";
    writer.execute_batch(begin).unwrap();
    for _ in 0..20 {
        writer.execute_batch("INSERT INTO pad VALUES(zeroblob(4000))").unwrap();
    }
    // Copies during the transaction.
    let killed = dir.path().join("killed.db");
    fs::copy(&path, &killed).unwrap();
    fs::copy(dir.path().join("database.db-journal"), dir.path().join("killed.db-journal")).unwrap();
    drop(writer);
    let input = read::open(&data("project")).unwrap();
    let error = read::descriptors(&killed, &input).unwrap_err().to_string();
    assert!(!error.contains('\n') && error.contains("killed.db: "), "{error}");
    assert!(read::descriptors(&path, &input).is_ok(), "what was taken back");
}
