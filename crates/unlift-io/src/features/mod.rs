//! Features of images in and out: hloc's HDF5 files and COLMAP databases.
//!
//! One convention holds everywhere behind this module: **hloc's**. Keypoints are in pixels, `(x, y)`,
//! and the middle of the first pixel is `(0, 0)`; COLMAP's, whose middle is `(0.5, 0.5)`, are brought
//! to it where they are read. Names of images are relative to their folder, with slashes.
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
use crate::seen::Seen;

pub use hloc::decode;
pub use image::{ImageFeatures, round_to_half};
pub use writer::{FeatureWriter, encode};

/// Features in a file, one image at a time: memory does not grow with the number of images.
///
/// Shared by threads: [`get`](Self::get) may be called from many at once.
pub struct FeatureSource {
    kind: Kind,
    seen: Seen,
}

enum Kind {
    Hloc(hloc::Hloc),
    Colmap(colmap::Colmap),
}

const SQLITE: &[u8; 8] = b"SQLite f";
const HDF5: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

impl FeatureSource {
    /// Opens hloc's HDF5 features or a COLMAP `database.db`; its first bytes decide which.
    ///
    /// # Errors
    /// When the file cannot be read, is neither, is cut off, or lists no image.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let seen = Seen::new([path]);
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
        let source = Self { kind, seen };
        if source.names().is_empty() {
            return Err(Error::new(path, "", "at least one image", "none"));
        }
        Ok(source)
    }

    /// Whether keypoints are in pixels of photos that were turned upright, as the file says of its first image.
    pub fn is_upright(&self) -> bool {
        match &self.kind {
            Kind::Hloc(file) => file.is_upright(),
            Kind::Colmap(_) => false,
        }
    }

    /// The file, if it is not what it was when it was opened.
    pub fn changed(&self) -> Option<&Path> {
        self.seen.changed([0])
    }

    /// What the file has in place of images, one error each.
    pub fn refused(&self) -> &[Error] {
        match &self.kind {
            Kind::Hloc(file) => file.refused(),
            Kind::Colmap(_) => &[],
        }
    }

    /// The images, sorted by the bytes of their names.
    pub fn names(&self) -> &[String] {
        match &self.kind {
            Kind::Hloc(file) => file.names(),
            Kind::Colmap(database) => database.names(),
        }
    }

    /// The features of image `at` of [`names`](Self::names).
    ///
    /// # Errors
    /// One line when this image is not as it should be; others may be.
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
