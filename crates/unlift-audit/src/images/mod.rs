//! Features of images from a folder of photos, an HDF5 file of hloc, a COLMAP database, or memory.

pub mod audit;
pub mod choice;
pub mod extraction;
mod folder;
mod pictures;
pub mod stream;

use std::path::{Path, PathBuf};

use unlift::audit::Plan;
use unlift_io::features::{self, ImageFeatures};
use unlift_io::hash::{hash_file, hash_files};
use unlift_vision::features::photo::Turn;
use unlift_vision::features::{Extraction, Extractor};
use unlift_vision::network::DescriptorKind;

use crate::changes::kind_of;
use crate::request::check_fit;
use crate::{Error, sources};

pub use folder::is_photo;

type Get = Box<dyn Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync>;

/// Images by name, read one at a time. Threads can share it; it holds the names only.
///
/// To read all images in parallel, in order and in constant memory, call `in_order` of
/// `unlift-vision` over the indices of `names`, with `get` as its work.
pub struct FeatureSource {
    /// The names of all images, sorted by their bytes.
    pub names: Vec<String>,
    refused: Vec<unlift_io::Error>,
    /// Skipped entries in one line.
    pub passed_over: Option<String>,
    from: Origin,
}

/// The origin of features.
enum Origin {
    /// Photos, whose features are extracted on request.
    Photos { paths: Vec<PathBuf>, extractor: Extractor, kind: DescriptorKind, turn: Turn },
    /// A file of features.
    File(features::FeatureSource),
    /// Images of the caller.
    Memory(Get),
}

impl FeatureSource {
    /// Opens a folder of photos, or a file of features.
    ///
    /// # Errors
    /// If `path` does not exist, or contains no image.
    pub fn open(path: &Path, extraction: &Extraction) -> Result<Self, Error> {
        let metadata = std::fs::metadata(path).map_err(|e| unlift_io::Error::read(path, e))?;
        if metadata.is_dir() {
            return folder::open(path, extraction);
        }
        let file = features::FeatureSource::open(path)?;
        let (names, refused) = (file.names().to_vec(), Vec::new());
        Ok(Self { names, refused, passed_over: None, from: Origin::File(file) })
    }

    /// Creates a source of the images `names` in memory. `get` returns the features of the image with an index in `names`, from any
    /// thread. An audit requests a few at a time, and the drawn ones again.
    ///
    /// # Errors
    /// If `names` is empty, or not sorted by bytes without repetition: the order decides the last
    /// bits of sums.
    pub fn in_memory(
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
        let from = Origin::Memory(Box::new(get));
        Ok(Self { names, refused: Vec::new(), passed_over: None, from })
    }

    /// Returns an error for each entry that cannot be used.
    pub fn refused(&self) -> &[unlift_io::Error] {
        match &self.from {
            Origin::File(file) => file.refused(),
            Origin::Photos { .. } | Origin::Memory(_) => &self.refused,
        }
    }

    /// Returns the orientation of photos in which keypoints are pixels.
    pub fn turn(&self) -> Turn {
        match &self.from {
            Origin::Photos { turn, .. } => *turn,
            Origin::File(file) if !file.is_upright() => Turn::AsStored,
            Origin::File(_) | Origin::Memory(_) => Turn::Upright,
        }
    }

    /// Sets how photos of a folder are turned. No effect for files, which state it themselves.
    #[must_use]
    pub fn with_turn(self, turn: Turn) -> Self {
        let from = match self.from {
            Origin::Photos { paths, extractor, kind, .. } => {
                Origin::Photos { paths, extractor: extractor.with_turn(turn), kind, turn }
            }
            from => from,
        };
        Self { from, ..self }
    }

    /// Returns true for images of the caller, who can correct them.
    pub fn is_in_memory(&self) -> bool {
        matches!(self.from, Origin::Memory(_))
    }

    /// Returns true for a file of features.
    pub fn is_file(&self) -> bool {
        matches!(self.from, Origin::File(_))
    }

    /// Returns the photo of image `at`, if images are photos.
    pub fn photo(&self, at: usize) -> Option<&Path> {
        match &self.from {
            Origin::Photos { paths, .. } => Some(&paths[at]),
            Origin::File(_) | Origin::Memory(_) => None,
        }
    }

