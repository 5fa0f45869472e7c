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

pub use aliked::{Aliked, AlikedOptions};
pub use superpoint::{SuperPoint, SuperPointOptions};

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

/// Checks the ranges of the common options.
fn check(max_features: usize, min_score: f32, max_image_size: usize) -> Result<(), Error> {
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
