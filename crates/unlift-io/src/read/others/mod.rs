//! Reads maps of other programs, in COLMAP's conventions.

pub mod bundler;
pub mod json;
pub mod nvm;

use std::path::{Path, PathBuf};

/// The files to look for in a folder without a COLMAP model, in this order.
const IN_FOLDERS: [&str; 5] = [
    "reconstruction.json",
    "opensfm/reconstruction.json",
    "transforms.json",
    "bundle.out",
    "bundle/bundle.out",
];

pub(super) fn in_folder(path: &Path) -> Option<PathBuf> {
    IN_FOLDERS.map(|name| path.join(name)).into_iter().find(|file| file.is_file())
}
