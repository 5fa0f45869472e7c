//! Miniatures of the datasets' folders and of a COLMAP project, with synthetic photos and rooms.

use std::path::Path;

use unlift::synthetic;

use crate::common::{Place, descriptor};

/// Points of a map: more than the entries of a list.
const N_POINTS: usize = 200;

/// Returns the center of camera `at`, in meters.
fn center(at: usize) -> [f64; 3] {
    let at = at as f64;
    [0.5 * at, 0.1 * at * at, 1.5 + 0.2 * (3.0 * at).sin()]
}

fn pose(at: usize) -> String {
    let [x, y, z] = center(at);
    format!("1 0 0 {x}\n0 1 0 {y}\n0 0 1 {z}\n0 0 0 1\n")
}

/// Creates a scene of 7-Scenes with `n` frames in the test sequence 3; returns the names of its
/// photos.
pub fn seven_scenes(place: &Place, scene: &str, n: usize) -> Vec<String> {
    place.write(&format!("{scene}/TestSplit.txt"), "sequence3\r\n");
    place.write(&format!("{scene}/TrainSplit.txt"), "sequence1\r\n");
    let names: Vec<String> = (0..n).map(|at| format!("seq-03/frame-{at:06}.color.png")).collect();
    for (at, name) in names.iter().enumerate() {
        let beside = |kind: &str| format!("{scene}/{}", name.replace("color.png", kind));
        place.write_photo(&beside("color.png"), at as u32);
        // Depth images differ from photos only by name.
        place.write_photo(&beside("depth.png"), 90 + at as u32);
        place.write(&beside("pose.txt"), pose(at));
    }
    names
}

/// Creates a COLMAP model of a room in `folder`; a unit is `unit` meters. All images see all
/// points.
pub fn model(place: &Place, folder: &str, names: &[String], unit: f64) {
    let points = synthetic::room(1, N_POINTS).points;
    write_model(place, folder, (names, [128, 96]), (&points, unit), |_, _| true);
}

/// Creates a COLMAP project of a room in `root`, with photos: each of 600 points is seen by two of
/// three images.
pub fn project(place: &Place, root: &str) {
    let names: Vec<String> = (0..3).map(|image| format!("room/{image}.jpg")).collect();
    let points = synthetic::room(1, 600).points;
    let sees = |image: usize, point: usize| (image + 3 - point % 3) % 3 < 2;
    let images = (names.as_slice(), [640, 480]);
    write_model(place, &format!("{root}/sparse/0"), images, (&points, 1.0), sees);
    write_database(&place.path(&format!("{root}/database.db")), &names, &points, sees);
    for (image, name) in names.iter().enumerate() {
        let path = format!("{root}/images/{name}");
        place.write(&path, "");
        let shade = |x: u32, y: u32| image::Rgb([x as u8, y as u8, 40 * image as u8]);
        image::RgbImage::from_fn(640, 480, shade).save(place.path(&path)).unwrap();
    }
}

/// Returns keypoint `at` of an image, on a wavy grid.
fn keypoint(at: usize) -> [f64; 2] {
    let wave = 3.0 * (at as f64).sin();
    [12.0 + 24.0 * (at % 25) as f64 + wave, 12.0 + 22.0 * (at / 25) as f64 - wave]
}

fn write_model(
    place: &Place,
    folder: &str,
    (names, [width, height]): (&[String], [u32; 2]),
    (points, unit): (&[[f64; 3]], f64),
    sees: impl Fn(usize, usize) -> bool,
) {
    let (focal, middle) = (width * 25 / 32, [width / 2, height / 2]);
    let camera = format!("1 SIMPLE_PINHOLE {width} {height} {focal} {} {}\n", middle[0], middle[1]);
    let (mut images, mut tracks) = (String::new(), vec![String::new(); points.len()]);
    for (image, name) in names.iter().enumerate() {
        let [x, y, z] = center(image).map(|x| -x / unit);
        let mut seen = Vec::new();
        for point in (0..points.len()).filter(|&point| sees(image, point)) {
            let [u, v] = keypoint(seen.len());
            tracks[point] += &format!(" {} {}", image + 1, seen.len());
            seen.push(format!("{u} {v} {}", point + 1));
        }
        images += &format!("{} 1 0 0 0 {x} {y} {z} 1 {name}\n{}\n", image + 1, seen.join(" "));
    }
    let line = |(at, (point, track)): (usize, (&[f64; 3], &String))| {
        let [x, y, z] = point.map(|x| x / unit);
        format!("{} {x} {y} {z} 0 0 0 0.5{track}\n", at + 1)
    };
    let points: String = points.iter().zip(&tracks).enumerate().map(line).collect();
    place.write(&format!("{folder}/cameras.txt"), camera);
    place.write(&format!("{folder}/images.txt"), images);
    place.write(&format!("{folder}/points3D.txt"), points);
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
