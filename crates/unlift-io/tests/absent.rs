//! Without a feature, the error about a file names the feature. `.ci/features` runs this.

#![cfg(not(any(feature = "hdf5", feature = "sqlite", feature = "scans", feature = "parquet")))]

use std::fs;

use unlift_io::features::{self, FeatureSource};
use unlift_io::read::{self, Input};
use unlift_io::{Error, hash};

fn line<T>(result: Result<T, Error>) -> String {
    result.err().expect("an error").to_string()
}

#[test]
fn the_error_about_a_file_names_the_feature_that_reads_it() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let h5 = put("features.h5", b"\x89HDF\r\n\x1a\n");
    let db = put("database.db", b"SQLite format 3\0");
    let e57 = put("scan.e57", b"ASTM-E57");
    let input = Input::default();
    let found = [
        ("hdf5", &h5, line(FeatureSource::open(&h5))),
        ("hdf5", &h5, line(read::descriptors(&h5, &input))),
        ("hdf5", &h5, line(features::decode(&h5, "a.jpg"))),
        ("sqlite", &db, line(FeatureSource::open(&db))),
        ("sqlite", &db, line(read::descriptors(&db, &input))),
        ("scans", &e57, line(read::open(&e57))),
        ("parquet", &folder.path().to_owned(), line(hash::hash_stage(folder.path()))),
    ];
    for (feature, path, found) in found {
        let path = path.display();
        let expected = format!("expected unlift-io with the feature `{feature}`");
        assert_eq!(found, format!("{path}: {expected}, found a build without it"));
    }
}
