//! Gates by solver and source, on what a map does not allow, and as JUnit XML.

use serde_json::Value;

use crate::common::{Place, recovered, rows};

#[test]
#[rustfmt::skip] // One row per line.
fn a_gate_may_name_a_solver_and_a_source_and_decides_the_exit_code() {
    let place = Place::with_room(700);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 0.5 \
                 --neighbors oracle --neighbors geometric --out a";
    let held = "--gate ppl:joint:oracle@0.5:0.25<=100 --gate ppl:geometric:0.25<=100";
    place.ends(&format!("{audit} {held}"), 0);
    let line = format!("{audit} {held} --gate olc:consensus:0.25<=0 --junit new/gates.xml");
    let (text, _) = place.ends(&line, 1);
    assert!(text.contains("gate olc:consensus:0.25<=0: FAILED"), "{text}");
    let document = place.json("a/audit.json");
    let is_named = |row: &&Value| {
        row["scheme"] == "ppl" && row["solver"] == "joint" && row["neighbors"] == "oracle"
    };
    let row = rows(&document).iter().find(is_named).expect("a row");
    assert_eq!(document["gates"][0]["found_percent"], recovered(row, "0.25"));
    let junit = place.text("new/gates.xml");
    let suite = "<testsuite name=\"room.csv\" tests=\"3\" failures=\"1\" errors=\"0\"";
    assert!(junit.contains(suite), "{junit}");
    let mut points = unlift::synthetic::room(1, 700).points;
    points.rotate_left(300);
    place.write_descriptors("other.bin", &points, 128);
    let (text, _) = place.ends(&format!("{audit} {held} --descriptors other.bin"), 1);
    assert!(text.contains("of another map, or in another order of rows?"), "{text}");
    place.ends(&format!("{line} --share-safe"), 1);
    assert!(!place.text("new/gates.xml").contains("room"), "it does not name the map");
    place.write("theirs.xml", "<?xml version=\"1.0\"?><project/>");
    place.refuses(audit, &[
        ("--gate ppl:ransac:0.25<=1", 2, "unlift: --gate ppl:ransac:0.25<=1: solver: expected one of joint, consensus"),
        ("--gate olc:0.25<=1 --junit theirs.xml", 2, "unlift: --junit: theirs.xml: expected nothing, or gates as JUnit XML"),
        ("--gate olc:0.25<=1 --junit room.csv", 2, "unlift: --junit: room.csv: expected a file that is not read"),
        // Without a gate it would say that all held.
        ("--junit g.xml", 2, "--gate <GATE>"),
    ]);
}

#[test]
fn no_gate_holds_on_a_scheme_that_the_map_does_not_allow() {
    let place = Place::empty();
    let spread = |i: usize| [((i * 7919) % 1000) as f64, ((i * 104_729) % 997) as f64, 1.0];
    place.write_points("flat.csv", &(0..400).map(spread).collect::<Vec<_>>());
    let audit =
        "audit map flat.csv --schemes olc,ppl+ --inlier-ratios 1,0.5 --no-records-alone --out a";
    let gates = "--gate olc:oracle:1.0<=100 --gate ppl+:1.0<=100 --gate all@0.5:1.0<=100";
    let (text, _) = place.ends(&format!("{audit} {gates}"), 1);
    assert!(text.contains("gate ppl+:1.0<=100: FAILED, ppl+ was not audited: k:"), "{text}");
    let gates = &place.json("a/audit.json")["gates"];
    let passed = [0, 1, 2].map(|at| gates[at]["passed"].as_bool());
    assert_eq!(passed, [true, false, false].map(Some), "all includes what is not known");
    assert!(gates[1]["found_percent"].is_null());
    let (_, stderr) = place.ends("table a/audit.json --out t.tex", 0);
    let text = place.text("t.tex");
    assert!(text.contains("\nppl+ & not audited & not audited &"), "{text}");
    assert!(stderr.starts_with("unlift: note: not audited: ppl+: k: expected"), "{stderr}");
    let none = "unlift: flat.csv: schemes: expected one that can be applied to this map";
    place.refuses("audit map flat.csv", &[("--schemes ppl+ --out b", 3, none)]);
    assert!(!place.path("b").exists());
}
