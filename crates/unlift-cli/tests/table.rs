//! `unlift table`: the figures of audit.json and no others, set for papers.

mod common;

use std::fs;

use common::Place;
use serde_json::Value;

/// A folder with an audit in `a`, and its figures.
fn audited(more: &str) -> (Place, Value) {
    let place = Place::with_room(500);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 1,0.5 --quiet --out a";
    place.ends(&format!("{audit} {more}"), 0);
    let text = fs::read_to_string(place.path("a/audit.json")).unwrap();
    (place, serde_json::from_str(&text).unwrap())
}

/// The largest share of `scheme` within `typed` from the oracle at `ratio`, as tables say it.
fn largest(document: &Value, scheme: &str, ratio: f64, typed: &str) -> String {
    let rows = document["results"].as_array().unwrap().iter();
    let of = rows.filter(|row| {
        row["scheme"] == scheme && row["neighbors"] == "oracle" && row["inlier_ratio"] == ratio
    });
    let share = of.filter_map(|row| row["recovered_percent"][typed].as_f64()).fold(0.0, f64::max);
    format!("{share:.1}")
}

#[test]
fn csv_has_every_row_and_every_digit() {
    let (place, document) = audited("--neighbors oracle --neighbors geometric");
    let (text, stderr) = place.ends("table a/audit.json --format csv", 0);
    assert!(stderr.is_empty(), "{stderr}");
    let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let rows = document["results"].as_array().unwrap();
    assert_eq!(lines.len(), 1 + rows.len());
    let column = |name: &str| lines[0].iter().position(|head| *head == name).expect(name);
    for (line, row) in lines[1..].iter().zip(rows) {
        assert_eq!(line.len(), lines[0].len());
        for (name, value) in [
            ("scheme", &row["scheme"]),
            ("oracle_noise", &row["oracle_noise"]),
            ("inlier_ratio", &row["inlier_ratio"]),
            ("unit", &row["unit"]),
            ("recovered_percent_within_0.10", &row["recovered_percent"]["0.10"]),
            ("recovered_percent_within_0.25", &row["recovered_percent"]["0.25"]),
            ("blind_percent_within_0.10", &row["blind_percent"]["0.10"]),
            ("records_alone_percent_within_0.25", &row["records_alone_percent"]["0.25"]),
            ("median_error", &row["median_error"]),
            ("error_percentile_90", &row["error_percentiles"]["90"]),
            ("axis_accuracy_percent", &Value::Null),
        ] {
            let cell = line[column(name)];
            match value {
                Value::String(text) => assert_eq!(cell, text, "{name}"),
                Value::Number(number) => {
                    assert_eq!(cell.parse::<f64>().ok(), number.as_f64(), "{name}");
                }
                _ => assert_eq!(cell, "", "{name}"),
            }
        }
    }
    let (one, _) = place.ends("table a/audit.json --format csv --threshold 0.1", 0);
    let heads = one.lines().next().unwrap();
    assert!(heads.contains("recovered_percent_within_0.10,recovered_std_within_0.10"), "{heads}");
    assert!(!heads.contains("0.25"), "{heads}");
}

#[test]
fn markdown_and_latex_have_the_strongest_attack_of_every_scheme() {
    let (place, document) = audited("--neighbors oracle --neighbors geometric");
    let cell = |scheme: &str, ratio: f64| {
        let of = |typed| largest(&document, scheme, ratio, typed);
        format!("{} / {}", of("0.10"), of("0.25"))
    };
    let (text, _) = place.ends("table a/audit.json --format markdown", 0);
    let table: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
    assert_eq!(table.len(), 4, "{text}");
    assert_eq!(table[0], "| scheme | 1.0 | 0.5 | geometric | blind | records alone |");
    assert_eq!(table[1], "| --- | ---: | ---: | ---: | ---: | ---: |");
    let olc = format!("| olc | {} | {} | ", cell("olc", 1.0), cell("olc", 0.5));
    assert!(table[2].starts_with(&olc), "{olc}\n{text}");
    assert!(text.contains("recovered within 10 cm / 25 cm"), "{text}");

    let (text, _) = place.ends("table a/audit.json --format latex --threshold 0.25", 0);
    for part in
        ["\\begin{tabular}{lrrrrr}\n\\toprule\n", "\\midrule\n", "\\bottomrule\n\\end{tabular}\n"]
    {
        assert_eq!(text.matches(part).count(), 1, "{part}\n{text}");
    }
    let ppl = format!(
        "ppl & {} & {} & ",
        largest(&document, "ppl", 1.0, "0.25"),
        largest(&document, "ppl", 0.5, "0.25")
    );
    assert!(text.contains(&ppl), "{ppl}\n{text}");
    let body = text.lines().filter(|line| !line.starts_with('%'));
    assert!(body.clone().all(|line| !line.contains('%')), "nothing is commented out:\n{text}");
}

