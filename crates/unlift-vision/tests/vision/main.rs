//! Networks, features of photos, and pictures from keypoints.

mod aliked;
mod feature_images;
mod golden;
mod learned_features;
mod learned_source;
mod lenses;
mod load;
mod network;
mod parity;
mod projections;
mod sift;
mod superpoint;
