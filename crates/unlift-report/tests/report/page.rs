//! Tests of the page as text: numbers without script, escaping, and share-safe pages.

use sha2::{Digest, Sha256};
use unlift_report::document::{Document, Intervals, NotAudited, Row, Spread};
use unlift_report::{RenderOptions, Scene3d, render, text_table};

use crate::sample;

/// Returns the page of an audit, to keep or to share.
pub fn page(document: &Document, scene: Option<&Scene3d>, share_safe: bool) -> String {
    let options = RenderOptions { share_safe, scene: scene.cloned(), ..RenderOptions::default() };
    render(document, &options).expect("a page")
}

/// Removes all parts from `open` to `close`.
fn without(mut text: String, open: &str, close: &str) -> String {
    while let Some(start) = text.find(open) {
        let end = start + text[start..].find(close).expect("it ends") + close.len();
        text.replace_range(start..end, "");
    }
    text
}

/// Returns the page without scripts and styles, as a browser without script shows it.
fn without_script(page: &str) -> String {
    without(without(page.to_owned(), "<script", "</script>"), "<style", "</style>")
}

/// Returns the text without tags and with single spaces.
fn plain(markup: &str) -> String {
    let texts = markup.split('<').map(|part| part.split_once('>').map_or(part, |(_, text)| text));
    texts.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ")
}

/// Returns the page as text without scripts, tags and tooltips.
fn said(document: &Document) -> String {
    let text = without_script(&page(document, None, false));
    let text = without(text, "<span class=\"tip\"", "</span>");
    // Marks the start of the verdict and cuts the table of contents.
    let text = text.replace("<section class=\"part", "VERDICT <section class=\"part");
    let (contents, rest) = text.split_once("</nav>").expect("contents");
    plain(&format!("{}{rest}", contents.split("<nav").next().unwrap_or_default()))
}

/// Returns the verdict section of a page, without tags.
fn verdict(document: &Document) -> String {
    let text = said(document);
    let from = text.find("VERDICT ").expect("a verdict") + "VERDICT ".len();
    text[from..text.find(" What to do next ").expect("what to do next")].to_owned()
}

#[test]
fn the_verdict_names_the_strongest_attack_of_every_scheme() {
    let of_lists = [
        "Do not release this map under olc, ray and ray-voxel. Not tried: attacks by descriptors and the strongest solver (--solver joint). The least leak of these, 20.8 % \
         (ray-voxel), is a fifth or more of the points. Nothing is decided about cp, ppl, ppl+ and plane, as the best attack by descriptors was not tried. \
         The rays of ray and ray-voxel show the scene from two published centers, without any attack. The strongest attack tried recovers 58.6 % of the points of this map within \
         10 cm today, from the released data alone (olc, records alone). If half of the neighbors were known, every scheme \
         tried would give back 83.3 % or more.",
        "olc Random lines Today, from the released data alone 58.6 % records alone (tomography) If half of the \
         neighbors were known 92.3 % known neighbors, 50 % right, solver consensus A blind guess recovers \
         1.9 %, the released records alone 58.6 %. Lists of neighbors add 33.7 percentage points (known neighbors). Half \
         of the points come back when 10 % of the neighbors are right, and perhaps when fewer are.",
        "plane Axis-aligned planes Today, from the released data alone Not tried on this scheme, so the \
         result is unknown. If half of the neighbors were known 83.7 %",
    ];
    let of_own_lists = [
        "olc Random lines",
        "41.0 % neighbors by descriptor overlap, 35 listed, 8.2 % of them right, solver consensus",
        "A blind guess recovers 1.2 %, the released records alone 7.3 %. Lists of neighbors add 33.7 percentage points \
         (by descriptor overlap), nothing (by record geometry) and 81.8 percentage points (known neighbors).",
        "plane Axis-aligned planes",
        "Not tried with neighbors by record geometry: planes say nothing of where points are.",
    ];
    // A blind guess that recovers more than every attack leads the verdict.
    let of_guess = ["(plane, a blind guess)", "96.0 % a blind guess"];
    let mut guessed = sample::document(true);
    sample::change(&mut guessed, "plane", |row| {
        row.blind_percent.values_mut().for_each(|percent| *percent = 96.0);
    });
    for (document, in_order) in [
        (sample::document(true), &of_lists[..]),
        (sample::mixed(true), &of_own_lists),
        (guessed, &of_guess),
    ] {
        let text = verdict(&document);
        let places: Vec<_> = in_order.iter().map(|sentence| text.find(sentence)).collect();
        assert!(places.iter().all(Option::is_some), "{places:?}\n{text}");
        assert!(places.is_sorted(), "{places:?}\n{text}");
    }
}

