//! Helpers of the tests: a temporary folder with inputs, and runs of the program in it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use image::RgbImage;
use serde_json::Value;
use unlift::Descriptors;
use unlift_io::features::{FeatureSource, FeatureWriter, ImageFeatures};

pub struct Place(tempfile::TempDir);

/// Name, keypoints and descriptors of an image.
pub type Image = (String, Vec<[f64; 2]>, Option<Descriptors>);

impl Place {
    pub fn empty() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// Creates a folder with three photos in `photos`, each with its own content.
    pub fn with_photos() -> Self {
        let place = Self::empty();
        for (file, which) in [("photos/a.png", 0), ("photos/b/c.jpg", 1), ("photos/b/ü d.webp", 2)]
        {
            place.write(file, "");
            photo(which).save(place.path(file)).unwrap();
        }
        place
    }

    /// Creates a folder with `n_points` of the synthetic room in `room.csv`.
    pub fn with_room(n_points: usize) -> Self {
        let place = Self::empty();
        place.write_points("room.csv", &unlift::synthetic::room(1, n_points).points);
        place
    }

    /// Creates a folder with the same room, and descriptors of `dim` bytes of its points in `d.bin`.
    pub fn with_described_room(n_points: usize, dim: u32) -> Self {
        let place = Self::with_room(n_points);
        place.write_descriptors("d.bin", &unlift::synthetic::room(1, n_points).points, dim);
        place
    }

    /// Writes a file and its parent folders.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::create_dir_all(self.path(name).parent().expect("a folder")).unwrap();
        fs::write(self.path(name), content).unwrap();
    }

    pub fn write_points(&self, name: &str, points: &[[f64; 3]]) {
        let text: String = points.iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
        self.write(name, text);
    }

    /// Writes a descriptor of `dim` bytes per point; near points have similar ones.
    pub fn write_descriptors(&self, name: &str, points: &[[f64; 3]], dim: u32) {
        let mut bytes = b"P3DESC01".to_vec();
        bytes.extend((points.len() as u64).to_le_bytes());
        bytes.extend([dim.to_le_bytes(), 1u32.to_le_bytes()].concat());
        (0..points.len() as u64).for_each(|id| bytes.extend(id.to_le_bytes()));
        points.iter().for_each(|point| bytes.extend(descriptor(point, dim)));
        self.write(name, bytes);
    }

    /// Writes features of images of 640 x 480 pixels in hloc's format.
    pub fn write_features(&self, file: &str, images: impl IntoIterator<Item = Image>) {
        let mut writer = FeatureWriter::create(&self.path(file)).unwrap();
        for (name, keypoints, descriptors) in images {
            let size = Some([640, 480]);
            let image = ImageFeatures { name, size, keypoints, descriptors, ..Default::default() };
            writer.append(&image).unwrap();
        }
        writer.finish().unwrap();
    }

    /// Reads the features of all images of a file.
    pub fn features(&self, name: &str) -> Vec<ImageFeatures> {
        let source = FeatureSource::open(&self.path(name)).unwrap();
        (0..source.names().len()).map(|at| source.get(at).unwrap()).collect()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).expect("UTF-8")
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.text(name)).expect("JSON")
    }

    pub fn n_entries(&self, folder: &str) -> usize {
        fs::read_dir(self.path(folder)).unwrap().count()
    }

    /// Returns a command that runs the program with these words in the folder; words such as
    /// `RAYON_NUM_THREADS=1` are variables.
    pub fn program<'a>(&self, words: impl IntoIterator<Item = &'a str>) -> Command {
        let is_name = |name: &str| name.chars().all(|c| c.is_ascii_uppercase() || c == '_');
        let mut command = Command::new(env!("CARGO_BIN_EXE_unlift"));
        for word in words {
            match word.split_once('=').filter(|(name, _)| is_name(name)) {
                Some((name, value)) => command.env(name, value),
                None => command.arg(word),
            };
        }
        command.current_dir(self.0.path());
        command
    }

    /// Runs a line in a shell; `unlift` is the program of this build.
    pub fn shell(&self, line: &str) -> Output {
        let ours = Path::new(env!("CARGO_BIN_EXE_unlift")).parent().expect("a folder").to_owned();
        let others = std::env::var_os("PATH").unwrap_or_default();
        let path = [ours].into_iter().chain(std::env::split_paths(&others));
        let mut shell = Command::new("sh");
        shell.args(["-c", line]).env("PATH", std::env::join_paths(path).expect("a path"));
        shell.current_dir(self.0.path()).stdin(Stdio::null()).output().expect("a shell")
    }

    /// Runs a line that must end with `code`, and returns stdout and stderr.
    pub fn ends(&self, line: &str, code: i32) -> (String, String) {
        let output = self.program(line.split_whitespace()).output().expect("the program starts");
        let (stdout, stderr) = texts(&output);
        assert_eq!(output.status.code(), Some(code), "{line}\n{stderr}");
        (stdout, stderr)
    }

    /// Runs a line that must end with `code` and an empty stdout, and returns stderr.
    pub fn complains(&self, line: &str, code: i32) -> String {
        let (stdout, stderr) = self.ends(line, code);
        assert!(stdout.is_empty(), "{line}: {stdout}");
        stderr
    }

    /// Runs lines of a command, each of which must end with its code, an empty stdout and this text on stderr.
    pub fn refuses(&self, command: &str, lines: &[(&str, i32, &str)]) {
        for (line, code, expected) in lines {
            let told = self.complains(&format!("{command} {line}"), *code);
            assert!(told.contains(expected), "{line}: {told}");
        }
    }

    /// Runs a line that must end with `code`, and returns the JSON from stdout.
    pub fn prints(&self, line: &str, code: i32) -> Value {
        serde_json::from_str(&self.ends(line, code).0).expect("JSON")
    }
}

/// Returns the rows of an audit's document.
pub fn rows(document: &Value) -> &[Value] {
    document["results"].as_array().expect("rows")
}

/// Returns the row of an audit's document for a scheme and a source.
pub fn row<'a>(document: &'a Value, scheme: &str, neighbors: &str) -> &'a Value {
    let is_row = |row: &&Value| row["scheme"] == scheme && row["neighbors"] == neighbors;
    rows(document).iter().find(is_row).unwrap_or_else(|| panic!("{scheme} {neighbors}"))
}

/// Returns the percentage that a row recovers within a threshold.
pub fn recovered(row: &Value, threshold: &str) -> f64 {
    row["recovered_percent"][threshold].as_f64().expect("a percentage")
}

pub fn texts(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    (text(&output.stdout), text(&output.stderr))
}

/// Returns a number in [0, 1) for any index.
pub fn random(at: usize) -> f64 {
    (at as f64 * 0.754_877_666 + 0.1).fract()
}

/// Draws blobs of several sizes at positions that depend on `which`.
fn photo(which: u32) -> RgbImage {
    RgbImage::from_fn(128, 96, |x, y| {
        let (x, y) = (f64::from(x + 9 * which), f64::from(y));
        let wave = (x / 5.0).sin() * (y / 7.0).cos() + (x * y / 90.0).sin();
        let value = (127.0 + 60.0 * wave) as u8;
        image::Rgb([value, value, 255 - value])
    })
}

/// Returns a descriptor that varies smoothly with the position of the point.
pub fn descriptor(point: &[f64; 3], dim: u32) -> impl Iterator<Item = u8> {
    let [x, y, z] = *point;
    (0..dim).map(move |c| {
        let phase = x + y * f64::from(c % 3) + z * f64::from(c % 5);
        (60.0 + 55.0 * (phase + f64::from(c * c)).sin()) as u8
    })
}
