//! `--journal`: an interrupted audit resumes, with the same results.

use std::fs;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::Place;

const AUDIT: &str = "audit map room.csv --schemes olc,ppl,plane,cp --inlier-ratios 0.5,0.3 --k 20 --scale 1 --solver joint,joint-start";

const RECOVERED: &str = ".recovered.parquet";

/// Returns the sorted names of the kept recoveries; unfinished files have another name.
fn kept(place: &Place) -> Vec<String> {
    if !place.path("kept").exists() {
        return Vec::new();
    }
    let is_named =
        |name: &String| name.contains('-') && !name.starts_with('.') && name.ends_with(RECOVERED);
    place.names("kept").into_iter().filter(is_named).collect()
}

/// Kills an audit with a journal after three recoveries; returns their names.
fn interrupted() -> (Place, Vec<String>) {
    let place = Place::with_room(3000);
    let mut child = place.start(&format!("{AUDIT} --journal kept --out out"));
    let started = Instant::now();
    while kept(&place).len() < 3 {
        assert!(started.elapsed() < Duration::from_secs(120), "nothing is kept");
        assert!(child.try_wait().expect("a state").is_none(), "it ended before it was killed");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("it is killed");
    child.wait().expect("it ends");
    assert!(!place.path("out/audit.json").exists());
    let kept = kept(&place);
    (place, kept)
}

/// Resumes the audit and returns stderr. The results must equal those of an uninterrupted audit.
fn go_on(place: &Place) -> String {
    let (_, told) = place.ends(&format!("{AUDIT} --journal kept --out out"), 0);
    place.ends(&format!("{AUDIT} --out whole"), 0);
    let figures = |folder: &str| -> Value {
        let mut document = place.json(&format!("{folder}/audit.json"));
        let fields = document.as_object_mut().expect("fields");
        fields.remove("run").expect("what tells runs apart");
        fields.remove("notes");
        document
    };
    assert_eq!(figures("out"), figures("whole"));
    told
}

#[test]
fn what_was_recovered_is_not_recovered_again() {
    let (place, kept) = interrupted();
    let told = go_on(&place);
    let n = kept.len();
    let taken = format!("{n} recoveries were read from the journal of an interrupted run");
    assert!(told.lines().any(|line| line == format!("unlift: note: {taken}")), "{told}");
    let notes = &place.json("out/audit.json")["notes"];
    assert!(notes.as_array().unwrap().contains(&taken.into()), "whoever reads the figures knows");
    assert!(!place.path("kept").exists(), "what is done is cleared away");

    let told = place.complains(&format!("{AUDIT} --journal room.csv --out out"), 2);
    assert_eq!(told, "unlift: --journal: room.csv: expected a folder, found a file\n");
}

#[test]
fn what_is_damaged_or_of_another_audit_is_not_taken() {
    let (place, kept) = interrupted();
    for name in &kept {
        let mut bytes = place.bytes(&format!("kept/{name}"));
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        place.write(&format!("kept/{name}"), bytes);
    }
    place.write("kept/notes.txt", "mine");
    let (_, told) = place.ends(&format!("{AUDIT} --seed 2 --journal kept --out other"), 0);
    assert!(!told.contains("--journal") && !told.contains("were taken"), "{told}");
    let told = go_on(&place);
    // Joint recovery and its first pass share one message.
    let damaged = told.lines().filter(|line| line.ends_with("is damaged: recovered again"));
    assert_eq!(damaged.count(), kept.len() - 1, "{told}");
    assert_eq!(place.names("kept"), ["notes.txt"], "what is not ours stays");
}

/// Two exchanged files, or one with other content, do not match their keys.
#[test]
fn files_that_were_exchanged_or_replaced_are_not_taken() {
    let (place, kept) = interrupted();
    let parts: Vec<(&str, &str)> = kept.iter().map(|name| name.split_once('-').unwrap()).collect();
    let path = |name: &str| place.path("kept").join(name);
    let exchanged = |key: usize, content: usize| format!("{}-{}", parts[key].0, parts[content].1);
    fs::rename(path(&kept[0]), place.path("first")).unwrap();
    fs::rename(path(&kept[1]), path(&exchanged(0, 1))).unwrap();
    fs::rename(place.path("first"), path(&exchanged(1, 0))).unwrap();
    // The name has the plain hash of the content.
    let hash = unlift_io::hash::hash_file(&path(&kept[2])).unwrap();
    fs::rename(path(&kept[2]), path(&format!("{}-{hash}{RECOVERED}", parts[2].0))).unwrap();
    assert!(!go_on(&place).contains("were taken"));
}
