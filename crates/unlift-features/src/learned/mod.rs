//! Learned features: a network says how much every pixel is a keypoint, and what it looks like.
//!
//! ```text
//! ColorImage ──> network ──> scores ──> maxima ──> keypoints ──> descriptors ──> LearnedFeatures
//!                        └──> maps ───────────────────────────────┘
//! ```

mod aliked;
mod levels;
mod maxima;
mod superpoint;

use unlift::Error;

pub use aliked::{Aliked, AlikedOptions};
pub use superpoint::{SuperPoint, SuperPointOptions};

/// Features of one image, the best first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LearnedFeatures {
    /// Places `(x, y)` in pixels of the image as it was given; the middle of the first pixel is `(0, 0)`, as hloc has it.
    pub keypoints: Vec<[f32; 2]>,
    /// How sure the network is of each, 0 to 1.
    pub scores: Vec<f32>,
    /// `(n, dim)`, row-major, each of length 1.
    pub descriptors: Vec<f32>,
    /// Numbers in a descriptor.
    pub dim: usize,
}

/// Whether the options that all learned features have are in their ranges.
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
