//! Recognizes files that unlift wrote by their content.

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use serde_json::Value;

use crate::stage;

/// A kind of file that unlift writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `audit.json`: an object with a string `unlift` and a number `schema`.
    AuditJson,
    /// `report.html`: its head names unlift as the generator.
    Page,
    /// A Parquet file whose metadata names this kind.
    Stage(stage::Kind),
    /// The manifest of a folder of parts: an object with an object `unlift` and a list `parts`.
    Manifest,
    /// A PLY or OBJ file that begins with the comment `CLOUD_COMMENT`.
    Cloud,
    /// A text file of a COLMAP model whose first line is `MODEL_MARK`.
    Model,
    /// An HDF5 file with `FEATURES_MARK` after the superblock.
    Features,
    /// A PNG whose first text chunk names unlift, as written by [`marked_picture`].
    Picture,
    /// JUnit XML whose root element is named unlift.
    Junit,
    /// A table of figures: CSV with the columns of `TABLE_MARKS`, or LaTeX or Markdown with a
    /// comment that names unlift.
    Table,
    /// An SVG whose first line has a comment that names unlift.
    Curves,
}

pub(crate) const CLOUD_COMMENT: &str = "unlift";
const CLOUD_MARKS: [&str; 2] =
    ["ply\nformat binary_little_endian 1.0\ncomment unlift\n", "# unlift\n"];
/// The first line of each file of a COLMAP model.
pub(crate) const MODEL_MARK: &str = "# unlift model";
const JUNIT_MARK: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"unlift\"";
const TABLE_MARKS: [&str; 3] =
    ["scheme,neighbors,oracle_noise,inlier_ratio,", "% unlift ", "<!-- unlift "];
const CURVES_MARK: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?><!-- unlift ";
/// The head of a page ends before the style.
const PAGE_MARK: &str = "<meta name=\"generator\" content=\"unlift\">";
const PAGE_HEAD: usize = 2048;
/// A mark after the superblock. No HDF5 structure refers to it.
pub(crate) const FEATURES_MARK: &[u8; 32] = b"unlift features, format 1\0\0\0\0\0\0\0";
const SUPERBLOCK: usize = 96;
/// A PNG chunk: length, the text "Software: unlift", checksum.
const PICTURE_MARK: &[u8; 27] = b"\0\0\0\x0ftEXtSoftware\0unlift\xfe\xc8\xcb\xd5";
/// Bytes of the signature and first chunk of a PNG.
const PNG_HEAD: usize = 33;

/// Adds the mark of [`Kind::Picture`] to the bytes of a PNG.
#[must_use]
pub fn marked_picture(png: &[u8]) -> Vec<u8> {
    let (head, rest) = png.split_at(PNG_HEAD.min(png.len()));
    [head, PICTURE_MARK, rest].concat()
}

impl Kind {
    /// Returns true if the file at `path` is of this kind, and false if it cannot be read.
    pub fn is_at(self, path: &Path) -> bool {
        match self {
            Self::AuditJson => {
                is_json(path, |audit| audit["unlift"].is_string() && audit["schema"].is_u64())
            }
            Self::Page => String::from_utf8_lossy(&start(path, PAGE_HEAD)).contains(PAGE_MARK),
            Self::Stage(kind) => stage::declared_kind(path) == Some(kind),
            Self::Manifest => {
                is_json(path, |parts| parts["unlift"].is_object() && parts["parts"].is_array())
            }
            Self::Cloud => begins(path, &CLOUD_MARKS),
            Self::Model => begins(path, &[MODEL_MARK]),
            Self::Features => has_at(path, SUPERBLOCK, FEATURES_MARK),
            Self::Picture => has_at(path, PNG_HEAD, PICTURE_MARK),
            Self::Junit => begins(path, &[JUNIT_MARK]),
            Self::Table => begins(path, &TABLE_MARKS),
            Self::Curves => begins(path, &[CURVES_MARK]),
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AuditJson => f.write_str("an audit.json"),
            Self::Page => f.write_str("a report"),
            Self::Stage(kind) => kind.fmt(f),
            Self::Manifest => f.write_str("a manifest of parts"),
            Self::Cloud => f.write_str("a cloud"),
            Self::Model => f.write_str("a model"),
            Self::Features => f.write_str("features"),
            Self::Picture => f.write_str("a picture"),
            Self::Junit => f.write_str("gates as JUnit XML"),
            Self::Table => f.write_str("a table"),
            Self::Curves => f.write_str("curves"),
        }
    }
}

