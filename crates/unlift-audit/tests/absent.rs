//! Without a feature, the error about what needs it names the feature. `.ci/features` runs this.

#![cfg(not(any(feature = "networks", feature = "parquet")))]

use std::path::Path;

use unlift_audit::{Preparation, by_point, prepare, sources};
use unlift_features::{AlikedOptions, Extraction, Extractor, SuperPointOptions};

fn line<T, E: ToString>(result: Result<T, E>) -> String {
    result.err().expect("an error").to_string()
}

#[test]
fn the_error_about_what_needs_a_feature_names_it() {
    let points: Vec<_> = (0..100).map(|at| [0.1 * f64::from(at), 0.0, 0.0]).collect();
    let preparation = Preparation { scale: Some(1.0), k: 10, ..Preparation::default() };
    let prepared = prepare(&points, None, &preparation).unwrap();
    let lists = Path::new("lists.parquet");
    let extractor = |extraction| line(Extractor::try_new(&extraction));
    let found = [
        ("source learned", "audit", "networks", line(sources::named("learned"))),
        (
            "aliked-n16rot",
            "features",
            "networks",
            extractor(Extraction::Aliked(AlikedOptions::default())),
        ),
        (
            "superpoint",
            "features",
            "networks",
            extractor(Extraction::SuperPoint(SuperPointOptions::default())),
        ),
        (
            "lists.parquet",
            "audit",
            "parquet",
            line(by_point(lists, &prepared, points.len(), &mut Vec::new())),
        ),
    ];
    for (what, package, feature, found) in found {
        let expected = format!("expected unlift-{package} with the feature `{feature}`");
        assert_eq!(found, format!("{what}: {expected}, found a build without it"));
    }
    assert!(Extractor::try_new(&Extraction::default()).is_ok());
    assert!(sources::all().iter().all(|entry| entry.name != "learned"));
}
