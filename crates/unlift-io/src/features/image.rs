//! The features of one image.

use std::path::{Path, PathBuf};

use half::f16;
use unlift::Descriptors;

use crate::error::Error;
use crate::read::lines::quoted;

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
    /// True if keypoints are in pixels of the photo rotated upright by its EXIF orientation. COLMAP
    /// and hloc use the photo as stored.
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

/// Rounds descriptors of a network to half floats, as hloc stores them, so that memory and files
/// have equal values.
pub fn round_to_half(values: &mut [f32]) {
    values.iter_mut().for_each(|value| *value = f16::from_f32(*value).to_f32());
}