/// Returns the first `n` bytes of a file, or fewer if it is shorter or cannot be read.
fn start(path: &Path, n: usize) -> Vec<u8> {
    let mut head = Vec::new();
    let _ = File::open(path).and_then(|file| file.take(n as u64).read_to_end(&mut head));
    head
}

fn begins(path: &Path, marks: &[&str]) -> bool {
    marks.iter().any(|mark| has_at(path, 0, mark.as_bytes()))
}

fn has_at(path: &Path, offset: usize, mark: &[u8]) -> bool {
    start(path, offset + mark.len()).get(offset..) == Some(mark)
}

fn is_json(path: &Path, holds: impl FnOnce(Value) -> bool) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let parsed: Result<Value, _> = serde_json::from_reader(BufReader::new(file));
    parsed.is_ok_and(holds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// Stage files, features, models and pictures are tested elsewhere.
    const OURS: [(Kind, &str); 8] = [
        (Kind::AuditJson, r#"{"unlift": "0.1.0", "schema": 1, "results": []}"#),
        (Kind::Manifest, r#"{"unlift": {}, "parts": []}"#),
        (Kind::Page, "<!doctype html>\n<head><meta name=\"generator\" content=\"unlift\">"),
        (Kind::Junit, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"unlift\" t"),
        (Kind::Curves, "<?xml version=\"1.0\" encoding=\"UTF-8\"?><!-- unlift curves --><svg>"),
        (Kind::Table, "scheme,neighbors,oracle_noise,inlier_ratio,k\n"),
        (Kind::Table, "% unlift k\n"),
        (Kind::Table, "<!-- unlift k\n"),
    ];
    const OF_OTHERS: [&str; 13] = [
        "",
        "{}",
        r#"["unlift", "schema", "parts"]"#,
        r#"{"auditReportVersion": 2, "vulnerabilities": {}, "metadata": {}}"#,
        r#"{"frames": [], "ply_file_path": "sparse_pc.ply"}"#,
        r#"{"version": "2.1.0", "runs": [{"tool": {"driver": {"name": "other"}}}]}"#,
        "<!doctype html><title>my notes on unlift</title>",
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"nextest-run\">",
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><!-- Inkscape -->",
        "scheme,price\n",
        "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
        "# Blender\nv 0 0 0\n",
        "PAR1PAR1",
    ];

    #[test]
    fn our_own_are_known_and_those_of_others_are_not_ours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        for (kind, content) in OURS {
            fs::write(&path, content).unwrap();
            assert!(kind.is_at(&path), "{kind}");
        }
        crate::clouds::write_points(&path, &[[1.0, 2.0, 3.0]]).unwrap();
        assert!(Kind::Cloud.is_at(&path));
        crate::clouds::write_lines(&path, &[[[0.0; 3], [1.0; 3]]]).unwrap();
        assert!(Kind::Cloud.is_at(&path));
        let stage = Kind::Stage(stage::Kind::Truth);
        let more = [Kind::Cloud, Kind::Features, Kind::Picture, Kind::Model, stage];
        let features = format!("\u{89}HDF\r\n\u{1a}\n{}", "\0".repeat(200));
        for content in OF_OTHERS.into_iter().chain([features.as_str()]) {
            fs::write(&path, content).unwrap();
            for kind in OURS.into_iter().map(|ours| ours.0).chain(more) {
                assert!(!kind.is_at(&path), "{kind}: {content}");
            }
        }
    }
}
