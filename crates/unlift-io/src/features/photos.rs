//! The photos in a folder.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::Error;

/// File name endings of photos. The format is detected from the bytes.
const ENDINGS: [&str; 6] = ["jpg", "jpeg", "jpe", "jfif", "png", "webp"];
/// File name endings of images that cannot be read; they are counted and skipped.
const OTHER_ENDINGS: [&str; 24] = [
    "arw", "avif", "bmp", "cr2", "cr3", "dng", "exr", "gif", "hdr", "heic", "heif", "j2k", "jp2",
    "jxl", "nef", "orf", "pbm", "pgm", "ppm", "raf", "rw2", "tga", "tif", "tiff",
];

/// The photos in a folder and its subfolders.
#[derive(Debug, Default)]
pub struct Photos {
    /// Their names, relative to the folder and sorted, and their paths.
    pub photos: Vec<(String, PathBuf)>,
    /// Entries that cannot be used.
    pub refused: Vec<Error>,
    /// Number of images of other formats, by the ending of their names.
    pub others: BTreeMap<String, usize>,
}

impl Photos {
    /// Lists the photos in `root` and its subfolders, each folder once: under its own name, or
    /// under the first link to it. Names that begin with a dot are skipped.
    pub fn list(root: &Path) -> Self {
        let (mut listing, mut visited) = (Self::default(), HashSet::new());
        // Links between folders can create endless paths. They come after all folders, so that
        // photos have the names of their own folders, and sorted, so that the result does not
        // depend on the file system.
        let mut waiting = BTreeSet::from([(false, String::new(), root.to_owned())]);
        while let Some((_, name, folder)) = waiting.pop_first() {
            let Ok(real) = fs::canonicalize(&folder) else { continue };
            if visited.insert(real) {
                listing.add(&name, &folder, &mut waiting);
            }
        }
        listing.photos.sort_unstable();
        listing
    }

    /// Adds the files in `folder`, whose name is `prefix`. Adds to `waiting`, for each subfolder,
    /// whether it is a link, its name and its path.
    fn add(
        &mut self,
        prefix: &str,
        folder: &Path,
        waiting: &mut BTreeSet<(bool, String, PathBuf)>,
    ) {
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(source) => return self.refused.push(Error::read(folder, source)),
        };
        for entry in entries {
            let (path, is_link) = match entry {
                Ok(entry) => (entry.path(), entry.file_type().is_ok_and(|kind| kind.is_symlink())),
                Err(source) => {
                    self.refused.push(Error::read(folder, source));
                    continue;
                }
            };
            let file_name = path.file_name().unwrap_or_default();
            if file_name.as_encoded_bytes().starts_with(b".") {
                continue;
            }
            let name = file_name.to_str().map(|name| match prefix {
                "" => name.to_owned(),
                _ => format!("{prefix}/{name}"),
            });
            let ending = path.extension().unwrap_or_default().to_string_lossy();
            let ending = ending.to_ascii_lowercase();
            let (is_folder, is_photo) = (path.is_dir(), ENDINGS.contains(&&*ending));
            if !is_folder && OTHER_ENDINGS.contains(&&*ending) {
                *self.others.entry(ending).or_default() += 1;
            }
            match name {
                Some(name) if is_folder => _ = waiting.insert((is_link, name, path)),
                Some(name) if is_photo => self.photos.push((name, path)),
                None if is_folder || is_photo => {
                    let found = "another encoding";
                    self.refused.push(Error::new(&path, "", "a name in UTF-8", found));
                }
                _ => {}
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn folders_that_link_to_each_other_are_listed_once() {
        let (dir, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        // Twelve folders that link to each other: 12! paths.
        for at in 0..12 {
            let folder = dir.path().join(format!("f{at:02}"));
            fs::create_dir(&folder).unwrap();
            fs::write(folder.join("a.jpg"), "").unwrap();
            for to in 0..12 {
                symlink(dir.path().join(format!("f{to:02}")), folder.join(format!("a{to}")))
                    .unwrap();
            }
        }
        fs::write(outside.path().join("b.jpg"), "").unwrap();
        symlink(outside.path(), dir.path().join("link")).unwrap();
        symlink(outside.path().join("b.jpg"), dir.path().join("c.jpg")).unwrap();
        let mut expected: Vec<String> = (0..12).map(|at| format!("f{at:02}/a.jpg")).collect();
        expected.splice(0..0, ["c.jpg".to_owned()]);
        expected.push("link/b.jpg".to_owned());
        let listing = Photos::list(dir.path());
        let names: Vec<String> = listing.photos.into_iter().map(|(name, _)| name).collect();
        assert_eq!((names, listing.refused.len()), (expected, 0));
    }
}
