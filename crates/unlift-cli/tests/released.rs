//! `unlift audit released`: records of somebody else, audited end to end.

mod common;

use std::fs;
use std::process::Command;
use std::sync::Arc;

use arrow_array::types::UInt32Type;
use arrow_array::{ArrayRef, ListArray, RecordBatch, UInt32Array};
use common::Place;
use parquet::arrow::ArrowWriter;
use serde_json::Value;
use unlift_io::stage::{read_truth, write_truth};

/// A scheme as a researcher writes it: every point on a line of random direction through it, records in random
/// order, a tenth of the points left out.
const SCHEME: &str = r#"
import json, numpy as np, pyarrow as pa, pyarrow.parquet as pq
points = np.loadtxt("room.csv", delimiter=",")
rng = np.random.default_rng(3)
order = rng.permutation(len(points))
hidden, left_out = order[len(points) // 10:], order[:len(points) // 10]
direction = rng.normal(size=(len(hidden), 3))
along = rng.normal(size=(len(hidden), 1))
foot = points[hidden] + along * direction  # any point of the line will do
columns = {f"foot_{a}": foot[:, i] for i, a in enumerate("xyz")}
columns |= {f"direction_{a}": direction[:, i] for i, a in enumerate("xyz")}
meta = {"unit": "m", "scheme": "numpy-lines"}
pq.write_table(pa.table(columns).replace_schema_metadata({"unlift": json.dumps(meta)}), "mine.parquet")
rows = np.concatenate([hidden, left_out])
truth = {"original": rows, "slot": [*range(len(hidden)), *[None] * len(left_out)]}
truth |= {a: points[rows, i] for i, a in enumerate("xyz")}
truth |= {"dropped": [None] * len(hidden) + ["other"] * len(left_out)}
meta = {"unit": "m"}
pq.write_table(pa.table(truth).replace_schema_metadata({"unlift": json.dumps(meta)}), "truth.parquet",
               compression="zstd")
"#;

fn json(place: &Place, line: &str, code: i32) -> Value {
    serde_json::from_str(&place.ends(line, code).0).expect("JSON")
}

#[test]
fn a_scheme_written_in_python_gets_rows_page_and_gates() {
    let place = Place::with_room(600);
    let run = |script: &str| {
        let mut python = Command::new("python3");
        python.args(["-c", script]).current_dir(place.path("")).output()
    };
    if !run("import numpy, pyarrow.parquet").is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: python3 with numpy and pyarrow is not installed");
        return;
    }
    let output = run(SCHEME).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let audit =
        "audit released mine.parquet --truth truth.parquet --k 10 --inlier-ratios 1,0.5,0.1";
    let gates = "--gate numpy-lines@0.1:0.25<=100 --gate all@1:0.25<=5";
    let found = json(&place, &format!("{audit} {gates} --out a --json"), 1);
    let rows = found["results"].as_array().unwrap();
    // Three ratios; joint, joint-start and consensus, as the map is small.
    assert_eq!(rows.len(), 9);
    for row in rows {
        assert_eq!((&row["scheme"], &row["unit"]), (&"numpy-lines".into(), &"m".into()));
        assert_eq!(
            (row["n_points"].as_u64(), row["dropped"]["other"].as_u64()),
            (Some(540), Some(60))
        );
        assert!(
            row["blind_percent"]["0.25"].is_f64() && row["records_alone_percent"]["0.25"].is_f64()
        );
    }
    assert!(rows[0]["recovered_percent"]["0.25"].as_f64() > Some(60.0), "{}", rows[0]);
    let held: Vec<bool> = found["gates"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|gate| gate["passed"].as_bool())
        .collect();
    assert_eq!(held, [true, false]);
    assert!(!found["break_even"].as_array().unwrap().is_empty());
    let page = fs::read_to_string(place.path("a/report.html")).unwrap();
    assert!(page.contains("numpy-lines") && page.contains("<canvas"), "no page of numpy-lines");

    // By another name, from the records alone.
    let named = format!("{audit} --name own --neighbors geometric --out b --json")
        .replace(" --inlier-ratios 1,0.5,0.1", "");
    let found = json(&place, &named, 0);
    assert!(found["results"].as_array().unwrap().iter().all(|row| row["scheme"] == "own"));
    let (_, stderr) = place.ends(&format!("{audit} --gate olc@1:0.25<=5 --out c"), 2);
    assert!(stderr.contains("scheme: expected one of numpy-lines, found olc"), "{stderr}");
    let (_, stderr) = place.ends(&format!("{audit} --neighbors overlap --out c"), 2);
    assert!(stderr.contains("expected descriptors in the released map, found none"), "{stderr}");
    let (_, stderr) = place.ends(&format!("{audit} --name all --out c"), 2);
    assert!(stderr.contains("(not all), found all"), "{stderr}");
    assert!(!place.path("c").exists());
}

