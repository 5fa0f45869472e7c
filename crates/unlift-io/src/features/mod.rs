//! Reads and writes features of images: hloc's HDF5 files and COLMAP databases.
//!
//! The coordinates are **hloc's** in this module. Keypoints are `(x, y)` in pixels, and the center
//! of the first pixel is `(0, 0)`. COLMAP's, where it is `(0.5, 0.5)`, are converted when they are
//! read. Names of images are relative to their folder, with slashes.

pub(crate) mod database;
mod hloc;
mod links;
mod photos;

use std::path::{Path, PathBuf};

use half::f16;
use unlift::Descriptors;

use crate::error::Error;
use crate::input;
use crate::read::lines::quoted;

pub use hloc::FeatureWriter;
pub(crate) use hloc::is_ours;
pub use photos::Photos;

/// Features of one image, independent of the file format.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageFeatures {
    /// Path relative to the folder of photos, with slashes.
    pub name: String,
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// `n` finite coordinates `(x, y)` in pixels. The center of the first pixel is `(0, 0)`.
    pub keypoints: Vec<[f64; 2]>,
    /// `(n, dim)` descriptors: bytes are RootSIFT times 512, floats are from a network. `None` when
    /// the source has none; see [`described`](Self::described).
    pub descriptors: Option<Descriptors>,
    /// `n` confidences of the detector.
    pub scores: Option<Vec<f32>>,
    /// `n` scales in pixels.
    pub scales: Option<Vec<f32>>,
    /// `n` orientations in degrees, from x to y.
    pub orientations_deg: Option<Vec<f32>>,
    /// Standard deviation of a keypoint's position in pixels, as stated by the detector.
    pub uncertainty_px: Option<f64>,
    /// True if keypoints are in pixels of the photo rotated upright by its EXIF orientation. COLMAP and hloc use the photo as stored.
    pub upright: bool,
    /// The path of the photo, if the source is a folder of photos.
    pub photo: Option<PathBuf>,
}

impl ImageFeatures {
    /// Returns the descriptors.
    ///
    /// # Errors
    /// When there are none: one line that names `source` (the file) and the image.
    pub fn described(&self, source: &Path) -> Result<&Descriptors, Error> {
        let place = || format!("image {}", quoted(self.name.as_bytes()));
        let missing = || Error::new(source, place(), "descriptors", "none");
        self.descriptors.as_ref().ok_or_else(missing)
    }
}

/// Rounds descriptors of a network to half floats, as hloc stores them, so that memory and files have equal values.
pub fn round_to_half(values: &mut [f32]) {
    values.iter_mut().for_each(|value| *value = f16::from_f32(*value).to_f32());
}

/// An open file of features that is read one image at a time.
///
/// Several threads may call [`get`](Self::get) at once.
pub struct FeatureSource {
    names: Vec<String>,
    refused: Vec<Error>,
    is_upright: bool,
    get: Box<dyn Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync>,
}

pub(crate) const SQLITE: &[u8; 8] = b"SQLite f";
pub(crate) const HDF5: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

impl FeatureSource {
    /// Opens hloc's HDF5 features or a COLMAP `database.db`, distinguished by the first bytes.
    ///
    /// # Errors
    /// When the file cannot be read, is of another format, is truncated, or contains no image.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (start, len) = input::head(path, 8)?;
        let source = match start.first_chunk() {
            Some(HDF5) => {
                let mut file = hloc::Hloc::open(path)?;
                let (names, refused) = (file.names(), std::mem::take(&mut file.broken));
                let is_upright = file.is_upright();
                Self { names, refused, is_upright, get: Box::new(move |at| file.get(at)) }
            }
            Some(SQLITE) => {
                let file = database::Database::open(path)?;
                let (names, refused, is_upright) = (file.names.clone(), Vec::new(), false);
                Self { names, refused, is_upright, get: Box::new(move |at| file.get(at)) }
            }
            _ => {
                let expected = "features in HDF5, or a COLMAP database (SQLite)";
                let found = match len {
                    0 => "an empty file".to_owned(),
                    _ => format!("a file that begins with {}", quoted(&start)),
                };
                return Err(Error::new(path, "", expected, found));
            }
        };
        if source.names.is_empty() {
            return Err(Error::new(path, "", "at least one image", "none"));
        }
        Ok(source)
    }

    /// Returns true if the first image states that keypoints are in pixels of the upright photo.
    pub fn is_upright(&self) -> bool {
        self.is_upright
    }

    /// One error for each entry of the file that is not an image.
    pub fn refused(&self) -> &[Error] {
        &self.refused
    }

    /// The names of the images, sorted by bytes.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Reads the features of image `at` of [`names`](Self::names).
    ///
    /// # Errors
    /// When this image is malformed. Others may still be readable.
    ///
    /// # Panics
    /// When there is no such image.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        (self.get)(at)
    }
}
