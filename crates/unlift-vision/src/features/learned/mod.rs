//! Learned features: a network scores every pixel as a keypoint and computes descriptors.
//!
//! ```text
//! ColorImage ──> network ──> scores ──> maxima ──> keypoints ──> descriptors ──> LearnedFeatures
//!                        └──> maps ───────────────────────────────┘
//! ```

mod aliked;
mod maxima;
mod superpoint;

use unlift::Error;

pub use aliked::Aliked;
pub use superpoint::SuperPoint;

/// Features of one image, the best first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LearnedFeatures {
    /// Positions `(x, y)` in pixels of the original image; the middle of the first pixel is
    /// `(0, 0)`, as in hloc.
    pub keypoints: Vec<[f32; 2]>,
    /// The network's score of each keypoint, 0 to 1.
    pub scores: Vec<f32>,
    /// Descriptors `(n, dim)`, row-major, each of length 1.
    pub descriptors: Vec<f32>,
    /// Number of values of a descriptor.
    pub dim: usize,
}

/// Options of the extraction by a network.
#[derive(Clone, Debug, PartialEq)]
pub struct LearnedOptions {
    /// Maximum number of features, the best ones.
    pub max_features: usize,
    /// Score that a keypoint must exceed, 0 to 1.
    pub min_score: f32,
    /// Longest side in pixels. Larger images are downsized; keypoints are in pixels of the original image.
    pub max_image_size: usize,
}

impl LearnedOptions {
    /// The options of ALIKED in COLMAP.
    pub const ALIKED: Self = Self { max_features: 2048, min_score: 0.2, max_image_size: 1600 };
    /// The options of SuperPoint in hloc.
    pub const SUPERPOINT: Self =
        Self { max_features: 4096, min_score: 0.005, max_image_size: 1600 };

    /// Checks the ranges.
    fn check(&self) -> Result<(), Error> {
        let Self { max_features, min_score, max_image_size } = *self;
        if max_features == 0 {
            return Err(Error::new("max_features", "at least 1", "0"));
        }
        if !(0.0..1.0).contains(&min_score) {
            return Err(Error::new("min_score", "0 to below 1", min_score.to_string()));
        }
        if !(1..=1 << 16).contains(&max_image_size) {
            return Err(Error::new("max_image_size", "1 to 65536", max_image_size.to_string()));
        }
        Ok(())
    }
}
