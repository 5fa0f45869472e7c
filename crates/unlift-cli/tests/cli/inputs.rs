//! Maps, descriptors and scales: what is read, and the error for what is not.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::Place;

/// Returns a path in the test data of the readers.
fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../unlift-io/tests/data").join(name)
}

const QUICK: &str = "--k 10 --schemes olc --quiet --out a";

/// Errors are one line, with a line of advice if there is any, and come before any work.
#[test]
#[rustfmt::skip] // One row per line.
fn what_cannot_be_meant_is_refused_with_a_way_out() {
    let place = Place::with_room(700);
    place.write("two.xyz", "1 2 3\n4 5 6\n");
    place.write_descriptors("d.bin", &unlift::synthetic::room(1, 700).points, 128);
    fs::create_dir(place.path("empty")).unwrap();
    let number = "expected meters per unit of the map, a number above 0, found ";
    let overlap = "expected with --neighbors oracle, found only overlap";
    for (line, code, expected, advice) in [
        ("nothing.ply", 3, "nothing.ply: expected a file or folder, found nothing", ""),
        ("two.xyz", 3, "two.xyz: points: expected at least 11 (K + 1), found 2", ""),
        ("empty", 3, "found none", "the folder of a COLMAP model or project; for photos, unlift audit images"),
        ("room.csv --neighbors room.csv", 3, "room.csv: expected an archive of NumPy arrays (.npz), found another file", ""),
        ("room.csv --scale 0", 2, number, ""),
        ("room.csv --scale inf", 2, number, ""),
        ("room.csv --scale 1e-300", 2, "units across, found 1e-300", "--scale 1 for a map in meters"),
        ("room.csv --scale 1e-3", 2, "any guess would count as recovered", "another --scale"),
        ("room.csv --scale 1e5", 2, "no attack could come near", "another --scale"),
        ("room.csv --thresholds 1e9", 2, "unlift: --thresholds: expected a map larger", ""),
        ("room.csv --scale 1 --expect-extent 20..50", 2, "a longest side of 20 to 50 m, found ", ""),
        ("room.csv --scale 1 --expect-extent 9", 2, "expected LOW..HIGH in meters", ""),
        // The gate has a threshold in meters, but the audit has no scale.
        ("room.csv --gate olc:0.10<=20", 2, "expected one of 1.0, 2.5, found 0.1", "--scale and --thresholds, which change them"),
        ("room.csv --neighbors overlap", 2, "--neighbors overlap: expected descriptors (--descriptors FILE), found none", ""),
        ("room.csv --neighbors overlap --descriptors d.bin --inlier-ratios 0.5", 2, overlap, ""),
        ("room.csv --neighbors overlap --descriptors d.bin --oracle-noise near", 2, overlap, ""),
    ] {
        let told = place.complains(&format!("audit map {line} {QUICK}"), code);
        assert!(told.contains(expected), "{line}: {told}");
        assert!(advice.is_empty() || told.contains(&format!("\n  try: {advice}")), "{line}: {told}");
        assert!(!place.path("a").exists(), "{line}");
    }
    let told = place.complains("obfuscate room.csv --schemes olc --scale 1e-300 --out a", 2);
    assert!(told.starts_with("unlift: --scale 1e-300: expected"), "{told}");
}

#[test]
fn descriptors_that_are_missing_are_told_with_where_they_are() {
    let place = Place::with_room(100);
    place.ends("obfuscate room.csv --schemes olc --k 10 --out hidden", 0);
    let expected = "expected some, as neighbors by overlap need them, found none\n  \
                    try: --neighbors geometric, or hide the map with unlift obfuscate --descriptors FILE\n";
    place.refuses("neighbors", &[("hidden/released.npz --neighbors overlap", 3, expected)]);
}

#[test]
fn descriptors_beside_the_model_are_used_unless_only_the_oracle_is_wanted() {
    let (place, project) = (Place::with_room(1), data("project"));
    let database = project.join("database.db");
    let note = format!("unlift: note: descriptors: {}, beside the model", database.display());
    for (more, is_used) in [("", true), (" --neighbors oracle", false)] {
        let line = format!("audit map {} --k 3 --schemes olc{more}", project.display());
        assert_eq!(place.ends(&line, 0).1.contains(&note), is_used, "{more}");
        let document = place.json("unlift-audit/audit.json");
        assert_eq!(document["input"]["other_sha256"]["descriptors"].is_string(), is_used, "{more}");
    }
}
