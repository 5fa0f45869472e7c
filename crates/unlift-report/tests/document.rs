//! `audit.json`: round trip, stable text, and the rules it keeps.

mod sample;

use unlift_report::{Document, Error};

#[test]
fn a_document_survives_its_text() {
    let text = sample::document(true).to_json().unwrap();
    let read = Document::from_json(&text).unwrap();
    assert_eq!(read.to_json().unwrap(), text);
    assert_eq!(read.results.len(), sample::document(true).results.len());
}

#[test]
fn thresholds_keep_their_spelling_and_order() {
    let mut document = sample::document(true);
    let row = &mut document.results[0];
    row.recovered_percent = [("0.250".to_owned(), 98.0), ("0.10".to_owned(), 93.0)].into();
    row.blind_percent = [("0.250".to_owned(), 2.0), ("0.10".to_owned(), 1.0)].into();
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
}

#[test]
fn another_schema_is_refused_by_its_number() {
    let text = sample::document(true).to_json().unwrap().replace("\"schema\": 1", "\"schema\": 7");
    let error = Document::from_json(&text).unwrap_err();
    assert!(matches!(error, Error::Schema { expected: 1, found: 7 }), "{error}");
}
