//! How sure the attacker is of one recovered point.

/// How sure the attacker is of one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    /// The probability that the right place was found, up to an error.
    pub found: f32,
    /// The median of that error, in the unit of the map.
    pub scale: f32,
}

impl Confidence {
    /// What is said of a slot without a position.
    pub const LOST: Self = Self { found: 0.0, scale: f32::INFINITY };

    /// The probability that the true place is at most `threshold` away, in the unit of the map:
    /// `found / (1 + (scale / threshold)^2)`.
    pub fn probability_within(&self, threshold: f64) -> f64 {
        let ratio = f64::from(self.scale) / threshold;
        if ratio.is_finite() { f64::from(self.found) / (1.0 + ratio * ratio) } else { 0.0 }
    }
}
