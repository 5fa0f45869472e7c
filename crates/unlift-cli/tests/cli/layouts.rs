//! A miniature of a COLMAP project, with synthetic photos and a room.

use std::path::Path;

use unlift::synthetic;

use crate::common::{Place, descriptor};

/// Creates a COLMAP project of a room in `root`, with photos: each of 600 points is seen by two of
/// three images.
pub fn project(place: &Place, root: &str) {
    let names: Vec<String> = (0..3).map(|image| format!("room/{image}.jpg")).collect();
    let points = synthetic::room(1, 600).points;
    let sees = |image: usize, point: usize| (image + 3 - point % 3) % 3 < 2;
    let (mut images, mut tracks) = (String::new(), vec![String::new(); points.len()]);
    for (image, name) in names.iter().enumerate() {
        let at = image as f64;
        let center = [0.5 * at, 0.1 * at * at, 1.5 + 0.2 * (3.0 * at).sin()];
        let [x, y, z] = center.map(|x| -x);
        let mut seen = Vec::new();
        for point in (0..points.len()).filter(|&point| sees(image, point)) {
            let [u, v] = keypoint(seen.len());
            tracks[point] += &format!(" {} {}", image + 1, seen.len());
            seen.push(format!("{u} {v} {}", point + 1));
        }
        images += &format!("{} 1 0 0 0 {x} {y} {z} 1 {name}\n{}\n", image + 1, seen.join(" "));
        let path = format!("{root}/images/{name}");
        place.write(&path, "");
        let shade = |x: u32, y: u32| image::Rgb([x as u8, y as u8, 40 * image as u8]);
        image::RgbImage::from_fn(640, 480, shade).save(place.path(&path)).unwrap();
    }
    let line = |(at, ([x, y, z], track)): (usize, (&[f64; 3], &String))| {
        format!("{} {x} {y} {z} 0 0 0 0.5{track}\n", at + 1)
    };
    let rows: String = points.iter().zip(&tracks).enumerate().map(line).collect();
    let camera = "1 SIMPLE_PINHOLE 640 480 500 320 240\n";
    place.write(&format!("{root}/sparse/0/cameras.txt"), camera);
    place.write(&format!("{root}/sparse/0/images.txt"), images);
    place.write(&format!("{root}/sparse/0/points3D.txt"), rows);
    write_database(&place.path(&format!("{root}/database.db")), &names, &points, sees);
}

/// Returns keypoint `at` of an image, on a wavy grid.
fn keypoint(at: usize) -> [f64; 2] {
    let wave = 3.0 * (at as f64).sin();
    [12.0 + 24.0 * (at % 25) as f64 + wave, 12.0 + 22.0 * (at / 25) as f64 - wave]
}

fn write_database(
    path: &Path,
    names: &[String],
    points: &[[f64; 3]],
    sees: impl Fn(usize, usize) -> bool,
) {
    let database = rusqlite::Connection::open(path).unwrap();
    let tables = "CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY, model INTEGER, width INTEGER, height INTEGER);
         CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER);
         CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);
         CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);
         INSERT INTO cameras VALUES (1, 1, 640, 480);";
    database.execute_batch(tables).unwrap();
    for (image, name) in names.iter().enumerate() {
        // Ids are in reverse order, because images are matched by name.
        let id = (names.len() - image) as i64;
        let insert = "INSERT INTO images VALUES (?, ?, 1)";
        database.execute(insert, rusqlite::params![id, name]).unwrap();
        let seen: Vec<usize> = (0..points.len()).filter(|&point| sees(image, point)).collect();
        let places = (0..seen.len()).flat_map(|at| keypoint(at).map(|x| x as f32));
        let places: Vec<u8> = places.flat_map(f32::to_le_bytes).collect();
        let rows: Vec<u8> =
            seen.iter().flat_map(|&point| descriptor(&points[point], 128)).collect();
        for (table, n_columns, data) in [("keypoints", 2, places), ("descriptors", 128, rows)] {
            let insert = format!("INSERT INTO {table} VALUES (?, ?, ?, ?)");
            let n = seen.len() as i64;
            database.execute(&insert, rusqlite::params![id, n, n_columns, data]).unwrap();
        }
    }
    database.close().unwrap();
}
