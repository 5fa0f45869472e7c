//! Gates by solver and source, over both baselines, and about what a map does not allow.

mod common;

use std::fs;

use common::Place;
use serde_json::Value;

/// A folder with a small room in it.
fn place() -> Place {
    Place::with_room(700)
}

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(place.path(name)).unwrap()).unwrap()
}

/// The first line on standard error.
fn complaint(place: &Place, line: &str, code: i32) -> String {
    place.ends(line, code).1.lines().next().unwrap_or_default().to_owned()
}

#[test]
fn a_gate_may_name_a_solver_and_a_source() {
    let place = place();
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 0.5 \
                 --neighbors oracle --neighbors geometric --out a";
    let gates = "--gate ppl:joint:oracle@0.5:0.25<=100 --gate ppl:geometric:0.25<=100 --gate \
                 olc:joint-start:0.25<=0";
    place.ends(&format!("{audit} {gates}"), 1);
    let document = json(&place, "a/audit.json");
    let rows = document["results"].as_array().expect("rows");
    let largest = |scheme: &str, solver: &str, source: &str| {
        let is = |row: &Value, field: &str, name: &str| name.is_empty() || row[field] == name;
        let of = rows.iter().filter(|row| {
            is(row, "scheme", scheme) && is(row, "solver", solver) && is(row, "neighbors", source)
        });
        of.filter_map(|row| row["recovered_percent"]["0.25"].as_f64()).fold(0.0, f64::max)
    };
    let found = |at: usize| document["gates"][at]["found_percent"].as_f64().expect("a figure");
    assert_eq!(found(0), largest("ppl", "joint", "oracle"));
    assert_eq!(found(1), largest("ppl", "", "geometric"));
    assert_eq!(found(2), largest("olc", "joint-start", ""));
    assert_eq!(document["gates"][1]["passed"], true);
    assert_eq!(
        complaint(&place, &format!("{audit} --gate ppl:ransac:0.25<=1"), 2),
        "unlift: --gate ppl:ransac:0.25<=1: solver: expected one of joint, joint-start, consensus, found ransac"
    );
    assert_eq!(
        complaint(&place, &format!("{audit} --gate ppl:overlap:0.25<=1"), 2),
        "unlift: --gate ppl:overlap:0.25<=1: neighbors: expected one of oracle, geometric, found overlap"
    );
}

#[test]
fn the_gain_of_a_gate_is_over_the_larger_baseline() {
    let place = place();
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc --inlier-ratios 0.5 --out a \
                 --gate olc:0.25:gain<=100";
    let gain = |more: &str| {
        place.ends(&format!("{audit} {more}"), 0);
        let document = json(&place, "a/audit.json");
        let row = &document["results"][0];
        let of = |field: &str| row[field]["0.25"].as_f64();
        let strongest = document["results"].as_array().unwrap().iter();
        let strongest = strongest.filter_map(|row| row["recovered_percent"]["0.25"].as_f64());
        let gate = document["gates"][0]["found_percent"].as_f64().unwrap();
        (gate, strongest.fold(0.0, f64::max), of("blind_percent"), of("records_alone_percent"))
    };
    let (gate, got, blind, alone) = gain("");
    let (blind, alone) = (blind.unwrap(), alone.expect("an attack on lines alone"));
    assert!(alone > blind, "lines of a room give more than a guess: {alone} {blind}");
    assert!((gate - (got - alone)).abs() < 1e-3, "{gate}: {got} less {alone}");
    let (gate, got, blind, alone) = gain("--no-records-alone");
    assert_eq!(alone, None);
    assert!((gate - (got - blind.unwrap())).abs() < 1e-3);
}

#[test]
fn a_scheme_that_the_map_does_not_allow_is_told_and_no_gate_on_it_holds() {
    let place = place();
    let spread = |i: usize| [((i * 7919) % 1000) as f64, ((i * 104_729) % 997) as f64, 1.0];
    place.write_points("flat.csv", &(0..400).map(spread).collect::<Vec<_>>());
    let audit = "audit map flat.csv --schemes olc,ppl+ --inlier-ratios 1,0.5 --no-records-alone \
                 --out a";
    let text = place.ends(audit, 0).0;
    assert!(text.contains("not audited: ppl+: k: expected"), "{text}");
    let gates = "--gate olc:1.0<=100 --gate ppl+:1.0<=100 --gate all@0.5:1.0<=100";
    let text = place.ends(&format!("{audit} {gates}"), 1).0;
    assert!(text.contains("gate ppl+:1.0<=100: FAILED, ppl+ was not audited: k:"), "{text}");
    let document = json(&place, "a/audit.json");
    assert_eq!(document["results"].as_array().map(Vec::len), Some(6), "rows of olc");
    let missing = &document["not_audited"];
    assert_eq!(missing.as_array().map(Vec::len), Some(1), "{missing}");
    assert_eq!((&missing[0]["scheme"], &missing[0]["neighbors"]), (&"ppl+".into(), &Value::Null));
    let gates = document["gates"].as_array().expect("gates");
    let passed: Vec<bool> = gates.iter().filter_map(|gate| gate["passed"].as_bool()).collect();
    assert_eq!(passed, [true, false, false], "all includes what is not known");
    assert_eq!(gates[1]["found_percent"], Value::Null);
    assert!(gates[2]["found_percent"].as_f64() > Some(0.0));

    let alone = complaint(&place, "audit map flat.csv --schemes ppl+ --out b", 3);
    let begin =
        "unlift: flat.csv: schemes: expected one that can be applied to this map, found none";
    assert!(alone.starts_with(begin), "{alone}");
    assert!(!place.path("b").exists());
}

