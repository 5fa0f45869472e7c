//! The neighborhood graph: which slots list which targets, in both directions. A target is a slot where lists have slots, else a record.
//!
//! A slot has edges to the targets that it lists, and to the slots that list it, or its record. Edges fall in classes by direction (one end lists
//! the other, or both do) and by score. Edges of one class share an inlier ratio, which recovery learns.

use std::ops::Range;

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::parallel;
use crate::recover::map::places::{evenly, sorted};

/// Which end of an edge lists the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Side {
    Forward,
    /// The neighbor lists the slot, or its record: of a paired line, that may mean the other slot.
    Reverse,
    Mutual,
}

const SCORE_CLASSES: usize = 8;
/// Quantiles of all scores at which classes begin: finer at the top, where most true neighbors are.
const SCORE_RANKS: [f64; SCORE_CLASSES - 1] = [0.3, 0.55, 0.72, 0.84, 0.91, 0.955, 0.98];
const SCORES: usize = 1 << 16;
pub(crate) const CLASSES: usize = 3 * SCORE_CLASSES;
/// Largest number of reverse edges of a slot, in mean list lengths: a record in very many lists is in most of them by mistake.
const MOST_REVERSE: usize = 3;

/// Returns the record of a slot. Records have one or two slots, so a shift replaces a division.
#[inline(always)]
pub(crate) fn record_of(slot: usize, slots_per_record: usize) -> usize {
    slot >> (slots_per_record - 1)
}

#[inline(always)]
pub(crate) fn side(class: u8) -> Side {
    match usize::from(class) / SCORE_CLASSES {
        0 => Side::Forward,
        1 => Side::Reverse,
        _ => Side::Mutual,
    }
}

/// Returns the least score of each class but the first; empty without scores.
fn score_bounds(lists: &Neighborhoods) -> Vec<f32> {
    let scores = lists.scores().unwrap_or(&[]);
    let sample = sorted(evenly(scores.len(), SCORES).map(|at| scores[at]));
    let at = |share: &f64| sample.get((share * sample.len() as f64) as usize).copied();
    SCORE_RANKS.iter().filter_map(at).collect()
}

/// Returns the class of the entry `at()` of the list of `slot`. The entry is looked for only if there are scores.
fn class_of(
    lists: &Neighborhoods,
    bounds: &[f32],
    side: Side,
    slot: usize,
    at: impl FnOnce() -> usize,
) -> u8 {
    let class = |scores: &[f32]| {
        let score = scores[lists.offsets()[slot] as usize + at()];
        bounds.partition_point(|&bound| bound <= score)
    };
    (side as usize * SCORE_CLASSES + lists.scores().map_or(0, class)) as u8
}

/// The slots that list each target.
pub(crate) struct Listers {
    offsets: Vec<usize>,
    slots: Vec<u32>,
}

impl Listers {
    fn new(lists: &Neighborhoods, n_targets: usize) -> Self {
        let mut offsets = vec![0; n_targets + 1];
        for target in (0..lists.n_slots()).flat_map(|slot| lists.targets(slot)) {
            offsets[target + 1] += 1;
        }
        for target in 0..n_targets {
            offsets[target + 1] += offsets[target];
        }
        let (mut next, mut slots) = (offsets.clone(), vec![0; lists.records().len()]);
        for slot in 0..lists.n_slots() {
            for target in lists.targets(slot) {
                slots[next[target]] = slot as u32;
                next[target] += 1;
            }
        }
        Self { offsets, slots }
    }

    pub(crate) fn of(&self, target: usize) -> &[u32] {
        &self.slots[self.offsets[target]..self.offsets[target + 1]]
    }
}

/// Edges per slot, in order of their ends, with the class of each.
pub(crate) struct Graph {
    offsets: Vec<u64>,
    /// Slots; the first slot of a record if the edge does not specify which.
    ends: Vec<u32>,
    class: Vec<u8>,
    pub(crate) slots_per_record: usize,
    /// 1 where lists have slots, else as many as a record has.
    pub(crate) slots_per_target: usize,
    pub(crate) listers: Listers,
}

