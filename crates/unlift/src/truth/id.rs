//! Index of an original as a type, so that it cannot be confused with a slot or a record.

/// A row of the original points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[repr(transparent)]
pub struct OriginalId(pub u32);

impl OriginalId {
    /// Returns the id as an array index.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// Returns the id of row `index`.
    ///
    /// # Panics
    /// When `index` exceeds 32 bits. [`crate::PointSet`] checks sizes, so this does not happen.
    #[inline(always)]
    pub fn from_index(index: usize) -> Self {
        Self(u32::try_from(index).expect("sizes are checked where points enter"))
    }
}
