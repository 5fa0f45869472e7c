//! Exports of points and lines for other programs.

mod colmap;
mod color;
mod obj;
mod ply;
mod segments;

use std::path::Path;

use crate::Error;

pub use colmap::{write_cameras, write_images, write_model_points};
pub use color::error_color;
pub use obj::write_lines;
pub use ply::{write_points, write_recovered};
pub use segments::{Segment, record_segments};

/// Returns an error if a coordinate of the `row`-th `what` is not finite.
fn finite<const D: usize, const N: usize>(
    path: &Path,
    (what, row): (&str, usize),
    points: &[[f64; D]; N],
) -> Result<(), Error> {
    if points.iter().flatten().all(|x| x.is_finite()) {
        return Ok(());
    }
    let found = if N == 1 { format!("{:?}", points[0]) } else { format!("{points:?}") };
    Err(Error::new(path, format!("{what} {row}"), "finite coordinates", found))
}
