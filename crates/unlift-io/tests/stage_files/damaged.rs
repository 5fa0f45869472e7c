//! Files cut short or with bytes changed: an error, never a panic.

use crate::maps;
use std::fs::{self, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
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
        let length = fs::metadata(&path).unwrap().len() as usize;
        let step = (length / 300).max(1);
        let mut cuts: Vec<usize> = (0..length).step_by(step).chain(0..40).collect();
        cuts.extend(length.saturating_sub(40)..length);
        cuts.sort();
        // Shorter and shorter in place: to rewrite a file may wait for the disk.
        let file = OpenOptions::new().write(true).open(&path).unwrap();
        for &cut in cuts.iter().rev() {
            file.set_len(cut as u64).unwrap();
            let error = read(&path).expect_err("a file cut short was read").to_string();
            assert!(!error.contains('\n') && error.contains(".parquet: "), "{error}");
            assert!(stage::peek(&path).is_err());
        }
    }
}

#[test]
fn changed_bytes_are_an_error_or_another_value() {
    let folder = tempfile::tempdir().unwrap();
    for (path, read) in valid_files(folder.path()) {
        let bytes = fs::read(&path).unwrap();
        // The footer, where the counts stand, whole; the data in steps.
        let footer = bytes.len().saturating_sub(800);
        let step = (footer / 300).max(1);
        let mut file = OpenOptions::new().write(true).open(&path).unwrap();
        let mut put = |at: usize, byte: u8| {
            file.seek(SeekFrom::Start(at as u64)).unwrap();
            file.write_all(&[byte]).unwrap();
        };
        for at in (0..footer).step_by(step).chain(footer..bytes.len()) {
            for mask in [0x01, 0x80, 0xff] {
                put(at, bytes[at] ^ mask);
                if let Err(error) = read(&path) {
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
                put(at, bytes[at]);
            }
        }
        read(&path).unwrap();
    }
}

/// Lengths and places that follow shift into each other's: of 3.8 kB without 36 bytes a reader that trusted them was busy for half a
/// minute.
#[test]
fn missing_bytes_are_an_error_or_another_value() {
    let folder = tempfile::tempdir().unwrap();
    for (path, read) in valid_files(folder.path()) {
        let bytes = fs::read(&path).unwrap();
        let footer = bytes.len().saturating_sub(800);
        let places =
            (0..footer).step_by((footer / 60).max(1)).chain((footer..bytes.len()).step_by(5));
        for (at, missing) in places.flat_map(|at| [1, 36].map(|missing| (at, missing))) {
            let rest = bytes.get(at + missing..).unwrap_or_default();
            fs::write(&path, [&bytes[..at], rest].concat()).unwrap();
            if let Err(error) = read(&path) {
                assert!(!error.to_string().contains('\n'), "{error}");
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
    assert!(error.ends_with("found a folder without .parquet"), "{error}");
    let error = stage::peek(&folder.path().join("none")).unwrap_err().to_string();
    assert!(error.ends_with(": expected a file or folder, found nothing"), "{error}");
}
