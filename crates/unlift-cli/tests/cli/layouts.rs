//! A miniature of a COLMAP project of a room.

use std::path::Path;

use unlift::synthetic;

use crate::common::{Place, descriptor};

/// Creates a COLMAP project of a room in `root`: every image sees all points.
pub fn project(place: &Place, root: &str) {
    let names = ["room/0.jpg", "room/1.jpg", "room/2.jpg"];
    let points = synthetic::room(1, 600).points;
    let seen: String = (0..points.len())
        .map(|at| {
            let [u, v] = keypoint(at);
            format!("{u} {v} {} ", at + 1)
        })
        .collect();
    let mut images = String::new();
    for (at, name) in names.iter().enumerate() {
        let along = at as f64;
        let [x, y, z] = [0.5 * along, 0.1 * along * along, 1.5 + 0.2 * (3.0 * along).sin()];
        images += &format!("{} 1 0 0 0 {} {} {} 1 {name}\n{seen}\n", at + 1, -x, -y, -z);
    }
    let line = |(at, [x, y, z]): (usize, &[f64; 3])| {
        format!("{} {x} {y} {z} 0 0 0 0.5 1 {at} 2 {at} 3 {at}\n", at + 1)
    };
    let rows: String = points.iter().enumerate().map(line).collect();
    let camera = "1 SIMPLE_PINHOLE 640 480 500 320 240\n";
    place.write(&format!("{root}/sparse/0/cameras.txt"), camera);
    place.write(&format!("{root}/sparse/0/images.txt"), images);
    place.write(&format!("{root}/sparse/0/points3D.txt"), rows);
    write_database(&place.path(&format!("{root}/database.db")), &names, &points);
}

/// Returns keypoint `at` of every image, on a wavy grid.
fn keypoint(at: usize) -> [f64; 2] {
    let wave = 3.0 * (at as f64).sin();
    [12.0 + 24.0 * (at % 25) as f64 + wave, 12.0 + 19.0 * (at / 25) as f64 - wave]
}

fn write_database(path: &Path, names: &[&str], points: &[[f64; 3]]) {
    let database = rusqlite::Connection::open(path).unwrap();
    let tables = "CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY, model INTEGER, width INTEGER, height INTEGER);
         CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER);
         CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);
         CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);
         INSERT INTO cameras VALUES (1, 1, 640, 480);";
    database.execute_batch(tables).unwrap();
    let n = points.len() as i64;
    let places = (0..points.len()).flat_map(|at| keypoint(at).map(|x| x as f32));
    let places: Vec<u8> = places.flat_map(f32::to_le_bytes).collect();
    let rows: Vec<u8> = points.iter().flat_map(|point| descriptor(point, 128)).collect();
    for (at, name) in names.iter().enumerate() {
        let id = at as i64 + 1;
        let insert = "INSERT INTO images VALUES (?, ?, 1)";
        database.execute(insert, rusqlite::params![id, name]).unwrap();
        for (table, n_columns, data) in [("keypoints", 2, &places), ("descriptors", 128, &rows)] {
            let insert = format!("INSERT INTO {table} VALUES (?, ?, ?, ?)");
            database.execute(&insert, rusqlite::params![id, n, n_columns, data]).unwrap();
        }
    }
    database.close().unwrap();
}
