//! `unlift compare`: leaks, missing counterparts, and audits that cannot be compared.

use serde_json::{Value, json};

use crate::common::Place;

/// A change to a document, with the name of its folder.
type Change<'a> = (&'a str, &'a dyn Fn(&mut Value));

/// Audits a room in `a`, and writes changed copies of its audit.json.
fn audited(changes: &[Change<'_>]) -> Place {
    let place = Place::with_room(500);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 1,0.5 --neighbors \
                 oracle --neighbors geometric --solver joint --quiet --out a";
    place.ends(audit, 0);
    for (name, change) in changes {
        let mut document = place.json("a/audit.json");
        document["run"]["seconds"]["rows"] = json!([]);
        change(&mut document);
        place.write(name, document.to_string());
    }
    place
}

fn rows(document: &mut Value) -> &mut Vec<Value> {
    document["results"].as_array_mut().unwrap()
}

/// Sets the share within 0.10 in the row of `olc` by the oracle at 0.5.
fn set_share(document: &mut Value, percent: f64) {
    let row = rows(document).iter_mut().find(|row| {
        row["scheme"] == "olc" && row["neighbors"] == "oracle" && row["inlier_ratio"] == 0.5
    });
    row.unwrap()["recovered_percent"]["0.10"] = json!(percent);
}

#[test]
fn what_leaks_more_or_is_out_of_view_fails() {
    let std = json!({ "recovered_percent": { "0.10": 0.3, "0.25": 0.601 } });
    let place = audited(&[
        ("old.json", &|document| set_share(document, 40.0)),
        ("new.json", &|document| set_share(document, 42.5)),
        ("near.json", &|document| set_share(document, 41.5)),
        ("repeated.json", &|document| {
            set_share(document, 41.5);
            rows(document)[0]["std"] = std.clone();
        }),
        ("gone.json", &|document| {
            rows(document).retain(|row| row["scheme"] != "ppl");
            document["break_even"] = json!([]);
        }),
    ]);
    let usual = "tolerance 2 points (usual without repeats): ";
    let spread = "tolerance 1.21 points (twice the spread of repeats): ";
    for (files, code, tolerance, expected) in [
        ("a/audit.json a/audit.json", 0, usual, "0 leak more, 0 less, 20 as before\n"),
        ("old.json new.json", 1, usual, "1 leak more, 0 less, 19 as before\n"),
        ("new.json old.json", 0, usual, "0 leak more, 1 less"),
        ("old.json near.json", 0, usual, "0 leak more"),
        ("old.json repeated.json", 1, spread, "1 leak more"),
        ("a/audit.json gone.json", 1, usual, "0 leak more"),
    ] {
        let (text, _) = place.ends(&format!("compare {files}"), code);
        assert!(text.contains(&format!("{tolerance}{expected}")), "{files}: {text}");
        assert_eq!(text.contains("OUT OF VIEW: ppl: no row"), files.contains("gone"), "{text}");
    }
    let other: [Change<'_>; 4] = [
        ("map.json", &|document| document["input"]["sha256"] = json!("0".repeat(64))),
        ("scale.json", &|document| document["input"]["scale_m_per_unit"] = json!(4.0)),
        ("database.json", &|document| {
            document["input"]["other_sha256"] = json!({"descriptors": "0"})
        }),
        ("attack.json", &|document| rows(document).retain(|row| row["neighbors"] != "geometric")),
    ];
    for (name, change) in other {
        let mut document = place.json("a/audit.json");
        document["run"]["seconds"]["rows"] = json!([]);
        document["input"]["other_sha256"] = json!({"descriptors": "1"});
        place.write("was.json", document.to_string());
        change(&mut document);
        place.write(name, document.to_string());
        let (text, _) = place.ends(&format!("compare was.json {name}"), 1);
        assert!(text.starts_with("NOT COMPARED: "), "{name}: {text}");
        assert!(text.contains("\nnot comparable: "), "{name}: {text}");
        let accepted = |until: &str, code| {
            let accept = format!("--accept=new-rooms, until {until}");
            let line = ["compare", "was.json", name, &accept];
            let output = place.program(line).output().expect("a program");
            assert_eq!(output.status.code(), Some(code), "{name}: {output:?}");
            String::from_utf8(output.stdout).expect("text")
        };
        // An attack that is gone cannot be accepted.
        let (code, start) = match name {
            "attack.json" => (1, "NOT COMPARED: only in the old audit"),
            _ => (0, "accepted until 2999-12-31 (new-rooms): "),
        };
        assert!(accepted("2999-12-31", code).starts_with(start), "{name}");
        let ended =
            ["NOT COMPARED, as --accept ended on 2020-02-29: ", start][usize::from(code == 1)];
        assert!(accepted("2020-02-29", 1).starts_with(ended), "{name}");
    }
    let compared = place.prints("compare old.json new.json --json --out c", 1);
    assert_eq!(compared["more"][0]["scheme"], "olc");
    let page = place.text("c/compare.html");
    assert!(page.contains("<td>42.5</td><td>+2.5</td>") && page.contains("Private."), "{page}");
    place.write("c/compare.html", "mine");
    let told = place.complains("compare new.json old.json --out c", 2);
    assert!(told.starts_with("unlift: --out: c/compare.html: expected nothing, or a report"));
}

#[test]
#[rustfmt::skip] // One row per line.
fn other_units_and_thresholds_are_refused() {
    let place = audited(&[]);
    let audit = "audit map room.csv --k 10 --schemes olc --inlier-ratios 1 --quiet";
    place.ends(&format!("{audit} --out u"), 0);
    place.ends(&format!("{audit} --scale 1 --thresholds 0.10 --out t"), 0);
    place.refuses("compare --out c a/audit.json", &[
        ("u/audit.json", 3, "unit: expected m, as in a/audit.json, found kth_neighbor"),
        ("t/audit.json", 3, "thresholds: expected 0.10, 0.25, as in a/audit.json, found 0.10"),
    ]);
    assert!(!place.path("c").exists());
}
