//! The two photos that are part of the program.

use std::fs;

use tempfile::TempDir;

/// Minimum score of keypoints of the photos. It is low, because there are only two photos.
pub const MIN_SCORE: f32 = 0.02;

/// File names and bytes: JPEG, CC0. photos/README.md lists the authors.
static PHOTOS: [(&str, &[u8]); 2] = [
    ("cat.jpg", include_bytes!("photos/cat.jpg")),
    ("coffee.jpg", include_bytes!("photos/coffee.jpg")),
];

/// Writes the two photos into a temporary folder.
pub fn folder() -> crate::Result<TempDir> {
    let write = || {
        let folder = tempfile::tempdir()?;
        PHOTOS.iter().try_for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes))?;
        Ok(folder)
    };
    Ok(write().map_err(|error| unlift_io::Error::write(std::env::temp_dir(), error))?)
}
