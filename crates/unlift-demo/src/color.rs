//! Colors, and how they are mixed.

use crate::noise::hashed;

/// Red, green and blue, the share of the light that comes back.
pub(crate) type Color = [f64; 3];

/// One of several, by a hash.
pub(crate) fn one_of(colors: &[Color], parts: [u64; 3]) -> Color {
    colors[(hashed(parts) % colors.len() as u64) as usize]
}

pub(crate) fn toned(color: Color, tone: f64) -> Color {
    color.map(|c| c * tone)
}

pub(crate) fn mixed(a: Color, b: Color, share: f64) -> Color {
    std::array::from_fn(|c| a[c] * (1.0 - share) + b[c] * share)
}

/// How far into a band around 0 a value is, with soft sides: 1 in the middle, 0 outside.
pub(crate) fn within(x: f64, half: f64, soft: f64) -> f64 {
    ((half - x.abs()) / soft + 0.5).clamp(0.0, 1.0)
}
