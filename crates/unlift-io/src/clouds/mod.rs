//! Exports of points and lines for other programs: PLY, OBJ and COLMAP models in text.

mod colmap;

use std::io::{self, Write};
use std::path::Path;

use unlift::geometry::frame::Bounds;
use unlift::released::{Obfuscation, Released};

use crate::Error;
use crate::atomic::{self, Access};

pub use colmap::{write_cameras, write_images, write_model_points};

/// The comment of clouds of points and lines, by which their outputs are recognized.
const CLOUD_COMMENT: &str = "unlift";
/// The first line of each file of a COLMAP model, by which it is recognized.
const MODEL_MARK: &str = "# unlift model";

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

/// The two ends of a line segment.
pub type Segment<const D: usize> = [[f64; D]; 2];

/// Returns the segments of the released lines or rays inside the box from `low` to `high`, in
/// record order.
///
/// Coordinates are in the map's frame (the origin is added). Records that miss the box are left
/// out. Other families have no segments.
pub fn record_segments<const D: usize>(
    released: &Released<D>,
    low: &[f64; D],
    high: &[f64; D],
) -> Vec<Segment<D>> {
    let origin = released.origin();
    let placed = |p: [f32; D]| -> [f64; D] { std::array::from_fn(|c| f64::from(p[c]) + origin[c]) };
    match released.obfuscation() {
        Obfuscation::Lines(lines) => lines
            .foot()
            .iter()
            .zip(lines.direction())
            .filter_map(|(&f, d)| clip(&placed(f), &d.map(f64::from), LINE, (low, high)))
            .collect(),
        Obfuscation::Rays(rays) => rays
            .center()
            .iter()
            .zip(rays.direction())
            .filter_map(|(&c, d)| {
                let center = placed(rays.centers()[usize::from(c)]);
                clip(&center, &d.map(f64::from), RAY, (low, high))
            })
            .collect(),
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => Vec::new(),
    }
}

/// The start of a line and of a ray, in lengths of the direction.
const LINE: f64 = f64::NEG_INFINITY;
const RAY: f64 = 0.0;

/// Returns the segment of the line or ray through `point` along `direction` inside the box, or
/// `None` if it misses the box, only touches it, or has no direction.
fn clip<const D: usize>(
    point: &[f64; D],
    direction: &[f64; D],
    start: f64,
    (low, high): (&[f64; D], &[f64; D]),
) -> Option<Segment<D>> {
    let bounds = Bounds { low: *low, high: *high };
    let finite = |row: &[f64; D]| row.iter().all(|x| x.is_finite());
    let is_box = low.iter().zip(high).all(|(low, high)| low <= high);
    let (from, to) = bounds.clip(point, direction)?;
    let from = from.max(start);
    if !(from < to && is_box && finite(point) && finite(direction)) {
        return None;
    }
    // Rounding may leave the box by an ulp.
    let at = |t: f64| std::array::from_fn(|c| (point[c] + t * direction[c]).clamp(low[c], high[c]));
    Some([at(from), at(to)])
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOW: [f64; 3] = [0.0; 3];
    const HIGH: [f64; 3] = [1.0, 2.0, 3.0];

    #[test]
    fn what_is_within_the_box_stays() {
        let (x, y, nan) = ([1.0, -1.0, 0.0], [0.0, 1.0, 0.0], [f64::NAN, 0.0, 1.0]);
        let full = Some([[0.5, 0.0, 1.0], [0.5, 2.0, 1.0]]);
        for (point, direction, start, expected) in [
            // A line ends on faces of the box, and a ray starts at its center.
            ([0.5, 9.0, 1.0], y, LINE, full),
            ([0.5, 1.0, 1.0], y, RAY, Some([[0.5, 1.0, 1.0], [0.5, 2.0, 1.0]])),
            ([0.5, 9.0, 1.0], y, RAY, None),
            // Lines that miss the box, touch it, or have no direction.
            ([5.0, 5.0, 5.0], y, LINE, None),
            ([1.0, 2.0, 0.0], x, LINE, None),
            ([0.5; 3], [0.0; 3], LINE, None),
            ([0.5; 3], nan, LINE, None),
        ] {
            assert_eq!(clip(&point, &direction, start, (&LOW, &HIGH)), expected, "{point:?}");
        }
        for high in [[1.0, -1.0, 1.0], [f64::NAN; 3]] {
            assert_eq!(clip(&[0.5; 3], &y, LINE, (&LOW, &high)), None, "no box");
        }
    }
}
