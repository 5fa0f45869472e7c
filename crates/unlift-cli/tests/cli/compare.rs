//! `unlift compare`: leaks, missing counterparts, and audits that cannot be compared.

use serde_json::{Value, json};

use crate::common::{Place, texts};

type Change = (&'static str, fn(&mut Value));

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
#[rustfmt::skip] // One row per line.
fn what_leaks_more_or_is_out_of_view_fails() {
    let place = Place::with_room(500);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 1,0.5 --neighbors \
                 oracle --neighbors geometric --solver joint --quiet --out a";
    place.ends(audit, 0);
    let changes: [Change; 12] = [
        ("was.json", |_| ()),
        ("old.json", |document| set_share(document, 40.0)),
        ("new.json", |document| set_share(document, 42.5)),
        ("near.json", |document| set_share(document, 41.5)),
        ("repeated.json", |document| {
            set_share(document, 41.5);
            rows(document)[0]["std"] = json!({"recovered_percent": {"0.10": 0.3, "0.25": 0.601}});
        }),
        ("gone.json", |document| {
            rows(document).retain(|row| row["scheme"] != "ppl");
            document["break_even"] = json!([]);
        }),
        ("map.json", |document| document["input"]["sha256"] = json!("0".repeat(64))),
        ("scale.json", |document| document["input"]["scale_m_per_unit"] = json!(4.0)),
        ("database.json", |document| document["input"]["other_sha256"]["descriptors"] = json!("0")),
        ("unnamed.json", |document| document["input"]["sha256"] = json!(null)),
        ("scheme.json", |document| {
            let mut row = rows(document).iter().find(|row| row["neighbors"] == "geometric").cloned();
            let row = row.as_mut().unwrap();
            (row["scheme"], row["recovered_percent"]["0.10"]) = (json!("cp"), json!(99.9));
            rows(document).push(row.clone());
        }),
        ("attack.json", |document| rows(document).retain(|row| row["neighbors"] != "geometric")),
    ];
    for (name, change) in changes {
        let mut document = place.json("a/audit.json");
        document["run"]["seconds"]["rows"] = json!([]);
        document["input"]["other_sha256"] = json!({"descriptors": "1"});
        change(&mut document);
        place.write(name, document.to_string());
    }
    let usual = "tolerance 2 points or twice a figure's own spread: ";
    let spread = "tolerance 1.21 points or twice a figure's own spread: ";
    for (files, code, tolerance, expected) in [
        ("was.json was.json", 0, usual, "0 leak more, 0 less, 20 as before\n"),
        ("old.json new.json", 1, usual, "1 leak more, 0 less, 19 as before\n"),
        ("new.json old.json", 0, usual, "0 leak more, 1 less"),
        ("old.json near.json", 0, usual, "0 leak more"),
        ("old.json repeated.json", 1, spread, "1 leak more"),
        ("was.json gone.json", 1, usual, "0 leak more"),
        // A scheme that is new leaks more than all before.
        ("was.json scheme.json", 1, usual, "1 leak more"),
    ] {
        let (text, _) = place.ends(&format!("compare {files}"), code);
        assert!(text.contains(&format!("{tolerance}{expected}")), "{files}: {text}");
        assert_eq!(text.contains("NO LONGER AUDITED: ppl: no row"), files.contains("gone"), "{text}");
    }
    for name in ["map.json", "scale.json", "database.json", "attack.json", "unnamed.json"] {
        let (text, _) = place.ends(&format!("compare was.json {name}"), 1);
        let start = if name == "attack.json" { "NOT COMPARED: only in" } else { "OTHER INPUT: " };
        assert!(text.starts_with(start) && text.contains("\nnot like for like: "), "{text}");
    }
    for (name, until, code, start) in [
        ("map.json", "2999-12-31", 0, "accepted until 2999-12-31 (new-rooms): "),
        ("map.json", "2020-02-29", 1, "OTHER INPUT, and --accept ended on 2020-02-29: "),
        // An attack that is gone cannot be accepted.
        ("attack.json", "2999-12-31", 1, "NOT COMPARED: only in the old audit"),
    ] {
        let accept = format!("--accept=new-rooms, until {until}");
        let output = place.program(["compare", "was.json", name, &accept]).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{name}: {output:?}");
        assert!(texts(&output).0.starts_with(start), "{name}: {output:?}");
    }
    let compared = place.prints("compare old.json new.json --json --out c", 1);
    assert_eq!(compared["more"][0]["scheme"], "olc");
    let page = place.text("c/compare.html");
    assert!(page.contains("<td>42.5</td><td>+2.5</td>") && page.contains("Private."), "{page}");
    place.write("c/compare.html", "mine");
    let audit = "audit map room.csv --k 10 --schemes olc --inlier-ratios 1 --quiet";
    place.ends(&format!("{audit} --out u"), 0);
    place.ends(&format!("{audit} --scale 1 --thresholds 0.10 --out t"), 0);
    place.refuses(
        "compare was.json",
        &[
            ("u/audit.json --out d", 3, "unit: expected m, as in was.json, found kth_neighbor"),
            ("t/audit.json --out d", 3, "thresholds: expected 0.10, 0.25, as in was.json, found 0.10"),
            ("was.json --out c", 2, "unlift: --out: c/compare.html: expected nothing, or a report"),
        ],
    );
    assert!(!place.path("d").exists());
}
