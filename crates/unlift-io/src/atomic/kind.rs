//! Whose file stands at a place: known by its content, as a name proves nothing.

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use serde_json::Value;

use crate::stage;

/// What unlift writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `audit.json`: an object with a text `unlift` and a number `schema`.
    AuditJson,
    /// `report.html`: its head names unlift as the generator.
    Page,
    /// A Parquet file whose metadata names this kind.
    Stage(stage::Kind),
    /// What a folder of parts holds: an object with an object `unlift` and a list `parts`.
    Manifest,
    /// A PLY or OBJ file with the comment `CLOUD_COMMENT` in its second line at the latest.
    Cloud,
    /// A file of a COLMAP model in text whose first line is `MODEL_MARK`.
    Model,
    /// nerfstudio's cameras: an object with a text `unlift` and a list `frames`.
    Transforms,
    /// HDF5 with `FEATURES_MARK` behind the superblock.
    Features,
    /// A PNG whose first chunk of text names unlift, as [`marked_picture`] has it.
    Picture,
    /// JUnit XML whose root is named unlift.
    Junit,
    /// SARIF whose first run is by unlift.
    Sarif,
    /// A table of figures: CSV with `TABLE_COLUMNS` first, or LaTeX or Markdown with a comment that names unlift first.
    Table,
    /// An SVG whose comment in the first line names unlift.
    Curves,
}

/// The columns that a CSV table of ours begins with.
const TABLE_COLUMNS: &str = "scheme,neighbors,oracle_noise,inlier_ratio,";
/// First words of files of text, by kind.
const JUNIT_MARK: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"unlift\"";
const TABLE_MARKS: [&str; 3] = [TABLE_COLUMNS, "% unlift ", "<!-- unlift "];
const CURVES_MARK: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?><!-- unlift ";
/// The comment in clouds.
pub(crate) const CLOUD_COMMENT: &str = "unlift";
/// The first line of the files of a model.
pub(crate) const MODEL_MARK: &str = "# unlift model";
/// Between the superblock and the first array of features: no structure of HDF5 refers to it.
pub(crate) const FEATURES_MARK: &[u8; 32] = b"unlift features, format 1\0\0\0\0\0\0\0";
/// A chunk of a PNG: its length, the text "Software: unlift", its checksum.
const PICTURE_MARK: &[u8; 27] = b"\0\0\0\x0ftEXtSoftware\0unlift\xfe\xc8\xcb\xd5";
/// Signature and first chunk of a PNG, behind which others may stand.
const PNG_HEAD: usize = 33;

/// The bytes of a PNG, known as one of ours.
#[must_use]
pub fn marked_picture(png: &[u8]) -> Vec<u8> {
    let (head, rest) = png.split_at(PNG_HEAD.min(png.len()));
    [head, PICTURE_MARK, rest].concat()
}

/// In the head of a page.
const PAGE_MARK: &str = "<meta name=\"generator\" content=\"unlift\">";
/// The head of a page ends before its style.
const PAGE_HEAD: usize = 2048;

impl Kind {
    /// Whether the file at `path` is one of this kind. What cannot be read is none.
    pub fn is_at(self, path: &Path) -> bool {
        match self {
            Self::AuditJson => {
                is_json(path, |audit| audit["unlift"].is_string() && audit["schema"].is_u64())
            }
            Self::Page => start(path, PAGE_HEAD)
                .is_some_and(|head| String::from_utf8_lossy(&head).contains(PAGE_MARK)),
            Self::Stage(kind) => stage::declared_kind(path) == Some(kind),
            Self::Manifest => {
                is_json(path, |parts| parts["unlift"].is_object() && parts["parts"].is_array())
            }
            Self::Cloud => start(path, 256).is_some_and(|head| is_cloud(&head)),
            Self::Model => begins(path, &[MODEL_MARK]),
            Self::Transforms => {
                is_json(path, |map| map["unlift"].is_string() && map["frames"].is_array())
            }
            Self::Features => start(path, 128).is_some_and(|head| {
                head.starts_with(b"\x89HDF\r\n\x1a\n") && head.get(96..) == Some(&FEATURES_MARK[..])
            }),
            Self::Picture => start(path, PNG_HEAD + PICTURE_MARK.len())
                .is_some_and(|head| head.get(PNG_HEAD..) == Some(&PICTURE_MARK[..])),
            Self::Junit => begins(path, &[JUNIT_MARK]),
            Self::Sarif => is_json(path, |log| {
                log["version"].is_string() && log["runs"][0]["tool"]["driver"]["name"] == "unlift"
            }),
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
            Self::Transforms => f.write_str("cameras for nerfstudio"),
            Self::Features => f.write_str("features"),
            Self::Picture => f.write_str("a picture"),
            Self::Junit => f.write_str("gates as JUnit XML"),
            Self::Sarif => f.write_str("gates as SARIF"),
            Self::Table => f.write_str("a table"),
            Self::Curves => f.write_str("curves"),
        }
    }
}

