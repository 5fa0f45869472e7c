//! Maps, descriptors and scales as users have them: what is read, and what a line tells where it is not.

mod common;

use std::fs;
use std::path::Path;

use common::Place;

/// A place with a made-up room in `room.csv`.
fn room() -> Place {
    Place::with_room(700)
}

/// Descriptors of `dim` values for the points of `room.csv` as an array of `descr`: near rows of the file
/// look alike.
fn npy(path: &Path, descr: &str, dim: usize, write: impl Fn(&mut Vec<u8>, f32)) {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (700, {dim}), }}");
    let mut bytes = b"\x93NUMPY\x01\0\x76\0".to_vec();
    bytes.extend(format!("{header:117}\n").bytes());
    for row in 0..700 {
        for column in 0..dim {
            write(&mut bytes, (row as f32 / 20.0 + (column * column) as f32).sin());
        }
    }
    fs::write(path, bytes).unwrap();
}

const QUICK: &str = "--k 10 --schemes olc --quiet --out a";

#[test]
fn scales_without_meaning_are_refused_with_a_way_out() {
    let place = room();
    for (typed, line) in [
        ("-1", "expected meters per unit of the map, a number above 0, found -1"),
        ("-0.5", "expected meters per unit of the map, a number above 0, found -0.5"),
        ("0", "expected meters per unit of the map, a number above 0, found 0"),
        ("inf", "expected meters per unit of the map, a number above 0, found inf"),
        ("nan", "expected meters per unit of the map, a number above 0, found nan"),
        ("1e999", "expected meters per unit of the map, a number above 0, found 1e999"),
        ("1e-300", "units across, found 1e-300"),
        ("1e300", "units across, found 1e300"),
        ("1e-3", "any guess would count as recovered"),
        ("1e5", "no attack could come near"),
    ] {
        let (_, stderr) = place.ends(&format!("audit map room.csv --scale {typed} {QUICK}"), 2);
        assert!(stderr.contains(line), "{typed}: {stderr}");
        let is_value = line.starts_with("expected meters");
        assert!(is_value || stderr.contains("\n  try: "), "{typed}: {stderr}");
        assert!(!place.path("a").exists(), "{typed}");
    }
    let (_, stderr) = place.ends(&format!("audit map room.csv --thresholds 1e9 {QUICK}"), 2);
    assert!(stderr.starts_with("unlift: --thresholds: expected a map larger"), "{stderr}");
    // Meters in a gate, none in the audit.
    let (_, stderr) = place.ends(&format!("audit map room.csv --gate olc:0.10<=20 {QUICK}"), 2);
    let way_out =
        "expected one of 1.0, 2.5, found 0.1\n  try: --scale and --thresholds, which change them\n";
    assert!(stderr.ends_with(way_out), "{stderr}");
    let (_, stderr) = place.ends("obfuscate room.csv --scheme olc --scale 1e-300 --out a", 2);
    assert!(stderr.starts_with("unlift: --scale 1e-300: expected"), "{stderr}");
    // What can be meant is told and done.
    let quick = format!("{QUICK} --inlier-ratios 1");
    let (_, stderr) = place.ends(&format!("audit map room.csv --scale 100 {quick}"), 0);
    assert!(stderr.starts_with("unlift: note: lengths are doubtful: points are"), "{stderr}");
    assert_eq!(place.ends(&format!("audit map room.csv --scale 1 {quick}"), 0).1, "");
}

