//! Clouds as scanners and the programs around them store them: LAS, PCD, E57. Positions, nothing else.

mod e57;
mod las;
mod lzf;
mod pcd;
mod scan;

use std::path::Path;

pub(super) use scan::Scan;

use crate::error::Error;

/// The scan in `path`, if files with this extension (in lowercase) are such.
///
/// # Errors
/// When it cannot be read.
pub(super) fn file(path: &Path, extension: &str) -> Option<Result<Scan, Error>> {
    match extension {
        "las" => Some(las::read(path)),
        "pcd" => Some(pcd::read(path)),
        "e57" => Some(e57::read(path)),
        _ => None,
    }
}
