//! Tests of what some audits have besides the verdict: the cost of protection, and painted pictures.

use unlift_report::compare::{Accepted, compare};
use unlift_report::document::{Document, GateResult, HeldOut, Localization, Row, Spread};
use unlift_report::inversions::{Inversion, Painted};
use unlift_report::{ByAttack, RenderOptions, gate_lines, junit, render, text_table};

use crate::page::page;
use crate::sample;

fn one(scheme: &str, multiple: Option<f64>) -> Localization {
    Localization {
        scheme: scheme.to_owned(),
        multiple,
        center_error: multiple.map(|x| 0.0005 * x),
        rotation_error_degrees: multiple,
        failed_percent: if multiple.is_some() { 0.0 } else { 100.0 },
        ..Localization::default()
    }
}

/// The sample audit with localization; `olc` leaks little if `protects`.
fn document(protects: bool) -> Document {
    let mut document = sample::document(true);
    if protects {
        sample::change(&mut document, "olc", |row| sample::set(row, 10.0, 5.0));
    }
    let query = Localization { of_queries: true, ..one("lines2d", Some(1.4)) };
    document.localization = vec![
        one("none", Some(1.0)),
        one("olc", Some(1.4)),
        one("ppl", Some(1.6)),
        one("plane", None),
        query,
    ];
    document
}

#[test]
fn the_cost_of_protection_has_a_sentence_a_chart_and_a_table() {
    let by_oracle = page(&document(true), None, false);
    assert!(by_oracle.contains("Nothing is decided about olc."));
    let document = |protects| {
        let mut document = document(protects);
        sample::by_best(&mut document, "oracle");
        document
    };
    let none = page(&document(false), None, false);
    let said = "No scheme tried here keeps an attacker below 20\u{a0}% at a localization error within twice the unprotected one.";
    assert!(none.contains(said));
    let some = page(&document(true), None, false);
    for said in [
        "olc keeps the attacks tried here below 20\u{a0}%",
        "A better attack may recover more.",
        "<title>olc: 10.0 % come back, 1.4 times the unprotected error</title>",
        "most cameras do not localize</title>",
        "table-cost",
        "the query",
    ] {
        assert!(some.contains(said), "{said}");
    }
    // A doubt leaves schemes decided only if it is about another scheme.
    for (doubt, decided) in [("ppl: noise", true), ("olc: noise", false), ("unit: 2", false)] {
        let mut document = document(true);
        document.doubts = vec![doubt.to_owned()];
        assert_eq!(
            page(&document, None, false).contains("olc keeps the attacks"),
            decided,
            "{doubt}"
        );
    }
    let text = text_table(&document(true));
    assert!(text.contains("does not localize") && text.contains("1.4x"), "{text}");
    // The audit of a map without tracks has no chart.
    assert!(!page(&sample::document(true), None, false).contains("id=\"cost\""));
}

#[test]
fn changed_descriptors_have_no_known_cost_without_held_out_images() {
    let mut document = document(true);
    document.localization[1].changes_descriptors = true;
    assert_eq!(document.localization[1].cost(), None);
    let text = page(&document, None, false);
    assert!(text.contains("No scheme with both figures keeps"), "an unknown cost is not small");
    assert!(text.contains("olc, whose descriptors are changed"));
    document.localization[1].held_out = Some(HeldOut {
        n_images: 10,
        right_matches: 300.0,
        matches: 400.0,
        multiple: Some(3.5),
        ..HeldOut::default()
    });
    assert_eq!(document.localization[1].cost(), Some(3.5));
    assert!(page(&document, None, false).contains("300 of 400"));
    let same = Document::from_json(&document.to_json().unwrap()).unwrap();
    assert_eq!(same.localization, document.localization);
    let one = &mut document.localization[1];
    one.held_out.as_mut().unwrap().n_images = 9;
    assert!(one.is_unknown() && one.cost().is_none(), "nine held-out images are too few");
    one.changes_descriptors = false;
    assert_eq!(one.cost(), one.multiple, "the bound counts instead");
}

/// A scheme under which no camera is placed is not what the verdict and its advice name first.
#[test]
fn a_scheme_that_does_not_localize_is_no_advice() {
    let mut document = document(false);
    sample::by_best(&mut document, "oracle");
    for row in &mut document.results {
        sample::set(row, if row.scheme == "plane" { 5.0 } else { 12.0 }, 1.0);
    }
    let text = page(&document, None, false);
    assert!(text.contains("leaks least") && !text.contains("plane leaks least"));
    sample::retain(&mut document, |scheme| scheme == "plane");
    let text = page(&document, None, false);
    assert!(text.contains(", but most cameras cannot be placed with it."), "{text}");
}

