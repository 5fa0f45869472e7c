//! The page as text: numbers without script, escaping, nothing private in a page to share.

mod sample;

use sha2::{Digest, Sha256};
use unlift_report::document::Document;
use unlift_report::{RenderOptions, Scene3d, render, text_table};

fn page(document: &Document, scene: Option<&Scene3d>, share_safe: bool) -> String {
    let options = RenderOptions { share_safe, ..RenderOptions::default() };
    render(document, scene, &options).expect("a page")
}

/// The page without its scripts and styles: what a browser without script shows.
fn without_script(page: &str) -> String {
    let mut text = page.to_owned();
    for (open, close) in [("<script", "</script>"), ("<style", "</style>")] {
        while let Some(start) = text.find(open) {
            let end = start + text[start..].find(close).expect("it ends") + close.len();
            text.replace_range(start..end, "");
        }
    }
    text
}

#[test]
fn every_figure_stands_in_a_table() {
    let document = sample::document(true);
    let text = without_script(&page(&document, None, false));
    for row in &document.results {
        for value in row.recovered_percent.values().chain(row.blind_percent.values()) {
            assert!(text.contains(&format!("<td>{value:.1}</td>")), "{} {value}", row.scheme);
        }
    }
    assert!(text.contains("12 degenerate"));
    assert!(text.contains("1 odd point"));
}

#[test]
fn the_verdict_is_a_sentence_worst_first_and_never_says_safe() {
    let document = sample::document(true);
    let text = without_script(&page(&document, None, false));
    let sentence = "<strong>PPL: at least 89 %</strong> of the points come back within 10 cm \
        when half of the neighbors are right.";
    assert!(text.contains(sentence));
    assert!(text.contains("Half of the points come back when only 23 % of neighbors are right."));
    assert!(text.find("OLC: at least 92 %") < text.find("PLANE: at least 83 %"));
    let (_, body) = text.split_once("<body>").expect("a body");
    let words = body.replace("--share-safe", "");
    assert!(!words.to_lowercase().contains("safe"));
}

#[test]
fn centimeters_never_appear_without_a_scale() {
    let document = sample::document(false);
    let text = without_script(&page(&document, None, false));
    assert!(text.contains("No scale was declared"));
    assert!(text.contains("within 1 neighbor distance when half"));
    for unit in [" cm", " mm", "3DV 2025"] {
        assert!(!text.contains(unit), "{unit}");
    }
}

#[test]
fn names_are_escaped_everywhere() {
    let evil = "</script><script>alert(1)</script>";
    let mut document = sample::document(true);
    document.input.path = Some(evil.into());
    document.run.command = Some(evil.into());
    document.options.insert(evil.into(), evil.into());
    document.gates[0].gate = evil.into();
    for row in document.results.iter_mut().filter(|row| row.scheme == "cp") {
        row.scheme = evil.into();
        row.lost = [(evil.to_owned(), row.n_lost)].into();
    }
    let scene = sample::scene(&document, 50);
    let before = page(&sample::document(true), Some(&scene), false).matches("<script").count();
    let text = page(&document, Some(&scene), false);
    assert!(!text.contains("alert(1)</script>"));
    assert_eq!(text.matches("<script").count(), before);
}

#[test]
fn a_page_to_share_holds_figures_only() {
    let document = sample::document(true);
    let scene = sample::scene(&document, 200);
    let private = page(&document, Some(&scene), false);
    let shared = page(&document, Some(&scene), true);
    assert!(private.contains("furnished-room") && private.contains("id=\"block-0\""));
    for trace in ["furnished-room", "id=\"block-0\"", "<canvas", "unlift audit map"] {
        assert!(!shared.contains(trace), "{trace}");
    }
    assert!(shared.contains("Figures only.") && shared.contains("<td>92.3</td>"));
}

