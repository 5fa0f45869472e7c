//! Tests descriptors of the points of a map.

use std::fs;
use std::ops::Range;
use std::path::Path;

use half::f16;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::seed::{Draws, Stage};
use unlift_io::features::{FeatureWriter, ImageFeatures, round_to_half};
use unlift_io::read::{self, Input};

use super::malformed::{MANY, patched};
use super::{data, fixture, npy, place, shown, write, write_database};

#[test]
fn descriptors_follow_the_ids_of_the_input_in_every_form() {
    let all = read::open(&data("project")).unwrap();
    let some = Input { ids: vec![all.ids[4], all.ids[1]], ..all.clone() };
    let joined = read::descriptors(&data("project/descriptors.bin"), &all).unwrap();
    for (file, dim) in [("descriptors.bin", 128), ("database.db", 128), ("floats.db", 4)] {
        let path = data("project").join(file);
        let descriptors = read::descriptors(&path, &all).unwrap();
        assert_eq!((descriptors.len(), descriptors.dim()), (6, dim));
        assert_eq!(read::descriptors(&path, &some).unwrap(), descriptors.select(&[4, 1]), "{file}");
        match descriptors.values() {
            // Those through the tracks are those of the binary form.
            Values::U8(_) => assert_eq!(descriptors, joined),
            // Norm 1: four values rounded to 24 bits.
            Values::F32(values) => {
                let norm2 = |row: &[f32]| row.iter().map(|x| x * x).sum::<f32>();
                assert!(values.chunks(4).all(|row| (norm2(row) - 1.0).abs() < 1e-6));
            }
        }
    }
}

/// Writes hloc's features: names and descriptors of `dim` values.
fn write_features(path: &Path, dim: usize, images: impl IntoIterator<Item = (String, Vec<f32>)>) {
    let mut writer = FeatureWriter::create(path).unwrap();
    for (name, values) in images {
        let keypoints = vec![[3.0, 4.0]; values.len() / dim];
        let descriptors = Descriptors::try_new(Values::F32(values), dim).ok();
        let image = ImageFeatures { name, keypoints, descriptors, ..Default::default() };
        writer.append(&image).unwrap();
    }
    writer.finish().unwrap();
}

const N: usize = 60;

/// Returns the point that a keypoint shows.
fn point_of(image: usize, at: usize) -> usize {
    (at + 7 * image) % N
}

/// Writes and reads a model of the images `kept` with `n_views` per track, and an image without keypoints.
fn model(folder: &Path, kept: Range<usize>, n_views: usize) -> Input {
    let (mut images, mut tracks) =
        ("90 1 0 0 0 0 0 0 1 added.jpg\n\n".to_owned(), vec![String::new(); N]);
    for image in kept.clone() {
        images += &format!("{} 1 0 0 0 0 0 0 1 {image}.jpg\n", image + 1);
        for at in 0..N {
            let point = point_of(image, at);
            let is_seen = (image + point) % kept.len() < n_views;
            images += &format!("{at}.25 7 {} ", if is_seen { point as i64 + 1 } else { -1 });
            if is_seen {
                tracks[point] += &format!(" {} {at}", image + 1);
            }
        }
        images += "\n";
    }
    let point = |(at, track): (usize, String)| format!("{} {at} 0 1 9 9 9 0{track}\n", at + 1);
    let points: String = tracks.into_iter().enumerate().map(point).collect();
    fs::write(folder.join("images.txt"), images).unwrap();
    fs::write(folder.join("points3D.txt"), points).unwrap();
    fs::write(folder.join("cameras.txt"), "1 PINHOLE 640 480 500 500 320 240\n").unwrap();
    read::open(folder).unwrap()
}