#[test]
fn lists_that_cannot_be_made_at_some_ratios_cost_these_rows() {
    let place = place();
    place.write_points("tiny.csv", &unlift::synthetic::room(1, 60).points);
    let line = "audit map tiny.csv --schemes olc --inlier-ratios 1,0.3,0.1 --no-records-alone";
    place.ends(&format!("{line} --out a"), 0);
    let document = json(&place, "a/audit.json");
    assert_eq!(document["results"].as_array().map(Vec::len), Some(3));
    let missing = &document["not_audited"];
    assert_eq!(missing[0]["neighbors"], "oracle", "{missing}");
    let told: Vec<&str> =
        missing.as_array().unwrap().iter().filter_map(|m| m["reason"].as_str()).collect();
    assert!(told.iter().all(|reason| reason.starts_with("at 0.")), "{told:?}");
}

/// A file that declares fewer points than it holds: what is audited is a part of the map.
#[test]
fn no_gate_holds_on_a_part_of_a_map_that_is_not_told() {
    let place = Place::with_room(300);
    let rows = fs::read_to_string(place.path("room.csv")).unwrap().replace(',', " ");
    let head = "ply\nformat ascii 1.0\nelement vertex 100\nproperty float x\nproperty float y\nproperty float z\n\
                element face 0\nproperty list uchar int vertex_indices\nend_header\n";
    fs::write(place.path("less.ply"), format!("{head}{rows}")).unwrap();
    let audit = "audit map less.ply --scale 1 --k 5 --schemes olc --inlier-ratios 0.5 --gate olc:0.25<=100 --out a";
    let (_, told) = place.ends(audit, 1);
    assert!(told.contains("note: 100 points are declared, and 200 more seem to follow"), "{told}");
    let document = json(&place, "a/audit.json");
    assert_eq!(document["gates"][0]["passed"], false);
    let is_told =
        |note: &Value| note.as_str().is_some_and(|note| note.starts_with("100 points are"));
    assert!(document["notes"].as_array().unwrap().iter().any(is_told));
}

/// A map whose scale is a hundred times too large: nothing can come back within a threshold, and that is no protection.
#[test]
fn no_gate_holds_on_lengths_that_are_doubtful() {
    let place = place();
    let audit = "audit map room.csv --scale 100 --k 10 --schemes olc --inlier-ratios 0.5 --no-records-alone --out a";
    let (printed, told) = place.ends(&format!("{audit} --gate olc:0.25<=20"), 1);
    assert_eq!(told.matches("note: lengths are doubtful: points are").count(), 1, "{told}");
    let line = printed.lines().find(|line| line.starts_with("gate ")).unwrap_or_default();
    assert!(line.contains("FAILED") && line.contains("is --scale right?"), "{line}");
}

/// A first look is two schemes at one ratio, and the attack on what is released where there are descriptors.
#[test]
fn a_first_look_is_two_schemes_and_the_attack_on_what_is_released() {
    let place = place();
    place.ends("audit map room.csv --scale 1 --k 10 --quick --out a", 0);
    let schemes = |document: &Value| {
        let rows = document["results"].as_array().unwrap();
        assert!(rows.iter().all(|row| row["neighbors"] != "oracle" || row["inlier_ratio"] == 0.5));
        let mut found: Vec<String> = rows
            .iter()
            .map(|row| {
                format!(
                    "{} {}",
                    row["scheme"].as_str().unwrap(),
                    row["neighbors"].as_str().unwrap()
                )
            })
            .collect();
        found.dedup();
        found
    };
    assert_eq!(schemes(&json(&place, "a/audit.json")), ["olc oracle", "ppl oracle"]);
    let (_, stderr) = place.ends("audit map room.csv --quick --schemes ppl --out b", 2);
    assert!(stderr.contains("--quick") && stderr.contains("--schemes"), "{stderr}");
}
