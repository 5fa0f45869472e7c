//! Indices as types, so that slots and records are not confused.

/// A row of the released map. It replaces one point, or two for paired lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[repr(transparent)]
pub struct RecordId(pub u32);

impl RecordId {
    /// Returns the id as an array index.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// Creates the id of row `index`.
    ///
    /// # Panics
    /// When `index` does not fit 32 bits; sizes are checked where points enter ([`crate::PointSet`]).
    #[inline(always)]
    pub fn from_index(index: usize) -> Self {
        Self(u32::try_from(index).expect("sizes are checked where points enter"))
    }
}
