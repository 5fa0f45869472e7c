//! The original points, behind one grep-able call.

use crate::geometry::frame::Bounds;
use crate::{Error, PointSet};

/// The true points of a map. They must be opened with [`reveal`](Self::reveal), and recovery takes
/// no argument from which they can be reached:
///
/// ```compile_fail
/// use unlift::{recover, truth::Original};
/// fn attack(original: &Original<3>, neighborhoods: &unlift::neighbors::Neighborhoods) {
///     let _ = recover::recover(original, neighborhoods, &recover::RecoverOptions::default());
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Original<const D: usize> {
    points: PointSet<D>,
    bounds: Option<Bounds<D>>,
}

impl<const D: usize> Original<D> {
    /// Declares `points` to be the truth.
    pub fn new(points: PointSet<D>) -> Self {
        Self { points, bounds: None }
    }

    /// Declares `points`, all of them within `bounds`, to be the truth: the keypoints of an image of
    /// known size. Unlike the points, the bounds are no secret.
    ///
    /// # Errors
    /// When a point lies outside.
    pub fn within(points: PointSet<D>, bounds: Bounds<D>) -> Result<Self, Error> {
        if let Some(row) = points.positions().iter().position(|point| !bounds.contains(point)) {
            let expected = format!("between {:?} and {:?}", bounds.low, bounds.high);
            let found = format!("{:?}", points.positions()[row]);
            return Err(Error::new(format!("point {row}"), expected, found));
        }
        Ok(Self { points, bounds: Some(bounds) })
    }

    /// The box that is known to hold every point (of an image), if there is one. Not a secret.
    pub fn bounds(&self) -> Option<Bounds<D>> {
        self.bounds
    }

    /// The points. Called on the owner's side only: obfuscation, oracle, evaluation.
    pub fn reveal(&self) -> &PointSet<D> {
        &self.points
    }

    /// Number of points (not a secret: the released map tells it).
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}
