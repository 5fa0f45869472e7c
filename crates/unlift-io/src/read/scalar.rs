//! How one number of an array is stored.

use half::f16;

/// A number in a file, in the least significant byte first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    /// A byte without sign.
    U8,
    /// IEEE's float of 16 bits.
    F16,
    /// IEEE's float of 32 bits.
    F32,
    /// IEEE's float of 64 bits.
    F64,
}

impl Scalar {
    /// Bytes of one number.
    pub fn size(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::F16 => 2,
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number in `bytes`, of which there are [`size`](Self::size).
    ///
    /// # Panics
    /// When there are fewer.
    pub fn read(self, bytes: &[u8]) -> f64 {
        match self {
            Self::U8 => f64::from(bytes[0]),
            Self::F16 => f64::from(f16::from_le_bytes([bytes[0], bytes[1]])),
            Self::F32 => f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            Self::F64 => f64::from_le_bytes(std::array::from_fn(|at| bytes[at])),
        }
    }
}
