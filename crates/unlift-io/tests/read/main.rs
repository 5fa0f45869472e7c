//! Tests valid files: what pycolmap and NumPy wrote is read exactly.

mod clouds;
mod descriptors;
mod habits;
mod models;
mod others;
mod places;

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn write(name: &str, contents: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    fs::write(&path, contents).unwrap();
    (dir, path)
}

fn total(rows: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|axis| rows.iter().map(|p| p[axis]).sum())
}

fn close(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let near = |(a, b): (f64, f64)| (a - b).abs() <= tolerance;
    let all = found.into_iter().zip(expected).all(near);
    assert!(all, "{found:?}, expected {expected:?}");
}
