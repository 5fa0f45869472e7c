//! A curve that fills space: cells that are near each other lie near along it (Morton's).

/// The place of `cell` along the curve; coordinates below `2^bits`, at most 64 bits in all.
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
