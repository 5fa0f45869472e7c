//! How many trials the sampling loop took.

use std::sync::atomic::{AtomicU64, Ordering};

/// Trials at most, as in the paper's timings.
pub(crate) const MAX_TRIALS: u32 = 10_000;

/// How many slots took how many trials.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrialHistogram {
    counts: [u64; TrialHistogram::UP_TO.len()],
}

impl TrialHistogram {
    /// Upper ends (inclusive) of the bins.
    pub const UP_TO: [u32; 9] = [1, 3, 10, 30, 100, 300, 1_000, 3_000, MAX_TRIALS];

    /// (upper end, slots) per bin.
    pub fn bins(&self) -> impl Iterator<Item = (u32, u64)> {
        Self::UP_TO.into_iter().zip(self.counts)
    }
}

/// A histogram that threads add to. Sums of integers: the order in which they add does not matter.
#[derive(Debug, Default)]
pub(crate) struct TrialCounts {
    bins: [AtomicU64; TrialHistogram::UP_TO.len()],
}

impl TrialCounts {
    /// One more slot took so many trials.
    pub(crate) fn note(&self, trials: u32) {
        let bin = TrialHistogram::UP_TO.partition_point(|&up_to| up_to < trials);
        self.bins[bin.min(self.bins.len() - 1)].fetch_add(1, Ordering::Relaxed);
    }

    /// What was noted so far.
    pub(crate) fn histogram(&self) -> TrialHistogram {
        TrialHistogram { counts: self.bins.each_ref().map(|bin| bin.load(Ordering::Relaxed)) }
    }
}
