//! The records of a map, of any family: lines, rays, axis planes and axis candidates, in a normal form that is idempotent.

use crate::Error;
use crate::geometry::frame::Bounds;

/// The records of a map. For each hidden point, its record is the set `O(x)` of Eq. (1).
#[derive(Clone, Debug, PartialEq)]
pub enum Obfuscation<const D: usize> {
    /// A line through the point, or through two points (`olc`, `ppl`, `ppl+`).
    Lines(Lines<D>),
    /// A half-line from one of a few published centers (`ray`, `ray-voxel`).
    Rays(Rays<D>),
    /// A plane perpendicular to an axis (`plane`).
    AxisPlanes(AxisPlanes<D>),
    /// One of the `D` axis-parallel lines through a published point (`cp`).
    AxisCandidates(AxisCandidates<D>),
}

impl<const D: usize> Obfuscation<D> {
    /// Number of records.
    pub fn len(&self) -> usize {
        match self {
            Self::Lines(lines) => lines.foot.len(),
            Self::Rays(rays) => rays.center.len(),
            Self::AxisPlanes(planes) => planes.axis.len(),
            Self::AxisCandidates(candidates) => candidates.position.len(),
        }
    }

    /// Whether there are no records.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the records `order[0], order[1], ...`.
    pub fn select(&self, order: &[u32]) -> Self {
        match self {
            Self::Lines(Lines { foot, direction }) => {
                Self::Lines(Lines { foot: rows(foot, order), direction: rows(direction, order) })
            }
            Self::Rays(Rays { centers, center, direction, regions }) => Self::Rays(Rays {
                centers: centers.clone(),
                center: rows(center, order),
                direction: rows(direction, order),
                regions: regions.clone(),
            }),
            Self::AxisPlanes(AxisPlanes { axis, offset }) => Self::AxisPlanes(AxisPlanes {
                axis: rows(axis, order),
                offset: rows(offset, order),
            }),
            Self::AxisCandidates(AxisCandidates { position }) => {
                Self::AxisCandidates(AxisCandidates { position: rows(position, order) })
            }
        }
    }

    /// Returns a point and the unit direction of a line, or the center and the direction of a ray; `None` for other families.
    pub(crate) fn line(&self, record: usize) -> Option<(&[f32; D], &[f32; D])> {
        match self {
            Self::Lines(lines) => Some((&lines.foot[record], &lines.direction[record])),
            Self::Rays(rays) => {
                let center = &rays.centers[usize::from(rays.center[record])];
                Some((center, &rays.direction[record]))
            }
            Self::AxisPlanes(_) | Self::AxisCandidates(_) => None,
        }
    }

    pub(crate) fn rays(&self) -> Option<&Rays<D>> {
        match self {
            Self::Rays(rays) => Some(rays),
            Self::Lines(_) | Self::AxisPlanes(_) | Self::AxisCandidates(_) => None,
        }
    }

    /// Whether the records are bearings from one center: lists say nothing about ranges, but who stands there sees the scene.
    pub fn is_bearings(&self) -> bool {
        self.rays().is_some_and(|rays| rays.centers.len() == 1)
    }

    /// Name of the family in files.
    pub fn family(&self) -> &'static str {
        match self {
            Self::Lines(_) => "lines",
            Self::Rays(_) => "rays",
            Self::AxisPlanes(_) => "axis_planes",
            Self::AxisCandidates(_) => "axis_candidates",
        }
    }
}

/// Lines in normal form, as `(n, D)` columns of `f32` relative to the released origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Lines<const D: usize> {
    foot: Vec<[f32; D]>,
    direction: Vec<[f32; D]>,
}

/// A stored foot stays unchanged if its component along the line is below this fraction of its length.
const FOOT_SLACK: f64 = 1e-6;

