//! Noise: pseudorandom numbers as a function of position.

pub(crate) fn hashed([a, b, c]: [u64; 3]) -> u64 {
    let mut state = a
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(b.rotate_left(32).wrapping_mul(0xd6e8_feb8_6659_fd93))
        .wrapping_add(c.wrapping_mul(0xa076_1d64_78bd_642f));
    // The finalizer of SplitMix64 (Steele et al. 2014).
    state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    state ^ (state >> 31)
}

/// Returns a pseudorandom number from 0 to 1.
pub(crate) fn unit(parts: [u64; 3]) -> f64 {
    (hashed(parts) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Returns the number of a grid cell in the plane, 0 to 1.
pub(crate) fn of_cell(x: f64, y: f64, seed: u64) -> f64 {
    unit([x.floor() as i64 as u64, y.floor() as i64 as u64, seed])
}

/// Returns smooth noise between the corners of cells of side 1, 0 to 1.
pub(crate) fn smooth(x: f64, y: f64, seed: u64) -> f64 {
    let eased = |x: f64| x * x * (3.0 - 2.0 * x);
    let (a, b) = (eased(x - x.floor()), eased(y - y.floor()));
    let corner = |i: f64, j: f64| of_cell(x + i, y + j, seed);
    let low = corner(0.0, 0.0) * (1.0 - a) + corner(1.0, 0.0) * a;
    let high = corner(0.0, 1.0) * (1.0 - a) + corner(1.0, 1.0) * a;
    low * (1.0 - b) + high * b
}

/// Returns the sum of four octaves of [`smooth`], 0 to 1.
pub(crate) fn rough(x: f64, y: f64, seed: u64) -> f64 {
    let octave = |at: u64| {
        let fine = (1_u64 << at) as f64;
        smooth(x * fine, y * fine, seed ^ (at << 40)) / (2.0 * fine)
    };
    (0..4).map(octave).sum::<f64>() / 0.9375
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_between_0_and_1_smooth_and_varies() {
        let at = |i: u32| rough(f64::from(i) * 0.01, 0.37, 5);
        let values: Vec<f64> = (0..2_000).map(at).collect();
        assert!(values.iter().all(|x| (0.0..=1.0).contains(x)));
        assert!(values.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 0.1));
        let mean = values.iter().sum::<f64>() / 2_000.0;
        assert!((0.4..0.6).contains(&mean), "{mean}");
        assert!(values.iter().any(|x| *x < 0.35) && values.iter().any(|x| *x > 0.65));
    }
}
