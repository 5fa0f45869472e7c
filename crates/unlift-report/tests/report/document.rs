//! Tests of `audit.json`: round trip, stable text, and the rules of the format.

use serde_json::Value;
use unlift_report::document::{GateResult, NotAudited};
use unlift_report::{Document, Error, RenderOptions, render};

use crate::sample;

fn missing(scheme: &str, neighbors: Option<&str>, reason: &str) -> NotAudited {
    let neighbors = neighbors.map(str::to_owned);
    NotAudited { scheme: scheme.into(), neighbors, reason: reason.into() }
}

#[test]
fn a_document_survives_its_text() {
    let mut document = sample::document(true);
    assert!(!document.to_json().unwrap().contains("\"metrics\""));
    document.not_audited =
        vec![missing("star", None, "k: flat"), missing("plane", Some("geometric"), "no")];
    document.notes.push("--max-points: 200 of 400 points are audited".to_owned());
    document.gates[0] = GateResult {
        found_percent: None,
        passed: false,
        reason: Some("star was not audited".into()),
        ..document.gates[0].clone()
    };
    document.input.scale_m_per_unit = Some(1.234_567_890_1);
    let row = &mut document.results[0];
    (row.sure_percent, row.sure_unknown) = (None, Some("too few points".into()));
    row.metrics = [("ssim".to_owned(), 0.512_345_6), ("faces".into(), 7.0)].into();
    row.median_error = Some(0.012_345_678_9);
    // Thresholds keep spelling and order.
    row.recovered_percent = [("0.250".to_owned(), 98.0), ("0.10".to_owned(), 93.0)].into();
    row.blind_percent = [("0.250".to_owned(), 2.0), ("0.10".to_owned(), 1.0)].into();
    (row.records_alone_percent, row.records_alone_by) = (None, None);
    let text = document.to_json().unwrap();
    // Null differs from absent; measured numbers are rounded, typed ones are not.
    for field in [
        "\"sure_percent\": null",
        "\"median_error\": 0.0123457,",
        "\"scale_m_per_unit\": 1.2345678901,",
    ] {
        assert!(text.contains(field), "{field}");
    }
    let read = Document::from_json(&text).unwrap();
    assert_eq!(read.to_json().unwrap(), text);
    let row = &read.results[0];
    assert_eq!((row.metrics["ssim"], row.median_error), (0.512_346, Some(0.012_345_7)));
    assert!(row.recovered_percent.keys().eq(["0.250", "0.10"]));
    assert_eq!((&read.not_audited, &read.gates), (&document.not_audited, &document.gates));
    assert_eq!(read.notes, document.notes);
    let page = render(&document, None, &RenderOptions::default()).unwrap();
    assert!(page.contains("id=\"table-metrics\"") && page.contains("<td>7</td>"));
}

#[test]
fn documents_of_before_are_read_and_those_of_later_ones_refused() {
    let text = sample::document(true).to_json().unwrap();
    let mut value: Value = serde_json::from_str(&text).unwrap();
    for row in value["results"].as_array_mut().unwrap() {
        for field in ["records_alone_percent", "records_alone_by", "sure_percent"] {
            row.as_object_mut().unwrap().remove(field);
        }
    }
    let read = Document::from_json(&value.to_string()).unwrap();
    assert_eq!((read.not_audited.len(), read.results[0].sure_percent), (0, None));
    assert_eq!(read.results[0].records_alone_percent, None);
    let later = text.replace("\"schema\": 1", "\"schema\": 7");
    let error = Document::from_json(&later).unwrap_err();
    assert!(matches!(error, Error::Schema { expected: 1, found: 7 }), "{error}");
}

#[test]
fn the_larger_baseline_counts() {
    let document = sample::document(true);
    let of = |scheme: &str| document.results.iter().find(|row| row.scheme == scheme).unwrap();
    assert_eq!(of("olc").baseline_percent("0.10"), Some(58.6));
    // No attack on the records alone works for planes.
    assert_eq!(of("plane").baseline_percent("0.10"), Some(0.2));
    let mut worse = of("olc").clone();
    worse.blind_percent[0] = 60.0;
    assert_eq!(worse.baseline_percent("0.10"), Some(60.0));
    assert_eq!(worse.baseline_percent("7"), None);
}