/// Writes a database of the eight images with these descriptors of the keypoints of each.
fn write_bytes(path: &Path, bytes: impl Fn(usize) -> Vec<u8>) {
    let mut sql = "PRAGMA foreign_keys=0; DELETE FROM images; DELETE FROM descriptors;".to_owned();
    for image in 0..8 {
        let hex: String = bytes(image).iter().map(|x| format!("{x:02x}")).collect();
        let id = 50 - image;
        sql += &format!("INSERT INTO images VALUES({id}, '{image}.jpg', 1);");
        sql += &format!("INSERT INTO descriptors VALUES({id}, 0, {N}, 32, x'{hex}');");
    }
    write_database(path, "project/database.db", &sql);
}

#[test]
fn features_of_hloc_are_means_over_the_tracks_of_their_model() {
    let (dir, path) = place("features.h5");
    let input = model(dir.path(), 0..8, 8);
    let around = |point: usize, last: f32| {
        let (sin, cos) = (point as f32 * std::f32::consts::TAU / N as f32).sin_cos();
        [cos, sin, last]
    };
    // The image 7 has `n` keypoints.
    let read = |n: usize| {
        let of_image = |image: usize| {
            let rows = 0..if image == 7 { n } else { N };
            let row = |at: usize| around(point_of(image, at), 0.125 * image as f32);
            (format!("{image}.jpg"), rows.flat_map(row).collect())
        };
        write_features(&path, 3, (0..8).map(of_image));
        read::descriptors(&path, &input)
    };
    let (descriptors, mut found) = (read(N).unwrap(), [0.0; 3]);
    for point in 0..N {
        descriptors.read_row(point, &mut found);
        // The mean, with norm 1, of floats of 24 bits.
        let expected = around(point, 0.4375).map(|x| f64::from(x) / 1.0_f64.hypot(0.4375));
        super::close(found.map(f64::from), expected, 1e-6);
    }
    let line = read(N + 1).unwrap_err().to_string();
    let expected = "image \"7.jpg\": expected 60 keypoints, as the model has, found 61";
    assert!(line.ends_with(expected), "{line}");
    let array = read::open(&data("f8.npy")).unwrap();
    let line = read::descriptors(&path, &array).unwrap_err().to_string();
    let expected = "expected a COLMAP model, whose tracks lead to images, found npy points";
    assert!(line.ends_with(expected), "{line}");
}

/// Undistorted models have other cameras and places of keypoints, those of VGGSfM tracks of two images, others lack images of the
/// database or have more.
#[test]
fn features_of_changed_models_pass_unless_they_are_in_another_order() {
    let dir = tempfile::tempdir().unwrap();
    for (kept, n_views) in [(0..8, 8), (0..8, 2), (2..5, 2), (1..8, 3)] {
        let input = model(dir.path(), kept.clone(), n_views);
        // Images in another order: none, all, every other. Of three images, one cannot be told.
        let n_orders = if kept.len() > 3 { 3 } else { 2 };
        for every in [usize::MAX, 1, 2].into_iter().take(n_orders) {
            let row = |image: usize, at: usize| {
                let is_wrong = (image + 1).is_multiple_of(every);
                let point = if is_wrong { at } else { point_of(image, at) };
                let draws = |of: usize| Draws::new(of as u64, Stage::Synthetic, 0);
                let (mut of_place, mut noise) = (draws(point), draws(N + image * N + at));
                (0..32).map(move |_| (of_place.normal() + 0.6 * noise.normal()) as f32)
            };
            let rows = |image: usize| (0..N).flat_map(move |at| row(image, at));
            let [h5, db] = ["f.h5", "f.db"].map(|name| dir.path().join(name));
            let of_image = |image: usize| {
                let mut values: Vec<f32> = rows(image).collect();
                round_to_half(&mut values);
                (format!("{image}.jpg"), values)
            };
            write_features(&h5, 32, (0..8).map(of_image));
            write_bytes(&db, |image| rows(image).map(|x| (60.0 * x) as u8).collect());
            for path in [h5, db] {
                let error = read::descriptors(&path, &input).err();
                assert_eq!(error.is_none(), every > 2, "{every} {kept:?} {path:?} {error:?}");
                fs::remove_file(path).unwrap();
            }
        }
    }
}

