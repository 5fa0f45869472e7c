//! `unlift compare`: what leaks more, what is out of view, and what cannot be compared.

mod common;

use std::fs;

use common::Place;
use serde_json::{Value, json};

/// A folder with an audit in `a`.
fn audited() -> Place {
    let place = Place::with_room(500);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 1,0.5 --neighbors \
                 oracle --neighbors geometric --solver joint --quiet --out a";
    place.ends(audit, 0);
    place
}

/// Writes the audit of `a`, changed, as `name`.
fn changed(place: &Place, name: &str, change: impl FnOnce(&mut Value)) {
    let text = fs::read_to_string(place.path("a/audit.json")).unwrap();
    let mut document: Value = serde_json::from_str(&text).unwrap();
    document["run"]["seconds"]["rows"] = json!([]);
    change(&mut document);
    fs::write(place.path(name), document.to_string()).unwrap();
}

fn rows(document: &mut Value) -> &mut Vec<Value> {
    document["results"].as_array_mut().unwrap()
}

/// Sets what comes back within 0.10 in the row of `olc` by the oracle at 0.5.
fn set_share(document: &mut Value, percent: f64) {
    let row = rows(document).iter_mut().find(|row| {
        row["scheme"] == "olc" && row["neighbors"] == "oracle" && row["inlier_ratio"] == 0.5
    });
    row.unwrap()["recovered_percent"]["0.10"] = json!(percent);
}

#[test]
fn an_audit_is_as_it_was() {
    let place = audited();
    let (text, _) = place.ends("compare a/audit.json a/audit.json --tolerance 0", 0);
    // Six attacks and two baselines of two schemes, within two thresholds.
    assert_eq!(
        text,
        "20 figures compared, tolerance 0 points: 0 leak more, 0 less, 20 as before\n"
    );
}

#[test]
fn what_leaks_more_than_the_tolerance_fails() {
    let place = audited();
    changed(&place, "old.json", |document| set_share(document, 40.0));
    changed(&place, "new.json", |document| set_share(document, 41.5));
    let (text, _) = place.ends("compare old.json new.json --tolerance 1 --out c", 1);
    let lines: Vec<&str> = text.lines().collect();
    let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(words(lines[0]), "scheme attack within old new points");
    let more = "olc oracle, 50 % true neighbors, K = 10, joint 0.10 40.0 % 41.5 % +1.5 leaks more";
    assert_eq!(words(lines[1]), more);
    assert_eq!(
        lines[2],
        "20 figures compared, tolerance 1 point: 1 leak more, 0 less, 19 as before"
    );
    assert_eq!(lines.last(), Some(&"page: c/compare.html"));
    let page = fs::read_to_string(place.path("c/compare.html")).unwrap();
    assert!(page.contains("FAIL") && page.contains("<td>41.5</td><td>+1.5</td>"), "{page}");
    assert!(page.contains("Private.") && page.contains("room.csv"), "it names the map");
    assert!(
        !page.contains("<script") && !page.contains("src=") && !page.contains("https:"),
        "alone"
    );

    place.ends("compare old.json new.json --tolerance 1.5", 0);
    let (text, _) = place.ends("compare new.json old.json --tolerance 1", 0);
    assert!(text.contains("-1.5  leaks less"), "{text}");
    // Seeds differ by a point or two.
    let (text, _) = place.ends("compare old.json new.json", 0);
    let usual = "tolerance 2 points (usual without repeats): 0 leak more";
    assert!(text.contains(usual), "{text}");
    changed(&place, "repeated.json", |document| {
        set_share(document, 41.5);
        rows(document)[0]["std"] = json!({ "recovered_percent": { "0.10": 0.3, "0.25": 0.601 } });
    });
    let (text, _) = place.ends("compare old.json repeated.json", 1);
    let twice = "tolerance 1.21 points (twice the spread of repeats): 1 leak more";
    assert!(text.contains(twice), "{text}");
    // The page is written over by the next one, another file is not.
    place.ends("compare new.json old.json --out c", 0);
    fs::write(place.path("c/compare.html"), "mine").unwrap();
    let (_, stderr) = place.ends("compare new.json old.json --out c", 2);
    assert!(
        stderr.starts_with("unlift: --out: c/compare.html: expected nothing, or a report"),
        "{stderr}"
    );
}

#[test]
fn a_baseline_leaks_as_well() {
    let place = audited();
    changed(&place, "old.json", |document| {
        for row in rows(document).iter_mut().filter(|row| row["scheme"] == "ppl") {
            row["records_alone_percent"]["0.25"] = json!(0.0);
        }
    });
    let (text, _) = place.ends("compare old.json a/audit.json --json", 1);
    let compared: Value = serde_json::from_str(&text).unwrap();
    let more = compared["more"].as_array().unwrap();
    assert_eq!(more.len(), 1, "{text}");
    assert_eq!((&more[0]["scheme"], &more[0]["attack"]), (&json!("ppl"), &json!("records alone")));
    assert_eq!((&more[0]["threshold"], &compared["passed"]), (&json!("0.25"), &json!(false)));
}