fn publish_bearings(row: &mut Row) {
    row.metrics.insert("real_bearings_percent".to_owned(), 33.3);
}

#[test]
fn published_bearings_lead_the_verdict_and_never_count_as_the_least_leak() {
    let mut document = sample::document(true);
    sample::change(&mut document, "ppl+", publish_bearings);
    assert!(verdict(&document).contains("ray-voxel. ppl+ publishes bearings: whoever stands"));
    let mut document = sample::mixed(true);
    sample::by_best(&mut document, "overlap");
    sample::change(&mut document, "ppl+", |row| {
        let alone = row.records_alone_percent.iter_mut().flat_map(|percent| percent.values_mut());
        row.recovered_percent.values_mut().chain(alone).for_each(|percent| *percent = 1.0);
    });
    assert!(said(&document).contains("ppl+ leaks least"));
    sample::change(&mut document, "ppl+", publish_bearings);
    assert!(!said(&document).contains("ppl+ leaks least"));
}

#[test]
fn terminal_and_page_say_the_same_numbers() {
    for document in [sample::document(true), sample::mixed(true), sample::images()] {
        let (page, text) = (said(&document), text_table(&document));
        let lines: Vec<&str> = text.lines().take(2).collect();
        assert!(page.contains(lines[0]) && page.contains(lines[1]), "{lines:?}");
        for shares in unlift_report::shares(&document, &[]) {
            for share in [shares.today, shares.known].into_iter().flatten() {
                let share = format!("{share:.1} %");
                assert!(page.contains(&share) && text.contains(&share), "{share}\n{text}");
            }
        }
    }
}

#[test]
fn what_could_not_be_audited_is_said_and_never_reads_as_little() {
    let mut document = sample::document(true);
    sample::retain(&mut document, |scheme| scheme != "ppl+");
    let reason = "k: expected between 1 and 8, found 50";
    document.not_audited =
        serde_json::from_value(serde_json::json!([{"scheme": "ppl+", "reason": reason}])).unwrap();
    let text = verdict(&document);
    assert!(text.contains("Not audited, so nothing is known: ppl+."), "{text}");
    assert!(
        text.contains(&format!("ppl+ Paired-point lines, plane-aware Not audited : {reason}")),
        "{text}"
    );
    let page = without_script(&page(&document, None, true));
    assert!(page.contains("id=\"not-audited\"") && page.matches(reason).count() == 2);
}

#[test]
fn gates_come_first_and_failed_ones_before_the_others() {
    let text = page(&sample::document(true), None, true);
    let (_, body) = text.split_once("<body>").expect("a body");
    let gates = plain(body.split_once("<section id=\"gates\"").expect("gates").1);
    assert!(body.find("id=\"gates\"") < body.find("id=\"verdict\""));
    assert!(gates.contains("1 of 2 gates failed FAIL ppl@0.5:0.10&lt;=20 89.1 % came back"));
    assert!(text.contains("<title>FAIL · "));
    let mut passing = sample::document(true);
    passing.gates.retain(|gate| gate.passed);
    let text = without_script(&page(&passing, None, true));
    assert!(text.contains("The gate passed") && !text.contains("FAIL"));
}

