//! Colors and their mixtures.

use crate::noise::hashed;

/// Reflected shares of red, green and blue light.
pub(crate) type Color = [f64; 3];

pub(crate) fn one_of(colors: &[Color], parts: [u64; 3]) -> Color {
    colors[(hashed(parts) % colors.len() as u64) as usize]
}

pub(crate) fn toned(color: Color, tone: f64) -> Color {
    color.map(|c| c * tone)
}

pub(crate) fn mixed(a: Color, b: Color, share: f64) -> Color {
    std::array::from_fn(|c| a[c] * (1.0 - share) + b[c] * share)
}

/// Returns the weight of a value in a band around 0 with soft edges: 1 in the middle, 0 outside.
pub(crate) fn within(x: f64, half: f64, soft: f64) -> f64 {
    ((half - x.abs()) / soft + 0.5).clamp(0.0, 1.0)
}
