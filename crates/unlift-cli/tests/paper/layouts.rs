//! Miniatures of the datasets' folders: made-up photos of blobs and made-up rooms, in the places of the real ones.

use std::fs;
use std::path::Path;

use crate::common::photo;

/// Points of a map: more than its lists have neighbors.
pub const N_POINTS: usize = 200;

/// Where camera `at` stands, in meters.
pub fn center(at: usize) -> [f64; 3] {
    let at = at as f64;
    [0.5 * at, 0.1 * at * at, 1.5 + 0.2 * (3.0 * at).sin()]
}

/// Writes a file, and the folders that it lies in.
pub fn put(path: &Path, text: impl AsRef<[u8]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

fn put_photo(path: &Path, at: usize) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    photo(at as u32).save(path).unwrap();
}

fn pose(at: usize) -> String {
    let [x, y, z] = center(at);
    format!("1 0 0 {x}\n0 1 0 {y}\n0 0 1 {z}\n0 0 0 1\n")
}

/// A scene of 7-Scenes with `n` frames in sequence 3, its only one for tests; the names of its photos.
pub fn seven_scenes(scene: &Path, n: usize) -> Vec<String> {
    put(&scene.join("TestSplit.txt"), "sequence3\r\n");
    put(&scene.join("TrainSplit.txt"), "sequence1\r\n");
    let names: Vec<String> = (0..n).map(|at| format!("seq-03/frame-{at:06}.color.png")).collect();
    for (at, name) in names.iter().enumerate() {
        put_photo(&scene.join(name), at);
        // Depth is a photo by its name alone.
        put_photo(&scene.join(name.replace("color", "depth")), 90 + at);
        put(&scene.join(name.replace("color.png", "pose.txt")), pose(at));
    }
    names
}

/// A scene of 12-Scenes, whose first `n_test` frames are for tests, of `n`.
pub fn twelve_scenes(scene: &Path, n_test: usize, n: usize) {
    let last = (n_test - 1, n - 1);
    let split = format!(
        "sequence0 [frames={n_test}] [start=0 ; end={}]\nsequence1 [frames={}] [start={n_test} ; end={}]\n",
        last.0,
        n - n_test,
        last.1
    );
    put(&scene.join("split.txt"), split);
    for at in 0..n {
        put_photo(&scene.join(format!("data/frame-{at:06}.color.jpg")), at);
        put(&scene.join(format!("data/frame-{at:06}.pose.txt")), pose(at));
    }
}

/// A scene of Cambridge Landmarks with these photos for tests, of `width` pixels, and a map of VisualSFM.
pub fn cambridge(scene: &Path, names: &[&str], width: u32) {
    let mut list =
        "Visual Landmark Dataset V1\nImageFile, Camera Position [X Y Z W P Q R]\n\n".to_owned();
    let mut nvm = format!("NVM_V3\n\n{}\n", names.len());
    for (at, name) in names.iter().enumerate() {
        let wide = image::imageops::resize(&photo(at as u32), width, 96, image::imageops::Nearest);
        let path = scene.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        wide.save(path).unwrap();
        let [x, y, z] = center(at);
        list += &format!("{name} {x} {y} {z} 1 0 0 0\n");
        nvm += &format!("{} 500 1 0 0 0 {x} {y} {z} 0 0\n", name.replace(".png", ".jpg"));
    }
    put(&scene.join("dataset_test.txt"), list);
    nvm += &format!("\n{N_POINTS}\n");
    for [x, y, z] in unlift::synthetic::room(1, N_POINTS).points {
        nvm += &format!("{x} {y} {z} 0 0 0 0\n");
    }
    put(&scene.join("reconstruction.nvm"), nvm + "\n0\n");
}

/// A COLMAP model of a room in `folder`, of images with these names, `unit` meters to a unit.
pub fn model(folder: &Path, names: &[String], unit: f64) {
    put(&folder.join("cameras.txt"), "1 SIMPLE_PINHOLE 128 96 100 64 48\n");
    let (mut images, mut points) = (String::new(), String::new());
    for (at, name) in names.iter().enumerate() {
        let [x, y, z] = center(at).map(|x| -x / unit);
        let seen: Vec<String> = (0..N_POINTS).map(|id| format!("1 1 {}", id + 1)).collect();
        images += &format!("{} 1 0 0 0 {x} {y} {z} 1 {name}\n{}\n", at + 1, seen.join(" "));
    }
    for (at, point) in unlift::synthetic::room(1, N_POINTS).points.iter().enumerate() {
        let [x, y, z] = point.map(|x| x / unit);
        points += &format!("{} {x} {y} {z} 0 0 0 0.5 1 {at}\n", at + 1);
    }
    put(&folder.join("images.txt"), images);
    put(&folder.join("points3D.txt"), points);
}

/// The database of such a project: descriptors of its first image.
pub fn database(path: &Path, names: &[String]) {
    let database = rusqlite::Connection::open(path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER);
             CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);",
        )
        .unwrap();
    for (at, name) in names.iter().enumerate() {
        let insert = "INSERT INTO images VALUES (?, ?, 1)";
        database.execute(insert, rusqlite::params![at as i64 + 1, name]).unwrap();
    }
    let rows: Vec<u8> = (0..N_POINTS * 128).map(|at| (at * at % 251) as u8).collect();
    let insert = "INSERT INTO descriptors VALUES (1, ?, 128, ?)";
    database.execute(insert, rusqlite::params![N_POINTS as i64, rows]).unwrap();
    database.close().unwrap();
}
