//! Exports of points and lines for other programs: PLY, OBJ and COLMAP models in text.

mod colmap;

use std::io::Write;
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

/// Returns an error if a coordinate of one of the `rows`, each a `what`, is not finite.
fn finite<const D: usize, const N: usize>(
    path: &Path,
    what: &str,
    rows: impl IntoIterator<Item = [[f64; D]; N]>,
) -> Result<(), Error> {
    let is_wrong = |row: &[[f64; D]; N]| !row.iter().flatten().all(|x| x.is_finite());
    let Some((at, row)) = rows.into_iter().enumerate().find(|(_, row)| is_wrong(row)) else {
        return Ok(());
    };
    let found = if N == 1 { format!("{:?}", row[0]) } else { format!("{row:?}") };
    Err(Error::new(path, format!("{what} {at}"), "finite coordinates", found))
}

/// Writes `points` `(n, D)` as binary little-endian PLY.
///
/// The columns are `double x, y, z` (z is 0 in 2D).
///
/// # Errors
/// When a coordinate is not finite.
pub fn write_points<const D: usize>(path: &Path, points: &[[f64; D]]) -> Result<(), Error> {
    finite(path, "point", points.iter().map(|point| [*point]))?;
    atomic::write_file(path, Access::Private, |w| {
        writeln!(w, "ply\nformat binary_little_endian 1.0\ncomment {CLOUD_COMMENT}")?;
        writeln!(w, "element vertex {}", points.len())?;
        writeln!(w, "property double x\nproperty double y\nproperty double z\nend_header")?;
        points.iter().flat_map(in_space).try_for_each(|value| w.write_all(&value.to_le_bytes()))
    })
}

/// Returns the coordinates of a point in 3D; in 2D, z is 0.
fn in_space<const D: usize>(point: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|axis| point.get(axis).copied().unwrap_or(0.0))
}

/// Writes `segments` as an OBJ file: two `v` records and one `l` record each. In 2D, z is 0.
///
/// # Errors
/// When a coordinate is not finite.
pub fn write_lines<const D: usize>(path: &Path, segments: &[Segment<D>]) -> Result<(), Error> {
    finite(path, "segment", segments.iter().copied())?;
    atomic::write_file(path, Access::Private, |w| {
        writeln!(w, "# {CLOUD_COMMENT}")?;
        for (row, segment) in segments.iter().enumerate() {
            for end in segment {
                let [x, y, z] = in_space(end);
                writeln!(w, "v {x} {y} {z}")?;
            }
            writeln!(w, "l {} {}", 2 * row + 1, 2 * row + 2)?;
        }
        Ok(())
    })
}

/// The two ends of a line segment.
pub type Segment<const D: usize> = [[f64; D]; 2];

/// Returns the segments of these released lines or rays inside the box, in the map's frame (the
/// origin is added). Records that miss the box, or only touch it, are left out. Other families have
/// no segments.
pub fn record_segments<const D: usize>(
    released: &Released<D>,
    bounds: &Bounds<D>,
    records: impl IntoIterator<Item = usize>,
) -> Vec<Segment<D>> {
    let origin = released.origin();
    let segment = |record: usize| {
        let (point, direction, start) = match released.obfuscation() {
            Obfuscation::Lines(lines) => {
                (lines.foot()[record], lines.direction()[record], f64::NEG_INFINITY)
            }
            Obfuscation::Rays(rays) => {
                let center = rays.centers()[usize::from(rays.center()[record])];
                (center, rays.direction()[record], 0.0)
            }
            Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => return None,
        };
        let point: [f64; D] = std::array::from_fn(|c| f64::from(point[c]) + origin[c]);
        let direction = direction.map(f64::from);
        let (from, to) = bounds.clip(&point, &direction)?;
        // Rounding may leave the box by an ulp.
        let at = |t: f64| {
            let along = |c: usize| point[c] + t * direction[c];
            std::array::from_fn(|c| along(c).clamp(bounds.low[c], bounds.high[c]))
        };
        (from.max(start) < to).then(|| [at(from.max(start)), at(to)])
    };
    records.into_iter().filter_map(segment).collect()
}
