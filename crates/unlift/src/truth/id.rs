//! The index of an original as a type, so that it cannot be mixed up with a slot or a record.

/// A row of the original points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[repr(transparent)]
pub struct OriginalId(pub u32);

impl OriginalId {
    /// The id as an array index.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The id of row `index`.
    ///
    /// # Panics
    /// When `index` does not fit 32 bits; sizes are checked where points enter ([`crate::PointSet`]).
    #[inline(always)]
    pub fn from_index(index: usize) -> Self {
        Self(u32::try_from(index).expect("sizes are checked where points enter"))
    }
}
