//! One scene, as it was found.

use std::path::PathBuf;

use super::poses::Poses;

/// A scene of a dataset, as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name, which is that of its folder: `chess`, `apt1/kitchen`.
    pub name: String,
    /// Its folder.
    pub root: PathBuf,
    /// The folder by which photos are named.
    pub photos: PathBuf,
    /// Names of the photos of the test split that are there, sorted.
    pub test: Vec<String>,
    /// Why there are fewer than the split has, or none.
    pub lacking: Option<String>,
    /// The map, as [`unlift_io::read::open`] takes it.
    pub map: Option<PathBuf>,
    /// Where the cameras stood.
    pub poses: Poses,
}