/// The first `n` bytes of a file that may have fewer.
fn start(path: &Path, n: usize) -> Option<Vec<u8>> {
    let mut head = Vec::with_capacity(n);
    File::open(path).ok()?.take(n as u64).read_to_end(&mut head).ok()?;
    Some(head)
}

/// Whether a text begins with one of `marks`.
fn begins(path: &Path, marks: &[&str]) -> bool {
    let most = marks.iter().map(|mark| mark.len()).max().unwrap_or(0);
    let head = start(path, most);
    head.is_some_and(|head| marks.iter().any(|mark| head.starts_with(mark.as_bytes())))
}

fn is_json(path: &Path, holds: impl FnOnce(Value) -> bool) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let parsed: Result<Value, _> = serde_json::from_reader(BufReader::new(file));
    parsed.is_ok_and(holds)
}

fn is_cloud(head: &[u8]) -> bool {
    let mut lines = head.split(|&byte| byte == b'\n');
    match lines.next() {
        Some(b"ply") => {
            let comment = format!("comment {CLOUD_COMMENT}");
            lines.nth(1).is_some_and(|line| line == comment.as_bytes())
        }
        Some(line) => line == format!("# {CLOUD_COMMENT}").as_bytes(),
        None => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn files_of_others_are_not_ours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        let kinds = [
            Kind::AuditJson,
            Kind::Page,
            Kind::Stage(stage::Kind::Truth),
            Kind::Manifest,
            Kind::Cloud,
            Kind::Transforms,
            Kind::Features,
            Kind::Junit,
            Kind::Sarif,
            Kind::Table,
            Kind::Curves,
        ];
        let of_others: [&[u8]; 14] = [
            br#"{"frames": [], "ply_file_path": "sparse_pc.ply"}"#,
            b"",
            b"{}",
            // What `npm audit --json` writes, in short.
            br#"{"auditReportVersion": 2, "vulnerabilities": {}, "metadata": {}}"#,
            br#"["unlift", "schema"]"#,
            b"<!doctype html><title>my notes on unlift</title>",
            b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
            b"# Blender\nv 0 0 0\n",
            b"\x89HDF\r\n\x1a\n",
            b"PAR1PAR1",
            b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"nextest-run\">",
            br#"{"version": "2.1.0", "runs": [{"tool": {"driver": {"name": "other"}}}]}"#,
            b"scheme,price\n",
            b"<?xml version=\"1.0\" encoding=\"UTF-8\"?><!-- Inkscape -->",
        ];
        for content in of_others {
            fs::write(&path, content).unwrap();
            for kind in kinds {
                assert!(!kind.is_at(&path), "{kind}: {}", String::from_utf8_lossy(content));
            }
        }
        fs::write(&path, [b"\x89HDF\r\n\x1a\n".as_slice(), &[0; 200]].concat()).unwrap();
        assert!(!Kind::Features.is_at(&path));
    }

    #[test]
    fn our_own_are_known() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        let is = |kind: Kind, content: &[u8]| {
            fs::write(&path, content).unwrap();
            kind.is_at(&path)
        };
        assert!(is(Kind::AuditJson, br#"{"unlift": "0.1.0", "schema": 1, "results": []}"#));
        assert!(is(Kind::Junit, format!("{JUNIT_MARK} tests=\"1\">").as_bytes()));
        let sarif = br#"{"version": "2.1.0", "runs": [{"tool": {"driver": {"name": "unlift"}}}]}"#;
        assert!(is(Kind::Sarif, sarif));
        for mark in TABLE_MARKS {
            assert!(is(Kind::Table, format!("{mark}k\n").as_bytes()));
        }
        assert!(is(Kind::Curves, format!("{CURVES_MARK}curves -->\n<svg>").as_bytes()));
        assert!(is(Kind::Page, format!("<!doctype html>\n<head>{PAGE_MARK}").as_bytes()));
        let points = [[1.0, 2.0, 3.0]];
        crate::clouds::write_points(&path, &points, None).unwrap();
        assert!(Kind::Cloud.is_at(&path));
        crate::clouds::write_lines(&path, &[[[0.0; 3], [1.0; 3]]]).unwrap();
        assert!(Kind::Cloud.is_at(&path));
    }
}
