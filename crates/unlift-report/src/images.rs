//! What `audit.json` says of images, beside the rows pooled over all of them.

use serde::{Deserialize, Serialize};

use crate::document::ByThreshold;

/// How many images an audit had, and what became of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageCounts {
    /// Images in the folder or file.
    pub found: u64,
    /// Images that were used: the rest was left out by choice, or could not be used.
    pub used: u64,
    /// Images that could not be used; a line on stderr told why.
    pub unusable: u64,
    /// Used images with at most K keypoints: attacked with lists as long as can be.
    pub too_small: u64,
}

/// Shares over distinct places: a fifth of the keypoints of an image lie exactly on another one, and
/// every place counts once here.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Distinct {
    /// Places.
    pub n_places: u64,
    /// Percent of the places recovered within each threshold.
    pub recovered_percent: ByThreshold,
    /// The same for an attacker without neighborhoods.
    pub blind_percent: ByThreshold,
}

/// The figures of one image.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageFigures {
    /// Its name; `None` in a share-safe document.
    pub name: Option<String>,
    /// Its keypoints.
    pub n_points: u64,
    /// One per row of `results`, in the same order; empty for an image without keypoints.
    pub rows: Vec<ImageRow>,
}

/// The figures of one image in one row of `results`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageRow {
    /// Percent of the image's keypoints recovered within each threshold.
    pub recovered_percent: ByThreshold,
    /// The same of its distinct places.
    pub distinct_percent: ByThreshold,
    /// Share of true neighbors in this image, as requested or measured.
    pub inlier_ratio: f64,
    /// Median error in pixels; `None` when half of the keypoints or more are lost.
    pub median_error: Option<f64>,
}
