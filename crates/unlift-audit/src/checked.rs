//! Whether recovered points, a truth and a released map belong together.

use unlift::audit::Threshold;
use unlift::evaluate::{are_strangers, away_from_own, belongs, nearer_to_own, recovered_away};
use unlift::recover::Recovered;
use unlift::released::Released;
use unlift::truth::{Original, Secret};
use unlift::{Error, Unit};

use crate::doubts::{stray_positions, stray_truth};

/// Whether what is compared belongs together, whatever the files say: of strangers next to nothing comes back, and that
/// reads as "safe".
#[derive(Debug, Default)]
pub struct Checked {
    /// Positions nearer to their own than to strangers, and how many there are.
    nearer: (usize, usize),
    /// How far hidden points lie from their own records, where these are at hand.
    truth: Vec<f64>,
    /// How far recovered positions do.
    recovered: Vec<f64>,
}

impl Checked {
    /// Adds a map or an image.
    ///
    /// # Errors
    /// When the truth is not that of `released`.
    pub fn add<const D: usize>(
        &mut self,
        recovered: &Recovered<D>,
        original: &Original<D>,
        secret: &Secret,
        released: Option<&Released<D>>,
    ) -> Result<(), Error> {
        let (nearer, n) = nearer_to_own(recovered, original, secret, released);
        self.nearer = (self.nearer.0 + nearer, self.nearer.1 + n);
        if let Some(released) = released {
            belongs(original, released, secret)?;
            self.truth.extend(away_from_own(released, original, secret));
            self.recovered.extend(recovered_away(released, recovered));
        }
        Ok(())
    }

    /// What speaks against the figures.
    ///
    /// # Errors
    /// When positions by where they lie are not of this truth.
    pub fn notes(&self, thresholds: &[Threshold], unit: Unit) -> Result<Vec<String>, Error> {
        if are_strangers(self.nearer) {
            let expected = "nearer to their own records or points than to those of others";
            let (nearer, n) = self.nearer;
            let found = format!("{nearer} of {n} (of another map, or in another order of rows)");
            return Err(Error::new("positions", expected, found));
        }
        let truth = stray_truth(&self.truth, thresholds, unit);
        let recovered = stray_positions(&self.recovered, thresholds, unit);
        Ok(truth.into_iter().chain(recovered).collect())
    }
}
