//! The neighborhood graph as evidence: who lists whom, in both directions.
//!
//! A slot's own list names some of its neighbors; those who name its record are as likely to be
//! neighbors. Whether an edge is named by one end, by the other or by both tells how likely it is true,
//! and so do the scores of a source: edges of one class share an inlier ratio, which recovery learns.

use std::ops::Range;

use rayon::prelude::*;

use super::edges::{EdgeRule, record_of};
use super::merge::Rows;
use super::named_by::{Block, NamedBy};
use crate::neighbors::Neighborhoods;
use crate::{Error, RecordId};

/// Rows of edges in order of their other ends, a class beside each.
#[derive(Debug)]
pub(crate) struct Graph {
    offsets: Vec<u64>,
    /// Slots; the first of a record's where it is not known which.
    ends: Vec<u32>,
    class: Vec<u8>,
    slots_per_record: usize,
}

impl Graph {
    /// The edges of `lists`, in both directions.
    pub(crate) fn new(lists: &Neighborhoods, slots_per_record: usize) -> Self {
        let n_slots = lists.n_slots();
        let rule = EdgeRule::new(lists);
        let score_class = |at| rule.class_at(lists.scores(), at);
        let named_by = NamedBy::new(lists, slots_per_record, &score_class);
        let rooms = rooms(lists, &named_by, slots_per_record);
        let total = rooms.iter().map(|room| room.len).sum();
        let (mut ends, mut class) = (vec![0; total], vec![0; total]);
        let row_ends: Vec<Vec<u32>> = split(&rooms, &mut ends, &mut class)
            .into_par_iter()
            .zip(&rooms)
            .enumerate()
            .map_init(Block::default, |reverse, (block, (mut rows, room))| {
                reverse.fill(&named_by, block);
                let add = |slot: usize| {
                    let all = reverse.of(record_of(slot - room.slots.start, slots_per_record));
                    let first = lists.offsets()[slot] as usize;
                    let class = |at| score_class(first + at);
                    rows.add(lists.of(slot), all, slots_per_record, rule.most, class);
                    rows.n as u32
                };
                room.slots.clone().map(add).collect()
            })
            .collect();
        // Blocks move together.
        let (mut from, mut to) = (0, 0);
        let mut offsets = Vec::with_capacity(n_slots + 1);
        offsets.push(0);
        for (row_ends, room) in row_ends.iter().zip(&rooms) {
            let n = row_ends.last().map_or(0, |&end| end as usize);
            ends.copy_within(from..from + n, to);
            class.copy_within(from..from + n, to);
            offsets.extend(row_ends.iter().map(|&end| (to + end as usize) as u64));
            (from, to) = (from + room.len, to + n);
        }
        ends.truncate(to);
        class.truncate(to);
        ends.shrink_to_fit();
        class.shrink_to_fit();
        Self { offsets, ends, class, slots_per_record }
    }

    /// The other ends of the edges of `slot`, and the class of each.
    #[inline(always)]
    pub(crate) fn of(&self, slot: usize) -> (&[u32], &[u8]) {
        let range = self.offsets[slot] as usize..self.offsets[slot + 1] as usize;
        (&self.ends[range.clone()], &self.class[range])
    }

    /// The other end and the class of the edge at `at` of all edges.
    pub(crate) fn edge(&self, at: u64) -> (u32, u8) {
        (self.ends[at as usize], self.class[at as usize])
    }

