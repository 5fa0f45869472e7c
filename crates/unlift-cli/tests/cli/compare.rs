//! `unlift compare`: leaks, missing counterparts, and audits that cannot be compared.

use serde_json::{Value, json};

use crate::common::Place;

fn audited() -> Place {
    let place = Place::with_room(500);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 1,0.5 --neighbors \
                 oracle --neighbors geometric --solver joint --quiet --out a";
    place.ends(audit, 0);
    place
}

/// Writes a changed copy of the audit as `name`.
fn change(place: &Place, name: &str, change: impl FnOnce(&mut Value)) {
    let mut document = place.json("a/audit.json");
    document["run"]["seconds"]["rows"] = json!([]);
    change(&mut document);
    place.write(name, document.to_string());
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
fn what_leaks_more_than_the_tolerance_fails() {
    let place = audited();
    change(&place, "old.json", |document| set_share(document, 40.0));
    change(&place, "new.json", |document| set_share(document, 41.5));
    change(&place, "repeated.json", |document| {
        set_share(document, 41.5);
        rows(document)[0]["std"] = json!({ "recovered_percent": { "0.10": 0.3, "0.25": 0.601 } });
    });
    let (text, _) = place.ends("compare old.json new.json --tolerance 1 --out c", 1);
    let lines: Vec<&str> = text.lines().collect();
    let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(words(lines[0]), "scheme attack within old new points");
    let more = "olc oracle, 50 % true neighbors, K = 10, joint 0.10 40.0 % 41.5 % +1.5 leaks more";
    assert_eq!(words(lines[1]), more);
    assert_eq!(lines.last(), Some(&"page: c/compare.html"));
    let page = place.text("c/compare.html");
    assert!(page.contains("FAIL") && page.contains("<td>41.5</td><td>+1.5</td>"), "{page}");
    assert!(page.contains("Private.") && page.contains("room.csv"), "it names the map");
    let alone = ["<script", "src=", "https:"].iter().all(|load| !page.contains(load));
    assert!(alone, "it loads nothing");

    // Six attacks and two baselines of two schemes, within two thresholds.
    for (files, tolerance, code, expected) in [
        (
            "a/audit.json a/audit.json",
            "--tolerance 0",
            0,
            "tolerance 0 points: 0 leak more, 0 less, 20 as before\n",
        ),
        (
            "old.json new.json",
            "--tolerance 1",
            1,
            "tolerance 1 point: 1 leak more, 0 less, 19 as before\n",
        ),
        ("old.json new.json", "--tolerance 1.5", 0, "0 leak more, 0 less"),
        ("new.json old.json", "--tolerance 1", 0, "-1.5  leaks less"),
        // Seeds differ by a point or two.
        ("old.json new.json", "", 0, "tolerance 2 points (usual without repeats): 0 leak more"),
        (
            "old.json repeated.json",
            "",
            1,
            "tolerance 1.21 points (twice the spread of repeats): 1 leak more",
        ),
    ] {
        let (text, _) = place.ends(&format!("compare {files} {tolerance}"), code);
        assert!(text.contains(expected) && text.contains("20 figures compared"), "{text}");
    }
    // The page of an earlier comparison is replaced, another file is not.
    place.ends("compare new.json old.json --out c", 0);
    place.write("c/compare.html", "mine");
    let told = place.complains("compare new.json old.json --out c", 2);
    let expected = "unlift: --out: c/compare.html: expected nothing, or a report";
    assert!(told.starts_with(expected), "{told}");
    let audit = "audit map room.csv --k 10 --schemes olc --inlier-ratios 1 --quiet --share-safe";
    place.ends(&format!("{audit} --out s"), 0);
    place.ends("compare s/audit.json s/audit.json --out d", 0);
    let page = place.text("d/compare.html");
    assert!(page.contains("Figures only.") && !page.contains("room"), "{page}");
}

#[test]
fn a_baseline_leaks_as_well() {
    let place = audited();
    change(&place, "old.json", |document| {
        for row in rows(document).iter_mut().filter(|row| row["scheme"] == "ppl") {
            row["records_alone_percent"]["0.25"] = json!(0.0);
        }
    });
    let compared = place.prints("compare old.json a/audit.json --json", 1);
    let more = compared["more"].as_array().unwrap();
    assert_eq!(more.len(), 1, "{compared}");
    assert_eq!((&more[0]["scheme"], &more[0]["attack"]), (&json!("ppl"), &json!("records alone")));
    assert_eq!((&more[0]["threshold"], &compared["passed"]), (&json!("0.25"), &json!(false)));
}

#[test]
fn what_is_out_of_view_fails_and_what_only_one_has_is_told() {
    let place = audited();
    let without_ppl = |document: &mut Value| rows(document).retain(|row| row["scheme"] != "ppl");
    change(&place, "gone.json", |document| {
        without_ppl(document);
        document["break_even"] = json!([]);
    });
    change(&place, "flat.json", |document| {
        without_ppl(document);
        document["not_audited"] = json!([{ "scheme": "ppl", "reason": "flat" }]);
    });
    // A source that the later audit lacks.
    change(&place, "source.json", |document| {
        rows(document).retain(|row| row["scheme"] != "ppl" || row["neighbors"] == "oracle");
        document["not_audited"] =
            json!([{ "scheme": "ppl", "neighbors": "geometric", "reason": "no lists" }]);
    });
    // Other ratios of a scheme are listed, and are no failure.
    change(&place, "ratios.json", |document| {
        rows(document).retain(|row| row["inlier_ratio"] != 1.0);
    });
    // A baseline that was left out (`--no-records-alone`).
    change(&place, "blind.json", |document| {
        for row in rows(document).iter_mut().filter(|row| row["scheme"] == "olc") {
            let row = row.as_object_mut().unwrap();
            row.remove("records_alone_percent");
            row.remove("records_alone_by");
        }
    });
    // A measured ratio is a result and does not identify the attack.
    change(&place, "measured.json", |document| {
        for row in rows(document).iter_mut().filter(|row| row["neighbors"] == "geometric") {
            row["inlier_ratio"] = json!(0.987);
        }
    });
    for (old, new, code, expected) in [
        ("a/audit", "gone", 1, "OUT OF VIEW: ppl: no row in the new audit\n"),
        (
            "a/audit",
            "gone",
            1,
            "only in the old audit: ppl: oracle, 50 % true neighbors, K = 10, joint\n",
        ),
        ("a/audit", "flat", 1, "OUT OF VIEW: ppl: not audited: flat\n"),
        ("a/audit", "source", 1, "OUT OF VIEW: ppl by geometric: not audited: no lists\n"),
        ("a/audit", "ratios", 0, "only in the old audit: olc: oracle, 100 % true neighbors"),
        ("ratios", "a/audit", 0, "only in the new audit: olc: oracle, 100 % true neighbors"),
        ("a/audit", "blind", 0, "only in the old audit: olc: records alone\n18 figures"),
        ("blind", "a/audit", 0, "only in the new audit: olc: records alone\n18 figures"),
        ("a/audit", "measured", 0, "20 figures compared"),
    ] {
        let (text, _) = place.ends(&format!("compare {old}.json {new}.json"), code);
        assert!(text.contains(expected), "{old} {new}: {text}");
    }
}

#[test]
fn other_units_thresholds_or_attacks_are_refused() {
    let place = audited();
    place.ends("audit map room.csv --k 10 --schemes olc --inlier-ratios 1 --quiet --out u", 0);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc --inlier-ratios 1 --quiet";
    place.ends(&format!("{audit} --thresholds 0.10 --out t"), 0);
    // The same thresholds in another spelling can be compared.
    place.ends(&format!("{audit} --thresholds 0.1,0.250 --out n"), 0);
    place.ends("compare n/audit.json a/audit.json", 0);
    change(&place, "k.json", |document| {
        rows(document).iter_mut().for_each(|row| row["k"] = json!(11));
    });
    for (new, code, expected) in [
        (
            "u/audit.json",
            3,
            "u/audit.json: unit: expected m, as in a/audit.json, found kth_neighbor",
        ),
        (
            "t/audit.json",
            3,
            "t/audit.json: thresholds: expected 0.10, 0.25, as in a/audit.json, found 0.10",
        ),
        (
            "k.json",
            3,
            "k.json: results: expected an attack of the same scheme, source, ratio, k and solver, as in \
             a/audit.json, found none among 6",
        ),
        (
            "a/audit.json --tolerance -1",
            2,
            "expected a number of percentage points from 0 to 100, found -1",
        ),
    ] {
        let told = place.complains(&format!("compare a/audit.json {new} --out c"), code);
        assert!(told.contains(expected) && !place.path("c").exists(), "{told}");
    }
}
