//! The same graph where lists do not fit into memory: turned around in files.

use std::ops::Range;

use super::edge_rule::EdgeRule;
use super::edges::score_step;
use super::graph::Graph;
use super::merge::Rows;
use crate::Error;
use crate::neighbors::ShelvedLists;
use crate::shelf::{Column, Number, Shelf, Stored, windows};

/// Entries for one block that are written together.
const TOGETHER: usize = 1 << 14;
/// Bytes of an edge: an end and a class.
const EDGE: usize = 5;
/// Bits for a class of scores, and for a record within its block.
const CLASS_BITS: u32 = 8;
const RECORD_BITS: u32 = 24;

impl Graph {
    /// The edges of `lists`, in both directions, on `shelf`: those that [`new`](Self::new) finds in memory.
    ///
    /// Entries go to the part of a file that is for the block of records that they name; blocks are read one after the other
    /// and merged with their own lists. Twelve bytes of each entry of a window are in memory.
    ///
    /// # Errors
    /// When files cannot be read or written.
    pub(crate) fn away(
        lists: &ShelvedLists,
        slots_per_record: usize,
        shelf: &dyn Shelf,
    ) -> Result<Self, Error> {
        let rule = rule_of(lists)?;
        let named_by = NamedBy::new(lists, slots_per_record, &rule, shelf)?;
        let (mut ends, mut class) = (Column::new(shelf)?, Column::new(shelf)?);
        let mut offsets = Vec::with_capacity(lists.n_slots() + 1);
        offsets.push(0);
        for block in 0..named_by.blocks.len() {
            let by = named_by.block(block)?;
            let slots = by.records.start * slots_per_record..by.records.end * slots_per_record;
            // Blocks are made for who names them, and may name more themselves.
            let inside = windows(&lists.offsets()[slots.start..=slots.end], named_by.most, 1);
            for part in inside {
                let part = slots.start + part.start..slots.start + part.end;
                let (listed, scores) = (lists.records(&part)?, scores_of(lists, &part)?);
                let reverse: usize = part.clone().map(|s| by.of(s / slots_per_record).len()).sum();
                let room = listed.len() + reverse;
                let (mut part_ends, mut part_class) = (vec![0; room], vec![0; room]);
                let mut rows = Rows { ends: &mut part_ends, class: &mut part_class, n: 0 };
                let first = lists.offsets()[part.start];
                let from = *offsets.last().unwrap_or(&0);
                for slot in part {
                    let at = (lists.offsets()[slot] - first) as usize;
                    let list = &listed[at..(lists.offsets()[slot + 1] - first) as usize];
                    let class = |i: usize| rule.class_at(scores.as_deref(), at + i);
                    let by = by.of(slot / slots_per_record);
                    rows.add(list, by, slots_per_record, rule.most, class);
                    offsets.push(from + rows.n as u64);
                }
                let n = rows.n;
                ends.push_all(&part_ends[..n])?;
                class.push_all(&part_class[..n])?;
            }
        }
        let (ends, class) = (Stored::Away(ends), Stored::Away(class));
        let window = (shelf.window() / EDGE) as u64;
        Ok(Self { offsets, ends, class, window, slots_per_record, rule })
    }
}

/// How edges are made of `lists`.
fn rule_of(lists: &ShelvedLists) -> Result<EdgeRule, Error> {
    let n = lists.offsets()[lists.n_slots()];
    let mut sample = Vec::new();
    if lists.has_scores() {
        for at in (0..n).step_by(score_step(n as usize)) {
            sample.extend(lists.scores(at..at + 1)?.into_iter().flatten());
        }
    }
    Ok(EdgeRule::new(n as usize, lists.n_slots(), sample))
}

fn scores_of(lists: &ShelvedLists, slots: &Range<usize>) -> Result<Option<Vec<f32>>, Error> {
    lists.scores(lists.offsets()[slots.start]..lists.offsets()[slots.end])
}

/// All entries by the block of the record that they name.
struct NamedBy {
    /// Records of each block.
    blocks: Vec<Range<usize>>,
    /// Where the entries that name each record start.
    starts: Vec<u64>,
    /// From the highest bit: slot, record within its block, class.
    entries: Column<u64>,
    /// Entries in memory at a time.
    most: u64,
}