#[test]
fn a_page_stays_below_ten_megabytes() {
    let document = sample::document(true);
    for n in [3_000, 40_000] {
        let scene = sample::scene(&document, n);
        let size = page(&document, Some(&scene), false).len();
        assert!(size < 10_000_000, "{n} points: {size} bytes");
    }
}

#[test]
fn the_page_allows_no_network() {
    let text = page(&sample::document(true), None, false);
    let policy =
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";
    assert!(text.contains(policy));
    let markup = without_script(&text);
    for load in [" src=", "<link", "<iframe", "url("] {
        assert!(!markup.contains(load), "{load}");
    }
}

#[test]
fn an_empty_audit_still_makes_a_page() {
    let mut document = sample::document(true);
    document.results.clear();
    document.break_even.clear();
    document.gates.clear();
    document.run.seconds.rows.clear();
    assert!(page(&document, None, false).contains("No scheme was tested."));
}

#[test]
fn the_terminal_table_is_short_and_worst_first() {
    let table = text_table(&sample::document(true));
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 8);
    assert!(lines[1].starts_with("olc  ") && lines[1].contains("92.3 %"), "{table}");
    assert!(lines.iter().all(|line| line.len() <= 100));
}

#[test]
fn the_terminal_table_has_a_line_per_source() {
    let mut document = sample::document(true);
    let oracle = document.results.iter().find(|row| row.scheme == "olc").unwrap().clone();
    let typed = oracle.recovered_percent.keys().next().unwrap().clone();
    for (solver, percent) in [("consensus", 41.5), ("joint", 63.5)] {
        let mut row = oracle.clone();
        (row.neighbors, row.oracle_noise, row.inlier_ratio) = ("overlap".into(), None, 0.13);
        row.solver = solver.into();
        row.recovered_percent.insert(typed.clone(), percent);
        document.results.push(row);
    }
    let table = text_table(&document);
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 9);
    assert!(lines[2].starts_with("olc") && lines[2].contains("13 % (overlap)"), "{table}");
    assert!(lines[2].contains("63.5 %") && !table.contains("41.5 %"), "{table}");
}

#[test]
fn the_vendored_bundle_is_the_one_described() {
    let bundle = include_bytes!("../web/vendor/bundle.min.js");
    let sum: String = Sha256::digest(bundle).iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(
        include_str!("../web/vendor/VENDOR.md").contains(&sum),
        "bundle.min.js has sha256 {sum}"
    );
}

#[test]
fn a_page_of_images_speaks_of_keypoints_and_pixels() {
    let document = sample::images();
    let options = RenderOptions { pictures: vec![sample::picture()], ..RenderOptions::default() };
    let page = render(&document, None, &options).expect("a page");
    let text = without_script(&page);
    assert!(text.contains("How much of these images comes back?"));
    assert!(text.contains("2 of 4 images. 1 could not be used. 1 had too few keypoints"));
    assert!(text.contains("of the keypoints come back within 10 px when half"));
    assert!(text.contains("<td>94.2</td>") && text.contains("id=\"table-distinct\""));
    assert!(text.contains("3DV 2025") && page.contains("\"unit\":\"px\""));
    assert!(page.contains("kitchen/secret.jpg"));
    assert!(text_table(&document).contains("10 px"));

    let safe =
        render(&document, None, &RenderOptions { share_safe: true, ..options }).expect("a page");
    assert!(!safe.contains("secret") && !safe.contains("id=\"picture-graph\""));
    let json = document.share_safe().to_json().expect("a document");
    assert!(!json.contains("secret") && json.contains("\"name\": null"));
}

#[test]
fn rows_of_an_image_are_those_of_the_results() {
    let mut document = sample::images();
    document.images[1].rows.pop();
    let error = document.to_json().unwrap_err().to_string();
    assert_eq!(error, "audit.json: images[1].rows: expected 12 rows, as in results, found 11");
    document.images[1].rows.clear();
    let text = document.to_json().expect("an image without keypoints has no rows");
    assert_eq!(Document::from_json(&text).expect("the same").images, document.images);
}