/// The bits of a point are those of most of its observations.
#[test]
fn bit_strings_of_a_track_are_no_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let input = model(dir.path(), 0..8, 8);
    let mut draws = Draws::new(5, Stage::Synthetic, 0);
    let bits: Vec<u8> = (0..32 * N).map(|_| draws.below(256) as u8).collect();
    let path = dir.path().join("f.db");
    write_bytes(&path, |image| {
        let wrong = |byte: usize| if byte % 8 == image { 0xf0 } else { 0 };
        let all = (0..N).flat_map(|at| (0..32).map(move |byte| (at, byte)));
        all.map(|(at, byte)| bits[point_of(image, at) * 32 + byte] ^ wrong(byte)).collect()
    });
    assert_eq!(read::descriptors(&path, &input).unwrap().values(), &Values::U8(bits));
}

#[test]
fn descriptors_of_points_are_read_in_every_type_and_order() {
    let input = read::open(&data("project")).unwrap();
    let of_bytes = read::descriptors(&data("project/descriptors.bin"), &input).unwrap();
    let Values::U8(bytes) = of_bytes.values() else { panic!("bytes expected") };
    // 512ths of bytes fit a half.
    let floats: Vec<f32> = bytes.iter().map(|&byte| f32::from(byte) / 512.0).collect();
    let rows = || floats.chunks(128);
    let half: fn(f32) -> Vec<u8> = |x| f16::from_f32(x).to_le_bytes().into();
    let single: fn(f32) -> Vec<u8> = |x| x.to_le_bytes().into();
    // An extra point, and another order of rows: points are joined by id.
    let joined = |dtype: u32, of: fn(f32) -> Vec<u8>| {
        let head = b"P3DESC01\x07\0\0\0\0\0\0\0\x80\0\0\0".to_vec();
        let ids = [1000u64, 11, 9, 6, 4, 3, 2].map(u64::to_le_bytes).concat();
        let rows = std::iter::once(&[0.5; 128][..]).chain(rows().rev());
        let values = rows.flatten().flat_map(|&x| of(x)).collect();
        [head, dtype.to_le_bytes().into(), ids, values].concat()
    };
    let array = |descr: &str, of: fn(f32) -> Vec<u8>| {
        npy(descr, "(6, 128)", &floats.iter().flat_map(|&x| of(x)).collect::<Vec<u8>>())
    };
    let columns = (0..128).flat_map(|c| rows().flat_map(move |row| single(row[c])));
    let columns = npy("'<f4'", "(6, 128)", &columns.collect::<Vec<u8>>());
    let order = columns.windows(5).position(|word| word == b"False").unwrap();
    for (what, file) in [
        ("halves by id", joined(2, half)),
        ("floats by id", joined(3, single)),
        ("<f2", array("'<f2'", half)),
        (">f2", array("'>f2'", |x| f16::from_f32(x).to_be_bytes().into())),
        (">f8", array("'>f8'", |x| f64::from(x).to_be_bytes().into())),
        ("by columns", patched(columns, order, b"True ")),
    ] {
        let (_dir, path) = write("d", file);
        let read = read::descriptors(&path, &input).unwrap();
        assert_eq!(read.values(), &Values::F32(floats.clone()), "{what}");
    }
    let (_dir, path) = write("d.npy", npy("'|u1'", "(6, 128)", bytes));
    assert_eq!(read::descriptors(&path, &input).unwrap(), of_bytes);
}