#[test]
fn what_is_out_of_view_fails_and_what_only_one_has_is_told() {
    let place = audited();
    // The scheme is gone, with or without a word.
    changed(&place, "gone.json", |document| {
        rows(document).retain(|row| row["scheme"] != "ppl");
        document["break_even"] = json!([]);
    });
    let (text, _) = place.ends("compare a/audit.json gone.json", 1);
    assert!(text.contains("OUT OF VIEW: ppl: no row in the new audit\n"), "{text}");
    assert!(
        text.contains("only in the old audit: ppl: oracle, 50 % true neighbors, K = 10, joint\n"),
        "{text}"
    );
    changed(&place, "flat.json", |document| {
        rows(document).retain(|row| row["scheme"] != "ppl");
        document["not_audited"] = json!([{ "scheme": "ppl", "reason": "flat" }]);
    });
    let (text, _) = place.ends("compare a/audit.json flat.json", 1);
    assert!(text.contains("OUT OF VIEW: ppl: not audited: flat\n"), "{text}");
    // A source that could be asked before.
    changed(&place, "source.json", |document| {
        rows(document).retain(|row| row["scheme"] != "ppl" || row["neighbors"] == "oracle");
        document["not_audited"] =
            json!([{ "scheme": "ppl", "neighbors": "geometric", "reason": "no lists" }]);
    });
    let (text, _) = place.ends("compare a/audit.json source.json", 1);
    assert!(text.contains("OUT OF VIEW: ppl by geometric: not audited: no lists\n"), "{text}");
    // Other ratios were tried of a scheme that is there: told, and no failure.
    changed(&place, "ratios.json", |document| {
        rows(document).retain(|row| row["inlier_ratio"] != 1.0);
    });
    let (text, _) = place.ends("compare a/audit.json ratios.json", 0);
    assert!(text.contains("only in the old audit: olc: oracle, 100 % true neighbors"), "{text}");
    let (text, _) = place.ends("compare ratios.json a/audit.json", 0);
    assert!(text.contains("only in the new audit: olc: oracle, 100 % true neighbors"), "{text}");
    // A baseline that was left out (`--no-records-alone`).
    changed(&place, "blind.json", |document| {
        for row in rows(document).iter_mut().filter(|row| row["scheme"] == "olc") {
            let row = row.as_object_mut().unwrap();
            row.remove("records_alone_percent");
            row.remove("records_alone_by");
        }
    });
    let (text, _) = place.ends("compare a/audit.json blind.json", 0);
    assert!(text.starts_with("only in the old audit: olc: records alone\n18 figures"), "{text}");
    let (text, _) = place.ends("compare blind.json a/audit.json", 0);
    assert!(text.starts_with("only in the new audit: olc: records alone\n18 figures"), "{text}");
    // A measured ratio is a result: the attack is the same.
    changed(&place, "measured.json", |document| {
        for row in rows(document).iter_mut().filter(|row| row["neighbors"] == "geometric") {
            row["inlier_ratio"] = json!(0.987);
        }
    });
    let (text, _) = place.ends("compare a/audit.json measured.json", 0);
    assert!(text.starts_with("20 figures compared"), "{text}");
}

#[test]
fn other_units_thresholds_or_attacks_are_refused() {
    let place = audited();
    let refused = |new: &str| {
        let (stdout, stderr) = place.ends(&format!("compare a/audit.json {new} --out c"), 3);
        assert!(stdout.is_empty() && !place.path("c").exists());
        stderr.trim_end().to_owned()
    };
    place.ends("audit map room.csv --k 10 --schemes olc --inlier-ratios 1 --quiet --out u", 0);
    assert_eq!(
        refused("u/audit.json"),
        "unlift: u/audit.json: unit: expected m, as in a/audit.json, found kth_neighbor"
    );
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc --inlier-ratios 1 --quiet";
    place.ends(&format!("{audit} --thresholds 0.10 --out t"), 0);
    assert_eq!(
        refused("t/audit.json"),
        "unlift: t/audit.json: thresholds: expected 0.10, 0.25, as in a/audit.json, found 0.10"
    );
    // The same numbers, typed otherwise, are the same.
    place.ends(&format!("{audit} --thresholds 0.1,0.250 --out n"), 0);
    place.ends("compare n/audit.json a/audit.json", 0);
    changed(&place, "k.json", |document| {
        rows(document).iter_mut().for_each(|row| row["k"] = json!(11));
    });
    assert_eq!(
        refused("k.json"),
        "unlift: k.json: results: expected an attack of the same scheme, source, ratio, k and solver, as in \
         a/audit.json, found none among 6"
    );
    let (_, stderr) = place.ends("compare a/audit.json a/audit.json --tolerance -1", 2);
    assert!(
        stderr.contains("expected a number of percentage points from 0 to 100, found -1"),
        "{stderr}"
    );
}

#[test]
fn a_comparison_of_share_safe_audits_names_nothing() {
    let place = Place::with_room(300);
    let audit = "audit map room.csv --k 10 --schemes olc --inlier-ratios 1 --quiet --share-safe";
    place.ends(&format!("{audit} --out s"), 0);
    place.ends("compare s/audit.json s/audit.json --out c", 0);
    let page = fs::read_to_string(place.path("c/compare.html")).unwrap();
    assert!(page.contains("Figures only.") && !page.contains("room"), "{page}");
}
