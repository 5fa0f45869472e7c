//! Numeric types of files.

use half::f16;

/// The type of a number in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Scalar {
    /// `f`, `i` or `u`.
    kind: u8,
    size: usize,
}

impl Scalar {
    pub const U8: Self = Self { kind: b'u', size: 1 };
    pub const F16: Self = Self { kind: b'f', size: 2 };
    pub const F32: Self = Self { kind: b'f', size: 4 };
    pub const F64: Self = Self { kind: b'f', size: 8 };

    /// Returns a type by its size in bytes and kind: `f` float, `i` signed, `u` unsigned, in either
    /// case.
    pub fn of_kind(kind: u8, size: u64) -> Option<Self> {
        let kind = kind.to_ascii_lowercase();
        let sizes: &[u64] = match kind {
            b'i' | b'u' => &[1, 2, 4, 8],
            b'f' => &[2, 4, 8],
            _ => return None,
        };
        sizes.contains(&size).then_some(Self { kind, size: size as usize })
    }

    pub fn size(self) -> usize {
        self.size
    }

    /// Reads a number from the first [`size`](Self::size) `bytes`, big-endian if `big` is set.
    pub fn read(self, bytes: &[u8], big: bool) -> f64 {
        let mut little = [0; 8];
        little[..self.size].copy_from_slice(&bytes[..self.size]);
        if big {
            little[..self.size].reverse();
        }
        let [a, b, c, d, ..] = little;
        match (self.kind, self.size) {
            (b'u', _) => u64::from_le_bytes(little) as f64,
            (b'i', size) => {
                let unused = 64 - 8 * size;
                (i64::from_le_bytes(little) << unused >> unused) as f64
            }
            (_, 2) => f64::from(f16::from_le_bytes([a, b])),
            (_, 4) => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => f64::from_le_bytes(little),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_keep_their_sign_in_either_order() {
        for (kind, bytes, expected) in [
            (b'i', &[0xfe][..], -2.0),
            (b'u', &[0xfe], 254.0),
            (b'I', &[0xd4, 0xfe], -300.0),
            (b'u', &[0xd4, 0xfe], 65236.0),
            (b'i', &[0xff; 4], -1.0),
            (b'U', &[0xff, 0xff, 0xff, 0x7f], 2147483647.0),
            (b'i', &[0xff; 8], -1.0),
            (b'u', &[0, 0, 0, 0, 0, 0, 0, 0x80], 9223372036854775808.0),
        ] {
            let scalar = Scalar::of_kind(kind, bytes.len() as u64).unwrap();
            let reversed: Vec<u8> = bytes.iter().rev().copied().collect();
            assert_eq!([scalar.read(bytes, false), scalar.read(&reversed, true)], [expected; 2]);
        }
    }
}
