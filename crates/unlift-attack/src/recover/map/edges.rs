//! Kinds of edges: who names whom, and how high a source scores it.

use super::named_by::MOST_CLASSES;
use crate::neighbors::Neighborhoods;

/// Which end of an edge names the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Side {
    /// The slot names the neighbor.
    Forward,
    /// The neighbor names the slot. On a paired line it may mean the other slot, nobody knows.
    Reverse,
    /// Each names the other.
    Mutual,
}

/// Classes of scores per direction.
pub(super) const SCORE_CLASSES: usize = MOST_CLASSES;
/// Where score classes begin, as shares of all entries: finer at the top, where most neighbors are.
const SCORE_RANKS: [f64; SCORE_CLASSES - 1] = [0.3, 0.55, 0.72, 0.84, 0.91, 0.955, 0.98];
/// Classes of edges at most.
pub(crate) const CLASSES: usize = 3 * SCORE_CLASSES;

/// The record of a slot: one or two make a record, so a shift does for a division.
#[inline(always)]
pub(crate) fn record_of(slot: usize, slots_per_record: usize) -> usize {
    slot >> (slots_per_record - 1)
}

/// Whether an edge of this class says which record it leads to, but not which of its two slots: a list
/// names records, while the slot that a list belongs to is known.
#[inline(always)]
pub(crate) fn either(class: u8, slots_per_record: usize) -> bool {
    slots_per_record == 2 && side(class) != Side::Reverse
}

/// Who names whom in an edge of this class.
#[inline(always)]
pub(crate) fn side(class: u8) -> Side {
    match usize::from(class) / SCORE_CLASSES {
        0 => Side::Forward,
        1 => Side::Reverse,
        _ => Side::Mutual,
    }
}

/// Reverse entries of a row at most, as a multiple of the mean list: whoever is named by everyone is
/// named by mistake.
const MOST_REVERSE: usize = 3;
/// Scores are ranked by a sample of this many.
const SCORES: usize = 1 << 16;

/// The rule by which edges are made of lists.
pub(super) struct EdgeRule {
    /// Reverse entries of a row at most.
    pub(super) most: usize,
    /// The least score of each class but the first: equal shares of all entries, by rank. Empty without scores.
    bounds: Vec<f32>,
}

impl EdgeRule {
    /// The rule for `lists`.
    pub(super) fn new(lists: &Neighborhoods) -> Self {
        let n = lists.records().len();
        let most = MOST_REVERSE * n.div_ceil(lists.n_slots().max(1)).max(1);
        let step = n.div_ceil(SCORES).max(1);
        let mut sample: Vec<f32> =
            lists.scores().map_or_else(Vec::new, |all| all.iter().step_by(step).copied().collect());
        sample.sort_unstable_by(f32::total_cmp);
        let at = |share: &f64| sample.get((share * sample.len() as f64) as usize).copied();
        Self { most, bounds: SCORE_RANKS.iter().filter_map(at).collect() }
    }

    /// The class of the entry at `at` of `scores`.
    #[inline(always)]
    pub(super) fn class_at(&self, scores: Option<&[f32]>, at: usize) -> u8 {
        let class = |score: f32| self.bounds.partition_point(|&bound| bound <= score) as u8;
        scores.map_or(0, |scores| class(scores[at]))
    }
}