#[test]
fn centimeters_never_appear_without_a_scale() {
    let document = sample::mixed(false);
    let text = without_script(&page(&document, None, false));
    assert!(text.contains("No scale was declared"));
    assert!(text.contains("within 4\u{a0}% of the map&#x27;s longest side today"));
    assert!(text.contains("the median distance from a point to its 50th nearest neighbor"));
    for unit in [" cm", " mm", "neighbor distance", " nd"] {
        assert!(!text.contains(unit), "{unit}");
    }
    assert!(text.contains("within 1×, %") && text.contains("within 2.5×, %"));
}

#[test]
fn the_sampling_error_stands_beside_every_percentage_of_the_verdict() {
    let mut document = sample::mixed(true);
    for row in &mut document.results {
        sample::set(row, 20.2, 1.0);
        let ends = |low: f64, high: f64| {
            row.recovered_percent.keys().map(|typed| (typed.clone(), [low, high])).collect()
        };
        row.interval = Some(Intervals {
            recovered_percent: ends(19.0, 21.4),
            blind_percent: ends(0.8, 1.3),
            ..Intervals::default()
        });
    }
    let text = document.to_json().unwrap();
    let read = Document::from_json(&text).unwrap();
    assert_eq!(read.results[0].interval, document.results[0].interval);
    let page = page(&document, None, false);
    assert!(page.contains("The least leak, 20.2\u{a0}% (19.0 to 21.4, "), "the banner");
    assert!(page.contains(r#"title="95 % interval">19.0 to 21.4</span>"#), "the cards");
    assert!(page.contains(r#"<span class="whisker" style="left: 19.0%"#), "the bars");
    assert!(page.contains("<td>20.2 (19.0 to 21.4)</td>"), "the table");
    assert!(page.contains("<td>1.0 (0.8 to 1.3)</td>"), "the baselines");
    assert!(text_table(&document).contains("20.2 % (19.0 to 21.4) of the points"));
    // A guess that gets a little more has a narrow interval: the attack may still be worse.
    for row in &mut document.results {
        sample::set(row, 0.9, 1.0);
        let intervals = row.interval.as_mut().unwrap();
        intervals.recovered_percent.values_mut().for_each(|ends| *ends = [0.2, 21.4]);
    }
    assert!(text_table(&document).contains("1.0 % (0.8 to 21.4) of the points"));
}

#[test]
fn names_are_escaped_everywhere() {
    let evil = "</script><script>alert(1)</script>";
    let mut document = sample::document(true);
    document.input.path = Some(evil.into());
    document.run.command = Some(evil.into());
    document.options.insert(evil.into(), evil.into());
    document.gates[0].gate = evil.into();
    sample::change(&mut document, "cp", |row| {
        row.scheme = evil.into();
        row.lost = [(evil.to_owned(), row.n_lost)].into();
    });
    let scene = sample::scene(&document, 50);
    let usual = sample::document(true);
    let usual = page(&usual, Some(&sample::scene(&usual, 50)), false);
    let before = usual.matches("<script").count();
    let text = page(&document, Some(&scene), false);
    assert!(!text.contains("alert(1)</script>"));
    assert_eq!(text.matches("<script").count(), before);
}

#[test]
fn the_vendored_bundle_is_the_one_described() {
    let bundle = include_bytes!("../../web/vendor/bundle.min.js");
    let sum: String = Sha256::digest(bundle).iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(
        include_str!("../../web/vendor/VENDOR.md").contains(&sum),
        "bundle.min.js has sha256 {sum}"
    );
}

#[test]
fn a_page_of_images_speaks_of_keypoints_and_pixels() {
    let document = sample::images();
    let options = RenderOptions { pictures: vec![sample::picture()], ..RenderOptions::default() };
    let page = render(&document, &options).expect("a page");
    let text = without_script(&page);
    assert!(text.contains("2 of 4 images. 1 could not be used. 1 had fewer keypoints"));
    let said = verdict(&document);
    let sentence = "The strongest attack tried would recover 79.5 % of the keypoints of these images within 10 px";
    assert!(said.contains(sentence), "{said}");
    assert!(text.contains("<td>94.2</td>") && text.contains("id=\"table-distinct\""));
    assert!(page.contains("\"unit\":\"px\""));
    assert!(page.contains("kitchen/secret.jpg"));
    assert!(text_table(&document).contains("10 px"));

    let options = RenderOptions { share_safe: true, ..options };
    let safe = render(&document, &options).expect("a page");
    assert!(!safe.contains("secret") && !safe.contains("id=\"picture-graph\""));
    let json = document.share_safe().to_json().expect("a document");
    assert!(!json.contains("secret") && json.contains("\"name\": null"));
}

#[test]
fn every_figure_stands_in_a_table_and_what_must_be_known_beside_the_verdict() {
    let mut document = sample::document(true);
    document.notes.push("--max-points: 200 of 400 points are audited <b>".to_owned());
    sample::change(&mut document, "olc", |row| {
        (row.sure_percent, row.sure_correct_percent, row.reliability) = (None, None, None);
        row.sure_unknown = Some("the map is too small".into());
    });
    let text = without_script(&page(&document, None, true));
    for row in &document.results {
        let alone = row.records_alone_percent.iter().flat_map(|map| map.values());
        for value in row.recovered_percent.values().chain(row.blind_percent.values()).chain(alone) {
            assert!(text.contains(&format!("<td>{value:.1}</td>")), "{} {value}", row.scheme);
        }
    }
    for said in [
        "12 degenerate",
        "1 odd point",
        "<td>not known here</td>",
        "Not known here: the map is too small",
        "<strong>Note:</strong> --max-points: 200 of 400 points are audited &lt;b&gt;.",
    ] {
        assert!(text.contains(said), "{said}");
    }
    sample::retain(&mut document, |_| false);
    assert!(page(&document, None, false).contains("No scheme was tested."));
}

/// The banner says whether to release, and its color follows the share.
#[test]
#[rustfmt::skip] // One row per line.
fn the_banner_says_how_bad_it_is() {
    for (schemes, color, expected) in [
        (&["olc"][..], "red", "Do not release this map under olc. Not tried: attacks by descriptors and the strongest solver (--solver joint). The strongest attack tried recovers 58.6 %"),
        (&["ray", "ray-voxel"], "orange", "Do not release this map under any scheme tried. Not tried: attacks by descriptors and the strongest solver (--solver joint). The least leak, 20.8 % (ray-voxel), is a fifth or more of the points."),
        (&["ppl", "cp"], "orange", "Nothing is decided about this map under cp and ppl. Not tried: attacks by descriptors and the strongest solver (--solver joint). The strongest attack tried recovers 16.2"),
        // An untested attack is no good result.
        (&["plane"], "orange", "Not tested: what an attacker recovers from the released data alone. Not tried: attacks by descriptors, the strongest solver (--solver joint) and the attack on the records alone. The strongest attack tried would recover 83.7 % of the points of this map within 10 cm if half of the neighbors were known (plane, known neighbors)."),
    ] {
        let mut document = sample::document(true);
        sample::retain(&mut document, |scheme| schemes.contains(&scheme));
        let said = verdict(&document);
        assert!(said.contains(expected), "{said}");
        let colored = format!("<section class=\"part {color}\"");
        assert!(page(&document, None, true).contains(&colored), "{schemes:?}");
    }
    // With the best attack by descriptors, a small leak is told, unless it is doubtful.
    let mut document = sample::mixed(true);
    for row in &mut document.results {
        row.recovered_percent.values_mut().for_each(|percent| *percent = percent.min(12.0));
    }
    assert!(!verdict(&document).contains("no attack tried here"));
    sample::by_best(&mut document, "overlap");
    document.doubts = vec!["lengths".to_owned()];
    let doubtful = verdict(&document);
    assert!(doubtful.contains("Doubtful: lengths.") && !doubtful.contains("no attack tried here"));
    document.doubts.clear();
    let text = verdict(&document);
    assert!(text.contains("no attack tried here on released data recovers more than 16.2 % of the points within 10 cm."), "{text}");
    assert!(said(&document).contains("leaks least"), "{text}");
}

#[test]
fn pages_are_small_load_nothing_and_never_say_safe() {
    let document = sample::document(true);
    for n in [3_000, 40_000] {
        let scene = sample::scene(&document, n);
        let size = page(&document, Some(&scene), false).len();
        assert!(size < 10_000_000, "{n} points: {size} bytes");
    }
    let policy =
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";
    for document in [document, sample::mixed(false)] {
        let text = without_script(&page(&document, None, false));
        assert!(text.contains(policy));
        for load in [" src=", "<link", "<iframe", "url("] {
            assert!(!text.contains(load), "{load}");
        }
        let (_, body) = text.split_once("<body>").expect("a body");
        assert!(!body.replace("--share-safe", "").to_lowercase().contains("safe"));
    }
}

#[test]
fn a_page_to_share_holds_figures_only() {
    let document = sample::document(true);
    let scene = sample::scene(&document, 200);
    let [private, shared] = [false, true].map(|safe| page(&document, Some(&scene), safe));
    for trace in ["furnished-room", "id=\"block-0\"", "<canvas", "unlift audit map"] {
        assert!(private.contains(trace) && !shared.contains(trace), "{trace}");
    }
    assert!(shared.contains("Figures only.") && shared.contains("<td>92.3</td>"));
}

#[test]
fn the_terminal_table_has_a_line_per_source_and_says_what_is_missing() {
    let mut document = sample::document(true);
    let oracle = document.results.iter().find(|row| row.scheme == "olc").unwrap().clone();
    for (solver, percent, std) in [("consensus", 41.5, 0.0), ("joint", 63.5, 4.96)] {
        let mut row = oracle.clone();
        sample::by(&mut row, "overlap");
        (row.solver, row.inlier_ratio) = (solver.into(), 0.13);
        row.recovered_percent[0] = percent;
        let recovered_percent = [("0.10".to_owned(), std), ("0.25".to_owned(), 0.5)].into();
        row.std = Some(Spread { recovered_percent, ..Spread::default() });
        document.results.push(row);
    }
    for (neighbors, reason) in [(None, "flat"), (Some("geometric"), "geometric: no lists")] {
        document.not_audited.push(NotAudited::new("star", neighbors, reason));
    }
    let table = text_table(&document);
    let lines: Vec<&str> = table.lines().collect();
    let cells = |line: usize| lines[line].split_whitespace().collect::<Vec<_>>().join(" ");
    // The table shows the strongest attack of a source, with its standard deviation if that is large.
    assert!(cells(4).starts_with("olc overlap 13 % joint 63.5 ± 5.0 % 98.1 %"), "{table}");
    assert!(!table.contains("41.5 %"), "{table}");
    let alone = "olc records alone - tomography 58.6 % 76.4 % 1.9 % -";
    assert_eq!(cells(5), alone, "{table}");
    assert!(cells(6).starts_with("olc oracle"), "{table}");
    assert!(table.contains("not audited: star: flat\n"), "{table}");
    assert!(table.contains("not audited: star by geometric: no lists\n"), "{table}");
}

#[test]
fn the_axis_of_errors_begins_at_a_hundredth_of_the_largest_threshold() {
    let mut document = sample::document(true);
    document.results[0].error_percentiles.insert("1".into(), Some(1e-6));
    let page = page(&document, None, false);
    assert!(
        page.contains("[0.0025,1.0]") && !page.contains("[1e-6,") && !page.contains("[0.000001,")
    );
}
