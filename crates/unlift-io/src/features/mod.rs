//! Reads and writes features of images: hloc's HDF5 files and COLMAP databases.
//!
//! The coordinates are **hloc's** in this module. Keypoints are `(x, y)` in pixels, and the center
//! of the first pixel is `(0, 0)`. COLMAP's, where it is `(0.5, 0.5)`, are converted when they are
//! read. Names of images are relative to their folder, with slashes.
//!
//! ```no_run
//! use unlift_io::features::FeatureSource;
//!
//! let source = FeatureSource::open("features.h5".as_ref())?;
//! for at in 0..source.names().len() {
//!     match source.get(at) {
//!         Ok(image) => println!("{}: {} keypoints", image.name, image.keypoints.len()),
//!         Err(error) => eprintln!("{error}"),
//!     }
//! }
//! # Ok::<(), unlift_io::Error>(())
//! ```

mod colmap;
mod h5;
mod hloc;
mod image;
#[cfg(test)]
mod malformed;
mod writer;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::Error;
use crate::input;
use crate::read::lines::quoted;

pub use hloc::decode;
pub use image::{ImageFeatures, round_to_half};
pub use writer::{FeatureWriter, encode};

/// An open file of features that is read one image at a time.
///
/// Several threads may call [`get`](Self::get) at once.
pub struct FeatureSource {
    kind: Kind,
}

enum Kind {
    Hloc(hloc::Hloc),
    Colmap(colmap::Colmap),
}

const SQLITE: &[u8; 8] = b"SQLite f";
const HDF5: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

impl FeatureSource {
    /// Opens hloc's HDF5 features or a COLMAP `database.db`, distinguished by the first bytes.
    ///
    /// # Errors
    /// When the file cannot be read, is of another format, is truncated, or contains no image.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (file, len) = input::open(path)?;
        let mut start = Vec::new();
        file_start(&file, &mut start).map_err(|e| Error::read(path, e))?;
        let kind = match start.first_chunk() {
            Some(HDF5) => Kind::Hloc(hloc::Hloc::open(path)?),
            Some(SQLITE) => Kind::Colmap(colmap::Colmap::open(path)?),
            _ => {
                let expected = "features in HDF5, or a COLMAP database (SQLite)";
                let found = match len {
                    0 => "an empty file".to_owned(),
                    _ => format!("a file that begins with {}", quoted(&start)),
                };
                return Err(Error::new(path, "", expected, found));
            }
        };
        let source = Self { kind };
        if source.names().is_empty() {
            return Err(Error::new(path, "", "at least one image", "none"));
        }
        Ok(source)
    }

    /// Returns true if the first image states that keypoints are in pixels of the upright photo.
    pub fn is_upright(&self) -> bool {
        match &self.kind {
            Kind::Hloc(file) => file.is_upright(),
            Kind::Colmap(_) => false,
        }
    }

    /// One error for each entry of the file that is not an image.
    pub fn refused(&self) -> &[Error] {
        match &self.kind {
            Kind::Hloc(file) => file.refused(),
            Kind::Colmap(_) => &[],
        }
    }

    /// The names of the images, sorted by bytes.
    pub fn names(&self) -> &[String] {
        match &self.kind {
            Kind::Hloc(file) => file.names(),
            Kind::Colmap(database) => database.names(),
        }
    }

    /// Reads the features of image `at` of [`names`](Self::names).
    ///
    /// # Errors
    /// When this image is malformed. Others may still be readable.
    ///
    /// # Panics
    /// When there is no such image.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        match &self.kind {
            Kind::Hloc(file) => file.get(at),
            Kind::Colmap(database) => database.get(at),
        }
    }
}

fn file_start(file: &File, start: &mut Vec<u8>) -> std::io::Result<usize> {
    file.take(8).read_to_end(start)
}
