//! The program as a user runs it: exit codes, one-line errors, whole outputs, the same bytes.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A folder of its own per test, with a small map in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let rows = unlift::synthetic::room(1, 700).points;
        let text: String = rows.iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
        std::fs::write(folder.path().join("room.csv"), text).expect("a writable folder");
        Self(folder)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn run(&self, line: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_unlift"))
            .args(line.split_whitespace())
            .current_dir(self.path())
            .output()
            .expect("the program starts")
    }

    /// Standard output of a run that must end with `code`.
    fn stdout(&self, line: &str, code: i32) -> String {
        let output = self.run(line);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{line}\n{stderr}");
        String::from_utf8(output.stdout).expect("UTF-8")
    }

    /// The last line on standard error of a run that must end with `code` and print nothing else.
    fn complaint(&self, line: &str, code: i32) -> String {
        let output = self.run(line);
        let stderr = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(code), "{line}\n{stderr}");
        assert!(output.stdout.is_empty(), "{line}");
        stderr.lines().next().unwrap_or_default().to_owned()
    }

    fn json(&self, file: &str) -> Value {
        let text = std::fs::read_to_string(self.path().join(file)).expect("a written file");
        serde_json::from_str(&text).expect("JSON")
    }
}

const QUICK: &str = "--k 10 --schemes olc,ppl --inlier-ratios 1,0.5";

