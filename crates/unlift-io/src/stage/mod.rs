//! Stage files: the NumPy archives (`.npz`) that commands exchange, each of one kind, of a map or of many images.
//!
//! `docs/formats.md` describes them. Released maps, lists and recovered points contain nothing of
//! the ground truth: no ids, names or times of their source. Equal values make equal bytes.
//!
//! Readers accept what `np.savez` and `np.savez_compressed` write: floats of any width, integers of
//! any width, either order of memory and of bytes. Any deviation from the document is one line that
//! names the file, the array and row (counted from 0), what was expected and what was found.

mod arrays;
mod images;
mod kind;
mod lists;
mod meta;
mod recovered;
mod released;
mod truth;
mod write;

use std::path::Path;

use crate::Error;
use crate::read::archive::Archive;
use arrays::Arrays;

pub use images::{ImageFile, ImageRows, ImageWriter};
pub use kind::Kind;
pub use lists::{read_neighborhoods, read_point_neighborhoods, write_neighborhoods};
pub use recovered::{read_recovered, write_recovered};
pub use released::{published_positions, read_released, scheme_name, write_released};
pub use truth::{read_truth, write_truth};

/// Returns the kind of the stage file `path`, by its metadata or its arrays.
///
/// # Errors
/// When the file is not a stage file of a known kind and version.
pub fn kind(path: &Path) -> Result<Kind, Error> {
    let arrays = Arrays::open(path)?;
    arrays.kind()?.ok_or_else(|| Error::new(path, "", "a stage file of unlift", arrays.list()))
}

/// Returns true if the stage file `path` contains many images, below their names.
pub fn has_images(path: &Path) -> Result<bool, Error> {
    Ok(Archive::open(path)?.arrays().iter().any(|(_, name)| name.contains('/')))
}

/// Returns the kind that the metadata of the file at `path` declares, if it is a stage file and declares one.
pub fn declared_kind(path: &Path) -> Option<Kind> {
    Arrays::open(path).ok()?.meta.kind().ok()?
}