impl NamedBy {
    fn new(
        lists: &ShelvedLists,
        slots_per_record: usize,
        rule: &EdgeRule,
        shelf: &dyn Shelf,
    ) -> Result<Self, Error> {
        let mut starts = vec![0; lists.n_slots() / slots_per_record + 1];
        for window in lists.windows() {
            lists.records(&window)?.iter().for_each(|record| starts[record.index() + 1] += 1);
        }
        for record in 1..starts.len() {
            starts[record] += starts[record - 1];
        }
        let most = (shelf.window() / u64::BYTES) as u64;
        let of_records = 1 << RECORD_BITS;
        let blocks: Vec<Range<usize>> = windows(&starts, most, 1)
            .into_iter()
            .flat_map(|block| {
                let parts = (block.end - block.start).div_ceil(of_records);
                (0..parts).map(move |part| {
                    let start = block.start + part * of_records;
                    start..block.end.min(start + of_records)
                })
            })
            .collect();
        let mut entries = Column::new(shelf)?;
        let mut next: Vec<u64> = blocks.iter().map(|block| starts[block.start]).collect();
        let mut waiting: Vec<Vec<u64>> = vec![Vec::new(); blocks.len()];
        for window in lists.windows() {
            let (records, scores) = (lists.records(&window)?, scores_of(lists, &window)?);
            let first = lists.offsets()[window.start];
            for slot in window {
                for at in lists.offsets()[slot] - first..lists.offsets()[slot + 1] - first {
                    let record = records[at as usize].index();
                    let block = blocks.partition_point(|block| block.end <= record);
                    let in_block = (record - blocks[block].start) as u64;
                    let class = rule.class_at(scores.as_deref(), at as usize);
                    let packed = (slot as u64) << RECORD_BITS | in_block;
                    waiting[block].push(packed << CLASS_BITS | u64::from(class));
                    if waiting[block].len() == TOGETHER {
                        entries.put_at(next[block], &waiting[block])?;
                        next[block] += TOGETHER as u64;
                        waiting[block].clear();
                    }
                }
            }
        }
        for (next, waiting) in next.iter().zip(&waiting) {
            entries.put_at(*next, waiting)?;
        }
        Ok(Self { blocks, starts, entries, most })
    }

    /// The entries that name the records of one block, in order of slot.
    fn block(&self, block: usize) -> Result<Block<'_>, Error> {
        let records = self.blocks[block].clone();
        let starts = &self.starts[records.start..=records.end];
        let entries = self.entries.read(starts[0]..starts[records.len()])?;
        let mut next: Vec<u32> = starts.iter().map(|start| (start - starts[0]) as u32).collect();
        let mut by = vec![(0, 0); entries.len()];
        for entry in entries {
            let in_block = (entry >> CLASS_BITS) as usize % (1 << RECORD_BITS);
            let slot = (entry >> (CLASS_BITS + RECORD_BITS)) as u32;
            by[next[in_block] as usize] = (slot, entry as u8);
            next[in_block] += 1;
        }
        Ok(Block { records, starts, by })
    }
}

/// Who names each of some records.
struct Block<'a> {
    records: Range<usize>,
    starts: &'a [u64],
    /// The slot that names it, and the class of its score.
    by: Vec<(u32, u8)>,
}

impl Block<'_> {
    /// Who names `record`, which is among them.
    fn of(&self, record: usize) -> &[(u32, u8)] {
        let (at, from) = (record - self.records.start, self.starts[0]);
        &self.by[(self.starts[at] - from) as usize..(self.starts[at + 1] - from) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RecordId;
    use crate::neighbors::Neighborhoods;
    use crate::seed::{Draws, Stage};
    use crate::shelf::tests::Temporary;

    #[test]
    fn edges_are_those_found_in_memory() {
        for (slots_per_record, has_scores, window) in
            [(1, false, 1 << 12), (1, true, 1 << 20), (2, true, 1 << 11), (2, false, 100)]
        {
            let n_records = 700;
            let mut draws = Draws::new(5, Stage::NullSample, 0);
            let (mut offsets, mut records, mut scores) = (vec![0], Vec::new(), Vec::new());
            for slot in 0..n_records * slots_per_record {
                let own = slot / slots_per_record;
                let mut row = vec![7, own ^ 1];
                row.extend((0..9).map(|_| draws.below(n_records as u64) as usize));
                row.sort_unstable();
                row.dedup();
                row.retain(|&record| record != own && record < n_records - 1 && slot % 5 > 0);
                scores.extend(row.iter().map(|_| draws.below(100) as f32));
                records.extend(row.into_iter().map(RecordId::from_index));
                offsets.push(records.len() as u64);
            }
            let map = (n_records, slots_per_record);
            let scores = has_scores.then_some(scores);
            let mut away = ShelvedLists::new(map, has_scores, &Temporary(window)).unwrap();
            let lengths = offsets.windows(2).map(|w| (w[1] - w[0]) as usize);
            away.push(lengths, records.clone(), scores.clone()).unwrap();
            let away = away.finish(crate::About::default()).unwrap();
            let lists =
                Neighborhoods::try_new(offsets, records, scores, n_records, slots_per_record)
                    .unwrap();
            let here = Graph::new(&lists, slots_per_record);
            let away = Graph::away(&away, slots_per_record, &Temporary(window)).unwrap();
            assert!(window > 1 << 19 || away.windows().len() > 1, "all in one window");
            assert_eq!(here.len(), away.len());
            assert_eq!(here.times_listed().unwrap(), away.times_listed().unwrap());
            let all = here.rows(&(0..here.n_slots())).unwrap();
            for window in away.windows() {
                let rows = away.rows(&window).unwrap();
                for slot in window {
                    assert_eq!(rows.of(slot), all.of(slot), "slot {slot}");
                }
            }
            for at in (0..here.len() as u64).step_by(97) {
                assert_eq!(here.edge(at).unwrap(), away.edge(at).unwrap());
            }
        }
    }
}
