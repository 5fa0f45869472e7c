//! What may leave the house says nothing that others wrote.

mod sample;

use unlift_report::document::NotAudited;
use unlift_report::{RenderOptions, render};

#[test]
fn what_others_say_of_why_they_failed_is_kept_back() {
    let mut document = sample::document(true);
    let missing = |scheme: &str, neighbors: Option<&str>, reason: &str| NotAudited {
        scheme: scheme.into(),
        neighbors: neighbors.map(str::to_owned),
        reason: reason.into(),
    };
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
