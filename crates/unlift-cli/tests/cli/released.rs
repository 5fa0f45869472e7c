//! `unlift audit released`: records of another program, audited end to end.

use std::fs;
use std::process::Command;
use std::sync::Arc;

use arrow_array::types::UInt32Type;
use arrow_array::{ArrayRef, ListArray, RecordBatch, UInt32Array};
use parquet::arrow::ArrowWriter;
use unlift_io::stage::{read_truth, write_truth};

use crate::common::Place;

/// A scheme of a researcher: each point on a random line through it, records in random order, a
/// tenth of the points left out.
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

    let audit = "audit released mine.parquet --truth truth.parquet --k 10";
    let gates = "--inlier-ratios 1,0.5,0.1 --gate numpy-lines@0.1:0.25<=100 --gate all@1:0.25<=5";
    place.ends(&format!("{audit} {gates} --out a"), 1);
    let found = place.json("a/audit.json");
    let rows = found["results"].as_array().unwrap();
    // Three ratios; ranking, joint, joint-start and, because the map is small, consensus.
    assert_eq!(rows.len(), 12);
    for row in rows {
        assert_eq!((&row["scheme"], &row["unit"]), (&"numpy-lines".into(), &"m".into()));
        let counts = (row["n_points"].as_u64(), row["dropped"]["other"].as_u64());
        assert_eq!(counts, (Some(540), Some(60)));
        for baseline in ["blind_percent", "records_alone_percent"] {
            assert!(row[baseline]["0.25"].is_f64(), "{row}");
        }
    }
    assert!(rows[0]["recovered_percent"]["0.25"].as_f64() > Some(60.0), "{}", rows[0]);
    let gates = found["gates"].as_array().unwrap().iter();
    let held: Vec<bool> = gates.filter_map(|gate| gate["passed"].as_bool()).collect();
    assert_eq!(held, [true, false]);
    assert!(!found["break_even"].as_array().unwrap().is_empty());
    let page = place.text("a/report.html");
    assert!(page.contains("numpy-lines") && page.contains("<canvas"), "no page of numpy-lines");

    // With another name, and lists from the records alone.
    place.ends(&format!("{audit} --name own --neighbors geometric --out a"), 0);
    let found = place.json("a/audit.json");
    assert!(found["results"].as_array().unwrap().iter().all(|row| row["scheme"] == "own"));
    for (more, expected) in [
        ("--gate olc@1:0.25<=5", "scheme: expected one of numpy-lines, found olc"),
        ("--neighbors overlap", "expected descriptors in the released map, found none"),
        ("--name all", "(not all), found all"),
    ] {
        let told = place.complains(&format!("{audit} {more} --out c"), 2);
        assert!(told.contains(expected) && !place.path("c").exists(), "{told}");
    }
}

/// Writes lists of the `k` nearest points for the first `n` points, as another program would.
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

/// Released maps of unlift have the rows of `audit map`, also with lists by original in a file, and
/// with descriptors of the originals.
#[test]
fn the_rows_are_those_of_an_audit_of_the_map() {
    let place = Place::with_room(400);
    let points = unlift::synthetic::room(1, 400).points;
    write_lists(&place, "lists.parquet", &points, 400, 10);
    place.write_descriptors("d.bin", &points, 32);
    let released = "audit released hidden/released.parquet --truth hidden/truth.parquet";
    let made = "--inlier-ratios 0.5 --neighbors oracle --neighbors geometric";
    let (given, described) =
        ("--neighbors lists.parquet", "--descriptors d.bin --neighbors similarity");
    for (scheme, sources) in [
        ("ppl", &[made, given, described][..]),
        ("cp", &[made, given]),
        ("ray", &[made]),
        ("olc", &[given]),
    ] {
        let hide = "obfuscate room.csv --scale 1 --k 10 --seed 7 --out hidden --scheme";
        place.ends(&format!("{hide} {scheme}"), 0);
        for sources in sources {
            let options = format!("--k 10 --seed 7 {sources}");
            let audited = |line: String| {
                place.ends(&format!("{line} {options} --out a"), 0);
                place.json("a/audit.json")
            };
            let ours = audited(format!("{released} --name {scheme}"));
            let map = audited(format!("audit map room.csv --scale 1 --schemes {scheme}"));
            assert_eq!(ours["results"], map["results"], "{scheme} {sources}");
            assert_eq!(ours["break_even"], map["break_even"], "{scheme} {sources}");
            let rows = ours["results"].as_array().unwrap();
            let is_described =
                *sources != described || rows[0]["assignment_accuracy_percent"].is_f64();
            assert!(is_described, "{}", rows[0]);
            for row in rows.iter().filter(|row| row["neighbors"] == "file") {
                // All entries are true, except a partner on the same line.
                assert!(row["inlier_ratio"].as_f64() > Some(0.9), "{scheme}: {row}");
                let percent = |of: &str| row[of]["0.25"].as_f64().unwrap();
                assert!(percent("recovered_percent") > 2.0 * percent("blind_percent"), "{row}");
            }
        }
    }
    // Points without a row have no neighbors, and a note says so.
    write_lists(&place, "few.parquet", &points, 300, 10);
    let (_, stderr) =
        place.ends(&format!("{released} --k 10 --neighbors few.parquet --out few"), 0);
    assert!(stderr.contains("note: lists: 100 of 400 points have no neighbors"), "{stderr}");
    // Lists of a larger map name points that this one lacks.
    let more = unlift::synthetic::room(1, 401).points;
    write_lists(&place, "other.parquet", &more, 401, 10);
    let line = format!("{released} --k 10 --neighbors other.parquet --out other");
    let told = place.complains(&line, 3);
    assert!(told.starts_with("unlift: other.parquet: ") && told.lines().count() == 1, "{told}");
    assert!(!place.path("other").exists());
}

/// The truth of another map is an error, because almost nothing would come back, which reads as
/// "safe".
#[test]
fn a_truth_of_another_map_is_refused() {
    let place = Place::with_room(400);
    for (name, seed) in [("one", 1), ("two", 2)] {
        let line =
            format!("obfuscate room.csv --scale 1 --k 10 --scheme olc --seed {seed} --out {name}");
        place.ends(&line, 0);
    }
    let (original, secret) = read_truth::<3>(&place.path("two/truth.parquet")).unwrap();
    let secret: unlift::truth::Secret = secret.of_map(None, 1).unwrap();
    write_truth(&place.path("bare"), &original, &secret).unwrap();
    for (truth, expected) in [
        ("two/truth.parquet", "fingerprint: expected "),
        ("bare", "truth: expected points nearer to their own records than to others, found "),
    ] {
        let line = format!("audit released one/released.parquet --k 10 --out a --truth {truth}");
        let told = place.complains(&line, 3);
        let expected = format!("unlift: one/released.parquet: {expected}");
        assert!(told.starts_with(&expected) && told.lines().count() == 1, "{told}");
        assert!(!place.path("a").exists());
    }
}
