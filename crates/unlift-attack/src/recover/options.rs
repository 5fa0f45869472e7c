//! Options of recovery.

use crate::Error;

/// The distance up to which a listed record supports a position, in the unit of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Delta {
    /// Chosen automatically, from the released map and the neighborhoods.
    Auto,
    /// A fixed length.
    Fixed(f64),
}

/// Options of recovery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecoverOptions {
    /// The distance that decides support.
    pub delta: Delta,
    /// The attacker's random seed, for null samples and random trials.
    pub seed: u64,
    /// Whether to compute the probability that each recovered point is right; it takes a few microseconds per point.
    pub confidence: bool,
}

impl Default for RecoverOptions {
    fn default() -> Self {
        Self { delta: Delta::Auto, seed: 0, confidence: true }
    }
}

impl RecoverOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the first field out of range.
    pub fn check(&self) -> Result<(), Error> {
        match self.delta {
            Delta::Fixed(delta) if !(delta.is_finite() && delta > 0.0) => {
                Err(Error::new("delta", "a positive length", delta.to_string()))
            }
            // Solvers compare squared distances in f32.
            Delta::Fixed(delta) if !(delta as f32 * delta as f32).is_normal() => {
                let expected = "a length whose square is in the range of f32";
                Err(Error::new("delta", expected, delta.to_string()))
            }
            Delta::Fixed(_) | Delta::Auto => Ok(()),
        }
    }
}