#[test]
fn what_was_not_audited_is_a_row_that_says_so() {
    let place = Place::with_room(10);
    let spread = |i: usize| [((i * 7919) % 1000) as f64, ((i * 104_729) % 997) as f64, 1.0];
    place.write_points("flat.csv", &(0..400).map(spread).collect::<Vec<_>>());
    let audit =
        "audit map flat.csv --schemes olc,ppl+ --inlier-ratios 1 --no-records-alone --quiet";
    place.ends(&format!("{audit} --out a"), 0);
    let (text, stderr) = place.ends("table a/audit.json --format markdown", 0);
    assert!(text.ends_with("\n| ppl+ | not audited | not audited |\n"), "{text}");
    assert!(stderr.starts_with("unlift: note: not audited: ppl+: k: expected"), "{stderr}");
    let (csv, stderr) = place.ends("table a/audit.json --format csv", 0);
    assert!(!csv.contains("ppl+") && stderr.contains("not audited: ppl+"), "{stderr}");
}

#[test]
fn curves_are_a_drawing_of_every_scheme() {
    let (place, document) = audited("--oracle-noise uniform,near");
    place.ends("table a/audit.json --format csv --out t.csv --curves c.svg --threshold 0.25", 0);
    let svg = fs::read_to_string(place.path("c.svg")).unwrap();
    assert!(svg.contains("<title>points recovered within 25 cm, %</title>"), "{svg}");
    // A curve per scheme and noise, a mark per ratio of each.
    assert_eq!((svg.matches("<polyline").count(), svg.matches("<circle").count()), (4, 8));
    // The share at ratio 1, the right edge: 346 is 0 %, 34 is 100 %.
    let share: f64 = largest(&document, "olc", 1.0, "0.25").parse().unwrap();
    let marks = svg.split("<circle cx=\"470.0\" cy=\"").skip(1);
    let shares = marks.map(|mark| {
        let y: f64 = mark.split('"').next().unwrap().parse().unwrap();
        (346.0 - y) / 3.12
    });
    assert!(shares.clone().any(|found| (found - share).abs() < 0.1), "{share}");
    assert!(!svg.contains("script") && !svg.contains("http://www.w3.org/1999"), "{svg}");
}

#[test]
fn files_replace_their_own_kind_and_what_cannot_be_done_is_one_line() {
    let (place, _) = audited("");
    let line = |more: &str, code| {
        let (stdout, stderr) = place.ends(&format!("table {more}"), code);
        assert!(stdout.is_empty(), "{stdout}");
        stderr.lines().next().unwrap_or_default().to_owned()
    };
    for format in ["csv", "latex", "markdown", "csv"] {
        line(&format!("a/audit.json --format {format} --out t --curves c.svg"), 0);
    }
    assert_eq!(
        line("a/audit.json --format csv --out room.csv", 2),
        "unlift: --out: room.csv: expected nothing, or a table of an earlier run (else --force), found another file"
    );
    let input = line("a/audit.json --format csv --out a/audit.json --force", 2);
    assert!(input.contains("expected a file that is not read, found the input"), "{input}");
    assert_eq!(
        line("a/audit.json --format csv --threshold 0.3", 2),
        "unlift: --threshold: expected one of 0.10, 0.25, as in the audit, found 0.3"
    );
    assert_eq!(
        line("a/audit.json --format csv --out x --curves ./x", 2),
        "unlift: --curves: ./x: expected a file of its own, found that of --out"
    );
    fs::write(place.path("old.json"), r#"{"unlift": "0", "schema": 9}"#).unwrap();
    assert_eq!(line("old.json --format csv", 3), "unlift: old.json: expected schema 1, found 9");
    place.ends("audit map room.csv --k 10 --schemes olc --neighbors geometric --quiet --out g", 0);
    let none = line("g/audit.json --format csv --curves g.svg", 2);
    assert_eq!(none, "unlift: --curves: expected an audit with rows by the oracle, found none");
    assert!(!place.path("g.svg").exists());
}
