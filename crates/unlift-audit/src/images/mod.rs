//! Features of images from a folder of photos, an HDF5 file of hloc, a COLMAP database, or memory.

pub mod audit;
pub mod choice;
pub mod extraction;
mod folder;
mod pictures;
pub mod stream;

use std::path::Path;

use unlift_io::features::{self, ImageFeatures};
use unlift_vision::features::Extraction;
use unlift_vision::features::photo::Turn;

use crate::Error;

pub use folder::{Folder, is_photo};

/// Images by name, read one at a time. Threads can share it; it holds the names only.
///
/// To read all images in parallel, in order and in constant memory, call `in_order` of
/// `unlift-vision` over the indices of [`names`](Self::names), with `get` as its work.
pub enum FeatureSource {
    /// Photos, whose features are extracted on request.
    Folder(Folder),
    /// A file of features.
    File(features::FeatureSource),
    /// Images of the caller.
    InMemory(InMemory),
}

impl FeatureSource {
    /// Opens a folder of photos, or a file of features.
    ///
    /// # Errors
    /// If `path` does not exist, or contains no image.
    pub fn open(path: &Path, extraction: &Extraction) -> Result<Self, Error> {
        let metadata = std::fs::metadata(path).map_err(|e| unlift_io::Error::read(path, e))?;
        Ok(match metadata.is_dir() {
            true => Self::Folder(Folder::open(path, extraction)?),
            false => Self::File(features::FeatureSource::open(path)?),
        })
    }

    /// Returns the orientation of photos in which keypoints are pixels.
    pub fn turn(&self) -> Turn {
        match self {
            Self::Folder(folder) => folder.turn(),
            Self::File(file) if !file.is_upright() => Turn::AsStored,
            Self::File(_) | Self::InMemory(_) => Turn::Upright,
        }
    }

    /// Sets how photos of a folder are turned. No effect for files, which state it themselves.
    #[must_use]
    pub fn with_turn(self, turn: Turn) -> Self {
        match self {
            Self::Folder(folder) => Self::Folder(folder.with_turn(turn)),
            other => other,
        }
    }

    /// Returns the names of all images, sorted by their bytes.
    pub fn names(&self) -> &[String] {
        match self {
            Self::Folder(folder) => folder.names(),
            Self::File(file) => file.names(),
            Self::InMemory(images) => images.names(),
        }
    }

    /// Returns one error for each entry that cannot be used.
    pub fn refused(&self) -> &[unlift_io::Error] {
        match self {
            Self::Folder(folder) => folder.refused(),
            Self::File(file) => file.refused(),
            Self::InMemory(_) => &[],
        }
    }

    /// Describes skipped entries in one line.
    pub fn passed_over(&self) -> Option<&str> {
        match self {
            Self::Folder(folder) => folder.passed_over(),
            Self::File(_) | Self::InMemory(_) => None,
        }
    }

    /// Reads the features of image `at` of [`names`](Self::names).
    ///
    /// # Errors
    /// If this image cannot be used; others may be.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        match self {
            Self::Folder(folder) => folder.get(at),
            Self::File(file) => Ok(file.get(at)?),
            Self::InMemory(images) => images.get(at),
        }
    }

    /// Returns the first of `chosen` that can be read and has keypoints, to check its contents
    /// before the audit. The audit reports the unusable ones.
    pub fn first(&self, chosen: &[usize]) -> Option<ImageFeatures> {
        let mut read = chosen.iter().filter_map(|&at| self.get(at).ok());
        read.find(|image| !image.keypoints.is_empty())
    }
}

type Get = Box<dyn Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync>;

/// Images by name, each made on request. An audit requests a few at a time, and the drawn ones
/// again.
pub struct InMemory {
    names: Vec<String>,
    get: Get,
}

impl InMemory {
    /// Creates a source of the images `names`. `get` returns the features of the image with an
    /// index in `names`, from any thread.
    ///
    /// # Errors
    /// If `names` is empty, or not sorted by bytes without repetition: the order decides the last
    /// bits of sums.
    pub fn try_new(
        names: Vec<String>,
        get: impl Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync + 'static,
    ) -> Result<Self, Error> {
        if names.is_empty() {
            return Err(Error::request("images: expected at least one, found none"));
        }
        if let Some(pair) = names.windows(2).find(|pair| pair[0].as_bytes() >= pair[1].as_bytes()) {
            let expected = "images: expected each name once, sorted by bytes";
            return Err(Error::request(format!(
                "{expected}, found {:?} before {:?}",
                pair[0], pair[1]
            )));
        }
        Ok(Self { names, get: Box::new(get) })
    }

    /// Returns the names of all images.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the features of image `at`, under its name.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        let name = self.names[at].clone();
        Ok(ImageFeatures { name, ..(self.get)(at)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_once_and_in_order() {
        let of = |names: &[&str]| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            InMemory::try_new(names, |_| Ok(ImageFeatures::default()))
        };
        let images = of(&["B", "a"]).unwrap();
        assert_eq!(images.get(1).unwrap().name, "a");
        let line = |names: &[&str]| of(names).err().map(|error| error.to_string());
        let expected = "images: expected each name once, sorted by bytes, found \"a\" before \"a\"";
        assert_eq!(line(&["a", "a"]).as_deref(), Some(expected));
        assert!(line(&["a", "B"]).is_some());
        assert_eq!(line(&[]).as_deref(), Some("images: expected at least one, found none"));
    }
}
