//! A miniature of a COLMAP project, with a room.

use rusqlite::{Connection, params};
use unlift::synthetic;

use crate::common::{Place, descriptor};

/// Creates a COLMAP project of a room in `root`: each of 600 points is seen by two of three images.
pub fn project(place: &Place, root: &str) {
    let points = synthetic::room(1, 600).points;
    let mut tracks = vec![String::new(); points.len()];
    let mut images = String::new();
    place.write(&format!("{root}/database.db"), "");
    let database = Connection::open(place.path(&format!("{root}/database.db"))).unwrap();
    let tables = "CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER);
         CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);";
    database.execute_batch(tables).unwrap();
    for image in 0..3 {
        let at = image as f64;
        let [x, y, z] = [-0.5 * at, -0.1 * at * at, -1.5 - 0.2 * (3.0 * at).sin()];
        images += &format!("{} 1 0 0 0 {x} {y} {z} 1 room/{image}.jpg\n\n", image + 1);
        let (mut n, mut rows) = (0, Vec::new());
        for point in (0..points.len()).filter(|point| (image + 3 - point % 3) % 3 < 2) {
            tracks[point] += &format!(" {} {n}", image + 1);
            n += 1;
            rows.extend(descriptor(&points[point], 128));
        }
        // Ids are in reverse order, because images are matched by name.
        let (id, name) = (3 - image as i64, format!("room/{image}.jpg"));
        database.execute("INSERT INTO images VALUES (?, ?, 1)", params![id, name]).unwrap();
        let insert = "INSERT INTO descriptors VALUES (?, ?, 128, ?)";
        database.execute(insert, params![id, n, rows]).unwrap();
    }
    database.close().unwrap();
    let line = |(at, ([x, y, z], track)): (usize, (&[f64; 3], &String))| {
        format!("{} {x} {y} {z} 0 0 0 0.5{track}\n", at + 1)
    };
    let rows: String = points.iter().zip(&tracks).enumerate().map(line).collect();
    let camera = "1 SIMPLE_PINHOLE 640 480 500 320 240\n";
    place.write(&format!("{root}/sparse/0/cameras.txt"), camera);
    place.write(&format!("{root}/sparse/0/images.txt"), images);
    place.write(&format!("{root}/sparse/0/points3D.txt"), rows);
}
