//! `audit.json`: round trip, stable text, and the rules it keeps.

mod sample;

use unlift_report::document::{GateResult, NotAudited};
use unlift_report::{Document, Error, RenderOptions, render};

#[test]
fn a_document_survives_its_text() {
    let text = sample::document(true).to_json().unwrap();
    let read = Document::from_json(&text).unwrap();
    assert_eq!(read.to_json().unwrap(), text);
    assert_eq!(read.results.len(), sample::document(true).results.len());
}

#[test]
fn what_could_not_be_audited_and_what_is_not_known_survive() {
    let mut document = sample::document(true);
    document.not_audited = vec![
        NotAudited { scheme: "star".into(), neighbors: None, reason: "k: flat".into() },
        NotAudited {
            scheme: "plane".into(),
            neighbors: Some("geometric".into()),
            reason: "no".into(),
        },
    ];
    let row = &mut document.results[0];
    (row.sure_percent, row.sure_unknown) = (None, Some("too few points".into()));
    document.gates[0] = GateResult {
        found_percent: None,
        passed: false,
        reason: Some("star was not audited".into()),
        ..document.gates[0].clone()
    };
    let text = document.to_json().unwrap();
    assert!(text.contains("\"sure_percent\": null"), "null, not absent");
    let read = Document::from_json(&text).unwrap();
    assert_eq!((read.not_audited, read.gates), (document.not_audited, document.gates));
    let (read, row) = (&read.results[0], &document.results[0]);
    assert_eq!((read.sure_percent, &read.sure_unknown), (None, &row.sure_unknown));
    assert_eq!(read.records_alone_percent, row.records_alone_percent);
    assert_eq!(read.records_alone_by, row.records_alone_by);
}

#[test]
fn added_measures_survive_and_are_drawn() {
    let mut document = sample::document(true);
    assert!(!document.to_json().unwrap().contains("\"metrics\""));
    document.results[0].metrics = [("ssim".to_owned(), 0.512_345_6), ("faces".into(), 7.0)].into();
    let read = Document::from_json(&document.to_json().unwrap()).unwrap();
    assert_eq!(
        read.results[0].metrics.iter().map(|(name, x)| (name.as_str(), *x)).collect::<Vec<_>>(),
        [("ssim", 0.512_346), ("faces", 7.0)]
    );
    assert!(read.results[1].metrics.is_empty());
    let page = render(&document, None, &RenderOptions::default()).unwrap();
    assert!(page.contains("id=\"table-metrics\"") && page.contains("<td>0.512</td>"));
}

#[test]
fn documents_of_before_are_read() {
    let mut value: serde_json::Value =
        serde_json::from_str(&sample::document(true).to_json().unwrap()).unwrap();
    for row in value["results"].as_array_mut().unwrap() {
        for field in ["records_alone_percent", "records_alone_by", "sure_percent"] {
            row.as_object_mut().unwrap().remove(field);
        }
    }
    let read = Document::from_json(&value.to_string()).unwrap();
    assert_eq!((read.not_audited.len(), read.results[0].sure_percent), (0, None));
    assert_eq!(read.results[0].records_alone_percent, None);
}

#[test]
fn the_larger_baseline_counts() {
    let document = sample::document(true);
    let of = |scheme: &str| document.results.iter().find(|row| row.scheme == scheme).unwrap();
    assert_eq!(of("olc").baseline_percent("0.10"), Some(58.6));
    // No attack on planes works from records alone.
    assert_eq!(of("plane").baseline_percent("0.10"), Some(0.2));
    let mut worse = of("olc").clone();
    worse.blind_percent[0] = 60.0;
    assert_eq!(worse.baseline_percent("0.10"), Some(60.0));
    assert_eq!(worse.baseline_percent("7"), None);
}

#[test]
fn thresholds_keep_their_spelling_and_order() {
    let mut document = sample::document(true);
    let row = &mut document.results[0];
    row.recovered_percent = [("0.250".to_owned(), 98.0), ("0.10".to_owned(), 93.0)].into();
    row.blind_percent = [("0.250".to_owned(), 2.0), ("0.10".to_owned(), 1.0)].into();
    (row.records_alone_percent, row.records_alone_by) = (None, None);
    let read = Document::from_json(&document.to_json().unwrap()).unwrap();
    assert_eq!(read.results[0].recovered_percent.keys().collect::<Vec<_>>(), ["0.250", "0.10"]);
}

#[test]
fn measured_numbers_are_rounded_and_typed_ones_are_not() {
    let mut document = sample::document(true);
    document.results[0].median_error = Some(0.012_345_678_9);
    document.input.scale_m_per_unit = Some(1.234_567_890_1);
    let text = document.to_json().unwrap();
    assert!(text.contains("\"median_error\": 0.0123457,"));
    assert!(text.contains("\"scale_m_per_unit\": 1.2345678901,"));
}

fn message(spoil: impl Fn(&mut Document)) -> String {
    let mut document = sample::document(true);
    spoil(&mut document);
    document.to_json().expect_err("a broken rule").to_string()
}

#[test]
fn a_broken_rule_names_its_place() {
    assert_eq!(
        message(|d| d.results[1].median_error = Some(f64::NAN)),
        "audit.json: results[1].median_error: expected a finite number, found NaN"
    );
    assert_eq!(
        message(|d| _ = d.results[1].metrics.insert("faces".into(), f64::INFINITY)),
        "audit.json: results[1].metrics[\"faces\"]: expected a finite number, found inf"
    );
    assert_eq!(
        message(|d| d.results[2].recovered_percent[0] = 100.5),
        "audit.json: results[2].recovered_percent[\"0.10\"]: expected a number from 0 to 100, found 100.5"
    );
    assert_eq!(
        message(|d| d.results[1] = d.results[0].clone()),
        "audit.json: results[1]: expected a combination of its own, found the combination of results[0] again"
    );
    assert_eq!(
        message(|d| d.results[0].n_lost = 5),
        "audit.json: results[0].lost: expected a sum of 5, found 12"
    );
    assert_eq!(
        message(|d| d.results[0].records_alone_by = None),
        "audit.json: results[0].records_alone_by: expected the thresholds 0.10, 0.25, found nothing"
    );
    assert_eq!(
        message(|d| d.results[0].records_alone_percent.as_mut().unwrap()[1] = 101.0),
        "audit.json: results[0].records_alone_percent[\"0.25\"]: expected a number from 0 to 100, found 101"
    );
    assert_eq!(
        message(|d| d.results[0].sure_unknown = Some("few".into())),
        "audit.json: results[0].sure_percent: expected null, as sure_unknown says \"few\", found 74.7"
    );
    assert_eq!(
        message(|d| (d.gates[1].passed, d.gates[1].found_percent) = (true, None)),
        "audit.json: gates[1].passed: expected false where a figure is not known, found true"
    );
    let missing = NotAudited { scheme: "olc".into(), neighbors: None, reason: "no".into() };
    assert_eq!(
        message(|d| d.not_audited.push(missing.clone())),
        "audit.json: not_audited[0].scheme: expected a scheme without rows in results, found olc, which has rows"
    );
}

#[test]
fn another_schema_is_refused_by_its_number() {
    let text = sample::document(true).to_json().unwrap().replace("\"schema\": 1", "\"schema\": 7");
    let error = Document::from_json(&text).unwrap_err();
    assert!(matches!(error, Error::Schema { expected: 1, found: 7 }), "{error}");
}
