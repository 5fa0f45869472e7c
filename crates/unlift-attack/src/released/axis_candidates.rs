//! Axis candidates: a published point, one coordinate of which belongs to another point.

use super::normal_form::finite_f32;
use crate::Error;

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
        let position = positions
            .iter()
            .enumerate()
            .map(|(row, &p)| Ok(finite_f32(p, "position", row)?.map(|x| x + 0.0)))
            .collect::<Result<_, Error>>()?;
        Ok(Self { position })
    }

    /// Returns the rows `order[0], order[1], ...`.
    pub fn select(&self, order: &[u32]) -> Self {
        Self { position: super::normal_form::rows(&self.position, order) }
    }

    /// Number of records.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are no records.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// The published points.
    pub fn position(&self) -> &[[f32; D]] {
        &self.position
    }
}
