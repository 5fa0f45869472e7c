//! Line segments as OBJ.

use super::Segment;
use crate::Error;
use crate::atomic::{self, Access, CLOUD_COMMENT};
use std::io::Write;
use std::path::Path;

/// Writes `segments` as an OBJ file: two `v` records and one `l` record each, coordinates with as
/// many digits as it takes to read them back equal; z is 0 in 2D.
///
/// # Errors
/// When a coordinate is not finite, or the file cannot be written.
pub fn write_lines<const D: usize>(path: &Path, segments: &[Segment<D>]) -> Result<(), Error> {
    let infinite = |segment: &Segment<D>| segment.iter().flatten().any(|x| !x.is_finite());
    if let Some(row) = segments.iter().position(infinite) {
        let found = format!("{:?}", segments[row]);
        let place = format!("segment {row}");
        return Err(Error::new(path, place, "finite coordinates", found));
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
