//! Point clouds as binary PLY.

use super::{error_color, finite};
use crate::Error;
use crate::atomic::{self, Access, CLOUD_COMMENT};
use std::io::{self, Write};
use std::path::Path;

/// Writes `points` `(n, D)` as binary little-endian PLY.
///
/// The columns are `double x, y, z` (z is 0 in 2D).
///
/// # Errors
/// When a coordinate is not finite, or the file cannot be written.
pub fn write_points<const D: usize>(path: &Path, points: &[[f64; D]]) -> Result<(), Error> {
    for (row, point) in points.iter().enumerate() {
        finite(path, ("point", row), &[*point])?;
    }
    atomic::write_file(path, Access::Private, |w| {
        header(w, points.len(), "")?;
        points.iter().try_for_each(|point| coordinates(w, point))
    })
}

/// Writes recovered points as PLY, colored by their `errors` (distance to the original).
///
/// The columns are those of [`write_points`], then `uchar red, green, blue, float error`. Lost points (`None`) are omitted.
/// Colors are those of [`error_color`] with `full_scale`, in the unit of the points.
///
/// # Errors
/// When a coordinate is not finite, `errors` has another length, or the file cannot be written.
pub fn write_recovered<const D: usize>(
    path: &Path,
    points: &[Option<[f64; D]>],
    errors: &[f64],
    full_scale: f64,
) -> Result<(), Error> {
    if errors.len() != points.len() {
        let expected = format!("{} errors", points.len());
        return Err(Error::new(path, "", expected, errors.len().to_string()));
    }
    for (row, point) in points.iter().enumerate() {
        if let Some(point) = point {
            finite(path, ("point", row), &[*point])?;
        }
    }
    let n_found = points.iter().flatten().count();
    atomic::write_file(path, Access::Private, |w| {
        header(w, n_found, COLOR_AND_ERROR)?;
        for (point, &error) in points.iter().zip(errors) {
            if let Some(point) = point {
                coordinates(w, point)?;
                w.write_all(&error_color(error, full_scale))?;
                w.write_all(&(error as f32).to_le_bytes())?;
            }
        }
        Ok(())
    })
}

const COLOR_AND_ERROR: &str =
    "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float error\n";

fn header(w: &mut impl Write, n: usize, more: &str) -> io::Result<()> {
    write!(w, "ply\nformat binary_little_endian 1.0\ncomment {CLOUD_COMMENT}\n")?;
    writeln!(w, "element vertex {n}")?;
    for axis in ["x", "y", "z"] {
        writeln!(w, "property double {axis}")?;
    }
    writeln!(w, "{more}end_header")
}

fn coordinates<const D: usize>(w: &mut impl Write, point: &[f64; D]) -> io::Result<()> {
    for axis in 0..3 {
        w.write_all(&point.get(axis).copied().unwrap_or(0.0).to_le_bytes())?;
    }
    Ok(())
}
