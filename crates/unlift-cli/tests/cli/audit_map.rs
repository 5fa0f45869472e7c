//! `unlift audit map`: what is read, the error for what is not, and what is written.

use std::fs;

use serde_json::Value;

use crate::common::{Place, rows};

/// Errors come before any work, with a line of advice if there is any.
#[test]
#[rustfmt::skip] // One row per line.
fn what_cannot_be_meant_is_refused_with_a_way_out() {
    let place = Place::with_described_room(700, 128);
    place.write("two.xyz", "1 2 3\n4 5 6\n");
    fs::create_dir(place.path("empty")).unwrap();
    let number = "expected meters per unit of the map, a number above 0, found ";
    let overlap = "expected with --neighbors oracle, found only overlap";
    place.refuses("audit map --k 10 --schemes olc --quiet --out a", &[
        ("nothing.ply", 3, "nothing.ply: expected a file or folder, found nothing"),
        ("two.xyz", 3, "two.xyz: points: expected at least 11 (K + 1), found 2"),
        ("empty", 3, "\n  try: the folder of a COLMAP model or project; for photos, unlift audit images"),
        ("room.csv --neighbors room.csv", 3, "room.csv: expected an archive of NumPy arrays (.npz), found another file"),
        ("room.csv --scale 0", 2, number),
        ("room.csv --scale inf", 2, number),
        // Negative numbers are values, not options.
        ("room.csv --scale -1", 2, number),
        ("room.csv --thresholds -1", 2, "expected a number above 0, found -1"),
        ("room.csv --inlier-ratios -1", 2, "expected a number from 0 to 1, found -1"),
        ("room.csv --inlier-ratios nan", 2, "expected a number from 0 to 1, found nan"),
        ("room.csv --max-points 4294967296", 2, "expected a whole number from 1 to 4294967295, found 4294967296"),
        ("room.csv --schemes pppl", 2, "expected one of olc, ppl, ppl+, ray, ray-voxel, plane, cp, sphere, found pppl"),
        ("room.csv --schemes cp2d", 2, "plane, cp, sphere, found cp2d (for images only)"),
        ("room.csv --solver magic", 2, "expected one of joint, consensus, ransac, density, tomography, found magic"),
        ("room.csv --oracle-noise white", 2, "expected one of uniform, near, clustered, found white"),
        ("room.csv --scale 1e-300", 2, "units across, found 1e-300\n  try: --scale 1 for a map in meters"),
        ("room.csv --scale 1e-3", 2, "any guess would count as recovered\n  try: another --scale"),
        ("room.csv --scale 1e5", 2, "no attack could come near\n  try: another --scale"),
        ("room.csv --thresholds 1e9", 2, "unlift: --thresholds: expected a map larger"),
        ("room.csv --scale 1 --expect-extent 20..50", 2, "a longest side of 20 to 50 m, found "),
        ("room.csv --scale 1 --expect-extent 9", 2, "expected LOW..HIGH in meters"),
        // The gate has a threshold in meters, but the audit has no scale.
        ("room.csv --gate olc:0.10<=20", 2, "expected one of 1.0, 2.5, found 0.1\n  try: --thresholds, which changes them"),
        ("room.csv --neighbors overlap", 2, "--neighbors overlap: expected descriptors (--descriptors FILE), found none"),
        ("room.csv --neighbors overlap --descriptors d.bin --inlier-ratios 0.5", 2, overlap),
        ("room.csv --neighbors overlap --descriptors d.bin --oracle-noise near", 2, overlap),
    ]);
    assert!(!place.path("a").exists());
    let told = place.complains("obfuscate room.csv --schemes olc --scale 1e-300 --out a", 2);
    assert!(told.starts_with("unlift: --scale 1e-300: expected"), "{told}");
    place.ends("obfuscate room.csv --schemes olc --k 10 --out hidden", 0);
    let expected = "expected some, as neighbors by overlap need them, found none\n  \
                    try: --neighbors geometric, or hide the map with unlift obfuscate --descriptors FILE\n";
    let sources = "expected one of similarity, overlap, geometric, learned, descriptors, found magic";
    place.refuses("neighbors hidden/released.npz --neighbors", &[("overlap", 3, expected), ("magic", 2, sources)]);
}

#[test]
fn descriptors_beside_the_model_are_used_unless_only_the_oracle_is_wanted() {
    let place = Place::empty();
    let project = concat!(env!("CARGO_MANIFEST_DIR"), "/../unlift-io/tests/data/project");
    for (more, is_used) in [("", true), ("--neighbors oracle", false)] {
        let line = format!("audit map {project} --k 3 --schemes olc {more} --out a");
        let (_, told) = place.ends(&line, 0);
        assert_eq!(told.contains("database.db, beside the model"), is_used, "{told}");
        let hashes = &place.json("a/audit.json")["input"]["other_sha256"];
        assert_eq!(hashes["descriptors"].is_string(), is_used, "{more}");
    }
}

/// A share-safe report contains neither the name nor a hash of the map, which would confirm a guess.
#[test]
fn a_shareable_report_names_nothing() {
    let place = Place::with_room(200);
    let hash = unlift_io::hash::hash_files(&[place.path("room.csv")]).unwrap();
    for (more, is_named) in [("", true), ("--share-safe", false)] {
        place.ends(&format!("audit map room.csv --quick --k 10 --scale 1 {more} --out a"), 0);
        for file in ["a/audit.json", "a/report.html"] {
            let text = place.text(file);
            for trace in ["room.csv", &hash, "sha256"] {
                assert_eq!(text.contains(trace), is_named, "{more} {file}: {trace}");
            }
        }
    }
}

/// `--quick` audits two schemes at one ratio, and one source if there are descriptors.
#[test]
fn a_first_look_is_two_schemes_and_the_attack_on_what_is_released() {
    let place = Place::with_described_room(700, 64);
    let attacks = |more: &str| {
        place.ends(&format!("audit map room.csv --scale 1 --k 10 --quick {more} --out a"), 0);
        let document = place.json("a/audit.json");
        let is_half = |row: &Value| row["neighbors"] != "oracle" || row["inlier_ratio"] == 0.5;
        assert!(rows(&document).iter().all(is_half), "{document}");
        let attack = |row: &Value| format!("{} {}", row["scheme"], row["neighbors"]);
        let mut found: Vec<String> = rows(&document).iter().map(attack).collect();
        found.dedup();
        found.join(", ").replace('"', "")
    };
    assert_eq!(attacks(""), "olc oracle, ppl oracle");
    let with = "olc oracle, olc similarity, ppl oracle, ppl similarity";
    assert_eq!(attacks("--descriptors d.bin"), with);
    place.refuses(
        "audit map room.csv --quick",
        &[("--schemes ppl", 2, "cannot be used with"), ("--k -1", 2, "-1 is not in 1..=65535")],
    );
}

/// The verdict of a scheme that publishes bearings leads with what they show.
#[test]
fn bearings_are_audited_and_painted() {
    let place = Place::with_described_room(700, 128);
    let map = "room.csv --scale 1 --descriptors d.bin";
    let audit = format!("audit map {map} --neighbors similarity");
    let (stdout, _) = place.ends(&format!("{audit} --schemes sphere --out s"), 0);
    assert!(stdout.contains("bearing"), "{stdout}");
    place.ends(&format!("obfuscate {map} --schemes sphere --out sphere"), 0);
    let (stdout, _) = place.ends("invert sphere/released.npz --out views", 0);
    assert_eq!(stdout, "6 pictures, in views\n");
    place.refuses(&audit, &[("--protect-descriptors subspace:0", 2, "--protect-descriptors")]);
}
