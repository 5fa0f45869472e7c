//! Stage files: the NumPy archives (`.npz`) that commands exchange, each of one kind, of a map or
//! of many images.
//!
//! `docs/formats.md` describes them. Released maps, lists and recovered points contain nothing of
//! the ground truth: no ids, names or times of their source. Equal values make equal bytes.
//!
//! Readers accept what `np.savez` and `np.savez_compressed` write: floats of any width, integers of
//! any width, either order of memory and of bytes. Any deviation from the document is one line that
//! names the file, the array and row (counted from 0), what was expected and what was found.

mod arrays;
mod images;
mod lists;
mod meta;
mod recovered;
mod released;
mod truth;
mod write;

use std::fmt;
use std::path::Path;

use crate::Error;
use crate::read::npz::Archive;
use arrays::Arrays;

pub use images::{ImageFile, ImageRows, ImageWriter};
pub use lists::{read_neighborhoods, read_point_neighborhoods, write_neighborhoods};
pub use recovered::{read_recovered, read_recovered_in, write_recovered};
pub use released::{published_positions, read_released, scheme_name, write_released};
pub use truth::{read_truth, write_truth};

/// The content of a stage file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An obfuscated map: the attacker's side.
    Released,
    /// Originals and the secret of an obfuscation: the owner's side.
    Truth,
    /// Lists of records, one per slot.
    Neighborhoods,
    /// Lists of original points, one per point.
    PointNeighborhoods,
    /// Recovered points, one per slot.
    Recovered,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 5] = [
        Self::Released,
        Self::Truth,
        Self::Neighborhoods,
        Self::PointNeighborhoods,
        Self::Recovered,
    ];

    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Released => "released",
            Self::Truth => "truth",
            Self::Neighborhoods => "neighborhoods",
            Self::PointNeighborhoods => "point_neighborhoods",
            Self::Recovered => "recovered",
        }
    }

    /// Returns the kind with the name `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The arrays that a file of this kind may have, besides the metadata.
    fn arrays(self) -> &'static [&'static str] {
        match self {
            Self::Released => &released::ARRAYS,
            Self::Truth => &truth::ARRAYS,
            Self::Neighborhoods => &["records", "scores"],
            Self::PointNeighborhoods => &["neighbors", "scores"],
            Self::Recovered => &recovered::ARRAYS,
        }
    }

    /// Returns the kind that alone may have such arrays.
    fn of_arrays<'a>(mut names: impl Iterator<Item = &'a str>) -> Option<Self> {
        names.find_map(|name| {
            let mut kinds = Self::ALL.into_iter().filter(|kind| kind.arrays().contains(&name));
            kinds.next().filter(|_| kinds.next().is_none())
        })
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Released => "a released map",
            Self::Truth => "a truth file",
            Self::Neighborhoods => "neighborhoods of slots",
            Self::PointNeighborhoods => "neighborhoods of points",
            Self::Recovered => "a file of recovered points",
        })
    }
}

/// Returns the kind of the stage file `path`, by its metadata or its arrays.
///
/// # Errors
/// When the file is not a stage file of a known kind and version.
pub fn kind(path: &Path) -> Result<Kind, Error> {
    let arrays = Arrays::open(path)?;
    let kind = arrays.kind()?;
    kind.ok_or_else(|| Error::new(path, "", "a stage file of unlift", arrays.list()))
}

/// Returns true if the stage file `path` contains many images, below their names.
pub fn has_images(path: &Path) -> Result<bool, Error> {
    Ok(Archive::open(path)?.arrays()?.iter().any(|(_, name)| name.contains('/')))
}

/// Returns the kind that the metadata of the file at `path` declares, if it is a stage file and
/// declares one.
pub fn declared_kind(path: &Path) -> Option<Kind> {
    Arrays::open(path).ok()?.meta().kind().ok()?
}
