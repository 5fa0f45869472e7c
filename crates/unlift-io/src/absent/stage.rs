//! Stage files, which this build of unlift-io does not read or write: it lacks the feature
//! `parquet`.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::error::Error;

/// The kinds of stage files: none in this build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {}

impl fmt::Display for Kind {
    fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {}
    }
}

/// Returns the kind of the stage file at `path`: `None` in this build.
pub fn declared_kind(_: &Path) -> Option<Kind> {
    None
}

/// Returns `path` if it is a file.
///
/// # Errors
/// When it is a folder of parts, which this build does not read.
pub fn part_files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    match path.is_dir() {
        true => Err(Error::needs_feature(path, "parquet")),
        false => Ok(vec![path.to_owned()]),
    }
}
