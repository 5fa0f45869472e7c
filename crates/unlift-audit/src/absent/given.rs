//! Replaces `given.rs` in builds without the feature `parquet`: no list is read.

use std::path::Path;

use unlift::audit::PointNeighbors;

use crate::Error;
use crate::prepare::Prepared;

/// Lists by row of the file, which this build does not read.
///
/// # Errors
/// Always. The error names the feature that reads `path`.
pub fn by_point(
    path: &Path,
    _: &Prepared,
    _: usize,
    _: &mut Vec<String>,
) -> Result<PointNeighbors, Error> {
    let expected = "unlift-audit with the feature `parquet`";
    Err(unlift_io::Error::new(path, "", expected, "a build without it").into())
}
