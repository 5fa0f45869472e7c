//! Times of an audit.

use std::time::Instant;

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

impl Seconds {
    /// Does `work` and adds its time to that of a stage.
    pub fn time<T>(
        &mut self,
        stage: impl Fn(&mut Self) -> &mut f64,
        work: impl FnOnce() -> T,
    ) -> T {
        let started = Instant::now();
        let result = work();
        *stage(self) += started.elapsed().as_secs_f64();
        result
    }

    /// Adds the stages of another clock, without the seconds per row.
    pub(super) fn merge(&mut self, more: &Self) {
        self.search += more.search;
        self.obfuscate += more.obfuscate;
        self.neighbors += more.neighbors;
        self.recover += more.recover;
        self.records_alone += more.records_alone;
        self.evaluate += more.evaluate;
    }
}