#[test]
fn similarity_takes_descriptors_of_any_kind_and_overlap_those_of_sift() {
    let place = room();
    npy(&place.path("learned.npy"), "<f2", 64, |bytes, value| {
        // A half: sign, five bits of exponent, ten of mantissa; rounding does not matter here.
        let bits = value.to_bits();
        let exponent = ((bits >> 23) & 0xff) as i32 - 112;
        let half = match exponent {
            1.. => (bits >> 16 & 0x8000) | (exponent as u32) << 10 | (bits >> 13 & 0x3ff),
            _ => 0,
        };
        bytes.extend((half as u16).to_le_bytes());
    });
    npy(&place.path("sift.npy"), "<f4", 128, |bytes, value| {
        bytes.extend(value.abs().to_le_bytes());
    });
    let audit = |file: &str, source: &str, code| {
        let line = format!("audit map room.csv --descriptors {file} --neighbors {source} {QUICK}");
        place.ends(&line, code)
    };
    audit("learned.npy", "similarity", 0);
    audit("sift.npy", "overlap", 0);
    let first_look = "audit map room.csv --descriptors learned.npy --k 10 --quick --out quick";
    let (table, _) = place.ends(first_look, 0);
    for source in ["oracle", "similarity"] {
        for scheme in ["olc", "ppl"] {
            let is = |line: &&str| line.starts_with(scheme) && line.contains(source);
            assert!(table.lines().any(|line| is(&line)), "{scheme} {source}: {table}");
        }
    }
    let wrong = "SIFT descriptors (128 values each, none negative), found 64 values each\n";
    let way_out = "  try: --neighbors similarity, which takes descriptors of any kind\n";
    let (_, stderr) = audit("learned.npy", "overlap", 2);
    assert_eq!(stderr, format!("unlift: --neighbors overlap: expected {wrong}{way_out}"));
    let hide = "obfuscate room.csv --scheme olc --k 10 --descriptors";
    let (_, stderr) = place.ends(&format!("{hide} learned.npy --out hidden"), 0);
    assert_eq!(stderr, "");
    // Zeros mark points without a descriptor: lists of them are worse, which is no protection.
    let mut bytes = fs::read(place.path("learned.npy")).unwrap();
    let n = bytes.len();
    bytes[n - 2 * 2 * 64..].fill(0);
    fs::write(place.path("partial.npy"), bytes).unwrap();
    let (_, stderr) = place.ends(&format!("{hide} partial.npy --out hidden2"), 0);
    assert_eq!(
        stderr,
        "unlift: note: 2 of 700 descriptors are all zero, and tell an attacker nothing\n"
    );
    let find = "neighbors find hidden/released.parquet --out lists.parquet --source";
    place.ends(&format!("{find} similarity"), 0);
    let (_, stderr) = place.ends(&format!("{find} overlap"), 3);
    assert_eq!(
        stderr,
        format!(
            "unlift: hidden/released.parquet: descriptors for overlap: expected {wrong}  \
             try: --source similarity, which takes descriptors of any kind\n"
        )
    );
}

#[test]
fn descriptors_that_are_missing_are_told_with_where_they_are() {
    let place = room();
    place.ends("obfuscate room.csv --scheme olc --k 10 --out hidden", 0);
    let (_, stderr) = place.ends("neighbors find hidden/released.parquet --source overlap", 3);
    assert_eq!(
        stderr,
        "unlift: hidden/released.parquet: descriptors for overlap: expected some in the released map, \
         found none\n  try: --source geometric, or hide the map with unlift obfuscate --descriptors FILE\n"
    );
    // Six points suffice: what is missing is told before any attack.
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../unlift-io/tests/data/project");
    let line = format!("audit map {} --k 3 --neighbors overlap", project.display());
    let (_, stderr) = place.ends(&line, 2);
    let database = project.join("database.db");
    assert_eq!(
        stderr,
        format!(
            "unlift: --neighbors overlap: expected descriptors (--descriptors FILE), found none\n  \
             try: --descriptors {}\n",
            database.display()
        )
    );
}

#[test]
fn which_of_several_models_was_read_is_told() {
    let place = room();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../unlift-io/tests/data");
    for (fixture, folder) in [("project/sparse/0", "p/sparse/0"), ("rig-bin", "p/models/1")] {
        fs::create_dir_all(place.path(folder)).unwrap();
        for file in fs::read_dir(data.join(fixture)).unwrap() {
            let file = file.unwrap();
            fs::copy(file.path(), place.path(folder).join(file.file_name())).unwrap();
        }
    }
    fs::create_dir(place.path("empty")).unwrap();
    let (_, stderr) = place.ends("audit map empty", 3);
    assert!(stderr.ends_with("found none\n  try: the folder of a COLMAP model or project; for photos, unlift audit images\n"));
    let (_, stderr) = place.ends("audit images p/sparse/0", 3);
    assert!(
        stderr.ends_with("found none\n  try: unlift audit map, as this is a map\n"),
        "{stderr}"
    );
    let told = "unlift: note: models/1: read, the largest of 2 models (8 points)\n\
                unlift: note: sparse/0: another model (6 points), give its path to read it\n";
    let (_, stderr) = place.ends("obfuscate p --scheme olc --k 3 --out hidden", 0);
    assert_eq!(stderr, told);
    let line = "audit map p --schemes olc --k 3 --inlier-ratios 1 --out a";
    assert_eq!(place.ends(line, 0).1, told);
}