/// Without types, descriptors are bytes. A journal of writes ahead counts.
#[test]
fn databases_in_other_states_are_read_whole() {
    // A URI would misread this name.
    let (dir, path) = place("a?b#c%20 d.db");
    write_database(&path, "project/database.db", "ALTER TABLE descriptors DROP COLUMN type");
    let input = read::open(&data("project")).unwrap();
    let expected = read::descriptors(&data("project/descriptors.bin"), &input).unwrap();
    assert_eq!(read::descriptors(&path, &input).unwrap(), expected);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "reading writes no journal");
    let writer = rusqlite::Connection::open(&path).unwrap();
    let rename = "PRAGMA journal_mode=WAL; UPDATE images SET name = 'gone' WHERE image_id = 1";
    writer.execute_batch(rename).unwrap();
    let error = read::descriptors(&path, &input).unwrap_err().to_string();
    assert!(error.contains("no such image"), "{error}");
}

/// The file contains uncommitted rows, and the journal beside it the rows to restore.
#[test]
fn a_database_with_a_transaction_that_was_not_done_is_refused() {
    let (dir, path) = place("database.db");
    fs::copy(data("project/database.db"), &path).unwrap();
    let writer = rusqlite::Connection::open(&path).unwrap();
    let begin = "PRAGMA journal_mode=DELETE; PRAGMA cache_size=2; BEGIN; UPDATE images SET name = name || 'x'; \
                 CREATE TABLE pad(x);";
    let pads = "INSERT INTO pad VALUES(zeroblob(4000));".repeat(20);
    writer.execute_batch(&format!("{begin}{pads}")).unwrap();
    // Copies during the transaction.
    let [killed, journal] = ["killed.db", "killed.db-journal"].map(|name| dir.path().join(name));
    fs::copy(&path, &killed).unwrap();
    fs::copy(dir.path().join("database.db-journal"), journal).unwrap();
    drop(writer);
    let input = read::open(&data("project")).unwrap();
    let error = read::descriptors(&killed, &input).unwrap_err().to_string();
    assert!(!error.contains('\n') && error.contains("killed.db: "), "{error}");
    assert!(read::descriptors(&path, &input).is_ok(), "what was taken back");
}

