//! How one number of an array is stored.

use half::f16;

/// A number in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

impl Scalar {
    /// The number of `size` bytes of a kind: `f` float, `i` integer, `u` integer without sign, in either case.
    pub fn of_kind(kind: u8, size: u64) -> Option<Self> {
        Some(match (kind.to_ascii_lowercase(), size) {
            (b'i', 1) => Self::I8,
            (b'u', 1) => Self::U8,
            (b'i', 2) => Self::I16,
            (b'u', 2) => Self::U16,
            (b'i', 4) => Self::I32,
            (b'u', 4) => Self::U32,
            (b'i', 8) => Self::I64,
            (b'u', 8) => Self::U64,
            (b'f', 2) => Self::F16,
            (b'f', 4) => Self::F32,
            (b'f', 8) => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one number.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number in `bytes`, of which there are [`size`](Self::size), the most significant one first if `big`.
    ///
    /// # Panics
    /// When there are fewer.
    pub fn read(self, bytes: &[u8], big: bool) -> f64 {
        fn little<const N: usize>(bytes: &[u8], big: bool) -> [u8; N] {
            std::array::from_fn(|at| bytes[if big { N - 1 - at } else { at }])
        }
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(i16::from_le_bytes(little(bytes, big))),
            Self::U16 => f64::from(u16::from_le_bytes(little(bytes, big))),
            Self::I32 => f64::from(i32::from_le_bytes(little(bytes, big))),
            Self::U32 => f64::from(u32::from_le_bytes(little(bytes, big))),
            Self::I64 => i64::from_le_bytes(little(bytes, big)) as f64,
            Self::U64 => u64::from_le_bytes(little(bytes, big)) as f64,
            Self::F16 => f64::from(f16::from_le_bytes(little(bytes, big))),
            Self::F32 => f64::from(f32::from_le_bytes(little(bytes, big))),
            Self::F64 => f64::from_le_bytes(little(bytes, big)),
        }
    }
}