impl<const D: usize> Lines<D> {
    /// Creates lines through `points` along `directions`: brought to normal form in `f64`, then rounded.
    ///
    /// The first nonzero component of the stored direction is positive.
    ///
    /// # Errors
    /// When the columns differ in length, or a row is not finite or has no direction.
    pub fn through(points: &[[f64; D]], directions: &[[f64; D]]) -> Result<Self, Error> {
        Error::check_len("line directions", directions.len(), points.len(), " rows")?;
        let mut foot = Vec::with_capacity(points.len());
        let mut direction = Vec::with_capacity(points.len());
        for (row, (point, &along)) in points.iter().zip(directions).enumerate() {
            let unit = unit_direction(along, row)?;
            let mut stored = finite_f32(unit, "direction", row)?;
            if stored.iter().find(|x| **x != 0.0).is_some_and(|x| *x < 0.0) {
                stored = stored.map(|x| -x);
            }
            // No negative zeros, so that equal lines have equal bytes.
            direction.push(stored.map(|x| x + 0.0));
            foot.push(finite_f32(foot_of(point, &unit), "foot", row)?.map(|x| x + 0.0));
        }
        Ok(Self { foot, direction })
    }

    /// Point of each line nearest to the origin.
    pub fn foot(&self) -> &[[f32; D]] {
        &self.foot
    }

    /// Unit direction of each line.
    pub fn direction(&self) -> &[[f32; D]] {
        &self.direction
    }
}

fn foot_of<const D: usize>(point: &[f64; D], unit: &[f64; D]) -> [f64; D] {
    let along: f64 = point.iter().zip(unit).map(|(p, u)| p * u).sum();
    let length2: f64 = point.iter().map(|p| p * p).sum();
    let stored = is_f32(point) && is_f32(unit);
    if stored && along * along <= FOOT_SLACK * FOOT_SLACK * length2 {
        return *point;
    }
    // A unit vector from a file has the rounding error of f32, so divide by its squared length.
    let norm2: f64 = unit.iter().map(|u| u * u).sum();
    std::array::from_fn(|c| point[c] - along / norm2 * unit[c])
}

/// Half-lines `center + t direction`, `t > 0`; `center` is an index into a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Rays<const D: usize> {
    centers: Vec<[f32; D]>,
    center: Vec<u8>,
    direction: Vec<[f32; D]>,
    regions: Option<Vec<Bounds<D>>>,
}

impl<const D: usize> Rays<D> {
    /// Creates rays from `centers[center[i]]` along `direction[i]`, which points from the center to the hidden point.
    ///
    /// # Errors
    /// When there are no or more than 255 centers, the columns differ in length, a center index is
    /// out of range, or a row is not finite or has no direction.
    pub fn try_new(
        centers: &[[f64; D]],
        center: Vec<u8>,
        directions: &[[f64; D]],
    ) -> Result<Self, Error> {
        if centers.is_empty() || centers.len() > 255 {
            return Err(Error::new("ray centers", "1 to 255", centers.len()));
        }
        Error::check_len("ray directions", directions.len(), center.len(), " rows")?;
        if let Some(row) = center.iter().position(|&c| usize::from(c) >= centers.len()) {
            let what = format!("center of record {row}");
            let expected = format!("an index below {}", centers.len());
            return Err(Error::new(what, expected, center[row]));
        }
        let rounded = |(row, &c)| finite_f32(c, "center table entry", row);
        let centers = centers.iter().enumerate().map(rounded).collect::<Result<_, _>>()?;
        let unit =
            |(row, &d)| Ok(finite_f32(unit_direction(d, row)?, "direction", row)?.map(|x| x + 0.0));
        let direction = directions.iter().enumerate().map(unit).collect::<Result<_, Error>>()?;
        Ok(Self { centers, center, direction, regions: None })
    }

    /// Declares that the region of a point decides its center. `regions` has, per center, the box of its points, relative to the released
    /// origin. It is a public rule of the scheme.
    ///
    /// # Errors
    /// When there is not one region per center.
    pub fn with_regions(self, regions: Vec<Bounds<D>>) -> Result<Self, Error> {
        Error::check_len("regions", regions.len(), self.centers.len(), ", one per center")?;
        Ok(Self { regions: Some(regions), ..self })
    }

    /// Box of the points of each center, relative to the released origin, if declared.
    pub fn regions(&self) -> Option<&[Bounds<D>]> {
        self.regions.as_deref()
    }

