//! Pictures from keypoints and descriptors, and their similarity to the photo (Sec. 4.3 and 6 of
//! the paper).
//!
//! ```text
//! places, descriptors, weights ──> feature image ──> Inverter ──> picture ──> metrics, Detector
//! points of a map, a camera ──> projection ──┘                    photo ──┘
//! ```
//!
//! Pictures are [`ColorImage`]s, so metrics compare values rounded to bytes. Positions are in
//! pixels with the middle of the first pixel at (0, 0), as everywhere in unlift.

mod compared;
mod detect;
mod feature_image;
mod inverter;
mod lens;
mod lpips;
mod projection;
mod psnr;
mod sizes;
mod ssim;

pub use crate::features::ColorImage;
pub use compared::Metrics;
pub use detect::{CLASSES, Detection, Detector};
pub use feature_image::{CELL, Points, feature_image};
pub use inverter::Inverter;
pub use lens::Lens;
pub use lpips::Lpips;
pub use projection::{Projection, View};
pub use psnr::psnr;
pub use ssim::ssim;