#[test]
fn gates_on_localization_speak_of_multiples() {
    let mut document = document(true);
    document.gates = vec![GateResult {
        gate: "ppl:localization<=1.5".to_owned(),
        found_percent: Some(1.6),
        of: Some("ppl, bound".to_owned()),
        bound_percent: 1.5,
        ..GateResult::default()
    }];
    let line =
        "gate ppl:localization<=1.5: FAILED, found 1.60 times the unprotected error: ppl, bound\n";
    assert_eq!(gate_lines(&document), line);
    let said = "1.6 times the unprotected localization error, at most 1.5 times may be; ppl, bound";
    for text in [page(&document, None, false), junit(&document).unwrap()] {
        assert!(text.contains(said), "{text}");
    }
}

#[test]
fn a_larger_localization_error_fails_a_comparison() {
    let (old, mut new) = (document(true), document(true));
    new.localization[1].multiple = Some(1.5);
    assert!(compare(&old, &new, None).unwrap().passed, "within a tenth");
    new.localization[1].multiple = Some(1.7);
    new.localization[2].multiple = None;
    let found = compare(&old, &new, None).unwrap();
    let worse: Vec<&str> = found.costs_more.iter().map(|one| one.scheme.as_str()).collect();
    assert_eq!(worse, ["olc", "ppl"]);
    assert!(!found.passed && found.summary().ends_with("; 2 localize less precisely"));
    new.localization.clear();
    let unknown = compare(&old, &new, None).unwrap();
    assert!(!unknown.passed && unknown.costs_more[0].new_multiple.is_none());
    assert!(compare(&new, &old, None).unwrap().passed, "the old audit did not measure it");
}

#[test]
fn a_new_doubt_fails_a_comparison_whatever_is_accepted() {
    let (mut old, mut new) = (document(true), document(true));
    new.doubts = vec!["truth: 12 of 400 points".to_owned()];
    let accepted = Some(Accepted::parse("more rooms, until 9000-01-01").unwrap());
    let found = compare(&old, &new, accepted).unwrap();
    assert!(!found.passed && found.doubts == new.doubts);
    old.doubts = vec!["truth: 13 of 400 points".to_owned()];
    assert!(compare(&old, &new, None).unwrap().passed, "the old audit has it, too");
    // What queries cost has no rows of its own.
    new.localization.iter_mut().filter(|of| of.of_queries).for_each(|of| of.multiple = Some(14.0));
    assert!(!compare(&old, &new, None).unwrap().passed);
}

#[test]
fn a_figure_that_varies_much_lets_no_other_rise() {
    let old = document(true);
    for (varies, passes) in [("olc", true), ("ppl", false)] {
        let mut new = old.clone();
        sample::change(&mut new, varies, |row| {
            let spread = row.recovered_percent.keys().map(|label| (label.clone(), 5.3)).collect();
            row.std = Some(Spread { recovered_percent: spread, ..Spread::default() });
        });
        sample::change(&mut new, "olc", |row| {
            row.recovered_percent.values_mut().for_each(|percent| *percent += 4.0);
        });
        assert_eq!(compare(&old, &new, None).unwrap().passed, passes, "{varies}");
    }
}

#[test]
fn an_attack_of_the_new_audit_alone_counts_if_it_recovers_more() {
    let old = document(true);
    for (percent, passes) in [(5.0, true), (99.0, false)] {
        let mut new = old.clone();
        let mut row = new.results[0].clone();
        sample::by(&mut row, "file");
        sample::set(&mut row, percent, 1.0);
        new.results.push(row);
        let found = compare(&old, &new, None).unwrap();
        assert_eq!((found.passed, found.only_new.len()), (passes, 1), "{percent}");
    }
    // The strongest of the old audit includes records alone.
    let mut new = old.clone();
    let mut row =
        new.results.iter().find(|row| row.records_alone_percent.is_some()).unwrap().clone();
    sample::by(&mut row, "file");
    row.recovered_percent = row.records_alone_percent.clone().unwrap();
    new.results.push(row);
    assert!(compare(&old, &new, None).unwrap().passed);
    let mut without = old.clone();
    without.results.iter_mut().for_each(|row| row.records_alone_percent = None);
    let found = compare(&without, &old, None).unwrap();
    assert!(!found.more.is_empty());
    assert!(found.more.iter().all(|change| change.attack == "records alone"));
}

/// Returns an audit of images, with rows by an attacker's own lists for both schemes.
fn painted_document() -> Document {
    let mut document = sample::images();
    for (row, ssim) in document.results.iter_mut().zip([0.48, 0.33].into_iter().cycle()) {
        row.metrics.insert("ssim".into(), ssim);
        row.metrics.insert("ssim_baseline".into(), 0.5);
        row.metrics.insert("reidentified".into(), 0.95);
        row.metrics.insert("reidentified_baseline".into(), 1.0);
        row.metrics.insert("reidentified_by_chance".into(), 0.025);
        row.metrics.insert("objects_found".into(), 0.2);
        row.metrics.insert("objects_found_of_tv".into(), 0.25);
        row.metrics.insert("objects_found_of_tv_baseline".into(), 0.75);
    }
    for scheme in ["lines2d", "cp2d"] {
        let mut row = document.results.iter().find(|row| row.scheme == scheme).unwrap().clone();
        sample::by(&mut row, "overlap");
        row.inlier_ratio = 0.2;
        document.results.push(row);
    }
    // Rows of images must match the results in number, or be absent.
    document.images.iter_mut().for_each(|image| image.rows.clear());
    document
}

