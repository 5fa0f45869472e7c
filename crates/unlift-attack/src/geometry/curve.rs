//! A space-filling curve (Morton's): cells that are near each other are mostly near along it.

/// Returns the index of `cell` along the curve. Coordinates are below `2^bits`; all together have at most 64 bits.
#[inline]
pub(crate) fn along<const D: usize>(cell: &[u32; D], bits: u32) -> u64 {
    let mut place = 0;
    for bit in (0..bits).rev() {
        for of_axis in cell {
            place = place << 1 | u64::from(of_axis >> bit & 1);
        }
    }
    place
}
