//! Options of the extraction of features.

use unlift::Error;
use unlift::neighbors::DescriptorKind;

/// Kind and options of the extraction. The default is SIFT as in COLMAP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extraction {
    /// The kind of the features.
    pub kind: DescriptorKind,
    /// Number of requested features. Networks return the best ones, at most this number; SIFT whole
    /// levels, from the coarsest to the one that exceeds it.
    pub max_features: usize,
    /// Score that a keypoint of a network must exceed, 0 to 1. Keypoints of SIFT have none.
    pub min_score: f32,
    /// Longest side in pixels. Larger images are downsized; keypoints are in pixels of the original image.
    pub max_image_size: usize,
}

impl Default for Extraction {
    fn default() -> Self {
        Self::SIFT
    }
}

impl Extraction {
    /// The options of SIFT in COLMAP.
    pub const SIFT: Self = Self {
        kind: DescriptorKind::Sift,
        max_features: 8192,
        min_score: 0.0,
        max_image_size: 3200,
    };
    /// The options of ALIKED in COLMAP.
    pub const ALIKED: Self = Self {
        kind: DescriptorKind::Aliked,
        max_features: 2048,
        min_score: 0.2,
        max_image_size: 1600,
    };
    /// The options of SuperPoint in hloc.
    pub const SUPERPOINT: Self = Self {
        kind: DescriptorKind::SuperPoint,
        max_features: 4096,
        min_score: 0.005,
        max_image_size: 1600,
    };

    /// Checks the ranges.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let Self { max_features, min_score, max_image_size, .. } = *self;
        if max_features == 0 {
            return Err(Error::new("max_features", "at least 1", "0"));
        }
        if !(0.0..1.0).contains(&min_score) {
            return Err(Error::new("min_score", "0 to below 1", min_score));
        }
        if !(1..=1 << 16).contains(&max_image_size) {
            return Err(Error::new("max_image_size", "1 to 65536", max_image_size));
        }
        Ok(())
    }
}
