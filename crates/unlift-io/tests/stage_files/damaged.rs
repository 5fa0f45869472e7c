//! Tests truncated files and files with changed bytes: errors, never a panic.

use crate::maps;
use std::fs::{self, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use unlift_io::{Error, stage};

const N: usize = 60;

type Read = fn(&Path) -> Result<(), Error>;

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
        // Truncates the file in place, because rewriting it is slow.
        let file = OpenOptions::new().write(true).open(&path).unwrap();
        for &cut in cuts.iter().rev() {
            file.set_len(cut as u64).unwrap();
            let error = read(&path).expect_err("a file cut short was read").to_string();
            assert!(!error.contains('\n') && error.contains(".parquet: "), "{error}");
            assert!(stage::peek(&path).is_err());
        }
    }
}

/// Changes the footer, which has the counts, at every `step`, and the data at `n` places.
///
/// Missing bytes turn later lengths and offsets into others: a reader that trusted them took half a
/// minute for 3.8 kB without 36 bytes.
#[test]
fn changed_or_missing_bytes_are_an_error_or_another_value() {
    let folder = tempfile::tempdir().unwrap();
    for (path, read) in valid_files(folder.path()) {
        let bytes = fs::read(&path).unwrap();
        let footer = bytes.len().saturating_sub(800);
        let places = |n: usize, step: usize| {
            (0..footer).step_by((footer / n).max(1)).chain((footer..bytes.len()).step_by(step))
        };
        let one_line = || {
            if let Err(error) = read(&path) {
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        };
        let mut file = OpenOptions::new().write(true).open(&path).unwrap();
        let mut put = |at: usize, byte: u8| {
            file.seek(SeekFrom::Start(at as u64)).unwrap();
            file.write_all(&[byte]).unwrap();
        };
        for at in places(300, 1) {
            for mask in [0x01, 0x80, 0xff] {
                put(at, bytes[at] ^ mask);
                one_line();
                put(at, bytes[at]);
            }
        }
        read(&path).unwrap();
        for (at, missing) in places(60, 5).flat_map(|at| [1, 36].map(|missing| (at, missing))) {
            let rest = bytes.get(at + missing..).unwrap_or_default();
            fs::write(&path, [&bytes[..at], rest].concat()).unwrap();
            one_line();
        }
    }
}

#[test]
fn what_is_no_parquet_file_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    for (bytes, found) in [
        (&b""[..], "an empty file"),
        (b"ply\nformat ascii 1.0\n", "a file that does not begin with PAR1"),
        (b"PAR1 and then nothing", "one cut short after 21 bytes"),
        (b"PA", "one cut short after 2 bytes"),
    ] {
        fs::write(&path, bytes).unwrap();
        let line = stage::peek(&path).unwrap_err().to_string();
        assert!(line.ends_with(&format!(": expected a Parquet file, found {found}")), "{line}");
    }
    let error = stage::peek(folder.path()).unwrap_err().to_string();
    assert!(error.ends_with("found a folder without .parquet"), "{error}");
    let error = stage::peek(&folder.path().join("none")).unwrap_err().to_string();
    assert!(error.ends_with(": expected a file or folder, found nothing"), "{error}");
}
