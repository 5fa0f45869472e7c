//! Files of descriptors: the binary form and databases.

use std::fs;

use unlift_io::read;

use super::{MANY, appended, fixture, fixtures, patched, shown};

/// What is wrong with a file of descriptors: its bytes, or a statement run on the database.
enum Wrong {
    Bytes(Vec<u8>),
    Sql(&'static str),
}

#[test]
#[rustfmt::skip] // A row is read as a row.
fn every_malformed_file_of_descriptors_is_refused_with_its_line() {
    let good = fixture("project/descriptors.bin");
    let input = read::open(&fixtures().join("project")).unwrap();
    let n = good.len();
    let bytes = |what, bytes, line| (what, Wrong::Bytes(bytes), line);
    let sql = |what, statement, line| (what, Wrong::Sql(statement), line);
    let zeros = appended(good[..n - 6 * 128].to_vec(), &[0; 6 * 128]);
    let rows: Vec<(&str, Wrong, &str)> = vec![
        bytes("empty", vec![],
            "d: expected a file that begins with P3DESC01, or a COLMAP database (SQLite), found an empty file"),
        bytes("short", b"P3D".to_vec(),
            "d: expected a file that begins with P3DESC01, or a COLMAP database (SQLite), found a file of 3 bytes"),
        bytes("another form", b"\x89HDF\r\n\x1a\n".to_vec(),
            "d: expected a file that begins with P3DESC01, or a COLMAP database (SQLite), found \"�HDF\\r\\n\\u{1a}\\n\""),
        bytes("cut in the header", good[..18].to_vec(),
            "d: header (byte 8): expected at most 0 for the number of descriptors (2 bytes are left), found 6"),
        bytes("cut in the ids", good[..40].to_vec(),
            "d: header (byte 8): expected at most 3 for the number of descriptors (24 bytes are left), found 6"),
        bytes("cut in the values", good[..n - 1].to_vec(),
            "d: header (byte 24): expected 6 ids and rows of 128 bytes, found 815 bytes"),
        bytes("trailing byte", appended(good.clone(), b"x"),
            "d: header (byte 24): expected 6 ids and rows of 128 bytes, found 817 bytes"),
        bytes("count of 10^18", patched(good.clone(), 8, &MANY),
            "d: header (byte 8): expected at most 103 for the number of descriptors (824 bytes are left), found 1000000000000000000"),
        bytes("dimension of 2^32 - 1", patched(good.clone(), 16, &[255; 4]),
            "d: header (byte 24): expected 6 ids and rows of 4294967295 bytes, found 816 bytes"),
        bytes("dimension of 0", patched(good.clone(), 16, &[0; 4]),
            "d: header (byte 24): expected 6 ids and rows of 0 bytes, found 816 bytes"),
        bytes("unknown type", patched(good.clone(), 20, &[2]),
            "d: header (byte 20): expected type 1 (bytes), found 2"),
        bytes("repeated id", patched(good.clone(), 24 + 8, &[2]),
            "d: record 2 (byte 32): expected each id once, found id 2 again"),
        bytes("id of a point missing", patched(good.clone(), 24 + 8, &[100]),
            "d: point 3: expected a descriptor, found none among 6"),
        bytes("dummies", zeros, "d: descriptors: expected real descriptors, found only zeros (dummies)"),
        bytes("a database cut short", fixture("project/database.db")[..100].to_vec(),
            "d: table images: expected a COLMAP database, found database disk image is malformed"),
        sql("a database without images", "PRAGMA foreign_keys=0; DROP TABLE images",
            "d: table images: expected a COLMAP database, found no such table: images"),
        sql("a database without descriptors", "DROP TABLE descriptors",
            "d: table descriptors: expected a COLMAP database, found no such table: descriptors"),
        sql("an image under another name", "UPDATE images SET name = 'x' WHERE name = 'i2.jpg'",
            "d: image \"i2.jpg\": expected this image of the model, found no such image"),
        sql("an image without descriptors", "DELETE FROM descriptors WHERE image_id = 1",
            "d: image \"i3.jpg\": expected descriptors, found none"),
        sql("fewer descriptors than keypoints", "UPDATE descriptors SET rows = 2, data = substr(data, 1, 256)",
            "d: image \"küche/ä 0.jpg\": expected a descriptor for keypoint 2, found 2 descriptors"),
        sql("a blob cut short", "UPDATE descriptors SET data = substr(data, 1, 1000)",
            "d: image \"küche/ä 0.jpg\": expected 8 descriptors of 128 bytes, found 1000 bytes"),
        sql("no blob", "UPDATE descriptors SET data = NULL",
            "d: image \"küche/ä 0.jpg\": expected 8 descriptors of 128 bytes, found 0 bytes"),
        sql("negative rows", "UPDATE descriptors SET rows = -8",
            "d: image \"küche/ä 0.jpg\": expected sizes of descriptors, found -8 x 128"),
        sql("rows of 2^62", "UPDATE descriptors SET rows = 4611686018427387904",
            "d: image \"küche/ä 0.jpg\": expected 4611686018427387904 descriptors of 128 bytes, found 1024 bytes"),
        sql("text for rows", "UPDATE descriptors SET rows = 'many'",
            "d: table descriptors: expected a COLMAP database, found Invalid column type Text at index: 0, name: rows"),
        sql("two kinds in one database", "UPDATE descriptors SET type = 1 WHERE image_id = 1",
            "d: image \"i3.jpg\": expected 128 columns of Bytes as in other images, found 128 of Floats"),
        sql("dummies in a database", "UPDATE descriptors SET data = zeroblob(1024)",
            "d: descriptors: expected real descriptors, found only zeros (dummies)"),
        sql("NaN in a database", "UPDATE descriptors SET type = 1, cols = 4, data = x'0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f0000c07f'",
            "d: descriptor 0, value 0: expected a finite value, found NaN"),
    ];
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
        "project/database.db: expected a COLMAP model, whose tracks lead to a database, found npy points"
    );
}
