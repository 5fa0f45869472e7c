//! Original points, accessible only through `reveal`, which is easy to search for.

use crate::geometry::frame::Bounds;
use crate::{Error, PointSet};

/// The true points of a map. Only [`reveal`](Self::reveal) returns them, and recovery takes no
/// argument that contains them:
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
    /// Creates ground truth from `points`.
    pub fn new(points: PointSet<D>) -> Self {
        Self { points, bounds: None }
    }

    /// Creates ground truth from the keypoints of an image of known size. All `points` must lie
    /// within `bounds`, which are not secret.
    ///
    /// # Errors
    /// When a point lies outside `bounds`.
    pub fn within(points: PointSet<D>, bounds: Bounds<D>) -> Result<Self, Error> {
        if let Some(row) = points.positions().iter().position(|point| !bounds.contains(point)) {
            let expected = format!("between {:?} and {:?}", bounds.low, bounds.high);
            let found = format!("{:?}", points.positions()[row]);
            return Err(Error::new(format!("point {row}"), expected, found));
        }
        Ok(Self { points, bounds: Some(bounds) })
    }

    /// Returns the public bounds of the points (of an image), if known.
    pub fn bounds(&self) -> Option<Bounds<D>> {
        self.bounds
    }

    /// Returns the points. Only obfuscation, oracle and evaluation call this.
    pub fn reveal(&self) -> &PointSet<D> {
        &self.points
    }

    /// Returns the number of points. It is not secret, because the released map reveals it.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns true if there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}
