//! Line segments as OBJ.

use super::{Segment, finite};
use crate::Error;
use crate::atomic::{self, Access, CLOUD_COMMENT};
use std::io::Write;
use std::path::Path;

/// Writes `segments` as an OBJ file: two `v` records and one `l` record each. In 2D, z is 0.
///
/// # Errors
/// When a coordinate is not finite, or the file cannot be written.
pub fn write_lines<const D: usize>(path: &Path, segments: &[Segment<D>]) -> Result<(), Error> {
    for (row, segment) in segments.iter().enumerate() {
        finite(path, ("segment", row), segment)?;
    }
    atomic::write_file(path, Access::Private, |w| {
        writeln!(w, "# {CLOUD_COMMENT}")?;
        for (row, segment) in segments.iter().enumerate() {
            for end in segment {
                let [x, y, z] = std::array::from_fn(|c| end.get(c).copied().unwrap_or(0.0));
                writeln!(w, "v {x} {y} {z}")?;
            }
            writeln!(w, "l {} {}", 2 * row + 1, 2 * row + 2)?;
        }
        Ok(())
    })
}
