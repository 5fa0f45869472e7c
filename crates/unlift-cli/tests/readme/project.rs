//! A small COLMAP project, written as COLMAP writes one: `sparse/0` and `database.db`.

use std::fs;
use std::path::Path;

/// Points of the map.
const N_POINTS: usize = 600;
const N_IMAGES: usize = 3;
/// Images that see a point.
const TRACK: usize = 2;

/// Writes a made-up room, seen by three images, to `root`.
pub fn write(root: &Path) {
    let model = root.join("sparse/0");
    fs::create_dir_all(&model).unwrap();
    let points = unlift::synthetic::room(1, N_POINTS).points;
    // Per image the points it sees, in the order of its keypoints.
    let mut seen = vec![Vec::new(); N_IMAGES];
    for point in 0..points.len() {
        (0..TRACK).for_each(|step| seen[(point + step) % N_IMAGES].push(point));
    }
    fs::write(model.join("cameras.bin"), cameras()).unwrap();
    fs::write(model.join("images.bin"), images(&seen)).unwrap();
    fs::write(model.join("points3D.bin"), points3d(&points, &seen)).unwrap();
    write_database(&root.join("database.db"), &points, &seen);
    fs::create_dir_all(root.join("images/room")).unwrap();
    for image in 0..N_IMAGES {
        let shade = |x: u32, y: u32| image::Rgb([x as u8, y as u8, 40 * image as u8]);
        image::RgbImage::from_fn(640, 480, shade)
            .save(root.join("images").join(name(image)))
            .unwrap();
    }
}

fn name(image: usize) -> String {
    format!("room/{image}.jpg")
}

/// A pinhole camera of 640 x 480.
fn cameras() -> Vec<u8> {
    let mut file = 1u64.to_le_bytes().to_vec();
    file.extend(1u32.to_le_bytes());
    file.extend(1i32.to_le_bytes());
    [640u64, 480].iter().for_each(|side| file.extend(side.to_le_bytes()));
    [500.0f64, 500.0, 320.0, 240.0].iter().for_each(|x| file.extend(x.to_le_bytes()));
    file
}

/// Where keypoint `at` of an image lies: on a grid with a wave in it, within the image.
fn keypoint(at: usize) -> [f64; 2] {
    let wave = 3.0 * (at as f64).sin();
    [12.0 + 24.0 * (at % 25) as f64 + wave, 12.0 + 22.0 * (at / 25) as f64 - wave]
}

fn images(seen: &[Vec<usize>]) -> Vec<u8> {
    let mut file = (seen.len() as u64).to_le_bytes().to_vec();
    for (image, points) in seen.iter().enumerate() {
        file.extend((image as u32 + 1).to_le_bytes());
        let pose = [1.0f64, 0.0, 0.0, 0.0, -(image as f64), 0.0, 0.0];
        pose.iter().for_each(|x| file.extend(x.to_le_bytes()));
        file.extend(1u32.to_le_bytes());
        file.extend(name(image).bytes().chain([0]));
        file.extend((points.len() as u64).to_le_bytes());
        for (at, &point) in points.iter().enumerate() {
            keypoint(at).iter().for_each(|x| file.extend(x.to_le_bytes()));
            file.extend((point as u64 + 1).to_le_bytes());
        }
    }
    file
}

fn points3d(points: &[[f64; 3]], seen: &[Vec<usize>]) -> Vec<u8> {
    let mut file = (points.len() as u64).to_le_bytes().to_vec();
    for (point, position) in points.iter().enumerate() {
        file.extend((point as u64 + 1).to_le_bytes());
        position.iter().for_each(|x| file.extend(x.to_le_bytes()));
        file.extend([128; 3]);
        file.extend(0.5f64.to_le_bytes());
        file.extend((TRACK as u64).to_le_bytes());
        for (image, points) in seen.iter().enumerate() {
            if let Ok(at) = points.binary_search(&point) {
                file.extend((image as u32 + 1).to_le_bytes());
                file.extend((at as u32).to_le_bytes());
            }
        }
    }
    file
}

/// A descriptor that changes with the place of its point: near points look alike.
fn descriptor(position: &[f64; 3]) -> Vec<u8> {
    let value = |c: usize| {
        let of_axis = |axis: usize| position[axis] * (1.0 + ((c * (axis + 3)) % 7) as f64 / 4.0);
        let angle = of_axis(0) + of_axis(1) + of_axis(2) + (c * c) as f64;
        (45.0 + 44.0 * angle.sin()) as u8
    };
    (0..128).map(value).collect()
}

fn write_database(path: &Path, points: &[[f64; 3]], seen: &[Vec<usize>]) {
    let database = rusqlite::Connection::open(path).unwrap();
    database
        .execute_batch(
            "CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY, model INTEGER, width INTEGER, height INTEGER);
             CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER);
             CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);
             CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);
             INSERT INTO cameras VALUES (1, 1, 640, 480);",
        )
        .unwrap();
    for (image, points_seen) in seen.iter().enumerate() {
        // In reverse order: names join, not ids.
        let (id, n) = ((seen.len() - image) as i64, points_seen.len() as i64);
        let insert = "INSERT INTO images VALUES (?, ?, 1)";
        database.execute(insert, rusqlite::params![id, name(image)]).unwrap();
        let places = (0..points_seen.len()).flat_map(|at| keypoint(at).map(|x| x as f32));
        let places: Vec<u8> = places.flat_map(f32::to_le_bytes).collect();
        let insert = "INSERT INTO keypoints VALUES (?, ?, 2, ?)";
        database.execute(insert, rusqlite::params![id, n, places]).unwrap();
        let rows: Vec<u8> = points_seen.iter().flat_map(|&at| descriptor(&points[at])).collect();
        let insert = "INSERT INTO descriptors VALUES (?, ?, 128, ?)";
        database.execute(insert, rusqlite::params![id, n, rows]).unwrap();
    }
    database.close().unwrap();
}
