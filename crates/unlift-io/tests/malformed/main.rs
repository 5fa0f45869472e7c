//! Tests of malformed files: the exact error line of each, and no panic for any cut or changed
//! byte.

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

fn patched(mut file: Vec<u8>, at: usize, bytes: &[u8]) -> Vec<u8> {
    file[at..at + bytes.len()].copy_from_slice(bytes);
    file
}

fn appended(mut file: Vec<u8>, bytes: &[u8]) -> Vec<u8> {
    file.extend(bytes);
    file
}

/// A count that exceeds any file.
const MANY: [u8; 8] = 1_000_000_000_000_000_000_u64.to_le_bytes();

/// A malformed input: its files (or, ending in `/`, a folder), the path to open, and the error
/// line.
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

fn alone(
    what: &'static str,
    name: &'static str,
    bytes: impl AsRef<[u8]>,
    line: &'static str,
) -> Row {
    row(what, vec![(name, bytes.as_ref().to_vec())], name, line)
}

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

#[test]
fn what_is_wrong_with_cameras_is_told() {
    for row in colmap::cameras() {
        let dir = tempfile::tempdir().unwrap();
        let notes = read::open(&make(dir.path(), &row)).expect(row.what).notes;
        assert!(notes.iter().any(|note| note.ends_with(row.line)), "{}: {notes:?}", row.what);
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

/// They must be an error before they are opened.
#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_refused() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().unwrap();
    let refused = ": expected a file, found a pipe, a socket or a device";
    let names = [
        "a.csv",
        "a.xyz",
        "a.txt",
        "a.ply",
        "a.npy",
        "a.las",
        "a.pcd",
        "a.e57",
        "points3D.bin",
        "points3D.txt",
    ];
    for name in names {
        let link = dir.path().join(name);
        symlink("/dev/zero", &link).unwrap();
        let error = read::open(&link).unwrap_err();
        assert_eq!(shown(dir.path(), &error), format!("{name}{refused}"));
    }
    let map = read::open(&fixtures().join("cloud.ply")).unwrap();
    let place = |name: &str| dir.path().join(name);
    let error = read::descriptors(&place("a.npy"), &map).unwrap_err();
    assert_eq!(shown(dir.path(), &error), format!("a.npy{refused}"));
    symlink("/dev/zero", place("a.parquet")).unwrap();
    let error = unlift_io::stage::peek(&place("a.parquet")).unwrap_err();
    assert_eq!(shown(dir.path(), &error), format!("a.parquet{refused}"));

    let pipe = place("pipe.ply");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    if !made.is_ok_and(|status| status.success()) {
        eprintln!("skipped: there is no mkfifo here");
        return;
    }
    let line = format!("pipe.ply{refused}");
    assert_eq!(shown(dir.path(), &read::open(&pipe).unwrap_err()), line);
    assert_eq!(shown(dir.path(), &read::descriptors(&pipe, &map).unwrap_err()), line);
    assert_eq!(shown(dir.path(), &unlift_io::stage::peek(&pipe).unwrap_err()), line);
}

#[test]
fn a_line_without_end_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.csv");
    fs::write(&path, vec![b'1'; (16 << 20) + 1]).unwrap();
    let line = "a.csv:1: expected a line of at most 16 MiB, found a longer one";
    assert_eq!(shown(dir.path(), &read::open(&path).unwrap_err()), line);
}
