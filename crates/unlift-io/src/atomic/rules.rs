//! What an output may replace: nothing that is read in the same run, and nothing of others unless told so.

use std::fs;
use std::path::{Path, PathBuf};

use super::{Kind, OutputFile};
use crate::Error;

/// What a run reads, and whether it may replace files of others.
#[derive(Clone, Debug, Default)]
pub struct Rules {
    inputs: Vec<PathBuf>,
    force: bool,
}

/// Folders in folders that are looked into: a project's models and photos.
const DEPTH: usize = 8;
/// Endings of what is read from folders: models, databases, photos, parts of stage files.
const READ_FROM_FOLDERS: [&str; 10] =
    ["bin", "txt", "db", "jpg", "jpeg", "jpe", "jfif", "png", "webp", "parquet"];

impl Rules {
    /// The rules of a run that reads `inputs`: files, and folders with the models, databases and photos below
    /// them. With `force` files of others are replaced; inputs never are.
    pub fn new<'a>(inputs: impl IntoIterator<Item = &'a Path>, force: bool) -> Self {
        Self { inputs: inputs.into_iter().map(Path::to_owned).collect(), force }
    }

    /// Whether `kind` may be written at `path`; where it will stand, links followed.
    ///
    /// # Errors
    /// When no file can be written there, an input stands there (under whatever name), or a file that is not of
    /// this kind does and that is not forced.
    pub fn check(&self, path: &Path, kind: Kind) -> Result<PathBuf, Error> {
        let target = OutputFile::check(path)?;
        if !target.exists() {
            return Ok(target);
        }
        if let Some(input) = self.input_at(&target) {
            let found = format!("the input {}", input.display());
            return Err(Error::new(path, "", "a file that is not read", found));
        }
        if !self.force && !kind.is_at(&target) {
            let expected = format!("nothing, or {kind} of an earlier run (else --force)");
            return Err(Error::new(path, "", expected, "another file"));
        }
        Ok(target)
    }

    /// The input that is the same file as `target`, by whatever path or link.
    fn input_at(&self, target: &Path) -> Option<PathBuf> {
        let target = identity(target)?;
        let mut waiting: Vec<(PathBuf, usize)> =
            self.inputs.iter().map(|path| (path.clone(), DEPTH)).collect();
        while let Some((path, depth)) = waiting.pop() {
            if path.is_dir() {
                let Ok(entries) = fs::read_dir(&path) else { continue };
                let inside = entries.flatten().map(|entry| entry.path());
                let inside = inside.filter(|path| is_read_from_folders(path) || path.is_dir());
                if depth > 0 {
                    waiting.extend(inside.map(|path| (path, depth - 1)));
                }
            } else if identity(&path).as_ref() == Some(&target) {
                return Some(path);
            }
        }
        None
    }
}

fn is_read_from_folders(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.is_some_and(|ending| READ_FROM_FOLDERS.contains(&ending.as_str()))
}

/// What two paths to one file share.
#[cfg(unix)]
fn identity(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).ok().map(|found| (found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<PathBuf> {
    fs::canonicalize(path).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_files_need_force_and_inputs_are_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("audit.json"), "{}").unwrap();
        let rules = |inputs: &[PathBuf], force| {
            Rules::new(inputs.iter().map(PathBuf::as_path), force)
                .check(&at("audit.json"), Kind::AuditJson)
                .map_err(|error| error.to_string())
        };
        let error = rules(&[], false).unwrap_err();
        let rule = "expected nothing, or an audit.json of an earlier run (else --force), found another file";
        assert!(error.ends_with(rule), "{error}");
        assert!(rules(&[], true).is_ok());
        fs::hard_link(at("audit.json"), at("link")).unwrap();
        fs::create_dir_all(at("deep/er")).unwrap();
        fs::hard_link(at("audit.json"), at("deep/er/p.JPG")).unwrap();
        // Earlier outputs in an input folder are no inputs.
        let own = Rules::new([folder.path()], true).check(&at("audit.json"), Kind::AuditJson);
        assert!(own.unwrap_err().to_string().contains("p.JPG"));
        fs::write(at("report.html"), "other").unwrap();
        assert!(Rules::new([folder.path()], true).check(&at("report.html"), Kind::Page).is_ok());
        for input in ["audit.json", "link", "deep", "."] {
            let error = rules(&[at(input)], true).unwrap_err();
            assert!(error.contains("expected a file that is not read, found the input"), "{error}");
        }
        assert!(rules(&[at("missing")], true).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn symbolic_links_lead_to_the_input() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("map.ply"), "ply").unwrap();
        std::os::unix::fs::symlink(at("map.ply"), at("out.ply")).unwrap();
        let rules = Rules::new([at("map.ply").as_path()], true);
        assert!(rules.check(&at("out.ply"), Kind::Cloud).is_err());
    }
}
