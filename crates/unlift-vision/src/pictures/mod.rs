//! Pictures from keypoints and descriptors, and their similarity to photos (paper, Sec. 4.3, 6).
//!
//! ```text
//! places, descriptors, weights ──> feature image ──> Inverter ──> picture ──> metrics, Detector
//! points of a map, a camera ──> projection ──┘                    photo ──┘
//! ```
//!
//! Pictures are [`ColorImage`](crate::features::ColorImage)s, so metrics compare values rounded to bytes. Positions are in
//! pixels with the middle of the first pixel at (0, 0), as everywhere in unlift.

mod bearings;
mod camera;
mod detect;
mod gallery;
mod inverter;
mod metrics;
mod painter;

pub use bearings::{on_bearings, six_views};
pub use camera::{Lens, Projection, View};
pub use detect::{CLASSES, Detection, Detector};
pub use gallery::Gallery;
pub use inverter::{CELL, Inverter, Points, feature_image};
pub use metrics::{Lpips, Metrics};
pub use painter::{Painter, Picture, Reference, needed, size, trusted};
