//! Malformed files: the exact line each is refused with, and no panic for any cut or changed byte.

mod clouds;
mod colmap;
mod descriptors;
mod sweeps;

use std::fs;
use std::path::{Path, PathBuf};

use unlift_io::read;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn fixture(name: &str) -> Vec<u8> {
    fs::read(fixtures().join(name)).unwrap()
}

/// A file with other bytes at `at`.
fn patched(mut file: Vec<u8>, at: usize, bytes: &[u8]) -> Vec<u8> {
    file[at..at + bytes.len()].copy_from_slice(bytes);
    file
}

fn appended(mut file: Vec<u8>, bytes: &[u8]) -> Vec<u8> {
    file.extend(bytes);
    file
}

/// A count that no file holds.
const MANY: [u8; 8] = 1_000_000_000_000_000_000_u64.to_le_bytes();

/// One way to be wrong: files (or, ending in `/`, a folder), which of them is opened, and the line.
struct Row {
    what: &'static str,
    files: Vec<(&'static str, Vec<u8>)>,
    open: &'static str,
    line: &'static str,
}

fn row(
    what: &'static str,
    files: Vec<(&'static str, Vec<u8>)>,
    open: &'static str,
    line: &'static str,
) -> Row {
    Row { what, files, open, line }
}

/// A single file of any kind.
fn alone(
    what: &'static str,
    name: &'static str,
    bytes: impl AsRef<[u8]>,
    line: &'static str,
) -> Row {
    row(what, vec![(name, bytes.as_ref().to_vec())], name, line)
}

/// Makes the files of a row in `dir`; the path to open.
fn make(dir: &Path, row: &Row) -> PathBuf {
    for (name, bytes) in &row.files {
        let path = dir.join(name);
        if name.ends_with('/') {
            fs::create_dir_all(path).unwrap();
        } else {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }
    if row.open.is_empty() { dir.to_owned() } else { dir.join(row.open) }
}

/// The error without the temporary folder.
fn shown(dir: &Path, error: &unlift_io::Error) -> String {
    let dir = dir.to_str().unwrap();
    let line = error.to_string();
    let line = line.strip_prefix(dir).expect("errors begin with the path");
    line.trim_start_matches(['/', '\\']).to_owned()
}

#[test]
fn every_malformed_file_is_refused_with_its_line() {
    let tables = [
        colmap::binary(),
        colmap::last_record_cuts(),
        colmap::text(),
        clouds::ply(),
        clouds::tables(),
        clouds::arrays(),
        clouds::paths(),
    ];
    for row in tables.into_iter().flatten() {
        let dir = tempfile::tempdir().unwrap();
        let path = make(dir.path(), &row);
        let error = read::open(&path).expect_err(row.what);
        assert_eq!(shown(dir.path(), &error), row.line, "{}", row.what);
    }
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_be_read_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.csv");
    fs::write(&path, "1,2,3").unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::read(&path).is_ok() {
        eprintln!("skipped: this user may read everything");
        return;
    }
    assert_eq!(
        shown(dir.path(), &read::open(&path).unwrap_err()),
        "a.csv: expected a readable file, found no permission to read"
    );
}