#[test]
fn an_audit_writes_its_folder_whole_and_again() {
    let place = Place::new();
    for _ in 0..2 {
        let text = place.stdout(&format!("audit map room.csv --scale 1 {QUICK} --out a"), 0);
        assert!(text.trim_end().ends_with("report: a/report.html"), "{text}");
    }
    let document = place.json("a/audit.json");
    assert_eq!(document["schema"], 1);
    assert_eq!(document["results"].as_array().map(Vec::len), Some(12));
    assert_eq!(document["results"][0]["unit"], "m");
    let left: Vec<PathBuf> =
        std::fs::read_dir(place.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(left.len(), 2, "no temporary files: {left:?}");
}

#[test]
fn results_are_the_same_bytes_for_any_number_of_threads() {
    let place = Place::new();
    let results = |threads: usize| {
        let options = format!("{QUICK} --solver consensus,ransac --threads {threads}");
        place.stdout(&format!("audit map room.csv {options} --out t{threads}"), 0);
        let document = place.json(&format!("t{threads}/audit.json"));
        (document["results"].to_string(), document["break_even"].to_string())
    };
    let one = results(1);
    assert_eq!(one, results(2));
    assert_eq!(one, results(8));
}

#[test]
fn without_a_scale_no_centimeter_appears() {
    let place = Place::new();
    let text = place.stdout(&format!("audit map room.csv {QUICK} --out a"), 0);
    assert!(!text.contains(" m ") && !text.contains("cm"), "{text}");
    assert_eq!(place.json("a/audit.json")["results"][0]["unit"], "kth_neighbor");
}

#[test]
fn gates_decide_the_exit_code() {
    let place = Place::new();
    let audit = format!("audit map room.csv --scale 1 {QUICK} --out a --gate");
    place.stdout(&format!("{audit} all:0.25<=100"), 0);
    let text = place.stdout(&format!("{audit} olc@1:0.25<=1"), 1);
    assert!(text.contains("gate olc@1:0.25<=1: FAILED"), "{text}");
    assert_eq!(place.json("a/audit.json")["gates"][0]["passed"], false);
    assert_eq!(
        place.complaint(&format!("{audit} olc@0.4:0.25<=1"), 2),
        "unlift: --gate olc@0.4:0.25<=1: inlier ratio: expected one of 1, 0.5, found 0.4"
    );
}

#[test]
fn a_shareable_report_names_nothing() {
    let place = Place::new();
    place.stdout(&format!("audit map room.csv --scale 1 {QUICK} --share-safe --out a"), 0);
    for file in ["a/audit.json", "a/report.html"] {
        let text = std::fs::read_to_string(place.path().join(file)).unwrap();
        assert!(!text.contains("room.csv"), "{file}");
    }
    assert_eq!(place.json("a/audit.json")["input"]["path"], Value::Null);
}

#[test]
fn the_stages_give_what_the_audit_gives() {
    let place = Place::new();
    place.stdout("obfuscate room.csv --scheme ppl --scale 1 --k 10 --seed 0 --out hidden", 0);
    place.stdout(
        "neighbors oracle hidden/truth.parquet --k 10 --inlier-ratio 0.5 --out lists.parquet",
        0,
    );
    // The truth is out of reach while recovery runs.
    std::fs::rename(place.path().join("hidden/truth.parquet"), place.path().join("away")).unwrap();
    place.stdout("recover hidden/released.parquet --neighbors lists.parquet --out back.parquet", 0);
    let text = place.stdout("evaluate back.parquet --truth away --json", 0);
    let staged: Value = serde_json::from_str(&text).unwrap();
    let audit = "audit map room.csv --scale 1 --k 10 --schemes ppl --inlier-ratios 0.5 --json";
    let chained: Value = serde_json::from_str(&place.stdout(audit, 0)).unwrap();
    let share = |value: &Value| value["recovered_percent"]["0.25"].as_f64().unwrap();
    assert!((share(&staged) - share(&chained["results"][0])).abs() < 1e-3);
}

#[test]
fn neighbors_must_be_a_parquet_file() {
    let place = Place::new();
    let refused = place.complaint("audit map room.csv --neighbors room.csv --k 10", 3);
    assert!(refused.starts_with("unlift: room.csv: expected a Parquet file"), "{refused}");
}

/// 700 made-up descriptors for `room.csv`: points in a row of the file look alike.
fn write_descriptors(place: &Place) {
    let mut bytes = b"P3DESC01".to_vec();
    bytes.extend(700u64.to_le_bytes());
    bytes.extend(128u32.to_le_bytes());
    bytes.extend(1u32.to_le_bytes());
    (0..700u64).for_each(|id| bytes.extend(id.to_le_bytes()));
    for row in 0..700u32 {
        let wave = |c: u32| 40.0 + 39.0 * (f64::from(row) / 20.0 + f64::from(c * c)).sin();
        bytes.extend((0..128).map(|c| wave(c) as u8));
    }
    std::fs::write(place.path().join("d.bin"), bytes).expect("a writable folder");
}

#[test]
fn sources_without_an_oracle_have_rows_of_their_own() {
    let place = Place::new();
    write_descriptors(&place);
    let line = "audit map room.csv --k 10 --schemes olc,ppl --inlier-ratios 0.5 --descriptors d.bin \
                --neighbors oracle --neighbors overlap --neighbors geometric --out a";
    place.stdout(line, 0);
    let document = place.json("a/audit.json");
    let rows: Vec<(String, Value, u64)> = document["results"]
        .as_array()
        .expect("rows")
        .iter()
        .map(|row| {
            let neighbors = row["neighbors"].as_str().expect("a name").to_owned();
            (neighbors, row["oracle_noise"].clone(), row["k"].as_u64().expect("K"))
        })
        .collect();
    let both = |cells: Vec<(String, Value, u64)>| -> Vec<(String, Value, u64)> {
        cells.into_iter().flat_map(|cell| [cell.clone(), cell.clone(), cell]).collect()
    };
    let expected = [
        ("oracle".to_owned(), Value::from("uniform"), 10),
        ("overlap".to_owned(), Value::Null, 35),
        ("geometric".to_owned(), Value::Null, 50),
    ];
    // By joint, by joint-start, and by consensus, as the map is small.
    assert_eq!(rows, both([expected.clone(), expected].concat()));
    // 35 listed against the 10 nearest, and against the 35 nearest: more of those are listed.
    let ratio = |at: usize| document["results"][at]["inlier_ratio"].as_f64().expect("a ratio");
    let at_k = |at: usize| document["results"][at]["metrics"]["inlier_ratio_at_k"].as_f64();
    assert_eq!(at_k(0), None);
    assert!(at_k(3) > Some(ratio(3)), "{:?}, {}", at_k(3), ratio(3));
    assert!(document["run"]["seconds"]["rows"][3]["neighbors"].as_f64() > Some(0.0));
}

#[test]
fn a_released_map_alone_gives_the_lists_that_the_audit_uses() {
    let place = Place::new();
    write_descriptors(&place);
    let map = "room.csv --scale 1 --k 10 --descriptors d.bin --seed 0";
    place.stdout(&format!("obfuscate {map} --scheme olc --out hidden"), 0);
    let find = "neighbors find hidden/released.parquet --source overlap --k 8 --out lists.parquet";
    assert_eq!(
        place.stdout(find, 0),
        "700 neighborhoods of up to 8 by overlap, in lists.parquet\n"
    );
    place.stdout("recover hidden/released.parquet --neighbors lists.parquet --out b.parquet", 0);
    let text = place.stdout("evaluate b.parquet --truth hidden/truth.parquet --json", 0);
    let staged: Value = serde_json::from_str(&text).unwrap();
    let audit =
        format!("audit map {map} --schemes olc --neighbors overlap --source-k 8 --out a --json");
    let chained: Value = serde_json::from_str(&place.stdout(&audit, 0)).unwrap();
    let share = |value: &Value| value["recovered_percent"]["0.25"].as_f64().unwrap();
    assert!((share(&staged) - share(&chained["results"][0])).abs() < 1e-3);
}

#[test]
fn options_that_are_about_no_source_are_told() {
    let place = Place::new();
    write_descriptors(&place);
    let complaint = |options: &str| place.complaint(&format!("audit map room.csv {options}"), 2);
    assert_eq!(
        complaint("--neighbors overlap"),
        "unlift: --neighbors overlap: expected descriptors (--descriptors FILE), found none"
    );
    assert_eq!(
        complaint("--neighbors overlap --descriptors d.bin --inlier-ratios 0.5"),
        "unlift: --inlier-ratios: expected with --neighbors oracle, found only overlap"
    );
    assert_eq!(
        complaint("--neighbors overlap --descriptors d.bin --oracle-noise near"),
        "unlift: --oracle-noise: expected with --neighbors oracle, found only overlap"
    );
    assert_eq!(
        complaint("--source-k 7"),
        "unlift: --source-k: expected with a source that makes its own lists, found only oracle"
    );
}

#[test]
fn clouds_are_written_on_request() {
    let place = Place::new();
    place.stdout(&format!("audit map room.csv {QUICK} --write-clouds --out a"), 0);
    for file in ["original.ply", "olc-obfuscated.obj", "ppl-recovered-0.5-joint.ply"] {
        assert!(place.path().join("a/clouds").join(file).is_file(), "{file}");
    }
}

#[test]
fn bad_input_is_one_line_and_loses_nothing() {
    let place = Place::new();
    std::fs::write(place.path().join("two.xyz"), "1 2 3\n4 5 6\n").unwrap();
    std::fs::create_dir(place.path().join("mine")).unwrap();
    std::fs::write(place.path().join("mine/file"), "precious").unwrap();
    assert_eq!(
        place.complaint("audit map nothing.ply", 3),
        "unlift: nothing.ply: expected a file or folder, found nothing"
    );
    assert_eq!(
        place.complaint("audit map two.xyz", 3),
        "unlift: two.xyz: points: expected at least 51 (K + 1), found 2"
    );
    assert_eq!(
        place.complaint("audit map room.csv --k 10 --out mine/file", 2),
        "unlift: --out: mine/file: expected a folder, or nothing, found a file"
    );
    assert!(place.path().join("mine/file").is_file());
    assert!(!place.path().join("unlift-audit").exists());
}

#[test]
fn every_noise_model_has_rows_and_break_even_ratios_of_its_own() {
    let place = Place::new();
    let quick = "--k 10 --schemes olc,ppl --inlier-ratios 1,0.3 --solver joint --quiet --out audit";
    let noise = "--oracle-noise uniform,near --oracle-noise clustered,near";
    place.stdout(&format!("audit map room.csv --scale 1 {quick} {noise}"), 0);
    let audit = place.json("audit/audit.json");
    let results = audit["results"].as_array().expect("rows");
    assert_eq!(results.len(), 2 * 3 * 2);
    for rows in results.chunks(6) {
        let names: Vec<&str> = rows.iter().filter_map(|row| row["oracle_noise"].as_str()).collect();
        assert_eq!(names, ["uniform", "uniform", "near", "near", "clustered", "clustered"]);
        // Without outliers there is nothing to differ in.
        for other in [2, 4] {
            assert_eq!(rows[0]["recovered_percent"], rows[other]["recovered_percent"]);
            assert_ne!(rows[1]["recovered_percent"], rows[other + 1]["recovered_percent"]);
        }
    }
    let points = audit["break_even"].as_array().expect("ratios");
    // A blind guess may be the strongest, with a ratio of its own.
    let by_joint = points.iter().filter(|point| point["solver"] == "joint");
    let noises: Vec<&str> = by_joint.filter_map(|p| p["oracle_noise"].as_str()).collect();
    assert_eq!(noises, ["uniform", "near", "clustered", "uniform", "near", "clustered"]);
    let page = std::fs::read_to_string(place.path().join("audit/report.html")).expect("a report");
    assert!(page.contains("oracle (clustered), 30 % true neighbors"));
    assert!(page.contains("oracle (near), 30 % true neighbors"));

    // The uniform rows are those of an audit that names no model.
    place.stdout(&format!("audit map room.csv --scale 1 {quick}"), 0);
    let usual = place.json("audit/audit.json");
    assert_eq!(usual["results"][0], results[0]);
    assert_eq!(usual["results"][1], results[1]);
}

#[test]
fn lists_of_a_noise_model_are_written() {
    let place = Place::new();
    place.stdout("obfuscate room.csv --scheme olc --scale 1 --seed 1 --out hidden", 0);
    let mut files = std::collections::BTreeSet::new();
    for noise in ["uniform", "near", "clustered"] {
        let line = "neighbors oracle hidden/truth.parquet --k 10 --inlier-ratio 0.5 --out lists";
        place.stdout(&format!("{line} --oracle-noise {noise}"), 0);
        files.insert(std::fs::read(place.path().join("lists")).expect("lists"));
    }
    assert_eq!(files.len(), 3);
}

#[test]
fn a_bench_tells_seconds_of_every_ratio_and_solver() {
    let place = Place::new();
    let line = "bench recover --points 900 --map room.csv --k 10 --inlier-ratios 1,0.5 \
                --solver consensus,ransac";
    let text = place.stdout(line, 0);
    assert_eq!(
        text.lines().next(),
        text.lines().find(|l| l.starts_with("ppl: 900 points, K = 10"))
    );
    assert_eq!(text.matches("consensus").count() + text.matches("ransac").count(), 4, "{text}");
    let json: Value =
        serde_json::from_str(&place.stdout(&format!("{line} --json"), 0)).expect("JSON");
    assert_eq!((json["n_points"].as_u64(), json["k"].as_u64()), (Some(900), Some(10)));
    let rows = json["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 4);
    assert!(rows.iter().all(|row| row["seconds"].as_f64() > Some(0.0)));
    assert!(rows.iter().all(|row| row["published_seconds"].is_null()));
}

#[test]
fn help_is_part_of_the_interface() {
    let place = Place::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots");
    for command in [
        "",
        "demo",
        "audit map",
        "audit images",
        "audit released",
        "check",
        "obfuscate",
        "neighbors oracle",
        "neighbors find",
        "recover",
        "evaluate",
        "export",
        "split",
        "table",
        "compare",
        "paper",
        "bench recover",
        "features",
        "invert",
        "metrics",
        "schemes",
        "models",
        "doctor",
        "completions",
        "man",
    ] {
        let text = place.stdout(&format!("{command} --help"), 0);
        let name = if command.is_empty() { "unlift" } else { command }.replace(' ', "-");
        let file = folder.join(format!("{name}.txt"));
        if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
            std::fs::write(&file, &text).expect("a writable snapshot");
        }
        let kept = std::fs::read_to_string(&file).expect("a snapshot (UPDATE_SNAPSHOTS=1)");
        assert_eq!(text, kept, "{command}: UPDATE_SNAPSHOTS=1 re-blesses");
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{command}");
    }
}
