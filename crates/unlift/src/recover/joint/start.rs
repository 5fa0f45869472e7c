//! The pass that joint recovery starts from.

use std::ops::Range;

use crate::recover::consensus::Consensus;
use crate::recover::result::estimate::Estimate;
use crate::recover::solve::Solve;

/// Consensus over who lists whom in both directions, where a record hides one point; over the lists else. Its
/// delta is a narrow one, so that estimates are sharp.
pub(crate) struct JointStart<'a, const D: usize>(pub(crate) Consensus<'a, D>);

impl<'a, const D: usize> Solve<'a, D> for JointStart<'a, D> {
    fn solve(&self, slots: Range<usize>) -> Vec<Estimate<D>> {
        self.0.solve(slots)
    }
}
