//! `unlift audit released`: records of another program, audited end to end.

use std::process::Command;

use unlift_io::stage::{read_truth, write_truth};

use crate::common::Place;

/// A scheme of a researcher: each point on a random line through it, records in random order, a
/// tenth of the points left out.
const SCHEME: &str = r#"
import json, numpy as np
points = np.loadtxt("room.csv", delimiter=",")
rng = np.random.default_rng(3)
order = rng.permutation(len(points))
hidden = order[len(points) // 10:]
direction = rng.normal(size=(len(hidden), 3))
along = rng.normal(size=(len(hidden), 1))
foot = points[hidden] + along * direction  # any point of the line will do
meta = np.array(json.dumps({"unit": "m", "scheme": "numpy-lines"}))
np.savez("mine.npz", unlift=meta, foot=foot, direction=direction)
slot = np.full(len(points), -1)
slot[hidden] = np.arange(len(hidden))
np.savez_compressed("truth.npz", unlift=np.array('{"unit": "m"}'), position=points, slot=slot)
"#;

#[test]
fn a_scheme_written_in_python_gets_rows_page_and_gates() {
    let place = Place::with_room(600);
    let run = |script: &str| {
        let mut python = Command::new("python3");
        python.args(["-c", script]).current_dir(place.path("")).output()
    };
    if !run("import numpy").is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: python3 with numpy is not installed");
        return;
    }
    let output = run(SCHEME).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let audit = "audit released mine.npz --truth truth.npz --k 10";
    let gates = "--inlier-ratios 1,0.5,0.1 --gate numpy-lines@0.1:0.25<=100 --gate all@1:0.25<=5";
    place.ends(&format!("{audit} {gates} --out a"), 1);
    let found = place.json("a/audit.json");
    let rows = found["results"].as_array().unwrap();
    // Three ratios; joint and, because the map is small, consensus.
    assert_eq!(rows.len(), 6);
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
    let (original, secret) = read_truth::<3>(&place.path("two/truth.npz")).unwrap();
    let secret: unlift::truth::Secret = secret.of_map(None, 1).unwrap();
    write_truth(&place.path("bare"), &original, &secret).unwrap();
    for (truth, expected) in [
        ("two/truth.npz", "fingerprint: expected "),
        ("bare", "truth: expected points nearer to their own records than to others, found "),
    ] {
        let line = format!("audit released one/released.npz --k 10 --out a --truth {truth}");
        let told = place.complains(&line, 3);
        let expected = format!("unlift: one/released.npz: {expected}");
        assert!(told.starts_with(&expected) && told.lines().count() == 1, "{told}");
        assert!(!place.path("a").exists());
    }
}
