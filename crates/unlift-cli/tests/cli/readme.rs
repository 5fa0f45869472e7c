//! Runs every command line of the README in order, in an empty folder.

use std::fs;
use std::path::Path;

use rusqlite::{Connection, params};
use unlift::synthetic;
use unlift_io::clouds::write_points;

use crate::common::{Place, descriptor, texts};

/// Creates a COLMAP project of a room: each of 600 points is seen by three images.
fn write_project(place: &Place) {
    let points = synthetic::room(1, 600).points;
    let descriptors: Vec<u8> = points.iter().flat_map(|point| descriptor(point, 128)).collect();
    place.write("PROJECT/database.db", "");
    let database = Connection::open(place.path("PROJECT/database.db")).unwrap();
    let tables = "CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER);
         CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);";
    database.execute_batch(tables).unwrap();
    let mut images = String::new();
    for id in 1..=3 {
        let at = f64::from(id - 1);
        let [x, y, z] = [-0.5 * at, -0.1 * at * at, -1.5 - 0.2 * (3.0 * at).sin()];
        images += &format!("{id} 1 0 0 0 {x} {y} {z} 1 room/{id}.jpg\n\n");
        let insert = "INSERT INTO images VALUES (?, ?, 1)";
        database.execute(insert, params![id, format!("room/{id}.jpg")]).unwrap();
        let insert = "INSERT INTO descriptors VALUES (?, 600, 128, ?)";
        database.execute(insert, params![id, descriptors]).unwrap();
    }
    database.close().unwrap();
    let line = |(at, [x, y, z]): (usize, &[f64; 3])| {
        format!("{} {x} {y} {z} 0 0 0 0.5 1 {at} 2 {at} 3 {at}\n", at + 1)
    };
    let rows: String = points.iter().enumerate().map(line).collect();
    place.write("PROJECT/sparse/0/cameras.txt", "1 SIMPLE_PINHOLE 640 480 500 320 240\n");
    place.write("PROJECT/sparse/0/images.txt", images);
    place.write("PROJECT/sparse/0/points3D.txt", rows);
}

#[test]
fn every_command_line_of_the_readme_runs_as_it_is_written() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../README.md");
    let readme = fs::read_to_string(readme).unwrap();
    let blocks = readme.split("```sh\n").skip(1).filter_map(|block| block.split("```").next());
    let lines = blocks.flat_map(str::lines).filter_map(|line| line.split('#').next());
    let lines: Vec<&str> = lines.map(str::trim).filter(|line| !line.is_empty()).collect();
    assert!(lines.len() >= 15, "{lines:#?}");
    let builds = ["cargo install --path crates/unlift-cli", "cargo test --workspace"];

    let place = Place::with_photos();
    write_project(&place);
    write_points(&place.path("cloud.ply"), &synthetic::room(2, 400).points).unwrap();
    let names = ["PROJECT/database.db", "PROJECT/sparse/0/points3D.txt", "cloud.ply"];
    let inputs = || names.map(|name| place.bytes(name));
    let before = inputs();
    for line in lines.into_iter().filter(|line| !builds.contains(line)) {
        let line = line.replacen("cargo run --release --", "unlift", 1);
        assert!(line.starts_with("unlift "), "this test cannot run a line of the README: {line}");
        let run = place.shell(&line);
        let (stdout, stderr) = texts(&run);
        // A gate may fail, and must report that; nothing else may fail.
        let failed = line.contains("--gate") && stdout.contains("FAILED");
        assert_eq!(run.status.code(), Some(i32::from(failed)), "{line}\n{stdout}{stderr}");
        let out = line.split_whitespace().skip_while(|word| *word != "--out").nth(1);
        assert!(out.is_none_or(|out| place.path(out).exists()), "{line}");
    }
    assert!(inputs() == before, "a line of the README changed what a reader has");
}
