//! Tests readers of maps, descriptors and features, stage files, and exports of clouds.

mod clouds;
mod descriptors;
mod features;
mod malformed;
mod models;
mod others;
mod real_maps;
mod stages;

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use unlift_io::atomic::{Access, OutputFile};
use unlift_io::read::{self, Input};
use unlift_io::stage::ImageWriter;

const POINTS: [[f64; 3]; 3] = [[0.5, -1.25, 3.0], [1000.0, 2.0, -0.0625], [0.125, 0.25, 0.375]];

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn fixture(name: &str) -> Vec<u8> {
    fs::read(data(name)).unwrap()
}

/// Returns a path in a folder of its own.
fn place(name: &str) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    (dir, path)
}

fn write(name: &str, contents: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let (dir, path) = place(name);
    fs::write(&path, contents).unwrap();
    (dir, path)
}

/// Opens a map with this name and content.
fn open(name: &str, contents: impl AsRef<[u8]>) -> Input {
    let (_dir, path) = write(name, contents);
    read::open(&path).unwrap()
}

/// Returns the error line of a map with this name and content.
fn refused(name: &str, contents: impl AsRef<[u8]>) -> String {
    let (dir, path) = write(name, contents);
    shown(dir.path(), &read::open(&path).unwrap_err())
}

/// Returns the line of an error about a file in `dir`, with its path relative to `dir`.
fn shown(dir: &Path, error: &unlift_io::Error) -> String {
    let line = error.to_string();
    let line = line.strip_prefix(dir.to_str().unwrap()).expect("errors begin with the path");
    line.trim_start_matches(['/', '\\']).to_owned()
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for file in fs::read_dir(from).unwrap().map(Result::unwrap) {
        if file.path().is_file() {
            fs::copy(file.path(), to.join(file.file_name())).unwrap();
        }
    }
}

/// Copies a database of the fixtures to `path` and runs a statement on it.
fn write_database(path: &Path, name: &str, statement: &str) {
    fs::copy(data(name), path).unwrap();
    let database = rusqlite::Connection::open(path).unwrap();
    database.execute_batch(statement).unwrap();
    database.close().unwrap();
}

fn total(rows: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|axis| rows.iter().map(|p| p[axis]).sum())
}

fn close(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let is_near = |axis: usize| (found[axis] - expected[axis]).abs() <= tolerance;
    assert!((0..3).all(is_near), "{found:?}, expected {expected:?}");
}

/// Returns a file beside the repository, or `None` with a message.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(name);
    let found = path.exists().then_some(path);
    if found.is_none() {
        println!("skipped: shared/{name} is not beside the repository");
    }
    found
}

/// An `.npy` file. Its values begin at byte 128 unless the type is long.
fn npy(descr: &str, shape: &str, values: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}");
    let text = format!("{text:117}\n");
    let length = (text.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\0", &length[..], text.as_bytes(), values].concat()
}

/// An `.npz` file; every second array is deflated.
fn archive(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
    use std::io::Write;
    use zip::write::{SimpleFileOptions, ZipWriter};
    let mut out = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (at, (name, bytes)) in arrays.iter().enumerate() {
        let method = [zip::CompressionMethod::Deflated, zip::CompressionMethod::Stored][at % 2];
        let options = SimpleFileOptions::default().compression_method(method);
        out.start_file(format!("{name}.npy"), options).unwrap();
        out.write_all(bytes).unwrap();
    }
    out.finish().unwrap().into_inner()
}

/// Writes a stage file of many images.
fn write_images(path: &Path, fill: impl FnOnce(&mut ImageWriter<'_>)) {
    let mut output = OutputFile::create(path, Access::Private).unwrap();
    let mut images = ImageWriter::start(&mut output);
    fill(&mut images);
    images.finish().unwrap();
    output.commit().unwrap();
}