/// What unlift hid itself has the rows of `audit map`, figure by figure.
#[test]
fn the_rows_are_those_of_an_audit_of_the_map() {
    let place = Place::with_room(400);
    for scheme in ["ppl", "cp", "ray"] {
        let of_map = "room.csv --scale 1 --k 10 --seed 7";
        place.ends(&format!("obfuscate {of_map} --scheme {scheme} --out hidden"), 0);
        let options =
            "--k 10 --seed 7 --inlier-ratios 0.5 --neighbors oracle --neighbors geometric --json";
        let released = "audit released hidden/released.parquet --truth hidden/truth.parquet";
        let ours = json(&place, &format!("{released} --name {scheme} {options}"), 0);
        let map =
            json(&place, &format!("audit map room.csv --scale 1 --schemes {scheme} {options}"), 0);
        assert_eq!(ours["results"], map["results"], "{scheme}");
        assert_eq!(ours["break_even"], map["break_even"], "{scheme}");
    }
}

/// The `k` nearest points of every point, for the `n` first ones, as a file that any program could write.
fn write_lists(place: &Place, name: &str, points: &[[f64; 3]], n: usize, k: usize) {
    let near = |at: usize| {
        let off = |other: &u32| {
            let point = points[*other as usize];
            (0..3).map(|c| (point[c] - points[at][c]).powi(2)).sum::<f64>()
        };
        let mut others: Vec<u32> = (0..points.len() as u32).filter(|&p| p as usize != at).collect();
        others.sort_by(|a, b| off(a).total_cmp(&off(b)));
        Some(others.into_iter().take(k).map(Some).collect::<Vec<_>>())
    };
    let neighbors = ListArray::from_iter_primitive::<UInt32Type, _, _>((0..n).map(near));
    let point = UInt32Array::from_iter_values(0..n as u32);
    let columns: [(&str, ArrayRef); 2] =
        [("point", Arc::new(point)), ("neighbors", Arc::new(neighbors))];
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let file = fs::File::create(place.path(name)).unwrap();
    let mut writer = ArrowWriter::try_new(file, batch.schema(), None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
}

/// Lists by original are read as `audit map` reads them.
#[test]
fn lists_of_a_file_are_those_of_an_audit_of_the_map() {
    let place = Place::with_room(400);
    let points = unlift::synthetic::room(1, 400).points;
    write_lists(&place, "lists.parquet", &points, 400, 10);
    for scheme in ["olc", "ppl", "cp"] {
        let hide = "obfuscate room.csv --scale 1 --k 10 --seed 7 --scheme";
        place.ends(&format!("{hide} {scheme} --out hidden"), 0);
        let options = "--k 10 --seed 7 --neighbors lists.parquet --json";
        let released = "audit released hidden/released.parquet --truth hidden/truth.parquet";
        let ours = json(&place, &format!("{released} --name {scheme} {options}"), 0);
        let map =
            json(&place, &format!("audit map room.csv --scale 1 --schemes {scheme} {options}"), 0);
        assert_eq!(ours["results"], map["results"], "{scheme}");
        let rows = ours["results"].as_array().unwrap();
        assert_eq!(rows.len(), 3, "joint, joint-start and consensus");
        for row in rows {
            assert_eq!(row["neighbors"], "file");
            // All of them right, but for a partner on the same line.
            assert!(row["inlier_ratio"].as_f64() > Some(0.9), "{scheme}: {}", row["inlier_ratio"]);
            let percent = |of: &str| row[of]["0.25"].as_f64().unwrap();
            assert!(percent("recovered_percent") > 2.0 * percent("blind_percent"), "{row}");
        }
    }
    // Points without a row have no neighbors, and that is told.
    write_lists(&place, "few.parquet", &points, 300, 10);
    let released = "audit released hidden/released.parquet --truth hidden/truth.parquet --k 10";
    let (_, stderr) = place.ends(&format!("{released} --neighbors few.parquet --out few"), 0);
    assert!(stderr.contains("note: lists: 100 of 400 points have no neighbors"), "{stderr}");
    // Lists of another map name points that this one lacks.
    let more = unlift::synthetic::room(1, 401).points;
    write_lists(&place, "other.parquet", &more, 401, 10);
    let (_, stderr) = place.ends(&format!("{released} --neighbors other.parquet --out other"), 3);
    assert!(
        stderr.starts_with("unlift: other.parquet: ") && stderr.lines().count() == 1,
        "{stderr}"
    );
    assert!(!place.path("other").exists());
}

/// Descriptors of the originals go to the records that hide them, also where a record hides two.
#[test]
fn descriptors_of_originals_are_those_of_the_map() {
    let place = Place::with_room(400);
    let mut bytes = b"P3DESC01".to_vec();
    bytes.extend(400u64.to_le_bytes());
    bytes.extend([32u32.to_le_bytes(), 1u32.to_le_bytes()].concat());
    (0..400u64).for_each(|id| bytes.extend(id.to_le_bytes()));
    for point in unlift::synthetic::room(1, 400).points {
        let phase = |c: u32| point[0] + point[1] * f64::from(c % 3) + point[2] * f64::from(c % 5);
        bytes.extend((0..32).map(|c| (60.0 + 55.0 * (phase(c) + f64::from(c * c)).sin()) as u8));
    }
    fs::write(place.path("d.bin"), bytes).unwrap();
    place.ends("obfuscate room.csv --scale 1 --k 10 --seed 7 --scheme ppl --out hidden", 0);
    let options = "--k 10 --seed 7 --descriptors d.bin --neighbors similarity --json";
    let released = "audit released hidden/released.parquet --truth hidden/truth.parquet --name ppl";
    let ours = json(&place, &format!("{released} {options}"), 0);
    let map = json(&place, &format!("audit map room.csv --scale 1 --schemes ppl {options}"), 0);
    assert_eq!(ours["results"], map["results"]);
    assert!(ours["results"][0]["assignment_accuracy_percent"].is_f64());
}

/// With the truth of another map next to nothing comes back, which would read as "safe".
#[test]
fn a_truth_of_another_map_is_refused() {
    let place = Place::with_room(400);
    for (name, seed) in [("one", 1), ("two", 2)] {
        let line =
            format!("obfuscate room.csv --scale 1 --k 10 --scheme olc --seed {seed} --out {name}");
        place.ends(&line, 0);
    }
    let audit = "audit released one/released.parquet --k 10 --out a --truth";
    let (_, stderr) = place.ends(&format!("{audit} two/truth.parquet"), 3);
    let start = "unlift: one/released.parquet: fingerprint: expected ";
    assert!(stderr.starts_with(start) && stderr.lines().count() == 1, "{stderr}");
    let (original, secret) = read_truth::<3>(&place.path("two/truth.parquet")).unwrap();
    let secret = secret.of_map(None, 1).unwrap();
    write_truth(&place.path("bare"), &original, &secret).unwrap();
    let (_, stderr) = place.ends(&format!("{audit} bare"), 3);
    let start = "unlift: one/released.parquet: truth: expected points nearer to their own records than to others, found ";
    assert!(stderr.starts_with(start) && stderr.lines().count() == 1, "{stderr}");
    assert!(!place.path("a").exists());
}
