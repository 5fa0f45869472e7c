//! Malformed files of descriptors.

use std::fs;

use half::f16;
use unlift_io::read;

use super::{MANY, appended, fixture, fixtures, patched, shown};

/// The bytes of a file, or a statement that is run on the database.
enum Wrong {
    Bytes(Vec<u8>),
    Sql(&'static str),
}

/// Descriptors of the six points of the project, of a float type, whose values are all `value`.
fn floats(dtype: u8, value: &[u8]) -> Vec<u8> {
    let good = fixture("project/descriptors.bin");
    let header = patched(good[..24 + 6 * 8].to_vec(), 20, &[dtype]);
    appended(header, &value.repeat(6 * 128))
}

/// Creates an array whose header ends at byte 128.
fn array(descr: &str, shape: &str, values: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}");
    let head = appended(b"\x93NUMPY\x01\0\x76\0".to_vec(), format!("{text:118}").as_bytes());
    appended(head, values)
}

#[test]
#[rustfmt::skip] // One row per line.
fn every_malformed_file_of_descriptors_is_refused_with_its_line() {
    let good = fixture("project/descriptors.bin");
    let input = read::open(&fixtures().join("project")).unwrap();
    let n = good.len();
    let bytes = |what, bytes, line| (what, Wrong::Bytes(bytes), line);
    let sql = |what, statement, line| (what, Wrong::Sql(statement), line);
    let zeros = appended(good[..n - 6 * 128].to_vec(), &[0; 6 * 128]);
    let rows: Vec<(&str, Wrong, &str)> = vec![
        bytes("empty", vec![],
            "d: expected a file that begins with P3DESC01, a NumPy array (.npy), a COLMAP database (SQLite) or hloc's features (HDF5), found an empty file"),
        bytes("another form", b"\x89HDF\r\n\x1a\n".to_vec(),
            "d: expected a whole HDF5 file, found HDF5 format error: unexpected EOF: need 9 bytes, have 8"),
        bytes("cut in the ids", good[..40].to_vec(),
            "d: header (byte 8): expected at most 3 for the number of descriptors (24 bytes are left), found 6"),
        bytes("cut in the values", good[..n - 1].to_vec(),
            "d: header (byte 24): expected 6 ids and rows of 128 bytes, found 815 bytes"),
        bytes("count of 10^18", patched(good.clone(), 8, &MANY),
            "d: header (byte 8): expected at most 103 for the number of descriptors (824 bytes are left), found 1000000000000000000"),
        bytes("dimension of 2^32 - 1", patched(good.clone(), 16, &[255; 4]),
            "d: header (byte 24): expected 6 ids and rows of 4294967295 bytes, found 816 bytes"),
        bytes("unknown type", patched(good.clone(), 20, &[4]),
            "d: header (byte 20): expected type 1 (u8), 2 (float16) or 3 (float32), found 4"),
        bytes("bytes said to be halves", patched(good.clone(), 20, &[2]),
            "d: header (byte 24): expected 6 ids and rows of 256 bytes, found 816 bytes"),
        bytes("half that is not finite", floats(2, &f16::INFINITY.to_le_bytes()),
            "d: point 2, value 0: expected a finite value, found inf"),
        bytes("halves that are all the same", floats(2, &f16::ONE.to_le_bytes()),
            "d: descriptors: expected real descriptors, found the same row for every point (dummies)"),
        bytes("floats that are all zero", floats(3, &[0; 4]),
            "d: descriptors: expected real descriptors, found only zeros (dummies)"),
        bytes("id of a point missing", patched(good.clone(), 24 + 8, &[100]),
            "d: point 3: expected a descriptor, found none among 6"),
        bytes("dummies", zeros, "d: descriptors: expected real descriptors, found only zeros (dummies)"),
        bytes("a database cut short", fixture("project/database.db")[..100].to_vec(),
            "d: table images: expected a COLMAP database, found database disk image is malformed"),
        sql("a database without images", "PRAGMA foreign_keys=0; DROP TABLE images",
            "d: table images: expected a COLMAP database, found no such table: images"),
        sql("an image under another name", "UPDATE images SET name = 'x' WHERE name = 'i2.jpg'",
            "d: image \"i2.jpg\": expected this image of the model, found no such image"),
        sql("an image without descriptors", "DELETE FROM descriptors WHERE image_id = 1",
            "d: image \"i3.jpg\": expected descriptors, found none"),
        sql("fewer descriptors than keypoints", "UPDATE descriptors SET rows = 2, data = substr(data, 1, 256)",
            "d: image \"küche/ä 0.jpg\": expected a descriptor for keypoint 2, found 2 descriptors"),
        sql("a blob cut short", "UPDATE descriptors SET data = substr(data, 1, 1000)",
            "d: image \"küche/ä 0.jpg\": expected 8 descriptors of 128 bytes, found 1000 bytes"),
        sql("negative rows", "UPDATE descriptors SET rows = -8",
            "d: image \"küche/ä 0.jpg\": expected sizes of descriptors, found -8 x 128"),
        sql("text for rows", "UPDATE descriptors SET rows = 'many'",
            "d: table descriptors: expected a COLMAP database, found Invalid column type Text at index: 0, name: rows"),
        sql("two kinds in one database", "UPDATE descriptors SET type = 1 WHERE image_id = 1",
            "d: image \"i3.jpg\": expected 128 bytes each, as in other images, found 32 floats"),
        sql("NaN in a database", "UPDATE descriptors SET type = 1, cols = 4, data = x'0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f'",
            "d: descriptor 0, value 0: expected a finite value, found NaN"),
    ];
    let npy = |what, array, line| (what, Wrong::Bytes(array), line);
    let rows = rows.into_iter().chain([
        npy("an array of positions", array("'<f8'", "(6,)", &[0; 48]),
            "d: header (byte 10): expected an array of shape (6, dimension), a row per point, found \"(6,)\""),
        npy("a column per point", array("'|u1'", "(4, 6)", &[7; 24]),
            "d: header (byte 10): expected an array of shape (6, dimension), a row per point, \
             found \"(4, 6)\", rows and columns exchanged"),
        npy("integers", array("'<i4'", "(6, 1)", &[7; 24]),
            "d: header (byte 10): expected bytes, or floats of 2, 4 or 8 bytes (u1, f2, f4, f8), found \"<i4\""),
        npy("an array cut short", array("'<f2'", "(6, 4)", &[7; 47]),
            "d: header (byte 128): expected 6 rows of 8 bytes, found 47 bytes"),
        npy("2^62 columns", array("'<f8'", "(6, 4611686018427387904)", &[7; 24]),
            "d: header (byte 128): expected 6 rows of too many bytes, found 24 bytes"),
        npy("a double that no float holds", array("'<f8'", "(6, 1)", &[1e300f64.to_le_bytes(); 6].concat()),
            "d: header (byte 128): expected a finite value (as a float of 4 bytes) in row 0, found 1e300"),
        npy("65537 columns", array("'|u1'", "(6, 65537)", &[7; 6 * 65537]),
            "d: descriptors: expected at most 65536 values each, found 65537"),
    ]);
    for (what, wrong, line) in rows {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("d");
        match wrong {
            Wrong::Bytes(bytes) => fs::write(&path, bytes).unwrap(),
            Wrong::Sql(statement) => {
                fs::write(&path, fixture("project/database.db")).unwrap();
                let database = rusqlite::Connection::open(&path).unwrap();
                database.execute_batch(statement).unwrap();
                database.close().unwrap();
            }
        }
        let error = read::descriptors(&path, &input).expect_err(what);
        assert_eq!(shown(dir.path(), &error), line, "{what}");
    }
}

#[test]
fn descriptors_need_a_database_or_a_model_that_fit() {
    let cloud = read::open(&fixtures().join("f8.npy")).unwrap();
    let database = fixtures().join("project/database.db");
    let error = read::descriptors(&database, &cloud).unwrap_err();
    assert_eq!(
        shown(&fixtures(), &error),
        "project/database.db: expected a COLMAP model, whose tracks lead to images, found npy points"
    );
}

/// Without rows, any dimension matches the file size. It must not allocate memory, here 17 TB.
#[test]
fn a_dimension_without_rows_takes_no_memory() {
    let dir = tempfile::tempdir().unwrap();
    let header = patched(fixture("project/descriptors.bin")[..24].to_vec(), 8, &[0; 8]);
    let path = dir.path().join("d");
    fs::write(&path, patched(header, 16, &[255, 255, 255, 255, 3])).unwrap();
    let input = read::Input { ids: (0..1000).collect(), ..read::Input::default() };
    let error = read::descriptors(&path, &input).unwrap_err();
    assert_eq!(shown(dir.path(), &error), "d: point 0: expected a descriptor, found none among 0");
}
