//! Features of photos: SIFT, ALIKED and SuperPoint.

mod aliked;
mod learned;
mod load;
mod sift;
mod superpoint;
