use unlift::audit::Threshold;
use unlift::evaluate::{are_strangers, away_from_own, belongs, nearer_to_own, recovered_away};
use unlift::recover::Recovered;
use unlift::released::Released;
use unlift::truth::{Original, Secret};
use unlift::{Error, Unit};

use crate::doubts::{stray_positions, stray_truth};

/// Checks by geometry that compared data belongs together, whatever the files state. Of data of
/// another map hardly anything is recovered, which would look like protection.
#[derive(Debug, Default)]
pub struct Checked {
    /// The number of positions nearer to their own point than to another one, and the number
    /// compared.
    nearer: (usize, usize),
    /// Distances of hidden points from their own records, if the records are given.
    truth: Vec<f64>,
    /// Distances of recovered positions from their own records, if the records are given.
    recovered: Vec<f64>,
}

impl Checked {
    /// Adds a map or an image.
    ///
    /// # Errors
    /// If the ground truth is not that of `released`.
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

    /// Returns the doubts about the figures.
    ///
    /// # Errors
    /// If the positions are not of this ground truth.
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