    /// Number of slots.
    pub(crate) fn n_slots(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of edges, both directions counted.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// How often each record is at the other end of an edge.
    pub(crate) fn times_listed(&self) -> Vec<u32> {
        let none = vec![0; self.n_slots() / self.slots_per_record];
        // Sums of integers: the same however threads share the work.
        let part = self.ends.len().div_ceil(rayon::current_num_threads()).max(1);
        let counted = self.ends.par_chunks(part).map(|ends| {
            let mut counts = none.clone();
            for &end in ends {
                counts[record_of(end as usize, self.slots_per_record)] += 1;
            }
            counts
        });
        counted.reduce_with(sums).unwrap_or(none)
    }

    /// The edges as neighborhoods (records with one slot each).
    ///
    /// # Errors
    /// None: ends are ascending records.
    pub(crate) fn neighborhoods(&self) -> Result<Neighborhoods, Error> {
        let records = self.ends.iter().map(|&end| RecordId(end)).collect();
        Neighborhoods::try_new(self.offsets.clone(), records, None, self.n_slots(), 1)
    }
}

fn sums(mut a: Vec<u32>, b: Vec<u32>) -> Vec<u32> {
    a.iter_mut().zip(&b).for_each(|(a, b)| *a += b);
    a
}

/// Where the rows of a block of slots go.
struct Room {
    slots: Range<usize>,
    /// Edges that there could be. Memory of those that there are not is hardly touched.
    len: usize,
}

/// A room for each block.
fn rooms(lists: &Neighborhoods, named_by: &NamedBy, slots_per_record: usize) -> Vec<Room> {
    let room = |(block, records): (usize, Range<usize>)| {
        let slots = records.start * slots_per_record..records.end * slots_per_record;
        let n_listed = lists.offsets()[slots.end] - lists.offsets()[slots.start];
        let len = n_listed as usize + slots_per_record * named_by.n_entries(block);
        Room { slots, len }
    };
    named_by.blocks().enumerate().map(room).collect()
}

/// Empty rows in the place of each room.
fn split<'a>(rooms: &[Room], mut ends: &'a mut [u32], mut class: &'a mut [u8]) -> Vec<Rows<'a>> {
    let rows = |room: &Room| {
        let (own, rest) = std::mem::take(&mut ends).split_at_mut(room.len);
        let (own_class, rest_of_class) = std::mem::take(&mut class).split_at_mut(room.len);
        (ends, class) = (rest, rest_of_class);
        Rows { ends: own, class: own_class, n: 0 }
    };
    rooms.iter().map(rows).collect()
}

#[cfg(test)]
mod tests {
    use super::super::edges::{SCORE_CLASSES, Side};
    use super::super::named_by::BLOCK;
    use super::*;
    use crate::seed::{Draws, Stage};

    /// Everyone names record 7, nobody the last one, many each other, and every fifth slot nobody.
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

    /// The edges of each slot, found one by one.
    fn expected(lists: &Neighborhoods, slots_per_record: usize) -> Vec<Vec<(u32, u8)>> {
        let rule = EdgeRule::new(lists);
        let class = |at| rule.class_at(lists.scores(), at);
        let n_slots = lists.n_slots();
        let mut named_by = vec![Vec::new(); n_slots / slots_per_record];
        for slot in 0..n_slots {
            for (at, record) in lists.of(slot).iter().enumerate() {
                let entry = lists.offsets()[slot] as usize + at;
                named_by[record.index()].push((slot, class(entry)));
            }
        }
        let most = 3 * lists.records().len().div_ceil(n_slots);
        let edges = |slot: usize| {
            let all = &named_by[slot / slots_per_record];
            let reverse: Vec<_> = all.iter().step_by(all.len().div_ceil(most).max(1)).collect();
            let list = lists.of(slot);
            let mut edges = Vec::new();
            for (at, record) in list.iter().enumerate() {
                let is_mutual = reverse.iter().any(|by| by.0 / slots_per_record == record.index());
                let side = if is_mutual { Side::Mutual } else { Side::Forward };
                let of_score = class(lists.offsets()[slot] as usize + at);
                edges.push((record.0 * slots_per_record as u32, (side, of_score)));
            }
            for &&(by, of_score) in &reverse {
                if !list.contains(&RecordId::from_index(by / slots_per_record)) {
                    edges.push((by as u32, (Side::Reverse, of_score)));
                }
            }
            edges.sort_unstable_by_key(|edge| edge.0);
            let class = |(side, of_score)| (side as usize * SCORE_CLASSES) as u8 + of_score;
            edges.into_iter().map(|(end, of)| (end, class(of))).collect()
        };
        (0..n_slots).map(edges).collect()
    }

    #[test]
    fn edges_are_those_found_one_by_one() {
        for slots_per_record in [1, 2] {
            let lists = lists(2 * BLOCK + 77, slots_per_record);
            let expected = expected(&lists, slots_per_record);
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let graph = pool.install(|| Graph::new(&lists, slots_per_record));
                assert_eq!(graph.len(), expected.iter().map(Vec::len).sum::<usize>());
                for (slot, expected) in expected.iter().enumerate() {
                    let (ends, class) = graph.of(slot);
                    let found: Vec<_> = ends.iter().copied().zip(class.iter().copied()).collect();
                    assert_eq!(&found, expected, "slot {slot}");
                }
            }
        }
    }

    #[test]
    fn nobody_has_no_edges() {
        for n in [0, 1] {
            let none = Neighborhoods::try_new(vec![0; n + 1], Vec::new(), None, n, 1).unwrap();
            let graph = Graph::new(&none, 1);
            assert_eq!((graph.n_slots(), graph.len()), (n, 0));
        }
    }
}
