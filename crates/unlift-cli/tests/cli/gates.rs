//! Gates by solver and source, over both baselines, and on what a map does not allow.

use serde_json::Value;

use crate::common::Place;

fn rows(document: &Value) -> &Vec<Value> {
    document["results"].as_array().expect("rows")
}

/// Returns the largest share within 0.25 of the rows with these values; an empty value matches all.
fn largest(document: &Value, scheme: &str, solver: &str, source: &str) -> f64 {
    let is = |row: &Value, field: &str, name: &str| name.is_empty() || row[field] == name;
    let of = rows(document).iter().filter(|row| {
        is(row, "scheme", scheme) && is(row, "solver", solver) && is(row, "neighbors", source)
    });
    of.filter_map(|row| row["recovered_percent"]["0.25"].as_f64()).fold(0.0, f64::max)
}

#[test]
fn a_gate_may_name_a_solver_and_a_source_and_decides_the_exit_code() {
    let place = Place::with_room(700);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 0.5 \
                 --neighbors oracle --neighbors geometric --out a";
    let held = "--gate ppl:joint:oracle@0.5:0.25<=100 --gate ppl:geometric:0.25<=100";
    place.ends(&format!("{audit} {held}"), 0);
    let (text, _) = place.ends(&format!("{audit} {held} --gate olc:joint-start:0.25<=0"), 1);
    assert!(text.contains("gate olc:joint-start:0.25<=0: FAILED"), "{text}");
    let document = place.json("a/audit.json");
    for (at, (scheme, solver, source)) in
        [("ppl", "joint", "oracle"), ("ppl", "", "geometric"), ("olc", "joint-start", "")]
            .into_iter()
            .enumerate()
    {
        let gate = &document["gates"][at];
        let found = gate["found_percent"].as_f64();
        assert_eq!(found, Some(largest(&document, scheme, solver, source)), "{gate}");
        assert_eq!(gate["passed"], at < 2);
    }
    let expected = "unlift: --gate ppl:ransac:0.25<=1: solver: expected one of ranking, joint, joint-start, consensus, found ransac\n";
    assert_eq!(place.complains(&format!("{audit} --gate ppl:ransac:0.25<=1"), 2), expected);
}

#[test]
fn a_scheme_that_the_map_does_not_allow_is_told_and_no_gate_on_it_holds() {
    let place = Place::empty();
    let spread = |i: usize| [((i * 7919) % 1000) as f64, ((i * 104_729) % 997) as f64, 1.0];
    place.write_points("flat.csv", &(0..400).map(spread).collect::<Vec<_>>());
    let audit = "audit map flat.csv --schemes olc,ppl+ --inlier-ratios 1,0.5 --no-records-alone \
                 --out a";
    let (text, _) = place.ends(audit, 0);
    assert!(text.contains("not audited: ppl+: k: expected"), "{text}");
    let gates = "--gate olc:1.0<=100 --gate ppl+:1.0<=100 --gate all@0.5:1.0<=100";
    let (text, _) = place.ends(&format!("{audit} {gates}"), 1);
    assert!(text.contains("gate ppl+:1.0<=100: FAILED, ppl+ was not audited: k:"), "{text}");
    let document = place.json("a/audit.json");
    assert_eq!(rows(&document).len(), 8, "rows of olc");
    let missing = &document["not_audited"];
    assert_eq!(missing.as_array().map(Vec::len), Some(1), "{missing}");
    assert_eq!((&missing[0]["scheme"], &missing[0]["neighbors"]), (&"ppl+".into(), &Value::Null));
    let gates = document["gates"].as_array().expect("gates");
    let passed: Vec<bool> = gates.iter().filter_map(|gate| gate["passed"].as_bool()).collect();
    assert_eq!(passed, [true, false, false], "all includes what is not known");
    assert_eq!(gates[1]["found_percent"], Value::Null);
    assert!(gates[2]["found_percent"].as_f64() > Some(0.0));

    let alone = place.complains("audit map flat.csv --schemes ppl+ --out b", 3);
    let begin =
        "unlift: flat.csv: schemes: expected one that can be applied to this map, found none";
    assert!(alone.starts_with(begin) && !place.path("b").exists(), "{alone}");
}

/// No gate holds for a file that declares fewer points than it has, or for a map whose scale is a
/// hundred times too large.
#[test]
fn no_gate_holds_on_figures_that_are_doubtful() {
    let place = Place::with_room(300);
    let rows = place.text("room.csv").replace(',', " ");
    let head = "ply\nformat ascii 1.0\nelement vertex 100\nproperty float x\nproperty float y\nproperty float z\n\
                element face 0\nproperty list uchar int vertex_indices\nend_header\n";
    place.write("less.ply", format!("{head}{rows}"));
    for (map, note) in [
        ("less.ply --scale 1", "100 points are declared, and 200 more seem to follow"),
        ("room.csv --scale 100", "lengths are doubtful: points are"),
    ] {
        let options =
            "--k 5 --schemes olc --inlier-ratios 0.5 --no-records-alone --gate olc:0.25<=100";
        let (text, told) = place.ends(&format!("audit map {map} {options} --out a"), 1);
        assert_eq!(told.matches(&format!("note: {note}")).count(), 1, "{told}");
        assert!(text.lines().any(|line| line.starts_with("gate ") && line.contains("FAILED")));
        let document = place.json("a/audit.json");
        assert_eq!(document["gates"][0]["passed"], false);
        let mut notes =
            document["notes"].as_array().unwrap().iter().filter_map(|said| said.as_str());
        assert!(notes.any(|said| said.starts_with(note)));
    }
}
