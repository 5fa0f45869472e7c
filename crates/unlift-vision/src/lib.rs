//! Photos and networks: keypoints of photos, learned networks, and pictures from keypoints.
//!
//! - [`network`]: which learned networks there are, their files, and running them; the source
//!   `learned`
//! - [`features`]: keypoints and descriptors of photos, SIFT as COLMAP extracts it, or learned
//! - [`pictures`]: pictures from keypoints and descriptors, and their similarity to the photo

pub mod features;
pub mod network;
pub mod pictures;
