//! Keypoints and descriptors of photos: SIFT as COLMAP extracts it by default, or learned features.
//!
//! ```text
//! photo ──> GrayImage ──> octaves ──> extrema ──> orientations ──> descriptors ──> Features
//! photo ──> ColorImage ──> network ──> maxima ──> descriptors ──> LearnedFeatures
//! ```
//!
//! [`read`](load::read) decodes a photo, [`Sift`] or [`Aliked`] extracts features,
//! [`in_order`](batch::in_order) processes many photos in constant memory. [`Extractor`] extracts
//! any kind of features. The same image gives the same bytes for any number of threads.
//!
//! ```
//! use unlift_features::{GrayImage, Sift};
//!
//! // A Gaussian blob gives one keypoint at its center.
//! let pixels = (0..64 * 64).map(|i| {
//!     let (dx, dy) = ((i % 64) as f32 - 30.0, (i / 64) as f32 - 34.0);
//!     (-(dx * dx + dy * dy) / 50.0).exp()
//! });
//! let image = GrayImage::try_new(64, 64, pixels.collect())?;
//! let features = Sift::default().extract(&image);
//! let keypoint = features.keypoints[0];
//! assert!((keypoint.x - 30.5).abs() < 0.1 && (keypoint.y - 34.5).abs() < 0.1);
//! # Ok::<(), unlift::Error>(())
//! ```
//!
//! The feature `networks` (on by default) compiles the networks of learned features. Without it,
//! the error of an extractor that needs a network names the feature.

pub mod batch;
mod blur;
mod color;
mod descriptor;
mod extractor;
mod extrema;
mod fit;
mod gradient;
mod image;
mod learned;
pub mod load;
#[cfg(not(feature = "networks"))]
mod networks;
mod octave;
mod options;
mod orientation;
mod plane;
pub mod preview;
mod quantize;
mod refine;
mod sift;

pub use color::ColorImage;
pub use extractor::{Extraction, Extractor, Found, Photo};
pub use image::GrayImage;
pub use learned::{Aliked, AlikedOptions, LearnedFeatures, SuperPoint, SuperPointOptions};
pub use options::SiftOptions;
pub use sift::{Features, Keypoint, Sift};
#[cfg(feature = "networks")]
use unlift_nn as networks;
