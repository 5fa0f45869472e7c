//! Photos and networks: keypoints of photos, learned networks, and pictures from keypoints.
//!
//! - [`network`]: which learned networks there are, their files, and running them; the source
//!   `learned`
//! - [`features`]: keypoints and descriptors of photos, SIFT as COLMAP extracts it, or learned
//! - [`pictures`]: pictures from keypoints and descriptors, and their similarity to the photo

pub mod features;
pub mod network;
pub mod pictures;

use std::path::Path;
use std::{fs, io};

/// Reads all bytes of a file. Pipes, sockets and devices are refused: reading them may never end.
fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let metadata = fs::metadata(path)?;
    if !metadata.is_file() && !metadata.is_dir() {
        return Err(io::Error::other("a pipe, a socket or a device"));
    }
    fs::read(path)
}
