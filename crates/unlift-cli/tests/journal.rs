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

const RECOVERED: &str = ".recovered.parquet";

/// The files that are kept, with such an ending.
fn kept(place: &Place, ending: &str) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(place.path("kept")) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    // What is being written has another name yet.
    let is_named = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
        name.contains('-') && !name.starts_with('.') && name.ends_with(ending)
    };
    let mut paths: Vec<PathBuf> = paths.filter(is_named).collect();
    paths.sort();
    paths
}

/// What is said of so many recoveries that were kept.
fn taken(n: usize) -> String {
    format!("{n} recoveries were taken from a journal, as a run that was interrupted left them")
}

/// The notes that an audit wrote.
fn notes(place: &Place, out: &str) -> Vec<String> {
    let text = fs::read_to_string(place.path(out).join("audit.json")).expect("figures");
    let document: Value = serde_json::from_str(&text).expect("JSON");
    let notes = document["notes"].as_array().cloned().unwrap_or_default();
    notes.iter().map(|note| note.as_str().expect("a text").to_owned()).collect()
}

/// The figures that an audit wrote, without what tells one run from another.
fn figures(place: &Place, out: &str) -> Value {
    let text = fs::read_to_string(place.path(out).join("audit.json")).expect("figures");
    let mut document: Value = serde_json::from_str(&text).expect("JSON");
    let fields = document.as_object_mut().expect("fields");
    fields.remove("run").expect("what tells runs apart");
    fields.remove("notes");
    document
}

/// Begins an audit that keeps what it recovers, and kills it when three recoveries are kept.
fn interrupted(place: &Place) -> Vec<PathBuf> {
    killed_at(place, &format!("{AUDIT} --journal kept --out out"), (3, RECOVERED));
    assert!(!place.path("out/audit.json").exists());
    kept(place, RECOVERED)
}

/// Begins what `line` says, and kills it when so many files with such an ending are kept.
fn killed_at(place: &Place, line: &str, (n, ending): (usize, &str)) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_unlift"))
        .args(line.split_whitespace())
        .current_dir(place.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    let started = Instant::now();
    while kept(place, ending).len() < n {
        assert!(started.elapsed() < Duration::from_secs(120), "nothing is kept");
        assert!(child.try_wait().expect("a state").is_none(), "it ended before it was killed");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("it is killed");
    child.wait().expect("it ends");
}

#[test]
fn what_was_recovered_is_not_recovered_again() {
    let place = Place::with_room(3000);
    place.ends(&format!("{AUDIT} --out whole"), 0);
    let n_kept = interrupted(&place).len();
    let (_, told) = place.ends(&format!("{AUDIT} --journal kept --out out"), 0);
    let told = told.lines().find(|line| line.contains("recoveries were taken")).expect("a note");
    assert_eq!(told, format!("unlift: note: {}", taken(n_kept)));
    assert!(notes(&place, "out").contains(&taken(n_kept)), "whoever reads the figures knows");
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

/// Two files that change places, or one with another content: neither is the recovery that its key asks for.
#[test]
fn files_that_were_exchanged_or_replaced_are_not_taken() {
    let place = Place::with_room(3000);
    let kept_files = interrupted(&place);
    let name = |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
    let names: Vec<String> = kept_files.iter().map(name).collect();
    let parts: Vec<(&str, &str)> = names.iter().map(|name| name.split_once('-').unwrap()).collect();
    let exchanged = |key: usize, content: usize| {
        place.path("kept").join(format!("{}-{}", parts[key].0, parts[content].1))
    };
    fs::rename(&kept_files[0], place.path("first")).unwrap();
    fs::rename(&kept_files[1], exchanged(0, 1)).unwrap();
    fs::rename(place.path("first"), exchanged(1, 0)).unwrap();
    // Its own content under the plain hash of that content.
    let hash = unlift_io::hash::hash_file(&kept_files[2]).unwrap();
    fs::rename(&kept_files[2], place.path(&format!("kept/{}-{hash}{RECOVERED}", parts[2].0)))
        .unwrap();
    let (_, told) = place.ends(&format!("{AUDIT} --journal kept --out out"), 0);
    assert!(!told.contains("were taken"), "{told}");
    place.ends(&format!("{AUDIT} --out whole"), 0);
    assert_eq!(figures(&place, "out"), figures(&place, "whole"));
}

#[test]
fn a_journal_that_is_a_file_is_refused() {
    let place = Place::with_room(300);
    let (_, told) = place.ends(&format!("{AUDIT} --journal room.csv --out out"), 2);
    assert_eq!(told, "unlift: --journal: room.csv: expected a folder, found a file\n");
}
