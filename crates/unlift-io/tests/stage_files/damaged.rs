//! Files cut short or with bytes changed: an error, never a panic.

use crate::maps;
use std::fs;
use std::path::{Path, PathBuf};
use unlift_io::{Error, stage};

const N: usize = 60;

type Read = fn(&Path) -> Result<(), Error>;

/// A valid file of every kind and family, with its reader.
fn valid_files(folder: &Path) -> Vec<(PathBuf, Read)> {
    let mut files: Vec<(PathBuf, Read)> = Vec::new();
    for (at, released) in maps::released::<3>(8, N).iter().enumerate() {
        let path = folder.join(format!("released_{at}.parquet"));
        stage::write_released(&path, released).unwrap();
        files.push((path, |path| stage::read_released::<3>(path).map(drop)));
    }
    let path = folder.join("truth.parquet");
    let (original, secret) = maps::truth::<3>(2, N);
    stage::write_truth(&path, &original, &secret).unwrap();
    files.push((path, |path| stage::read_truth::<3>(path).map(drop)));
    let path = folder.join("neighborhoods.parquet");
    stage::write_neighborhoods(&path, &maps::neighborhoods(2, N, 1)).unwrap();
    files.push((path, |path| stage::read_neighborhoods(path, N, 1).map(drop)));
    let path = folder.join("recovered.parquet");
    stage::write_recovered(&path, &maps::recovered::<3>(1, N)).unwrap();
    files.push((path, |path| stage::read_recovered::<3>(path).map(drop)));
    files
}

#[test]
fn cut_short_anywhere_is_an_error_of_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (path, read) in valid_files(folder.path()) {
        read(&path).unwrap();
        let bytes = fs::read(&path).unwrap();
        let cut = folder.path().join("cut.parquet");
        let step = (bytes.len() / 300).max(1);
        let near_end = bytes.len().saturating_sub(40)..bytes.len();
        for length in (0..bytes.len()).step_by(step).chain(0..40).chain(near_end) {
            fs::write(&cut, &bytes[..length]).unwrap();
            let error = read(&cut).expect_err("a file cut short was read").to_string();
            assert!(!error.contains('\n') && error.contains("cut.parquet"), "{error}");
            assert!(stage::peek(&cut).is_err());
        }
    }
}

#[test]
fn changed_bytes_are_an_error_or_another_value() {
    let folder = tempfile::tempdir().unwrap();
    let changed = folder.path().join("changed.parquet");
    for (path, read) in valid_files(folder.path()) {
        let bytes = fs::read(&path).unwrap();
        // The footer, where the counts stand, whole; the data in steps.
        let footer = bytes.len().saturating_sub(800);
        let step = (footer / 100).max(1);
        for at in (0..footer).step_by(step).chain(footer..bytes.len()) {
            for mask in [0x01, 0xff] {
                let mut bytes = bytes.clone();
                bytes[at] ^= mask;
                fs::write(&changed, &bytes).unwrap();
                if let Err(error) = read(&changed) {
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
            }
        }
    }
}

#[test]
fn what_is_no_parquet_file_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let message = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = stage::peek(&path).unwrap_err().to_string();
        error.split_once(": ").unwrap().1.to_owned()
    };
    assert_eq!(message("a", b""), "expected a Parquet file, found an empty file");
    assert_eq!(
        message("b", b"ply\nformat ascii 1.0\n"),
        "expected a Parquet file, found a file that does not begin with PAR1"
    );
    assert_eq!(
        message("c", b"PAR1 and then nothing"),
        "expected a Parquet file, found one cut short after 21 bytes"
    );
    assert_eq!(message("d", b"PA"), "expected a Parquet file, found one cut short after 2 bytes");
    let error = stage::peek(folder.path()).unwrap_err().to_string();
    assert!(error.ends_with(": expected a file, found a folder"), "{error}");
    let error = stage::peek(&folder.path().join("none")).unwrap_err().to_string();
    assert!(error.ends_with(": expected a file or folder, found nothing"), "{error}");
}
