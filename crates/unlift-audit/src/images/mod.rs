//! Features of images from wherever they are: a folder of photos, hloc's HDF5, a COLMAP database.

pub mod audit;
mod folder;
pub mod parts;
mod pictures;
pub mod stream;

use std::path::Path;

use unlift_features::Extraction;
use unlift_io::features::{self, ImageFeatures};

use crate::Error;

pub use folder::{Folder, is_photo};

/// Numbers of at most `most` of `n` images, evenly spaced: the middles of as many equal parts.
pub fn evenly_spaced(n: usize, most: Option<usize>) -> Vec<usize> {
    let most = most.unwrap_or(n).min(n);
    (0..most).map(|at| ((2 * at + 1) * n) / (2 * most)).collect()
}

/// Images by name, one at a time. Shared by threads; memory grows by names only.
///
/// All images in parallel, in order and in constant memory is `in_order` of `unlift-features` over the
/// numbers of [`names`](Self::names), with `get` in its work.
pub enum FeatureSource {
    /// Photos, whose features are extracted when they are asked for.
    Folder(Folder),
    /// A file.
    File(features::FeatureSource),
}

impl FeatureSource {
    /// Opens a folder of photos, or a file of features.
    ///
    /// # Errors
    /// When there is no such thing, or no image in it.
    pub fn open(path: &Path, extraction: &Extraction) -> Result<Self, Error> {
        let metadata = std::fs::metadata(path).map_err(|e| unlift_io::Error::read(path, e))?;
        Ok(match metadata.is_dir() {
            true => Self::Folder(Folder::open(path, extraction)?),
            false => Self::File(features::FeatureSource::open(path)?),
        })
    }

    /// Names of all images, sorted by their bytes.
    pub fn names(&self) -> &[String] {
        match self {
            Self::Folder(folder) => folder.names(),
            Self::File(file) => file.names(),
        }
    }

    /// What was found beside images and cannot be used, one error each.
    pub fn refused(&self) -> &[unlift_io::Error] {
        match self {
            Self::Folder(folder) => folder.refused(),
            Self::File(_) => &[],
        }
    }

    /// What was found beside images and passed over, in a line.
    pub fn passed_over(&self) -> Option<&str> {
        match self {
            Self::Folder(folder) => folder.passed_over(),
            Self::File(_) => None,
        }
    }

    /// The features of image `at` of [`names`](Self::names).
    ///
    /// # Errors
    /// One line when this image cannot be used; others may be.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        match self {
            Self::Folder(folder) => folder.get(at),
            Self::File(file) => Ok(file.get(at)?),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_evenly_spaced_and_all_without_a_limit() {
        assert_eq!(evenly_spaced(4, None), [0, 1, 2, 3]);
        assert_eq!(evenly_spaced(10, Some(3)), [1, 5, 8]);
        assert_eq!(evenly_spaced(3, Some(9)), [0, 1, 2]);
        assert_eq!(evenly_spaced(0, Some(2)), [0; 0]);
    }
}
