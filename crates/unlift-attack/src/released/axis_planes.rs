//! Axis planes: one coordinate of the hidden point is published.

use crate::Error;

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
        if axis.len() != offset.len() {
            let expected = format!("{} rows", axis.len());
            return Err(Error::new("plane offsets", expected, offset.len().to_string()));
        }
        if let Some(row) = axis.iter().position(|&a| usize::from(a) >= D) {
            let what = format!("axis of record {row}");
            return Err(Error::new(what, format!("below {D}"), axis[row].to_string()));
        }
        let offset: Vec<f32> = offset.iter().map(|&x| x as f32 + 0.0).collect();
        if let Some(row) = offset.iter().position(|x| !x.is_finite()) {
            let what = format!("offset of record {row}");
            return Err(Error::new(
                what,
                "a finite number in the range of f32",
                offset[row].to_string(),
            ));
        }
        Ok(Self { axis, offset })
    }

    /// Returns the rows `order[0], order[1], ...`.
    pub fn select(&self, order: &[u32]) -> Self {
        Self {
            axis: super::normal_form::rows(&self.axis, order),
            offset: super::normal_form::rows(&self.offset, order),
        }
    }

    /// Number of planes.
    pub fn len(&self) -> usize {
        self.axis.len()
    }

    /// Whether there are no planes.
    pub fn is_empty(&self) -> bool {
        self.axis.is_empty()
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
