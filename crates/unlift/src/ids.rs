//! Indices as types, so that an original, a slot and a record cannot be mixed up.

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
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
    };
}

id! {
    /// A row of the original points.
    OriginalId
}
id! {
    /// A row of the released map: what replaces one point (or two, for paired lines).
    RecordId
}
