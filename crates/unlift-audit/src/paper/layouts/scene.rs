use std::path::PathBuf;

use super::poses::Poses;

/// A scene of a dataset, as found on disk.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name, which is that of its folder: `chess`, `apt1/kitchen`.
    pub name: String,
    /// Its folder.
    pub root: PathBuf,
    /// The folder that names of photos are relative to.
    pub photos: PathBuf,
    /// Names of the existing photos of the test split, sorted.
    pub test: Vec<String>,
    /// The reason for missing photos of the split, if any are missing.
    pub lacking: Option<String>,
    /// The map, as a path for [`unlift_io::read::open`].
    pub map: Option<PathBuf>,
    /// The camera poses.
    pub poses: Poses,
}
