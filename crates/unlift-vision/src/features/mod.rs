//! Keypoints and descriptors of photos: SIFT as COLMAP extracts it by default, or learned features.
//!
//! ```text
//! photo ──> GrayImage ──> octaves ──> extrema ──> orientations ──> descriptors ──> Features
//! photo ──> ColorImage ──> network ──> maxima ──> descriptors ──> LearnedFeatures
//! ```
//!
//! [`read`](photo::read) decodes a photo, [`Sift`], [`aliked`] or [`superpoint`] extracts features,
//! [`in_order`] processes many photos in constant memory. [`Extractor`] extracts
//! any kind of features. The same image gives the same bytes for any number of threads.
//!
//! ```
//! use unlift_vision::features::{GrayImage, Sift};
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

mod extractor;
mod image;
mod learned;
mod options;
pub mod photo;
mod sift;

pub use extractor::{Extractor, Photo, in_order};
pub use image::{ColorImage, GrayImage, halved};
pub use learned::{LearnedFeatures, aliked, superpoint};
pub use options::Extraction;
pub use sift::{Features, Keypoint, Sift};