impl Graph {
    pub(crate) fn new(lists: &Neighborhoods, slots_per_record: usize) -> Self {
        let n_slots = lists.n_slots();
        let slots_per_target = lists.slots_per_target(slots_per_record);
        let listers = Listers::new(lists, n_slots / slots_per_target);
        let bounds = &score_bounds(lists);
        let most = MOST_REVERSE * lists.mean_length().ceil() as usize;
        let edges = |slot: usize| {
            let mut edges: Vec<(u32, u8)> = Vec::new();
            let target = |at: usize| lists.target(slot, at);
            let n_listed = lists.of(slot).len();
            let own = |side: Side, at: usize| {
                let end = (target(at) * slots_per_target) as u32;
                (end, class_of(lists, bounds, side, slot, || at))
            };
            let record = record_of(slot, slots_per_record);
            let as_target = record_of(slot, slots_per_target);
            let all = listers.of(as_target);
            let (mut at, mut mutual) = (0, usize::MAX);
            // Slots are usually in random order, so evenly spaced ones are a fair sample.
            for &by in all.iter().step_by(all.len().div_ceil(most).max(1)) {
                let theirs = record_of(by as usize, slots_per_target);
                while at < n_listed && target(at) < theirs {
                    edges.push(own(Side::Forward, at));
                    at += 1;
                }
                if at < n_listed && target(at) == theirs {
                    edges.push(own(Side::Mutual, at));
                    at += 1;
                    mutual = theirs;
                } else if mutual != theirs {
                    // If a target is mutual already, its other slot adds nothing.
                    let by = by as usize;
                    let entry = || lists.of(by).partition_point(|r| r.index() < record);
                    edges.push((by as u32, class_of(lists, bounds, Side::Reverse, by, entry)));
                }
            }
            edges.extend((at..n_listed).map(|at| own(Side::Forward, at)));
            edges
        };
        let rows = parallel::map(n_slots, edges);
        let mut offsets = vec![0];
        offsets.extend(rows.iter().scan(0, |end, row| {
            *end += row.len() as u64;
            Some(*end)
        }));
        let (ends, class) = rows.into_iter().flatten().unzip();
        Self { offsets, ends, class, slots_per_record, slots_per_target, listers }
    }

    /// Returns the end and the class of each edge of `slot`.
    #[inline(always)]
    pub(crate) fn of(&self, slot: usize) -> impl ExactSizeIterator<Item = (usize, u8)> {
        let range = self.offsets[slot] as usize..self.offsets[slot + 1] as usize;
        let edges = self.ends[range.clone()].iter().zip(&self.class[range]);
        edges.map(|(&end, &class)| (end as usize, class))
    }

    /// Whether an edge of this class leads to a record without saying which of its two slots.
    #[inline(always)]
    pub(crate) fn is_either(&self, class: u8) -> bool {
        self.slots_per_target == 2 && side(class) != Side::Reverse
    }

    /// Returns the slot at the end of an edge, or both slots of the record where the edge does not specify one.
    #[inline(always)]
    pub(crate) fn slots_at(&self, (end, class): (usize, u8)) -> Range<usize> {
        end..end + 1 + usize::from(self.is_either(class))
    }

    pub(crate) fn slots_of(&self, target: usize) -> Range<usize> {
        target * self.slots_per_target..(target + 1) * self.slots_per_target
    }

    /// Returns the end and the class of the edge with index `at` among all edges.
    pub(crate) fn edge(&self, at: u64) -> (usize, u8) {
        (self.ends[at as usize] as usize, self.class[at as usize])
    }

