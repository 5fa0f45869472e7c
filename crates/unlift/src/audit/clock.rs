//! Where the time of an audit went, stage by stage.

use std::time::Instant;

use crate::Error;

/// Where the time went. Never part of results.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Seconds {
    /// Searching nearest neighbors of the originals.
    pub search: f64,
    /// Obfuscating, over all schemes and repeats.
    pub obfuscate: f64,
    /// Making neighborhoods.
    pub neighbors: f64,
    /// Recovering.
    pub recover: f64,
    /// Attacking the records alone, evaluated.
    pub records_alone: f64,
    /// Evaluating, the blind attacker included.
    pub evaluate: f64,
    /// Per row, summed over repeats.
    pub rows: Vec<RowSeconds>,
}

/// Where the time of one row went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RowSeconds {
    /// Making its neighborhoods; 0 where another solver's row already has the time.
    pub neighbors: f64,
    /// Recovering; 0 for what joint recovery started from, as the row of `joint` has the time.
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
    /// Does `work` on the time of a stage.
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

    /// Adds the time of another clock, but not that of its rows.
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
