//! The original points, behind one grep-able call.

use crate::PointSet;

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
pub struct Original<const D: usize>(PointSet<D>);

impl<const D: usize> Original<D> {
    /// Declares `points` to be the truth.
    pub fn new(points: PointSet<D>) -> Self {
        Self(points)
    }

    /// The points. Called on the owner's side only: obfuscation, oracle, evaluation.
    pub fn reveal(&self) -> &PointSet<D> {
        &self.0
    }

    /// Number of points (not a secret: the released map tells it).
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
