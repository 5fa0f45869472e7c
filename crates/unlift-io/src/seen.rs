//! Detects changes of files since they were first read.

use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::error::Error;
use crate::stage::part_files;

/// Metadata of files before they were read: length, time of the last change and, on Unix, the
/// inode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen(Vec<(PathBuf, Option<Stamp>)>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    len: u64,
    modified: Option<SystemTime>,
    /// Device, inode number, and seconds and nanoseconds of the last inode change.
    entry: (u64, u64, i64, i64),
}

impl Stamp {
    fn of(path: &Path) -> Option<Self> {
        let found = fs::metadata(path).ok()?;
        Some(Self { len: found.len(), modified: found.modified().ok(), entry: entry(&found) })
    }
}

#[cfg(unix)]
fn entry(found: &Metadata) -> (u64, u64, i64, i64) {
    use std::os::unix::fs::MetadataExt;
    (found.dev(), found.ino(), found.ctime(), found.ctime_nsec())
}

#[cfg(not(unix))]
fn entry(_: &Metadata) -> (u64, u64, i64, i64) {
    (0, 0, 0, 0)
}

impl Seen {
    /// Records the metadata of files. Call it before reading them.
    pub fn new<P: Into<PathBuf>>(paths: impl IntoIterator<Item = P>) -> Self {
        let seen = |path: P| {
            let path = path.into();
            let stamp = Stamp::of(&path);
            (path, stamp)
        };
        Self(paths.into_iter().map(seen).collect())
    }

    /// Records the metadata of stage files, and of the parts in folders of parts.
    pub fn of_stages<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Self {
        let files = |path: &'a Path| match path.is_dir() {
            // Errors are reported when the files are read.
            true => part_files(path).unwrap_or_default(),
            false => vec![path.to_owned()],
        };
        Self::new(paths.into_iter().flat_map(files))
    }

    /// The number of files.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns true if there are no files.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the first of the files `which` (by index) that has changed or is missing.
    ///
    /// # Panics
    /// When there is no such file.
    pub fn changed(&self, which: impl IntoIterator<Item = usize>) -> Option<&Path> {
        let files = which.into_iter().map(|at| &self.0[at]);
        let mut others = files.filter(|(path, stamp)| stamp.is_none() || Stamp::of(path) != *stamp);
        others.next().map(|(path, _)| path.as_path())
    }

    /// Checks that no file has changed.
    ///
    /// # Errors
    /// When a file has changed or is missing.
    pub fn check(&self) -> Result<(), Error> {
        match self.changed(0..self.0.len()) {
            None => Ok(()),
            Some(path) => {
                let found = "one that has changed since";
                Err(Error::new(path, "", "the file as it was when reading began", found))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_file_of_the_same_name_and_length_is_another() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        fs::write(&a, "one").unwrap();
        fs::write(&b, "two").unwrap();
        let seen = Seen::new([&a, &b]);
        assert!(seen.check().is_ok() && seen.changed([0, 1]).is_none());
        fs::rename(&b, &a).unwrap();
        if cfg!(unix) {
            assert_eq!(seen.changed([0, 1]), Some(&*a));
        }
        assert_eq!(seen.changed([1]), Some(&*b));
        let found = seen.check().unwrap_err().to_string();
        assert!(found.ends_with(
            "expected the file as it was when reading began, found one that has changed since"
        ));
        let seen = Seen::new([&a]);
        fs::write(&a, "grown").unwrap();
        assert_eq!(seen.changed([0]), Some(&*a));
        // A file that never existed counts as changed.
        assert_eq!(Seen::new([&b]).changed([0]), Some(&*b));
    }
}
