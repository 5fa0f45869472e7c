//! `unlift table`: the results of audit.json as CSV and LaTeX.

use crate::common::{Place, recovered, rows};

#[test]
#[rustfmt::skip] // One row per line.
fn the_ending_decides_what_is_written() {
    let place = Place::with_room(500);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 1,0.5";
    place.ends(&format!("{audit} --neighbors oracle --neighbors geometric --out a"), 0);
    let document = place.json("a/audit.json");
    let written = |name: &str, more: &str| {
        place.ends(&format!("table a/audit.json --out {name} {more}"), 0);
        place.text(name)
    };
    let tex = written("t.tex", "");
    assert!(tex.contains("scheme & 1.0 & 0.5 & geometric & blind & records alone \\\\\n"), "{tex}");
    assert!(tex.contains(" / "), "{tex}");
    // A table of unlift is replaced.
    let tex = written("t.tex", "--thresholds 0.25");
    for scheme in ["olc", "ppl"] {
        // The solver that recovers most counts.
        let [all, half] = [1.0, 0.5].map(|ratio| {
            let of = rows(&document).iter().filter(|row| {
                row["scheme"] == scheme && row["neighbors"] == "oracle" && row["inlier_ratio"] == ratio
            });
            of.map(|row| recovered(row, "0.25")).fold(0.0, f64::max)
        });
        assert!(tex.contains(&format!("\n{scheme} & {all:.1} & {half:.1} & ")), "{tex}");
    }
    let csv = written("t.csv", "--thresholds 0.1");
    assert_eq!(csv.lines().count(), 1 + rows(&document).len());
    assert!(csv.contains("recovered_percent_within_0.10") && !csv.contains("_0.25"), "{csv}");
    let (text, _) = place.ends("table a/audit.json", 0);
    assert_eq!(text, written("t.csv", ""));

    place.write("old.json", r#"{"unlift": "0", "schema": 9}"#);
    place.write("mine.csv", "mine");
    place.refuses("table", &[
        ("a/audit.json --out mine.csv", 2, "unlift: --out: mine.csv: expected nothing, or a table of an earlier run"),
        ("a/audit.json --out t.pdf", 2, "unlift: --out: expected a name that ends in .csv or .tex, found t.pdf"),
        ("a/audit.json --thresholds 0.3", 2, "unlift: --thresholds: expected one of 0.10, 0.25, as in the audit, found 0.3"),
        ("old.json", 3, "unlift: old.json: expected schema 1, found 9"),
    ]);
}
