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
    for (at, (scheme, solver, source)) in
        [("ppl", "joint", "oracle"), ("ppl", "", "geometric"), ("olc", "consensus", "")]
            .into_iter()
            .enumerate()
    {
        let is = |row: &Value, field: &str, name: &str| name.is_empty() || row[field] == name;
        let of = rows(&document).iter().filter(|row| {
            is(row, "scheme", scheme) && is(row, "solver", solver) && is(row, "neighbors", source)
        });
        let shares = of.map(|row| recovered(row, "0.25"));
        let gate = &document["gates"][at];
        assert_eq!(gate["found_percent"].as_f64(), Some(shares.fold(0.0, f64::max)), "{gate}");
        assert_eq!(gate["passed"], at < 2);
    }
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
        ("--gate olc:0.25<=1 --junit a/report.html", 2, "unlift: --junit: a/report.html: expected nothing, or gates as JUnit XML"),
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
    let document = place.json("a/audit.json");
    let gates = document["gates"].as_array().expect("gates");
    let passed: Vec<bool> = gates.iter().filter_map(|gate| gate["passed"].as_bool()).collect();
    assert_eq!(passed, [true, false, false], "all includes what is not known");
    assert_eq!(gates[1]["found_percent"], Value::Null);
    let (_, stderr) = place.ends("table a/audit.json --out t.tex", 0);
    let text = place.text("t.tex");
    assert!(text.contains("\nppl+ & not audited & not audited &"), "{text}");
    assert!(stderr.starts_with("unlift: note: not audited: ppl+: k: expected"), "{stderr}");
    let alone = place.complains("audit map flat.csv --schemes ppl+ --out b", 3);
    let begin =
        "unlift: flat.csv: schemes: expected one that can be applied to this map, found none";
    assert!(alone.starts_with(begin) && !place.path("b").exists(), "{alone}");
}

#[test]
fn images_that_cannot_be_used_are_an_error_beside_the_gates() {
    let place = Place::with_photos(&["a.jpg", "b.png"]);
    place.write("photos/c.png", "no picture");
    let line = "audit images photos --schemes cp2d --inlier-ratios 1 --k 5 --quiet --out a";
    place.ends(&format!("{line} --gate cp2d:10<=100 --junit g.xml"), 3);
    let junit = place.text("g.xml");
    let unusable = "<error message=\"1 of 3 images could not be used, and are in no figure\"";
    assert!(junit.contains("failures=\"0\" errors=\"1\"") && junit.contains(unusable), "{junit}");
}