    /// Returns the hash of the photos `used`, or of the file of features at `path`.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn hash(&self, path: &Path, used: &[usize]) -> Result<String, Error> {
        Ok(match &self.from {
            Origin::Photos { paths, .. } => {
                hash_files(&used.iter().map(|&at| &paths[at]).collect::<Vec<_>>())?
            }
            Origin::File(_) | Origin::Memory(_) => hash_file(path)?,
        })
    }

    /// Reads the features of image `at` of `names`.
    ///
    /// # Errors
    /// If this image cannot be used; others may be.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        let name = self.names[at].clone();
        Ok(match &self.from {
            Origin::Photos { paths, extractor, turn, .. } => {
                let photo = extractor.read(&paths[at])?;
                ImageFeatures {
                    name,
                    size: Some(photo.size.map(|side| side as u32)),
                    uncertainty_px: Some(photo.noise_px),
                    upright: *turn == Turn::Upright,
                    photo: Some(paths[at].clone()),
                    ..folder::features_of(photo.found)
                }
            }
            Origin::File(file) => file.get(at)?,
            Origin::Memory(get) => ImageFeatures { name, ..get(at)? },
        })
    }

    /// Returns the first of `chosen` that can be read and has keypoints, to check its contents
    /// before the audit. The audit reports the unusable ones.
    pub fn first(&self, chosen: &[usize]) -> Option<ImageFeatures> {
        let mut read = chosen.iter().filter_map(|&at| self.get(at).ok());
        read.find(|image| !image.keypoints.is_empty())
    }

    /// Returns the kind of the descriptors: of those that are extracted, or of the first image of `chosen` with keypoints. Without any,
    /// the error is about `option`.
    pub fn kind(&self, option: &str, chosen: &[usize]) -> Result<DescriptorKind, Error> {
        match &self.from {
            Origin::Photos { kind, .. } => Ok(*kind),
            _ => kind_of(option, self.first(chosen).and_then(|first| first.descriptors).as_ref()),
        }
    }
}

/// Options of opening images for an audit.
#[derive(Clone, Debug, Default)]
pub struct Opening<'a> {
    /// Options of the extraction from photos.
    pub wanted: extraction::Wanted,
    /// Maximum number of images, evenly spaced.
    pub max_images: Option<usize>,
    /// The folder of photos of a file of features.
    pub photos: Option<&'a Path>,
    /// Whether pictures are painted.
    pub paints: bool,
    /// Whether descriptors are used beside those that sources use.
    pub uses_descriptors: bool,
    /// Whether the sources of the plan are the usual ones, which do without descriptors if there are none.
    pub is_usual: bool,
}

/// Images that were opened and checked for an audit.
pub struct Opened {
    /// The images.
    pub source: FeatureSource,
    /// Their path; for images in memory, their name in errors.
    pub path: PathBuf,
    /// Numbers of the images to use, ascending.
    pub chosen: Vec<usize>,
}

impl Opened {
    /// Opens the folder of photos or the file of features at `path` for `plan`. Checks the first image with keypoints for what sources
    /// need, to get one error instead of one per image.
    ///
    /// # Errors
    /// If `path` cannot be read, or images lack what is requested.
    pub fn open(path: &Path, opening: &Opening<'_>, plan: &mut Plan<2>) -> Result<Self, Error> {
        if opening.photos.is_some() && path.is_dir() {
            let expected = "--photos: expected with a file of features";
            return Err(Error::request(format!("{expected}, found a folder of photos")));
        }
        let extraction = opening.wanted.extraction(path)?;
        if let (true, Some(rows)) = (path.is_dir(), extraction::sample(&extraction)) {
            check_fit(plan, Some(&rows), "")?;
        }
        let source = FeatureSource::open(path, &extraction).map_err(|error| {
            let map = unlift_io::read::is_project(path);
            if map { error.advise("unlift audit map, as this is a map") } else { error }
        })?;
        let opened = Self::of(source, path, opening.max_images);
        let has_photo = |&at: &usize| {
            opening.photos.is_none_or(|photos| photos.join(&opened.source.names[at]).is_file())
        };
        if let (true, Some(photos)) = (opening.paints, opening.photos)
            && !opened.chosen.iter().any(has_photo)
        {
            let expected = format!("photos of the images in {}", path.display());
            return Err(unlift_io::Error::new(photos, "", expected, "none").into());
        }
        // Extracted features always have descriptors.
        let uses = opening.uses_descriptors || stream::Needs::of_plan(plan).descriptors();
        if uses
            && opened.source.is_file()
            && let Some(first) = opened.source.first(&opened.chosen)
        {
            if opening.is_usual && first.descriptors.is_none() {
                plan.neighbors = sources::usual(false);
            }
            if opening.paints {
                kind_of("--invert", first.descriptors.as_ref())?;
            }
            check_fit(plan, first.descriptors.as_ref(), "")?;
        }
        Ok(opened)
    }

    /// Takes images that were opened already.
    pub fn of(source: FeatureSource, path: &Path, max_images: Option<usize>) -> Self {
        let chosen = choice::evenly(source.names.len(), max_images);
        Self { source, path: path.to_owned(), chosen }
    }

    /// Returns the kind of the descriptors; an error about `option` if there are none.
    pub fn kind(&self, option: &str) -> Result<DescriptorKind, Error> {
        self.source.kind(option, &self.chosen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_once_and_in_order() {
        let of = |names: &[&str]| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            FeatureSource::in_memory(names, |_| Ok(ImageFeatures::default()))
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
