//! Times of an audit.

use std::time::Instant;

use crate::Error;

/// Seconds per stage. They are not part of the results.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Seconds {
    /// Search of the originals' nearest neighbors.
    pub search: f64,
    /// Obfuscation, over all schemes and repeats.
    pub obfuscate: f64,
    /// Making of neighborhoods.
    pub neighbors: f64,
    /// Recovery.
    pub recover: f64,
    /// Attacks on the records alone, with their evaluation.
    pub records_alone: f64,
    /// Evaluation, including the blind baseline.
    pub evaluate: f64,
    /// Seconds per row, summed over repeats.
    pub rows: Vec<RowSeconds>,
}

/// Seconds of one row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RowSeconds {
    /// Making of its neighborhoods; 0 if another solver's row contains this time.
    pub neighbors: f64,
    /// Recovery.
    pub recover: f64,
}

impl RowSeconds {
    pub(super) fn add(&mut self, more: &Self) {
        self.neighbors += more.neighbors;
        self.recover += more.recover;
    }
}

#[derive(Default)]
pub(super) struct Clock {
    pub(super) seconds: Seconds,
}

impl Clock {
    pub(super) fn time<T>(
        &mut self,
        stage: impl Fn(&mut Seconds) -> &mut f64,
        work: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let started = Instant::now();
        let result = work();
        *stage(&mut self.seconds) += started.elapsed().as_secs_f64();
        result
    }

    /// Adds the stages of another clock, without the seconds per row.
    pub(super) fn merge(&mut self, more: &Self) {
        let (to, more) = (&mut self.seconds, &more.seconds);
        to.search += more.search;
        to.obfuscate += more.obfuscate;
        to.neighbors += more.neighbors;
        to.recover += more.recover;
        to.records_alone += more.records_alone;
        to.evaluate += more.evaluate;
    }
}