    /// The published centers.
    pub fn centers(&self) -> &[[f32; D]] {
        &self.centers
    }

    /// Index of the center of each ray, which is its group.
    pub fn center(&self) -> &[u8] {
        &self.center
    }

    /// Unit direction of each ray, away from its center.
    pub fn direction(&self) -> &[[f32; D]] {
        &self.direction
    }
}

/// Planes perpendicular to an axis: the axis, in `0..D`, and the coordinate on it.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisPlanes<const D: usize> {
    axis: Vec<u8>,
    offset: Vec<f32>,
}

impl<const D: usize> AxisPlanes<D> {
    /// Creates planes `x[axis[i]] = offset[i]`.
    ///
    /// # Errors
    /// When the columns differ in length, an axis is not below `D`, or an offset is not finite.
    pub fn try_new(axis: Vec<u8>, offset: &[f64]) -> Result<Self, Error> {
        Error::check_len("plane offsets", offset.len(), axis.len(), " rows")?;
        if let Some(row) = axis.iter().position(|&a| usize::from(a) >= D) {
            let what = format!("axis of record {row}");
            return Err(Error::new(what, format!("below {D}"), axis[row]));
        }
        let offset: Vec<f32> = offset.iter().map(|&x| x as f32 + 0.0).collect();
        if let Some(row) = offset.iter().position(|x| !x.is_finite()) {
            let what = format!("offset of record {row}");
            return Err(Error::new(what, "a finite number in the range of f32", offset[row]));
        }
        Ok(Self { axis, offset })
    }

    /// Axis that each plane is perpendicular to.
    pub fn axis(&self) -> &[u8] {
        &self.axis
    }

    /// Coordinate of each plane on its axis.
    pub fn offset(&self) -> &[f32] {
        &self.offset
    }
}

/// Published points. Each hidden point lies on one of the `D` axis-parallel lines through its published point.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisCandidates<const D: usize> {
    position: Vec<[f32; D]>,
}

impl<const D: usize> AxisCandidates<D> {
    /// Creates records from published points, `(n, D)` relative to the released origin.
    ///
    /// # Errors
    /// When a coordinate is not finite in `f32`.
    pub fn try_new(positions: &[[f64; D]]) -> Result<Self, Error> {
        let rounded = |(row, &p)| Ok(finite_f32(p, "position", row)?.map(|x| x + 0.0));
        let position = positions.iter().enumerate().map(rounded).collect::<Result<_, Error>>()?;
        Ok(Self { position })
    }

    /// The published points.
    pub fn position(&self) -> &[[f32; D]] {
        &self.position
    }
}

fn rows<T: Copy>(column: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&row| column[row as usize]).collect()
}

/// Stored directions whose squared length differs from 1 by less stay unchanged, so that normalizing twice changes no bit.
const UNIT_SLACK: f64 = 6e-7;

/// Whether `v` may come from a stored file. Otherwise its last bits would show a length near 1 or a point near the foot.
fn is_f32<const D: usize>(v: &[f64; D]) -> bool {
    v.iter().all(|&x| f64::from(x as f32) == x)
}

/// Returns the unit vector along `v`; `v` itself if it is a stored unit vector.
fn unit_direction<const D: usize>(v: [f64; D], row: usize) -> Result<[f64; D], Error> {
    let norm2: f64 = v.iter().map(|x| x * x).sum();
    if !norm2.is_finite() || norm2 <= 0.0 {
        let what = format!("direction of record {row}");
        return Err(Error::new(what, "a finite vector with length", format!("{v:?}")));
    }
    if is_f32(&v) && (norm2 - 1.0).abs() <= UNIT_SLACK {
        return Ok(v);
    }
    let norm = norm2.sqrt();
    Ok(v.map(|x| x / norm))
}

fn finite_f32<const D: usize>(v: [f64; D], what: &str, row: usize) -> Result<[f32; D], Error> {
    let rounded = v.map(|x| x as f32);
    if rounded.iter().all(|x| x.is_finite()) {
        return Ok(rounded);
    }
    let what = format!("{what} of record {row}");
    Err(Error::new(what, "coordinates in the range of f32", format!("{v:?}")))
}
