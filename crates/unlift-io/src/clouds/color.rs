//! Colors of errors.

/// Viridis (matplotlib, CC0) at nine even steps: perceptually uniform, also for color-blind
/// readers.
const VIRIDIS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];

/// Returns the color of an error, by interpolation of viridis: dark violet at 0, green at half of
/// `full_scale`, yellow from `full_scale` on and for NaN.
pub fn error_color(error: f64, full_scale: f64) -> [u8; 3] {
    let last = VIRIDIS.len() - 1;
    let share = error / full_scale;
    if share.is_nan() || share >= 1.0 {
        return VIRIDIS[last];
    }
    let at = share.max(0.0) * last as f64;
    let step = (at as usize).min(last - 1);
    let part = at - step as f64;
    std::array::from_fn(|c| {
        let (low, high) = (f64::from(VIRIDIS[step][c]), f64::from(VIRIDIS[step + 1][c]));
        (low + part * (high - low)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_runs_from_violet_to_yellow_and_odd_values_have_a_color() {
        let [violet, green, yellow] = [0, 4, 8].map(|step| VIRIDIS[step]);
        for (error, full_scale, color) in [
            (0.0, 0.25, violet),
            (0.125, 0.25, green),
            (0.25, 0.25, yellow),
            (99.0, 0.25, yellow),
            (f64::NAN, 1.0, yellow),
            (-1.0, 1.0, violet),
            (0.0, 0.0, yellow),
        ] {
            assert_eq!(error_color(error, full_scale), color, "{error} of {full_scale}");
        }
    }
}