fn inversion(document: &Document, ssim: impl Fn(&Row) -> f64) -> Inversion {
    let view = |row: &Row| ByAttack {
        row: row.clone(),
        recovered: Painted { jpeg: vec![1], ssim: ssim(row), lpips: 0.3 },
    };
    let picture = sample::picture();
    Inversion {
        name: picture.name,
        size: picture.size,
        baseline: Painted { ssim: 0.5, lpips: 0.2, ..Painted::default() },
        released: picture.released,
        views: document.results.iter().map(view).collect(),
        ..Inversion::default()
    }
}

fn painted_page(document: &Document, inversions: Vec<Inversion>, share_safe: bool) -> String {
    let options = RenderOptions { inversions, share_safe, ..RenderOptions::default() };
    render(document, &options).expect("a page")
}

#[test]
fn the_page_begins_with_what_an_attacker_paints_from_the_released_data() {
    let document = painted_document();
    let ssim = |row: &Row| if row.neighbors == "overlap" { 0.48 } else { 0.2 };
    let found = painted_page(&document, vec![inversion(&document, ssim)], false);
    let rebuilt =
        "<strong>An attacker can rebuild the picture.</strong> From the released data alone, ";
    let not = "<strong>The picture does not come back well by this attack.</strong> If half of the neighbors were known: ";
    let (first, second) = (found.find(rebuilt), found.find(not));
    assert!(first.is_some() && first < second, "{found}");
    assert!(found.contains(
        "% of the keypoints come back within 10\u{a0}px (lines2d, neighbors by descriptor overlap)."
    ));
    assert!(found.contains("What the service receives") && found.contains("<path d=\"M"));
    assert!(!found.to_lowercase().contains("worse picture"));
    let safe = painted_page(&document, vec![inversion(&document, ssim)], true);
    assert!(!safe.contains("class=\"exhibit") && !safe.contains("src=\"data:image/jpeg"));
}

#[test]
fn only_the_strongest_attacks_are_shown_at_first() {
    let document = painted_document();
    let found = painted_page(&document, vec![inversion(&document, |_| 0.4)], false);
    let (_, section) = found.split_once("id=\"inversions\"").expect("pictures");
    let (_, row) = section.split_once("<h3>lines2d</h3>").expect("a scheme");
    let (main, others) = row.split_once("<details>").expect("the others are folded away");
    assert_eq!(main.matches("<img").count(), 2, "released data alone, and half of the neighbors");
    assert!(main.contains("neighbors by descriptor overlap, 20 % right"));
    assert!(main.contains("known neighbors, 50 % right"));
    let (others, _) = others.split_once("</details>").expect("an end");
    assert_eq!(others.matches("<img").count(), 5);
}

#[test]
fn pictures_that_would_make_a_page_too_large_are_left_out() {
    let document = sample::images();
    let of = |n_photos: usize, bytes: usize| {
        let view = |at: usize| {
            let scheme = ["olc", "cp"][at % 2].into();
            let row = Row { scheme, inlier_ratio: at as f64, ..Row::default() };
            ByAttack { row, recovered: Painted { jpeg: vec![7; bytes], ..Painted::default() } }
        };
        let photo = Inversion { views: (0..40).map(view).collect(), ..Inversion::default() };
        let text = painted_page(&document, vec![photo; n_photos], false);
        let left_out = text.split_once(" more pictures were left out");
        let left_out = left_out.and_then(|(before, _)| before.rsplit_once(' '));
        let n_pictures = text.matches("alt=\"The picture painted from points").count();
        (n_pictures, left_out.map_or(0, |(_, number)| number.parse().expect("a number")))
    };
    assert_eq!(of(2, 9_000), (80, 0));
    assert_eq!(of(2, 40_000), (40, 40));
    let (few, left_out) = of(1, 200_000);
    assert!(few > 4 && few + left_out == 40, "{few}");
}

#[test]
fn figures_of_pictures_are_in_tables() {
    let found = painted_page(&painted_document(), Vec::new(), false);
    assert!(found.contains("tv, %"), "{found}");
    assert!(found.contains("<td>0.480</td><td>0.020</td><td>95.0</td>"), "{found}");
    assert!(found.contains("2.5 % would be by chance"));
    assert!(!found.contains("ssim_baseline"));
    assert!(found.contains("<td>75.0</td>") && found.contains("<td>25.0</td>"));
}
