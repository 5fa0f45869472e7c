//! Where the time of an audit went, stage by stage.

use std::time::Instant;

use super::run::Seconds;
use crate::Error;

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
