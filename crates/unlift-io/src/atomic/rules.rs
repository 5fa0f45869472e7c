//! Rules for replacing files.

use std::collections::{HashMap, HashSet, VecDeque};
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::{Kind, OutputFile};
use crate::Error;

/// The inputs of a run, and the permission to replace files of other programs.
#[derive(Clone, Debug, Default)]
pub struct Rules {
    inputs: Vec<PathBuf>,
    /// The input files by identity, found on first use.
    files: Arc<OnceLock<HashMap<Identity, PathBuf>>>,
    force: bool,
}

/// The maximum depth of the search for inputs in folders.
const DEPTH: usize = 8;
/// Extensions of models, databases, photos and parts of stage files.
const READ_FROM_FOLDERS: [&str; 10] =
    ["bin", "txt", "db", "jpg", "jpeg", "jpe", "jfif", "png", "webp", "parquet"];

impl Rules {
    /// Creates the rules of a run that reads `inputs`: files, and folders with the models,
    /// databases and photos below them.
    ///
    /// `force` permits replacing files of other programs, but never inputs.
    pub fn new<'a>(inputs: impl IntoIterator<Item = &'a Path>, force: bool) -> Self {
        let inputs = inputs.into_iter().map(Path::to_owned).collect();
        Self { inputs, files: Arc::default(), force }
    }

    /// Checks that a file of `kind` may be written at `path`, and returns its place with links
    /// resolved.
    ///
    /// # Errors
    /// When no file can be written there, the place is an input, or it has a file of another kind
    /// and `force` is not set.
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

    /// Checks the file `name` of a folder that may not exist yet.
    pub(super) fn check_in(&self, folder: &Path, name: &Path, kind: Kind) -> Result<(), Error> {
        let place = folder.join(name);
        if place.exists() || place.is_symlink() {
            self.check(&place, kind)?;
        }
        Ok(())
    }

    /// Returns the input that is the same file as `target`, under any path.
    fn input_at(&self, target: &Path) -> Option<&Path> {
        let files = self.files.get_or_init(|| files(&self.inputs));
        files.get(&identity(target)?).map(PathBuf::as_path)
    }
}

/// Finds the files among and below `inputs`. Each folder is visited once, even if several links
/// lead to it.
fn files(inputs: &[PathBuf]) -> HashMap<Identity, PathBuf> {
    let (mut files, mut folders) = (HashMap::new(), HashSet::new());
    let mut waiting: VecDeque<(PathBuf, usize)> =
        inputs.iter().map(|path| (path.clone(), DEPTH)).collect();
    // Breadth first: a folder that is reached twice is searched at its smallest depth.
    while let Some((path, depth)) = waiting.pop_front() {
        let Some(identity) = identity(&path) else { continue };
        if !path.is_dir() {
            files.entry(identity).or_insert(path);
        } else if depth > 0 && folders.insert(identity) {
            let Ok(entries) = fs::read_dir(&path) else { continue };
            let inside = entries.flatten().map(|entry| entry.path());
            let inside = inside.filter(|path| is_read_from_folders(path) || path.is_dir());
            waiting.extend(inside.map(|path| (path, depth - 1)));
        }
    }
    files
}

/// Returns an absolute path, without links and `..`, that is equal for all names of one place, even
/// if nothing exists there yet.
pub fn place_of(path: &Path) -> PathBuf {
    let mut place = std::path::absolute(Path::new(".")).unwrap_or_default();
    for step in path.components() {
        match step {
            Component::ParentDir => drop(place.pop()),
            Component::CurDir => {}
            step => place.push(step),
        }
        place = fs::canonicalize(&place).unwrap_or(place);
    }
    place
}

fn is_read_from_folders(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    ending.is_some_and(|ending| READ_FROM_FOLDERS.contains(&ending.as_str()))
}

#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(not(unix))]
type Identity = PathBuf;

#[cfg(unix)]
fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).ok().map(|found| (found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path) -> Option<Identity> {
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
        let told = |input: &str, force| {
            let rules = Rules::new([at(input).as_path()], force);
            rules.check(&at("audit.json"), Kind::AuditJson).map_err(|error| error.to_string())
        };
        let error = told("missing", false).unwrap_err();
        let rule = "expected nothing, or an audit.json of an earlier run (else --force), found another file";
        assert!(error.ends_with(rule), "{error}");
        assert!(told("missing", true).is_ok());
        assert!(told(".", true).is_ok());
        fs::hard_link(at("audit.json"), at("link")).unwrap();
        fs::create_dir_all(at("deep/er")).unwrap();
        fs::hard_link(at("audit.json"), at("deep/er/p.JPG")).unwrap();
        #[cfg(unix)]
        for name in 0..30 {
            // Links to their own folder make 30 times 30 times .. paths to one photo.
            std::os::unix::fs::symlink(".", at(&format!("l{name}"))).unwrap();
        }
        for input in ["audit.json", "link", "deep", "."] {
            let error = told(input, true).unwrap_err();
            assert!(error.contains("expected a file that is not read, found the input"), "{error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn names_of_one_place_are_equal_whatever_stands_there() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("real")).unwrap();
        std::os::unix::fs::symlink("real", at("link")).unwrap();
        let place = place_of(&at("real/out"));
        let names = ["link/out", "new/../real/out", "link/../real/./out", "link/a/b/../../out"];
        for name in names {
            assert_eq!(place_of(&at(name)), place, "{name}");
        }
        assert_ne!(place_of(&at("out")), place);
        assert_eq!(place_of(&at("link")), place_of(&at("real")));
        assert_eq!(place_of(Path::new("a")), place_of(Path::new("./b/../a")));
        fs::write(at("map.ply"), "ply").unwrap();
        std::os::unix::fs::symlink(at("map.ply"), at("out.ply")).unwrap();
        let rules = Rules::new([at("map.ply").as_path()], true);
        assert!(rules.check(&at("out.ply"), Kind::Cloud).is_err());
    }
}
