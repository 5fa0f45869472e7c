//! An interrupted audit goes on from what it kept, to the same figures.

#![cfg(unix)]

mod common;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::Place;
use serde_json::Value;

const AUDIT: &str = "audit map room.csv --schemes olc,ppl,plane,cp --inlier-ratios 0.5,0.3 --k 20 --scale 1 --solver joint,joint-start";

fn kept(place: &Place) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(place.path("kept")) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    // What is being written has another name yet.
    let is_named = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
        name.contains('-') && !name.starts_with('.') && name.ends_with(".recovered.parquet")
    };
    let mut paths: Vec<PathBuf> = paths.filter(is_named).collect();
    paths.sort();
    paths
}

/// The figures that an audit wrote, without what tells one run from another.
fn figures(place: &Place, out: &str) -> Value {
    let text = fs::read_to_string(place.path(out).join("audit.json")).expect("figures");
    let mut document: Value = serde_json::from_str(&text).expect("JSON");
    document.as_object_mut().expect("fields").remove("run").expect("what tells runs apart");
    document
}

/// Begins an audit that keeps what it recovers, and kills it when three recoveries are kept.
fn interrupted(place: &Place) -> Vec<PathBuf> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_unlift"))
        .args(format!("{AUDIT} --journal kept --out out").split_whitespace())
        .current_dir(place.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let started = Instant::now();
    while kept(place).len() < 3 {
        assert!(started.elapsed() < Duration::from_secs(120), "nothing is kept");
        assert!(child.try_wait().expect("a state").is_none(), "it ended before it was killed");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("it is killed");
    child.wait().expect("it ends");
    assert!(!place.path("out/audit.json").exists());
    kept(place)
}

#[test]
fn what_was_recovered_is_not_recovered_again() {
    let place = Place::with_room(3000);
    place.ends(&format!("{AUDIT} --out whole"), 0);
    let n_kept = interrupted(&place).len();
    let (_, told) = place.ends(&format!("{AUDIT} --journal kept --out out"), 0);
    let told = told.lines().find(|line| line.contains("recoveries were taken")).expect("a note");
    assert_eq!(told, format!("unlift: note: {n_kept} recoveries were taken from kept"));
    assert_eq!(figures(&place, "out"), figures(&place, "whole"));
    assert!(!place.path("kept").exists(), "what is done is cleared away");
}

#[test]
fn what_is_damaged_or_of_another_audit_is_not_taken() {
    let place = Place::with_room(3000);
    let kept_files = interrupted(&place);
    for path in &kept_files {
        let mut bytes = fs::read(path).expect("a kept file");
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(path, bytes).expect("a damaged file");
    }
    fs::write(place.path("kept/notes.txt"), "mine").expect("a file of the user's");
    let (_, told) = place.ends(&format!("{AUDIT} --seed 2 --journal kept --out other"), 0);
    assert!(!told.contains("--journal") && !told.contains("were taken"), "{told}");
    let (_, told) = place.ends(&format!("{AUDIT} --journal kept --out out"), 0);
    // Of joint recovery and the pass that it starts from the first tells of both.
    let damaged = told.lines().filter(|line| line.ends_with("is damaged: recovered again"));
    assert_eq!(damaged.count(), kept_files.len() - 1, "{told}");
    place.ends(&format!("{AUDIT} --out whole"), 0);
    assert_eq!(figures(&place, "out"), figures(&place, "whole"));
    let left: Vec<PathBuf> = fs::read_dir(place.path("kept"))
        .expect("a folder")
        .map(|e| e.expect("an entry").path())
        .collect();
    assert_eq!(left, [place.path("kept/notes.txt")], "what is not ours stays");
}

#[test]
fn a_journal_that_is_a_file_is_refused() {
    let place = Place::with_room(300);
    let (_, told) = place.ends(&format!("{AUDIT} --journal room.csv --out out"), 2);
    assert_eq!(told, "unlift: --journal: room.csv: expected a folder, found a file\n");
}
