//! Kinds of edges: who names whom, and how high a source scores it.

use super::named_by::MOST_CLASSES;
use crate::Error;

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

/// Refuses an edge that is none in a map of so many records and slots per record.
pub(crate) fn check_edge((end, class): (u32, u8), map: (usize, usize)) -> Result<(), Error> {
    let n_slots = map.0 * map.1;
    if end as usize >= n_slots {
        return Err(Error::new("edge", format!("a slot below {n_slots}"), end.to_string()));
    }
    if usize::from(class) >= CLASSES {
        return Err(Error::new("edge", format!("a class below {CLASSES}"), class.to_string()));
    }
    // What may be either slot of a record is called by the first.
    if either(class, map.1) && end % 2 == 1 {
        return Err(Error::new("edge", "the first slot of a record", end.to_string()));
    }
    Ok(())
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

/// The least score of each class but the first, by a `sample` of all scores: equal shares of all entries, by rank.
pub(super) fn score_bounds(mut sample: Vec<f32>) -> Vec<f32> {
    sample.sort_unstable_by(f32::total_cmp);
    let at = |share: &f64| sample.get((share * sample.len() as f64) as usize).copied();
    SCORE_RANKS.iter().filter_map(at).collect()
}

/// Every so many of `n` scores are a sample of them.
pub(super) fn score_step(n: usize) -> usize {
    n.div_ceil(1 << 16).max(1)
}

/// The class of a score.
#[inline(always)]
pub(super) fn score_class(bounds: &[f32], score: f32) -> u8 {
    bounds.partition_point(|&bound| bound <= score) as u8
}
