//! Whole vectors at a time: what the hot loops share.

/// Columns are padded to a multiple of this many entries that do not vote, so that every loop runs
/// over whole vectors, with the same order of additions whatever the machine.
pub(crate) const LANES: usize = 8;

/// One vector.
pub(crate) type Lanes = [f32; LANES];

/// The logarithm of a positive number, to 2e-6: exponent plus a polynomial of the mantissa, without
/// branches.
#[inline(always)]
pub(crate) fn ln(y: f32) -> f32 {
    let bits = y.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    let m = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000) - 1.0;
    // ln(1 + m) on [0, 1), zero at 0, fitted for the smallest largest error.
    let p = m * (0.317_648_7 + m * (-0.193_760_2 + m * (0.085_569_24 - m * 0.018_338_63)));
    exponent as f32 * std::f32::consts::LN_2 + m * (0.999_901_65 + m * (-0.497_875 + p))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithm_is_near_the_exact_one() {
        // Every exponent, and mantissas all over.
        for exponent in -126..127 {
            for step in 0..1000 {
                let y = (exponent as f32).exp2() * (1.0 + step as f32 / 1000.0);
                let exact = f64::from(y).ln();
                let off = (f64::from(ln(y)) - exact).abs();
                assert!(off <= 2.5e-6 + 1e-7 * exact.abs(), "ln {y}: off by {off}");
            }
        }
        assert_eq!(ln(1.0), 0.0);
    }
}
