//! `unlift table`: formats the results of audit.json for papers.

use serde_json::Value;

use crate::common::Place;

/// Creates a folder with an audit in `a`, and returns its results.
fn audited(more: &str) -> (Place, Value) {
    let place = Place::with_room(500);
    let audit = "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 1,0.5 --quiet --out a";
    place.ends(&format!("{audit} {more}"), 0);
    let document = place.json("a/audit.json");
    (place, document)
}

/// Returns the largest share of `scheme` within `typed` by the oracle at `ratio`, as tables print
/// it.
fn largest(document: &Value, scheme: &str, ratio: f64, typed: &str) -> String {
    let rows = document["results"].as_array().unwrap().iter();
    let of = rows.filter(|row| {
        row["scheme"] == scheme && row["neighbors"] == "oracle" && row["inlier_ratio"] == ratio
    });
    let share = of.filter_map(|row| row["recovered_percent"][typed].as_f64()).fold(0.0, f64::max);
    format!("{share:.1}")
}

#[test]
fn tables_have_every_row_or_the_strongest_attack_of_every_scheme() {
    let (place, document) = audited("--neighbors oracle --neighbors geometric");
    let table = |more: &str| place.ends(&format!("table a/audit.json --format {more}"), 0).0;
    let csv = table("csv");
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
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
    let heads = table("csv --threshold 0.1");
    let heads = heads.lines().next().unwrap();
    assert!(heads.contains("recovered_percent_within_0.10,recovered_std_within_0.10"), "{heads}");
    assert!(!heads.contains("0.25"), "{heads}");

    let cell = |scheme: &str, ratio: f64| {
        let of = |typed| largest(&document, scheme, ratio, typed);
        format!("{} / {}", of("0.10"), of("0.25"))
    };
    let text = table("markdown");
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
    assert_eq!(lines.len(), 4, "{text}");
    assert_eq!(lines[0], "| scheme | 1.0 | 0.5 | geometric | blind | records alone |");
    assert_eq!(lines[1], "| --- | ---: | ---: | ---: | ---: | ---: |");
    let olc = format!("| olc | {} | {} | ", cell("olc", 1.0), cell("olc", 0.5));
    assert!(lines[2].starts_with(&olc), "{olc}\n{text}");
    assert!(text.contains("recovered within 10 cm / 25 cm"), "{text}");

    let text = table("latex --threshold 0.25");
    for part in
        ["\\begin{tabular}{lrrrrr}\n\\toprule\n", "\\midrule\n", "\\bottomrule\n\\end{tabular}\n"]
    {
        assert_eq!(text.matches(part).count(), 1, "{part}\n{text}");
    }
    let [all, half] = [1.0, 0.5].map(|ratio| largest(&document, "ppl", ratio, "0.25"));
    assert!(text.contains(&format!("ppl & {all} & {half} & ")), "{text}");
    let mut body = text.lines().filter(|line| !line.starts_with('%'));
    assert!(body.all(|line| !line.contains('%')), "nothing is commented out:\n{text}");
}

#[test]
fn what_was_not_audited_is_a_row_that_says_so() {
    let place = Place::empty();
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
    let svg = place.text("c.svg");
    assert!(svg.contains("<title>points recovered within 25 cm, %</title>"), "{svg}");
    // A curve per scheme and noise, and a mark per ratio.
    assert_eq!((svg.matches("<polyline").count(), svg.matches("<circle").count()), (4, 8));
    // The share at ratio 1, at the right edge: 346 is 0 %, 34 is 100 %.
    let share: f64 = largest(&document, "olc", 1.0, "0.25").parse().unwrap();
    let mut shares = svg.split("<circle cx=\"470.0\" cy=\"").skip(1).map(|mark| {
        let y: f64 = mark.split('"').next().unwrap().parse().unwrap();
        (346.0 - y) / 3.12
    });
    assert!(shares.any(|found| (found - share).abs() < 0.1), "{share}");
    assert!(!svg.contains("script") && !svg.contains("http://www.w3.org/1999"), "{svg}");
}

#[test]
fn files_replace_their_own_kind_and_what_cannot_be_done_is_one_line() {
    let (place, _) = audited("");
    for format in ["csv", "latex", "markdown", "csv"] {
        place.ends(&format!("table a/audit.json --format {format} --out t --curves c.svg"), 0);
    }
    place.write("old.json", r#"{"unlift": "0", "schema": 9}"#);
    place.ends("audit map room.csv --k 10 --schemes olc --neighbors geometric --quiet --out g", 0);
    for (line, code, expected) in [
        (
            "a/audit.json --out room.csv",
            2,
            "--out: room.csv: expected nothing, or a table of an earlier run (else --force), found another file",
        ),
        (
            "a/audit.json --out a/audit.json --force",
            2,
            "--out: a/audit.json: expected a file that is not read, found the input a/audit.json",
        ),
        (
            "a/audit.json --threshold 0.3",
            2,
            "--threshold: expected one of 0.10, 0.25, as in the audit, found 0.3",
        ),
        (
            "a/audit.json --out x --curves ./x",
            2,
            "--curves: ./x: expected a file of its own, found that of --out",
        ),
        ("old.json", 3, "old.json: expected schema 1, found 9"),
        (
            "g/audit.json --curves g.svg",
            2,
            "--curves: expected an audit with rows by the oracle, found none",
        ),
    ] {
        let told = place.complains(&format!("table {line} --format csv"), code);
        assert_eq!(told.lines().next(), Some(&*format!("unlift: {expected}")));
    }
    assert!(!place.path("g.svg").exists());
}
