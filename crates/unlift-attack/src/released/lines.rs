//! Lines: a unit direction with a fixed sign, and the foot (the point nearest to the origin).

use super::normal_form::{finite_f32, is_f32, unit_direction};
use crate::Error;

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
        if points.len() != directions.len() {
            let expected = format!("{} rows", points.len());
            return Err(Error::new("line directions", expected, directions.len().to_string()));
        }
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

    /// Returns the rows `order[0], order[1], ...`.
    pub fn select(&self, order: &[u32]) -> Self {
        Self {
            foot: super::normal_form::rows(&self.foot, order),
            direction: super::normal_form::rows(&self.direction, order),
        }
    }

    /// Number of lines.
    pub fn len(&self) -> usize {
        self.foot.len()
    }

    /// Whether there are no lines.
    pub fn is_empty(&self) -> bool {
        self.foot.is_empty()
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
