//! A folder of photos or with a small map, and the program run in it as a user would.

// Every test program has a copy of this file and uses its own part of it.
#![allow(dead_code)]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use image::RgbImage;

/// A folder of its own per test.
pub struct Place(tempfile::TempDir);

impl Place {
    /// With these photos in `photos`, each of its own kind.
    pub fn with_photos(names: &[&str]) -> Self {
        let place = Self(tempfile::tempdir().expect("a temporary folder"));
        for (at, name) in names.iter().enumerate() {
            let path = place.path("photos").join(name);
            fs::create_dir_all(path.parent().expect("a folder")).unwrap();
            photo(at as u32).save(path).unwrap();
        }
        place
    }

    /// With `n_points` of a made-up room in `room.csv`.
    pub fn with_room(n_points: usize) -> Self {
        let place = Self(tempfile::tempdir().expect("a temporary folder"));
        place.write_points("room.csv", &unlift::synthetic::room(1, n_points).points);
        place
    }

    /// Writes `points` as a table.
    pub fn write_points(&self, name: &str, points: &[[f64; 3]]) {
        let text: String = points.iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
        fs::write(self.path(name), text).unwrap();
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// What a run that must end with `code` printed: on stdout, and on stderr.
    pub fn ends(&self, line: &str, code: i32) -> (String, String) {
        let Output { status, stdout, stderr } = Command::new(env!("CARGO_BIN_EXE_unlift"))
            .args(line.split_whitespace())
            .current_dir(self.0.path())
            .output()
            .expect("the program starts");
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        let (stdout, stderr) = (text(stdout), text(stderr));
        assert_eq!(status.code(), Some(code), "{line}\n{stderr}");
        (stdout, stderr)
    }
}

/// Blobs of several sizes; `which` moves them.
pub fn photo(which: u32) -> RgbImage {
    RgbImage::from_fn(128, 96, |x, y| {
        let (x, y) = (f64::from(x + 9 * which), f64::from(y));
        let wave = (x / 5.0).sin() * (y / 7.0).cos() + (x * y / 90.0).sin();
        let value = (127.0 + 60.0 * wave) as u8;
        image::Rgb([value, value, 255 - value])
    })
}
