//! Learned features: a network scores every pixel as a keypoint and computes descriptors.
//!
//! ```text
//! ColorImage ──> network ──> scores ──> maxima ──> keypoints ──> descriptors ──> LearnedFeatures
//!                        └──> maps ───────────────────────────────┘
//! ```

mod aliked;
mod maxima;
mod superpoint;

pub use aliked::aliked;
pub use superpoint::superpoint;

/// Features of one image, the best first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LearnedFeatures {
    /// Positions in pixels of the original image; the middle of the first pixel is `(0, 0)`.
    pub keypoints: Vec<[f32; 2]>,
    /// The network's score of each keypoint, 0 to 1.
    pub scores: Vec<f32>,
    /// Descriptors `(n, dim)`, row-major, each of length 1.
    pub descriptors: Vec<f32>,
    /// Number of values of a descriptor.
    pub dim: usize,
}