    pub(crate) fn n_slots(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of edges, with both directions counted.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    pub(crate) fn times_listed(&self) -> Vec<u32> {
        let mut counts = vec![0; self.n_slots() / self.slots_per_target];
        for &end in &self.ends {
            counts[record_of(end as usize, self.slots_per_target)] += 1;
        }
        counts
    }

    /// Returns the edges as lists of records; `None` if an edge may mean either slot of a record.
    pub(crate) fn neighborhoods(&self) -> Option<Neighborhoods> {
        if self.slots_per_target > 1 {
            return None;
        }
        let (mut offsets, mut records) = (vec![0], Vec::with_capacity(self.len()));
        for slot in 0..self.n_slots() {
            let record = |(end, _)| RecordId::from_index(record_of(end, self.slots_per_record));
            let start = records.len();
            for record in self.of(slot).map(record) {
                // Two slots of a record follow each other.
                if records[start..].last() != Some(&record) {
                    records.push(record);
                }
            }
            offsets.push(records.len() as u64);
        }
        Some(Neighborhoods::unchecked(offsets, records))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    /// Random lists: all slots list record 7, none lists the last record, many list each other, and every fifth list is empty.
    fn lists(n_records: usize, slots_per_record: usize) -> Neighborhoods {
        let mut draws = Draws::new(5, Stage::NullSample, 0);
        let (mut offsets, mut records, mut scores) = (vec![0], Vec::new(), Vec::new());
        for slot in 0..n_records * slots_per_record {
            let own = slot / slots_per_record;
            let mut row = vec![7, own ^ 1, draws.below(n_records as u64) as usize];
            row.retain(|&record| record != own && record < n_records - 1 && slot % 5 > 0);
            row.sort_unstable();
            row.dedup();
            scores.extend(row.iter().map(|_| draws.below(100) as f32));
            records.extend(row.into_iter().map(RecordId::from_index));
            offsets.push(records.len() as u64);
        }
        Neighborhoods::try_new(offsets, records, Some(scores), n_records, slots_per_record).unwrap()
    }

    /// Returns the edges of a slot, computed one by one.
    fn expected(
        lists: &Neighborhoods,
        per: usize,
        bounds: &[f32],
        slot: usize,
    ) -> Vec<(usize, u8)> {
        let class = |side: Side, slot: usize, at: usize| {
            let score = lists.scores_of(slot).unwrap()[at];
            let of_score = bounds.partition_point(|&bound| bound <= score);
            (side as usize * SCORE_CLASSES + of_score) as u8
        };
        let own = RecordId::from_index(slot / per);
        let place = |by: usize| Some((by, lists.of(by).iter().position(|&record| record == own)?));
        let named_by: Vec<(usize, usize)> = (0..lists.n_slots()).filter_map(place).collect();
        let most = 3 * lists.mean_length().ceil() as usize;
        let reverse = named_by.iter().step_by(named_by.len().div_ceil(most).max(1));
        let list = lists.of(slot);
        let mut edges = Vec::new();
        for (at, record) in list.iter().enumerate() {
            let is_mutual = reverse.clone().any(|by| by.0 / per == record.index());
            let side = if is_mutual { Side::Mutual } else { Side::Forward };
            edges.push((record.index() * per, class(side, slot, at)));
        }
        let only = reverse.filter(|by| !list.contains(&RecordId::from_index(by.0 / per)));
        edges.extend(only.map(|&(by, at)| (by, class(Side::Reverse, by, at))));
        edges.sort_unstable_by_key(|edge| edge.0);
        edges
    }

    /// Lists that name slots have the edges of lists of as many records with one slot each.
    #[test]
    fn edges_lead_to_the_slots_that_lists_name() {
        let lists = lists(2_000, 2);
        let mut draws = Draws::new(6, Stage::NullSample, 0);
        let slots = lists.records().iter().map(|record| 2 * record.0 + draws.below(2) as u32);
        let slots: Vec<u32> = slots.collect();
        let records = slots.iter().map(|&slot| RecordId(slot)).collect();
        let (offsets, scores) = (lists.offsets().to_vec(), lists.scores().map(<[f32]>::to_vec));
        let apart = Neighborhoods::try_new(offsets, records, scores, 4_000, 1).unwrap();
        let error = lists.clone().with_slots(vec![0; slots.len()]).unwrap_err().to_string();
        assert!(error.contains("expected a slot of record"), "{error}");
        let [named, apart] =
            [Graph::new(&lists.with_slots(slots).unwrap(), 2), Graph::new(&apart, 1)];
        for slot in 0..4_000 {
            assert_eq!(named.of(slot).collect::<Vec<_>>(), apart.of(slot).collect::<Vec<_>>());
        }
        assert!(named.neighborhoods().unwrap().records().iter().all(|record| record.0 < 2_000));
    }

    #[test]
    fn edges_are_those_computed_one_by_one() {
        for per in [1, 2] {
            let lists = lists(2_000, per);
            let (graph, bounds) = (Graph::new(&lists, per), score_bounds(&lists));
            for slot in 0..lists.n_slots() {
                let expected = expected(&lists, per, &bounds, slot);
                assert_eq!(graph.of(slot).collect::<Vec<_>>(), expected, "slot {slot}");
            }
        }
    }
}