#[test]
fn a_broken_rule_names_its_place() {
    type Spoil = fn(&mut Document);
    let rules: [(Spoil, &str); 11] = [
        (
            |d| d.results[1].median_error = Some(f64::NAN),
            "results[1].median_error: expected a finite number, found NaN",
        ),
        (
            |d| _ = d.results[1].metrics.insert("faces".into(), f64::INFINITY),
            "results[1].metrics[\"faces\"]: expected a finite number, found inf",
        ),
        (
            |d| d.results[2].recovered_percent[0] = 100.5,
            "results[2].recovered_percent[\"0.10\"]: expected a number from 0 to 100, found 100.5",
        ),
        (
            |d| d.results[1] = d.results[0].clone(),
            "results[1]: expected a combination of its own, found the combination of results[0] again",
        ),
        (|d| d.results[0].n_lost = 5, "results[0].lost: expected a sum of 5, found 12"),
        (
            |d| d.results[0].records_alone_by = None,
            "results[0].records_alone_by: expected the thresholds 0.10, 0.25, found nothing",
        ),
        (
            |d| d.results[0].records_alone_percent.as_mut().unwrap()[1] = 101.0,
            "results[0].records_alone_percent[\"0.25\"]: expected a number from 0 to 100, found 101",
        ),
        (
            |d| d.results[0].sure_unknown = Some("few".into()),
            "results[0].sure_percent: expected null, as sure_unknown says \"few\", found 74.7",
        ),
        (
            |d| (d.gates[1].passed, d.gates[1].found_percent) = (true, None),
            "gates[1].passed: expected false where a figure is not known, found true",
        ),
        (
            |d| d.not_audited.push(missing("olc", None, "no")),
            "not_audited[0].scheme: expected a scheme without rows in results, found olc, which has rows",
        ),
        (
            |d| {
                *d = sample::images();
                _ = d.images[1].rows.pop();
            },
            "images[1].rows: expected 12 rows, as in results, found 11",
        ),
    ];
    for (spoil, expected) in rules {
        let mut document = sample::document(true);
        spoil(&mut document);
        let error = document.to_json().expect_err(expected).to_string();
        assert_eq!(error, format!("audit.json: {expected}"));
    }
    let mut document = sample::images();
    document.images[1].rows.clear();
    let text = document.to_json().expect("an image without keypoints has no rows");
    assert_eq!(Document::from_json(&text).expect("a document").images, document.images);
}

/// A share-safe document contains no text from schemes, sources or solvers of others.
#[test]
fn what_others_say_of_why_they_failed_is_kept_back() {
    let mut document = sample::document(true);
    document.not_audited = vec![
        missing("mine", None, "mine: expected records or lists, found KeyError: 'secret'"),
        missing("plane", Some("near"), "near: expected records or lists, found secret"),
        missing("plane", Some("oracle"), "solver mine: expected positions, found secret"),
        missing("plane", Some("learned"), "/home/secret/x.onnx: expected a network, found none"),
        missing("plane", Some("geometric"), "k: expected at most 3, found 50"),
    ];
    document.gates[0].reason = Some("mine was not audited: mine: found secret".into());
    document.notes = vec!["/secret/rigs.bin: cut off".into(), "5 of 9 descriptors".into()];
    let options = RenderOptions { share_safe: true, ..RenderOptions::default() };
    let page = render(&document, None, &options).expect("a page");
    let safe = document.share_safe();
    let json = safe.to_json().expect("a document");
    assert!(!page.contains("secret") && !json.contains("secret"), "{json}");
    let reasons = safe.not_audited.iter().map(|missing| missing.reason.as_str());
    let failed = "its own function failed";
    let expected = [failed, failed, failed, "(withheld)", "k: expected at most 3, found 50"];
    assert_eq!(reasons.collect::<Vec<_>>(), expected);
    assert_eq!(safe.gates[0].reason.as_deref(), Some("mine was not audited"));
    assert_eq!(safe.notes, ["(withheld)", "5 of 9 descriptors"]);
}
