//! The features of one image, whatever they came from.

use std::path::{Path, PathBuf};

use half::f16;
use unlift::Descriptors;

use crate::error::Error;
use crate::read::lines::quoted;

/// What is known of one image, whatever it came from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageFeatures {
    /// Path relative to the folder of photos, with slashes.
    pub name: String,
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
    /// `n` places `(x, y)` in pixels, all finite; the middle of the first pixel is `(0, 0)`.
    pub keypoints: Vec<[f64; 2]>,
    /// `(n, dim)`: bytes are RootSIFT times 512, floats what a network made; never dummies. `None` when
    /// the source has none; see [`described`](Self::described).
    pub descriptors: Option<Descriptors>,
    /// `n` confidences of the detector.
    pub scores: Option<Vec<f32>>,
    /// `n` scales in pixels.
    pub scales: Option<Vec<f32>>,
    /// `n` orientations in degrees, from x to y.
    pub orientations_deg: Option<Vec<f32>>,
    /// Standard deviation of a keypoint's place in pixels, as the detector states it.
    pub uncertainty_px: Option<f64>,
    /// Keypoints are in pixels of the photo that was turned upright by its EXIF orientation, not of the photo as it is
    /// stored, as those of COLMAP and hloc are.
    pub upright: bool,
    /// The photo itself, where the source is a folder of them.
    pub photo: Option<PathBuf>,
}

impl ImageFeatures {
    /// The descriptors, for those who cannot do without.
    ///
    /// # Errors
    /// A line that names `source` (the file) and the image when there are none.
    pub fn described(&self, source: &Path) -> Result<&Descriptors, Error> {
        let place = || format!("image {}", quoted(self.name.as_bytes()));
        let missing = || Error::new(source, place(), "descriptors", "none");
        self.descriptors.as_ref().ok_or_else(missing)
    }
}

/// Rounds descriptors of a network to half floats, as hloc stores them: what is in memory is what a file would hold.
pub fn round_to_half(values: &mut [f32]) {
    values.iter_mut().for_each(|value| *value = f16::from_f32(*value).to_f32());
}
