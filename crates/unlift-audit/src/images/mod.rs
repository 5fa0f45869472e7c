//! Features of images from wherever they are: a folder of photos, hloc's HDF5, a COLMAP database, memory.

pub mod audit;
pub mod choice;
mod drawn;
pub mod extraction;
mod folder;
mod in_memory;
mod job;
pub mod parts;
mod pictures;
pub mod stream;

use std::path::Path;

use unlift_features::Extraction;
use unlift_features::load::Turn;
use unlift_io::features::{self, ImageFeatures};

use crate::Error;

pub use folder::{Folder, is_photo};
pub use in_memory::InMemory;

/// Images by name, one at a time. Shared by threads; memory grows by names only.
///
/// All images in parallel, in order and in constant memory is `in_order` of `unlift-features` over the
/// numbers of [`names`](Self::names), with `get` in its work.
pub enum FeatureSource {
    /// Photos, whose features are extracted when they are asked for.
    Folder(Folder),
    /// A file.
    File(features::FeatureSource),
    /// What the caller has, or makes.
    InMemory(InMemory),
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

    /// How photos are turned in whose pixels the keypoints are.
    pub fn turn(&self) -> Turn {
        match self {
            Self::Folder(folder) => folder.turn(),
            Self::File(file) if !file.is_upright() => Turn::AsStored,
            Self::File(_) | Self::InMemory(_) => Turn::Upright,
        }
    }

    /// Sets how photos of a folder are turned. It changes nothing for a file, which says how its photos were turned.
    #[must_use]
    pub fn with_turn(self, turn: Turn) -> Self {
        match self {
            Self::Folder(folder) => Self::Folder(folder.with_turn(turn)),
            other => other,
        }
    }

    /// Names of all images, sorted by their bytes.
    pub fn names(&self) -> &[String] {
        match self {
            Self::Folder(folder) => folder.names(),
            Self::File(file) => file.names(),
            Self::InMemory(images) => images.names(),
        }
    }

    /// What was found beside images and cannot be used, one error each.
    pub fn refused(&self) -> &[unlift_io::Error] {
        match self {
            Self::Folder(folder) => folder.refused(),
            Self::File(file) => file.refused(),
            Self::InMemory(_) => &[],
        }
    }

    /// What was found beside images and passed over, in a line.
    pub fn passed_over(&self) -> Option<&str> {
        match self {
            Self::Folder(folder) => folder.passed_over(),
            Self::File(_) | Self::InMemory(_) => None,
        }
    }

    /// A file of the images `which` that is not what it was when it was opened.
    pub fn changed(&self, which: &[usize]) -> Option<&Path> {
        match self {
            Self::Folder(folder) => folder.changed(which),
            Self::File(file) => file.changed(),
            Self::InMemory(_) => None,
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
            Self::InMemory(images) => images.get(at),
        }
    }

    /// The first of `chosen` that can be read and has keypoints: what it has and lacks is asked before the work, which tells of
    /// the others.
    pub fn first(&self, chosen: &[usize]) -> Option<ImageFeatures> {
        let mut read = chosen.iter().filter_map(|&at| self.get(at).ok());
        read.find(|image| !image.keypoints.is_empty())
    }
}
