//! The records of a map, of any family.

use super::axis_candidates::AxisCandidates;
use super::axis_planes::AxisPlanes;
use super::lines::Lines;
use super::rays::Rays;

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
            Self::Lines(lines) => lines.len(),
            Self::Rays(rays) => rays.len(),
            Self::AxisPlanes(planes) => planes.len(),
            Self::AxisCandidates(candidates) => candidates.len(),
        }
    }

    /// Whether there are no records.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the records `order[0], order[1], ...`.
    pub fn select(&self, order: &[u32]) -> Self {
        match self {
            Self::Lines(lines) => Self::Lines(lines.select(order)),
            Self::Rays(rays) => Self::Rays(rays.select(order)),
            Self::AxisPlanes(planes) => Self::AxisPlanes(planes.select(order)),
            Self::AxisCandidates(candidates) => Self::AxisCandidates(candidates.select(order)),
        }
    }

    /// Whether the records are bearings from one center. All meet there, so neighbors say nothing about ranges, but whoever stands in
    /// the center sees the scene.
    pub fn is_bearings(&self) -> bool {
        matches!(self, Self::Rays(rays) if rays.centers().len() == 1)
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
