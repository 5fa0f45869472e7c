//! Every file of the fixtures, cut at every length and with every byte changed: no panic, and
//! errors of one line.

use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use unlift_io::read;

use super::colmap::MODEL;
use super::{fixture, fixtures, shown};

/// Returns true on success. An error must be one line that begins with a path in `dir`.
fn opens_or_one_line(dir: &Path, path: &Path) -> bool {
    match read::open(path) {
        Ok(_) => true,
        Err(error) => {
            let line = shown(dir, &error);
            assert!(!line.contains('\n') && line.contains(": "), "{line}");
            false
        }
    }
}

/// Calls `check` with a copy of a fixture: its folder, the path to open, the file `name` and its
/// bytes.
fn sweep(folder: &str, name: &str, mut check: impl FnMut(&Path, &Path, &Path, &[u8])) {
    let dir = tempfile::tempdir().unwrap();
    let is_model = !folder.is_empty();
    if is_model {
        for file in fs::read_dir(fixtures().join(folder)).unwrap() {
            let file = file.unwrap();
            if file.path().is_dir() {
                continue;
            }
            fs::copy(file.path(), dir.path().join(file.file_name())).unwrap();
        }
    }
    let original = fixture(Path::new(folder).join(name).to_str().unwrap());
    let path = dir.path().join(name);
    fs::write(&path, &original).unwrap();
    let opened = if is_model { dir.path() } else { &path };
    check(dir.path(), opened, &path, &original);
}

const FIXTURES: [(&str, &str); 17] = [
    (MODEL, "cameras.bin"),
    (MODEL, "images.bin"),
    (MODEL, "points3D.bin"),
    ("rig-bin", "cameras.bin"),
    ("rig-bin", "frames.bin"),
    ("rig-bin", "images.bin"),
    ("rig-bin", "points3D.bin"),
    ("rig-bin", "rigs.bin"),
    ("rig-txt", "cameras.txt"),
    ("rig-txt", "frames.txt"),
    ("rig-txt", "images.txt"),
    ("rig-txt", "points3D.txt"),
    ("rig-txt", "rigs.txt"),
    ("", "cloud.ply"),
    ("", "f8.npy"),
    ("", "f8-fortran.npy"),
    ("", "f4-big-endian.npy"),
];

/// Rewriting a file for each change is slow.
struct InPlace(File);

impl InPlace {
    fn open(path: &Path) -> Self {
        Self(File::options().write(true).open(path).unwrap())
    }

    fn cut(&self, len: usize) {
        self.0.set_len(len as u64).unwrap();
    }

    fn change(&mut self, at: usize, byte: u8) {
        self.0.seek(SeekFrom::Start(at as u64)).unwrap();
        self.0.write_all(&[byte]).unwrap();
    }
}

#[test]
fn files_cut_at_any_length_open_or_are_refused() {
    for (folder, name) in FIXTURES {
        sweep(folder, name, |dir, opened, path, original| {
            // Text may end after any line, and cameras, rigs and frames are optional. Other files
            // have counts.
            let is_needed = !["cameras.bin", "rigs.bin", "frames.bin"].contains(&name);
            let needs_all = is_needed && !name.ends_with(".txt");
            let file = InPlace::open(path);
            for n in (0..original.len()).rev() {
                file.cut(n);
                let opens = opens_or_one_line(dir, opened);
                assert!(!(opens && needs_all), "{folder}/{name} cut at {n} opens");
            }
        });
    }
}

#[test]
fn files_with_any_byte_changed_open_or_are_refused() {
    for (folder, name) in FIXTURES {
        sweep(folder, name, |dir, opened, path, original| {
            let mut file = InPlace::open(path);
            for (at, &byte) in original.iter().enumerate() {
                for other in [0, 0xff, b'9'] {
                    file.change(at, other);
                    opens_or_one_line(dir, opened);
                }
                file.change(at, byte);
            }
        });
    }
}

#[test]
fn descriptors_cut_at_any_length_or_with_any_byte_changed_are_read_or_refused() {
    let input = read::open(&fixtures().join("project")).unwrap();
    // In steps, because SQLite has its own tests.
    for (name, step) in [("descriptors.bin", 1), ("database.db", 37), ("floats.db", 37)] {
        sweep("project", name, |_, _, path, original| {
            let mut file = InPlace::open(path);
            for at in (0..original.len()).step_by(step) {
                file.change(at, !original[at]);
                if let Err(error) = read::descriptors(path, &input) {
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
                file.change(at, original[at]);
            }
            for at in (0..original.len()).rev().step_by(step) {
                file.cut(at);
                let cut = read::descriptors(path, &input);
                assert!(cut.is_err() || step > 1, "{name} cut at {at}");
            }
        });
    }
}