#[test]
fn descriptors_are_of_the_points_that_have_a_place() {
    let (_dir, path) = write("a.xyz", "0 0 1\nnan 0 1\n0 2 1\n3 0 1\n");
    let input = read::open(&path).unwrap();
    let (_dir, path) = write("d.npy", npy("'|u1'", "(4, 2)", &[1, 2, 3, 4, 5, 6, 7, 8]));
    let descriptors = read::descriptors(&path, &input).unwrap();
    assert_eq!(descriptors.values(), &Values::U8(vec![1, 2, 5, 6, 7, 8]));
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_file_of_descriptors_is_refused_with_its_line() {
    let good = fixture("project/descriptors.bin");
    let input = read::open(&data("project")).unwrap();
    let header = || good[..24 + 6 * 8].to_vec();
    let halves = |half: f16| [patched(header(), 20, &[2]), half.to_le_bytes().repeat(6 * 128)].concat();
    let bytes = |what, bytes, line| (what, Ok::<Vec<u8>, &str>(bytes), line);
    let sql = |what, statement, line| (what, Err(statement), line);
    let zeros = [header(), vec![0; 6 * 128]].concat();
    // The bytes of a file, or a statement that is run on the database.
    let rows = vec![
        bytes("empty", vec![], "d: expected a file that begins with P3DESC01, a NumPy array (.npy), a COLMAP database (SQLite) or hloc's features (HDF5), found an empty file"),
        bytes("another form", b"\x89HDF\r\n\x1a\n".to_vec(), "d: expected a whole HDF5 file, found HDF5 format error: unexpected EOF: need 9 bytes, have 8"),
        bytes("count of 10^18", patched(good.clone(), 8, &MANY), "d: header (byte 8): expected at most 103 for the number of descriptors (824 bytes are left), found 1000000000000000000"),
        bytes("dimension of 2^32 - 1", patched(good.clone(), 16, &[255; 4]), "d: header (byte 24): expected 6 ids and rows of 4294967295 bytes, found 816 bytes"),
        bytes("unknown type", patched(good.clone(), 20, &[4]), "d: header (byte 20): expected type 1 (u8), 2 (float16) or 3 (float32), found 4"),
        bytes("half that is not finite", halves(f16::INFINITY), "d: header (byte 72): expected a finite value (as a float of 4 bytes) in row 0, found inf"),
        bytes("halves that are all the same", halves(f16::ONE), "d: descriptors: expected real descriptors, found the same row for every point (dummies)"),
        bytes("id of a point missing", patched(good.clone(), 24 + 8, &[100]), "d: point 3: expected a descriptor, found none among 6"),
        bytes("dummies", zeros, "d: descriptors: expected real descriptors, found only zeros (dummies)"),
        bytes("a database cut short", fixture("project/database.db")[..100].to_vec(), "d: table images: expected a COLMAP database, found database disk image is malformed"),
        sql("an image under another name", "UPDATE images SET name = 'x' WHERE name = 'i2.jpg'", "d: image \"i2.jpg\": expected this image of the model, found no such image"),
        sql("fewer descriptors than keypoints", "UPDATE descriptors SET rows = 2, data = substr(data, 1, 256)", "d: image \"küche/ä 0.jpg\": expected a descriptor for keypoint 2, found 2 descriptors"),
        sql("a blob cut short", "UPDATE descriptors SET data = substr(data, 1, 1000)", "d: image \"küche/ä 0.jpg\": expected 8 descriptors of 128 bytes, found 1000 bytes"),
        sql("text for rows", "UPDATE descriptors SET rows = 'many'", "d: table descriptors: expected a COLMAP database, found Invalid column type Text at index: 0, name: rows"),
        sql("two kinds in one database", "UPDATE descriptors SET type = 1 WHERE image_id = 1", "d: image \"i3.jpg\": expected 128 bytes each, as in other images, found 32 floats"),
        sql("NaN in a database", "UPDATE descriptors SET type = 1, cols = 4, data = x'0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f'", "d: descriptor 0, value 0: expected a finite value, found NaN"),
        bytes("an array of positions", npy("'<f8'", "(6,)", &[0; 48]), "d: header (byte 10): expected an array of shape (6, dimension), a row per point, found \"(6,)\""),
        bytes("a column per point", npy("'|u1'", "(4, 6)", &[7; 24]), "d: header (byte 10): expected an array of shape (6, dimension), a row per point, \
             found \"(4, 6)\", rows and columns exchanged"),
        bytes("integers", npy("'<i4'", "(6, 1)", &[7; 24]), "d: header (byte 10): expected bytes, or floats of 2, 4 or 8 bytes (u1, f2, f4, f8), found \"<i4\""),
        bytes("2^62 columns", npy("'<f8'", "(6, 4611686018427387904)", &[7; 24]), "d: header (byte 128): expected 6 rows of too many bytes, found 24 bytes"),
        bytes("a double that no float holds", npy("'<f8'", "(6, 1)", &[1e300f64.to_le_bytes(); 6].concat()), "d: header (byte 128): expected a finite value (as a float of 4 bytes) in row 0, found 1e300"),
        // Without rows, any dimension matches the file size. It must not allocate memory, here 100 GB.
        bytes("a dimension without rows", patched(patched(good[..24].to_vec(), 8, &[0; 8]), 16, &[255, 255, 255, 255, 3]), "d: descriptors: expected at most 65536 values each, found 4294967295"),
    ];
    for (what, wrong, line) in rows {
        let (dir, path) = place("d");
        match wrong {
            Ok(bytes) => fs::write(&path, bytes).unwrap(),
            Err(statement) => write_database(&path, "project/database.db", statement),
        }
        let error = read::descriptors(&path, &input).expect_err(what);
        assert_eq!(shown(dir.path(), &error), line, "{what}");
    }
}
