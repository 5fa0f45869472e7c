//! Tests descriptors of the points of a map.

use std::fs;
use std::ops::Range;
use std::path::Path;

use half::f16;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::seed::{Draws, Stage};
use unlift_io::features::{FeatureWriter, ImageFeatures, round_to_half};
use unlift_io::read::{self, Input, colmap};

use super::malformed::{MANY, appended, patched};
use super::{data, fixture, npy, place, shown, write, write_database};

#[test]
fn descriptors_follow_the_ids_of_the_input_in_every_form() {
    let all = read::open(&data("project")).unwrap();
    let some = Input {
        ids: vec![all.ids[4], all.ids[1]],
        positions: vec![all.positions[4], all.positions[1]],
        ..all.clone()
    };
    let joined = read::descriptors(&data("project/descriptors.bin"), &all).unwrap();
    assert_eq!((joined.len(), joined.dim()), (6, 128));
    for file in ["descriptors.bin", "database.db", "floats.db"] {
        let path = data("project").join(file);
        let descriptors = read::descriptors(&path, &all).unwrap();
        // Those through the tracks are those of the binary form.
        assert!(file == "floats.db" || descriptors == joined);
        assert_eq!(read::descriptors(&path, &some).unwrap(), descriptors.select(&[4, 1]), "{file}");
    }
    let floats = read::descriptors(&data("project/floats.db"), &all).unwrap();
    assert_eq!((floats.len(), floats.dim()), (6, 4));
    let Values::F32(values) = floats.values() else { panic!("floats expected") };
    for row in values.chunks(4) {
        // Norm 1: four values rounded to 24 bits.
        assert!((row.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-6);
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

fn row(id: u32, at: u32) -> [f32; 3] {
    [id as f32, at as f32 - 2.0, 1.0]
}

/// Writes features of the images of the project. The image `odd` has an extra keypoint.
fn features(path: &Path, odd: &str) {
    let images = colmap::read_images(&data("project/sparse/0/images.bin")).unwrap();
    let described = |image: colmap::Image| {
        let name = String::from_utf8(image.name).unwrap();
        let n = image.n_points2d as u32 + u32::from(name == odd);
        (name, (0..n).flat_map(|at| row(image.id, at)).collect())
    };
    write_features(path, 3, images.into_iter().map(described));
}

#[test]
fn features_of_hloc_are_descriptors_of_the_points_that_they_made() {
    let (_dir, path) = place("features.h5");
    let input = read::open(&data("project")).unwrap();
    features(&path, "");
    let descriptors = read::descriptors(&path, &input).unwrap();
    let points = colmap::read_points(&data("project/sparse/0/points3D.bin"), true).unwrap();
    let tracks = points.tracks.unwrap();
    let mut of_point = [0.0; 3];
    for at in 0..points.ids.len() {
        let rows = || tracks.row(at).iter().map(|&(id, index)| row(id, index));
        let sum: [f32; 3] = std::array::from_fn(|c| rows().map(|row| row[c]).sum());
        let length = sum.iter().map(|x| x * x).sum::<f32>().sqrt();
        descriptors.read_row(at, &mut of_point);
        super::close(of_point.map(f64::from), sum.map(|x| f64::from(x / length)), 1e-6);
    }
    features(&path, "küche/ä 0.jpg");
    let line = read::descriptors(&path, &input).unwrap_err().to_string();
    let expected = "keypoints, as the model has, found";
    assert!(line.contains("küche/ä 0.jpg") && line.contains(expected), "{line}");
    let array = read::open(&data("f8.npy")).unwrap();
    let line = read::descriptors(&data("project/database.db"), &array).unwrap_err().to_string();
    let expected =
        "database.db: expected a COLMAP model, whose tracks lead to images, found npy points";
    assert!(line.ends_with(expected), "{line}");
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
            tracks[point] +=
                &(if is_seen { format!(" {} {at}", image + 1) } else { String::new() });
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

/// Undistorted models have other cameras and places of keypoints, those of VGGSfM tracks of two images, others lack images of the
/// database or have more.
#[test]
fn features_of_changed_models_pass_unless_they_are_in_another_order() {
    let dir = tempfile::tempdir().unwrap();
    for (kept, n_views) in [(0..8, 8), (0..8, 2), (2..5, 2), (1..8, 3)] {
        let input = model(dir.path(), kept.clone(), n_views);
        for is_wrong in [false, true] {
            let row = |image: usize, at: usize| {
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
                assert_eq!(error.is_some(), is_wrong, "{kept:?} {n_views} {path:?} {error:?}");
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
        let head = [&b"P3DESC01\x07\0\0\0\0\0\0\0\x80\0\0\0"[..], &dtype.to_le_bytes()].concat();
        let ids = [1000u64, 11, 9, 6, 4, 3, 2].map(u64::to_le_bytes).concat();
        let rows = std::iter::once(&[0.5; 128][..]).chain(rows().rev());
        [head, ids, rows.flatten().flat_map(|&x| of(x)).collect()].concat()
    };
    let array = |descr: &str, of: fn(f32) -> Vec<u8>| {
        npy(descr, "(6, 128)", &floats.iter().flat_map(|&x| of(x)).collect::<Vec<u8>>())
    };
    let columns = (0..128).flat_map(|c| rows().map(move |row| row[c]));
    let columns = npy("'<f4'", "(6, 128)", &columns.flat_map(single).collect::<Vec<u8>>());
    let order = columns.windows(5).position(|word| word == b"False").unwrap();
    for (what, file) in [
        ("halves by id", joined(2, half)),
        ("floats by id", joined(3, single)),
        ("<f2", array("'<f2'", half)),
        (">f2", array("'>f2'", |x| f16::from_f32(x).to_be_bytes().into())),
        ("<f4", array("'<f4'", single)),
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

#[test]
fn a_database_without_types_is_read_as_bytes() {
    // A URI would misread this name.
    let (dir, path) = place("a?b#c%20 d.db");
    write_database(&path, "project/database.db", "ALTER TABLE descriptors DROP COLUMN type");
    let input = read::open(&data("project")).unwrap();
    let expected = read::descriptors(&data("project/descriptors.bin"), &input).unwrap();
    assert_eq!(read::descriptors(&path, &input).unwrap(), expected);
    let left: Vec<_> = fs::read_dir(dir.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "reading writes no journal: {left:?}");
}

#[test]
fn a_database_in_write_ahead_mode_is_read_whole() {
    let (_dir, path) = place("database.db");
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
    let (dir, path) = place("database.db");
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

#[test]
fn descriptors_are_of_the_points_that_have_a_place() {
    let (_dir, path) = write("a.xyz", "0 0 1\nnan 0 1\n0 2 1\n3 0 1\n");
    let input = read::open(&path).unwrap();
    let (_dir, path) = write("d.npy", npy("'|u1'", "(4, 2)", &[1, 2, 3, 4, 5, 6, 7, 8]));
    let descriptors = read::descriptors(&path, &input).unwrap();
    assert_eq!(descriptors.values(), &Values::U8(vec![1, 2, 5, 6, 7, 8]));
}

/// Descriptors of the six points of the project, of a float type, whose values are all `value`.
fn floats(dtype: u8, value: &[u8]) -> Vec<u8> {
    let good = fixture("project/descriptors.bin");
    let header = patched(good[..24 + 6 * 8].to_vec(), 20, &[dtype]);
    appended(header, &value.repeat(6 * 128))
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_file_of_descriptors_is_refused_with_its_line() {
    let good = fixture("project/descriptors.bin");
    let input = read::open(&data("project")).unwrap();
    let n = good.len();
    let bytes = |what, bytes, line| (what, Ok::<Vec<u8>, &str>(bytes), line);
    let sql = |what, statement, line| (what, Err(statement), line);
    let zeros = appended(good[..n - 6 * 128].to_vec(), &[0; 6 * 128]);
    // The bytes of a file, or a statement that is run on the database.
    let rows = vec![
        bytes("empty", vec![], "d: expected a file that begins with P3DESC01, a NumPy array (.npy), a COLMAP database (SQLite) or hloc's features (HDF5), found an empty file"),
        bytes("another form", b"\x89HDF\r\n\x1a\n".to_vec(), "d: expected a whole HDF5 file, found HDF5 format error: unexpected EOF: need 9 bytes, have 8"),
        bytes("cut in the ids", good[..40].to_vec(), "d: header (byte 8): expected at most 3 for the number of descriptors (24 bytes are left), found 6"),
        bytes("cut in the values", good[..n - 1].to_vec(), "d: header (byte 24): expected 6 ids and rows of 128 bytes, found 815 bytes"),
        bytes("count of 10^18", patched(good.clone(), 8, &MANY), "d: header (byte 8): expected at most 103 for the number of descriptors (824 bytes are left), found 1000000000000000000"),
        bytes("dimension of 2^32 - 1", patched(good.clone(), 16, &[255; 4]), "d: header (byte 24): expected 6 ids and rows of 4294967295 bytes, found 816 bytes"),
        bytes("unknown type", patched(good.clone(), 20, &[4]), "d: header (byte 20): expected type 1 (u8), 2 (float16) or 3 (float32), found 4"),
        bytes("bytes said to be halves", patched(good.clone(), 20, &[2]), "d: header (byte 24): expected 6 ids and rows of 256 bytes, found 816 bytes"),
        bytes("half that is not finite", floats(2, &f16::INFINITY.to_le_bytes()), "d: header (byte 72): expected a finite value (as a float of 4 bytes) in row 0, found inf"),
        bytes("halves that are all the same", floats(2, &f16::ONE.to_le_bytes()), "d: descriptors: expected real descriptors, found the same row for every point (dummies)"),
        bytes("id of a point missing", patched(good.clone(), 24 + 8, &[100]), "d: point 3: expected a descriptor, found none among 6"),
        bytes("dummies", zeros, "d: descriptors: expected real descriptors, found only zeros (dummies)"),
        bytes("a database cut short", fixture("project/database.db")[..100].to_vec(), "d: table images: expected a COLMAP database, found database disk image is malformed"),
        sql("a database without images", "PRAGMA foreign_keys=0; DROP TABLE images", "d: table images: expected a COLMAP database, found no such table: images"),
        sql("an image under another name", "UPDATE images SET name = 'x' WHERE name = 'i2.jpg'", "d: image \"i2.jpg\": expected this image of the model, found no such image"),
        sql("an image without descriptors", "DELETE FROM descriptors WHERE image_id = 1", "d: image \"i3.jpg\": expected descriptors, found none"),
        sql("fewer descriptors than keypoints", "UPDATE descriptors SET rows = 2, data = substr(data, 1, 256)", "d: image \"küche/ä 0.jpg\": expected a descriptor for keypoint 2, found 2 descriptors"),
        sql("a blob cut short", "UPDATE descriptors SET data = substr(data, 1, 1000)", "d: image \"küche/ä 0.jpg\": expected 8 descriptors of 128 bytes, found 1000 bytes"),
        sql("negative rows", "UPDATE descriptors SET rows = -8", "d: image \"küche/ä 0.jpg\": expected sizes of descriptors, found -8 x 128"),
        sql("text for rows", "UPDATE descriptors SET rows = 'many'", "d: table descriptors: expected a COLMAP database, found Invalid column type Text at index: 0, name: rows"),
        sql("two kinds in one database", "UPDATE descriptors SET type = 1 WHERE image_id = 1", "d: image \"i3.jpg\": expected 128 bytes each, as in other images, found 32 floats"),
        sql("NaN in a database", "UPDATE descriptors SET type = 1, cols = 4, data = x'0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f'", "d: descriptor 0, value 0: expected a finite value, found NaN"),
        bytes("an array of positions", npy("'<f8'", "(6,)", &[0; 48]), "d: header (byte 10): expected an array of shape (6, dimension), a row per point, found \"(6,)\""),
        bytes("a column per point", npy("'|u1'", "(4, 6)", &[7; 24]), "d: header (byte 10): expected an array of shape (6, dimension), a row per point, \
             found \"(4, 6)\", rows and columns exchanged"),
        bytes("integers", npy("'<i4'", "(6, 1)", &[7; 24]), "d: header (byte 10): expected bytes, or floats of 2, 4 or 8 bytes (u1, f2, f4, f8), found \"<i4\""),
        bytes("2^62 columns", npy("'<f8'", "(6, 4611686018427387904)", &[7; 24]), "d: header (byte 128): expected 6 rows of too many bytes, found 24 bytes"),
        bytes("a double that no float holds", npy("'<f8'", "(6, 1)", &[1e300f64.to_le_bytes(); 6].concat()), "d: header (byte 128): expected a finite value (as a float of 4 bytes) in row 0, found 1e300"),
        bytes("65537 columns", npy("'|u1'", "(6, 65537)", &[7; 6 * 65537]), "d: descriptors: expected at most 65536 values each, found 65537"),
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

/// Without rows, any dimension matches the file size. It must not allocate memory, here 17 TB.
#[test]
fn a_dimension_without_rows_takes_no_memory() {
    let header = patched(fixture("project/descriptors.bin")[..24].to_vec(), 8, &[0; 8]);
    let (dir, path) = write("d", patched(header, 16, &[255, 255, 255, 255, 3]));
    let input = read::Input { ids: (0..1000).collect(), ..read::Input::default() };
    let error = read::descriptors(&path, &input).unwrap_err();
    assert_eq!(
        shown(dir.path(), &error),
        "d: descriptors: expected at most 65536 values each, found 4294967295"
    );
}
