//! Conversion of histograms to the 128 bytes that COLMAP stores.

use super::descriptor::{BINS, LENGTH};

/// Maximum value of a normalized descriptor, which limits the effect of a strong edge.
const LARGEST: f32 = 0.2;
/// Length of a descriptor in bytes.
const SCALE: f32 = 512.0;

/// Quantizes a descriptor: unit length, values clamped to 0.2, unit length again, then the root of
/// its shares (RootSIFT, Arandjelovic and Zisserman 2012) times 512.
///
/// The order of directions is reversed, as in Lowe's program. All zeros stay zeros.
pub(crate) fn quantize(mut histograms: [f32; LENGTH]) -> [u8; LENGTH] {
    normalize(&mut histograms);
    for value in &mut histograms {
        *value = value.min(LARGEST);
    }
    normalize(&mut histograms);
    let sum = sum(&histograms, |value| value);
    let mut bytes = [0; LENGTH];
    if sum > 0.0 {
        let cells = histograms.as_chunks::<BINS>().0.iter();
        for (from, to) in cells.zip(bytes.as_chunks_mut::<BINS>().0) {
            for (direction, value) in from.iter().enumerate() {
                let root = (value / sum).sqrt();
                to[(BINS - direction) % BINS] = (SCALE * root + 0.5) as u8;
            }
        }
    }
    bytes
}

fn normalize(values: &mut [f32; LENGTH]) {
    let length = sum(values, |value| value * value).sqrt() + f32::EPSILON;
    for value in values {
        *value /= length;
    }
}

/// Sums in a fixed order that compiles to eight lanes.
fn sum(values: &[f32; LENGTH], of: impl Fn(f32) -> f32) -> f32 {
    let mut lanes = [0.0; BINS];
    for chunk in values.as_chunks::<BINS>().0 {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane += of(value);
        }
    }
    lanes.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_roots_of_shares_with_directions_reversed() {
        let mut histograms = [0.0; LENGTH];
        // 64 equal values: each an equal share, 512 sqrt(1 / 64) = 64.
        for (i, value) in histograms.iter_mut().enumerate() {
            *value = if i % 2 == 1 { 3.0 } else { 0.0 };
        }
        histograms[1] = 0.0;
        histograms[0] = 3.0;
        let bytes = quantize(histograms);
        assert_eq!(bytes[..8], [64, 64, 0, 64, 0, 64, 0, 0]);
        assert_eq!(bytes[8..16], [0, 64, 0, 64, 0, 64, 0, 64]);
    }

    #[test]
    fn a_single_value_is_clamped_and_nothing_stays_nothing() {
        let mut histograms = [1.0; LENGTH];
        histograms[0] = 1e6;
        let bytes = quantize(histograms);
        assert_eq!(bytes[0], 255);
        assert!(bytes[1..].iter().all(|&byte| byte < 2));
        assert_eq!(quantize([0.0; LENGTH]), [0; LENGTH]);
        assert_eq!(quantize([2.0; LENGTH]), quantize([0.5; LENGTH]));
    }
}
