//! `unlift table`: the results of audit.json as CSV, LaTeX, Markdown and curves.

use crate::common::{Place, recovered, rows};

#[test]
#[rustfmt::skip] // One row per line.
fn the_ending_decides_what_is_written() {
    let place = Place::with_room(500);
    let audit =
        "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 1,0.5 --quiet";
    place.ends(&format!("{audit} --neighbors oracle --neighbors geometric --out a"), 0);
    let document = place.json("a/audit.json");
    let largest = |scheme: &str, ratio: f64, typed: &str| {
        let of = rows(&document).iter().filter(|row| {
            row["scheme"] == scheme && row["neighbors"] == "oracle" && row["inlier_ratio"] == ratio
        });
        format!("{:.1}", of.map(|row| recovered(row, typed)).fold(0.0, f64::max))
    };
    let (text, _) = place.ends("table a/audit.json", 0);
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
    assert_eq!(lines[0], "| scheme | 1.0 | 0.5 | geometric | blind | records alone |");
    let cell =
        |ratio| format!("{} / {}", largest("olc", ratio, "0.10"), largest("olc", ratio, "0.25"));
    assert!(lines[2].starts_with(&format!("| olc | {} | {} | ", cell(1.0), cell(0.5))), "{text}");

    let written = |name: &str, more: &str| {
        // A table of unlift is replaced.
        for _ in 0..2 {
            place.ends(&format!("table a/audit.json --out {name} {more}"), 0);
        }
        place.text(name)
    };
    assert_eq!(written("t.md", ""), text);
    let csv = written("t.csv", "--thresholds 0.1");
    assert_eq!(csv.lines().count(), 1 + rows(&document).len());
    assert!(csv.contains("recovered_percent_within_0.10") && !csv.contains("_0.25"), "{csv}");
    let tex = written("t.tex", "--thresholds 0.25");
    let [all, half] = [1.0, 0.5].map(|ratio| largest("ppl", ratio, "0.25"));
    assert!(tex.contains(&format!("ppl & {all} & {half} & ")), "{tex}");
    assert!(tex.contains("\\toprule"), "{tex}");
    let svg = written("c.svg", "--thresholds 0.25");
    assert!(svg.contains("<title>points recovered within 25 cm, %</title>"), "{svg}");
    assert_eq!((svg.matches("<polyline").count(), svg.matches("<circle").count()), (2, 4));

    place.write("old.json", r#"{"unlift": "0", "schema": 9}"#);
    place.write("mine.csv", "mine");
    let geometric = audit.replace("--inlier-ratios 1,0.5", "--neighbors geometric");
    place.ends(&format!("{geometric} --out g"), 0);
    place.refuses("table", &[
        ("a/audit.json --out mine.csv", 2, "unlift: --out: mine.csv: expected nothing, or a table of an earlier run"),
        ("a/audit.json --out t.pdf", 2, "unlift: --out: expected a name that ends in .md, .tex, .csv or .svg, found t.pdf"),
        ("a/audit.json --thresholds 0.3", 2, "unlift: --thresholds: expected one of 0.10, 0.25, as in the audit, found 0.3"),
        ("old.json", 3, "unlift: old.json: expected schema 1, found 9"),
        ("g/audit.json --out g.svg", 2, "unlift: --out: expected an audit with rows by the oracle, for curves, found none"),
    ]);
}
