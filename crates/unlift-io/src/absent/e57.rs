//! Replaces `read/scans/e57.rs` in builds without the feature `scans`: no file is read.

use std::path::Path;

use crate::error::Error;
use crate::read::map_input::Input;

/// Names the feature that reads `path`.
pub fn read(path: &Path) -> Result<Input, Error> {
    Err(Error::needs_feature(path, "scans"))
}
