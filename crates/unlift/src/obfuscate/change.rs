//! What a scheme may change beside the records: the map before it is hidden, or the descriptors.

use std::sync::Arc;

use super::mitigate::Mitigation;
use super::protect::Protection;

/// A change of what a scheme releases.
#[derive(Clone, Debug)]
pub enum Change {
    /// Changes of the map before it is hidden, and the number of images per point, if known.
    Mitigation(Mitigation, Option<Arc<[u32]>>),
    /// Protected descriptors in place of plain ones.
    Protection(Protection),
}

impl Change {
    /// Returns true if it changes descriptors, so that fewer keypoints find their points.
    pub fn changes_descriptors(&self) -> bool {
        match self {
            Self::Mitigation(mitigation, _) => mitigation.changes_descriptors(),
            Self::Protection(_) => true,
        }
    }

    /// Returns the protection under which descriptors are released, if it is one.
    pub fn protection(&self) -> Option<&Protection> {
        match self {
            Self::Mitigation(..) => None,
            Self::Protection(protection) => Some(protection),
        }
    }
}
