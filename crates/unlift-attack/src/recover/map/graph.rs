//! The neighborhood graph: which slots list which records, in both directions.
//!
//! A slot has edges to the records that it lists, and to the slots that list its record: both are likely neighbors. Edges fall in
//! classes by direction (one end lists the other, or both do) and by the score of the source. Edges of one class share
//! an inlier ratio, which recovery learns.

use rayon::prelude::*;

use crate::RecordId;
use crate::neighbors::Neighborhoods;

/// Which end of an edge lists the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Side {
    Forward,
    /// The neighbor lists the slot's record. Of a paired line, it may mean the other slot.
    Reverse,
    Mutual,
}

const SCORE_CLASSES: usize = 1 << CLASS_BITS;
/// Quantiles of all scores at which classes begin: finer at the top, where most true neighbors are.
const SCORE_RANKS: [f64; SCORE_CLASSES - 1] = [0.3, 0.55, 0.72, 0.84, 0.91, 0.955, 0.98];
/// Number of scores from which these quantiles are computed.
const SCORES: usize = 1 << 16;
pub(crate) const CLASSES: usize = 3 * SCORE_CLASSES;
/// Largest number of reverse edges of a slot, as a multiple of the mean list length: a record in very many lists is in most of
/// them by mistake.
const MOST_REVERSE: usize = 3;

/// Returns the record of a slot. Records have one or two slots, so a shift replaces a division.
#[inline(always)]
pub(crate) fn record_of(slot: usize, slots_per_record: usize) -> usize {
    slot >> (slots_per_record - 1)
}

/// Whether an edge of this class leads to a record without saying which of its two slots: lists have records as entries, while
/// the slot that owns a list is known.
#[inline(always)]
pub(crate) fn either(class: u8, slots_per_record: usize) -> bool {
    slots_per_record == 2 && side(class) != Side::Reverse
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
    let step = lists.records().len().div_ceil(SCORES).max(1);
    let mut sample: Vec<f32> =
        lists.scores().unwrap_or(&[]).iter().step_by(step).copied().collect();
    sample.sort_unstable_by(f32::total_cmp);
    let at = |share: &f64| sample.get((share * sample.len() as f64) as usize).copied();
    SCORE_RANKS.iter().filter_map(at).collect()
}

/// Returns the score class of the entry with index `at` among all entries.
#[inline(always)]
fn score_class(lists: &Neighborhoods, bounds: &[f32], at: usize) -> u8 {
    let class = |score: f32| bounds.partition_point(|&bound| bound <= score) as u8;
    lists.scores().map_or(0, |scores| class(scores[at]))
}

/// Edges per slot, in order of their ends, with the class of each.
#[derive(Debug)]
pub(crate) struct Graph {
    offsets: Vec<u64>,
    /// Slots; the first slot of a record if the edge does not specify which.
    ends: Vec<u32>,
    class: Vec<u8>,
    slots_per_record: usize,
}

impl Graph {
    /// Creates the edges of `lists` in both directions.
    pub(crate) fn new(lists: &Neighborhoods, slots_per_record: usize) -> Self {
        let n_slots = lists.n_slots();
        let n_records = n_slots / slots_per_record;
        let bounds = &score_bounds(lists);
        let most = MOST_REVERSE * lists.records().len().div_ceil(n_slots.max(1)).max(1);
        let n_blocks = n_records.div_ceil(BLOCK);
        let transposed: Vec<Transposed> = (0..n_slots.div_ceil(BLOCK))
            .into_par_iter()
            .map(|part| Transposed::new(lists, part, n_blocks, bounds))
            .collect();
        // Each block gets space for the largest possible size of its rows. Unused memory is hardly touched.
        let slots_of = |block: usize| {
            let records = block * BLOCK..((block + 1) * BLOCK).min(n_records);
            records.start * slots_per_record..records.end * slots_per_record
        };
        let room = |block: usize| {
            let slots = slots_of(block);
            let n_listed = lists.offsets()[slots.end] - lists.offsets()[slots.start];
            let n_reverse: usize = transposed.iter().map(|part| part.of_block(block).len()).sum();
            n_listed as usize + slots_per_record * n_reverse
        };
        let rooms: Vec<usize> = (0..n_blocks).map(room).collect();
        let total = rooms.iter().sum();
        let (mut ends, mut class) = (vec![0; total], vec![0; total]);
        let (mut free, mut free_class) = (&mut ends[..], &mut class[..]);
        let mut rows = Vec::with_capacity(n_blocks);
        for &len in &rooms {
            let (Some(ends), Some(class)) =
                (free.split_off_mut(..len), free_class.split_off_mut(..len))
            else {
                unreachable!("rooms are as long as the columns");
            };
            rows.push(Rows { ends, class, n: 0 });
        }
        let merged = |reverse: &mut Block, (block, mut rows): (usize, Rows<'_>)| {
            reverse.fill(&transposed, block);
            let slots = slots_of(block);
            let first = slots.start;
            let add = |slot: usize| {
                let all = reverse.of(record_of(slot - first, slots_per_record));
                let entry = lists.offsets()[slot] as usize;
                let class = |at| score_class(lists, bounds, entry + at);
                rows.add(lists.of(slot), all, slots_per_record, most, class);
                rows.n
            };
            slots.map(add).collect::<Vec<usize>>()
        };
        let row_ends: Vec<Vec<usize>> =
            rows.into_par_iter().enumerate().map_init(Block::default, merged).collect();
        // Close the gaps between blocks.
        let (mut from, mut to) = (0, 0);
        let mut offsets = Vec::with_capacity(n_slots + 1);
        offsets.push(0);
        for (row_ends, room) in row_ends.iter().zip(rooms) {
            let n = row_ends.last().copied().unwrap_or(0);
            ends.copy_within(from..from + n, to);
            class.copy_within(from..from + n, to);
            offsets.extend(row_ends.iter().map(|end| (to + end) as u64));
            (from, to) = (from + room, to + n);
        }
        ends.truncate(to);
        class.truncate(to);
        ends.shrink_to_fit();
        class.shrink_to_fit();
        Self { offsets, ends, class, slots_per_record }
    }

    /// Returns the ends of the edges of `slot`, and the class of each.
    #[inline(always)]
    pub(crate) fn of(&self, slot: usize) -> (&[u32], &[u8]) {
        let range = self.offsets[slot] as usize..self.offsets[slot + 1] as usize;
        (&self.ends[range.clone()], &self.class[range])
    }

    /// Returns the end and the class of the edge with index `at` among all edges.
    pub(crate) fn edge(&self, at: u64) -> (u32, u8) {
        (self.ends[at as usize], self.class[at as usize])
    }

    pub(crate) fn n_slots(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Number of edges, with both directions counted.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns how many edges lead to each record.
    pub(crate) fn times_listed(&self) -> Vec<u32> {
        let none = vec![0; self.n_slots() / self.slots_per_record];
        // Sums of integers do not depend on how threads split the work.
        let part = self.ends.len().div_ceil(rayon::current_num_threads()).max(1);
        let counted = self.ends.par_chunks(part).map(|ends| {
            let mut counts = none.clone();
            for &end in ends {
                counts[record_of(end as usize, self.slots_per_record)] += 1;
            }
            counts
        });
        let sums = |mut a: Vec<u32>, b: Vec<u32>| {
            a.iter_mut().zip(&b).for_each(|(a, b)| *a += b);
            a
        };
        counted.reduce_with(sums).unwrap_or(none)
    }

    /// Returns the edges as neighborhoods, for records with one slot.
    pub(crate) fn neighborhoods(&self) -> Neighborhoods {
        let records = self.ends.iter().map(|&end| RecordId(end)).collect();
        Neighborhoods::unchecked(self.offsets.clone(), records)
    }
}

// Transposed lists: which slots list a record, one block of records at a time.
//
// Entries are first distributed over the blocks of their records, in four bytes each. A block is sorted only when its rows
// are made, while it is in the cache: a plain counting sort takes twice the time (docs/decisions/joint.md).

/// Number of records in a block, and of slots whose lists one task transposes.
const BLOCK: usize = 1 << BITS;
/// Bits of a slot or a record within its block.
const BITS: u32 = 12;
const CLASS_BITS: u32 = 3;
// A slot, a record and a class fit into one entry.
const _: () = assert!(2 * BITS + CLASS_BITS <= u32::BITS);

/// The entries of the lists of [`BLOCK`] slots, by block of their record and then in order of slot.
struct Transposed {
    first_slot: u32,
    /// Offset of each block.
    offsets: Vec<u32>,
    /// From the highest bit: slot (within this part), record (within its block), class.
    entries: Vec<u32>,
}

impl Transposed {
    fn new(lists: &Neighborhoods, part: usize, n_blocks: usize, bounds: &[f32]) -> Self {
        let slots = part * BLOCK..((part + 1) * BLOCK).min(lists.n_slots());
        let mut offsets = vec![0u32; n_blocks + 1];
        for record in slots.clone().flat_map(|slot| lists.of(slot)) {
            offsets[record.index() / BLOCK + 1] += 1;
        }
        for block in 0..n_blocks {
            offsets[block + 1] += offsets[block];
        }
        let mut next = offsets.clone();
        let mut entries = vec![0; offsets[n_blocks] as usize];
        for (in_part, slot) in slots.enumerate() {
            let first = lists.offsets()[slot] as usize;
            for (at, record) in lists.of(slot).iter().enumerate() {
                let to = &mut next[record.index() / BLOCK];
                let in_block = record.index() % BLOCK;
                let packed = (in_part << BITS | in_block) << CLASS_BITS;
                let class = score_class(lists, bounds, first + at);
                entries[*to as usize] = packed as u32 | u32::from(class);
                *to += 1;
            }
        }
        Self { first_slot: (part * BLOCK) as u32, offsets, entries }
    }

    fn of_block(&self, block: usize) -> &[u32] {
        &self.entries[self.offsets[block] as usize..self.offsets[block + 1] as usize]
    }
}

/// The entries whose records are in one block, sorted by record and slot.
#[derive(Default)]
struct Block {
    offsets: Vec<u32>,
    /// The slot that owns the entry, and the class of its score.
    by: Vec<(u32, u8)>,
}

impl Block {
    fn fill(&mut self, transposed: &[Transposed], block: usize) {
        let record = |entry: u32| (entry >> CLASS_BITS) as usize % BLOCK;
        let Self { offsets, by } = self;
        // Offsets are shifted by two places; filling the rows moves them to their ends.
        offsets.clear();
        offsets.resize(BLOCK + 2, 0);
        for part in transposed {
            part.of_block(block).iter().for_each(|&entry| offsets[record(entry) + 2] += 1);
        }
        for r in 0..BLOCK {
            offsets[r + 2] += offsets[r + 1];
        }
        by.resize(offsets[BLOCK + 1] as usize, (0, 0));
        for part in transposed {
            for &entry in part.of_block(block) {
                let slot = part.first_slot + (entry >> (BITS + CLASS_BITS));
                let to = &mut offsets[record(entry) + 1];
                by[*to as usize] = (slot, (entry % SCORE_CLASSES as u32) as u8);
                *to += 1;
            }
        }
    }

    /// Returns the slots that list a record of the block, and the score class of each.
    #[inline(always)]
    fn of(&self, record: usize) -> &[(u32, u8)] {
        &self.by[self.offsets[record] as usize..self.offsets[record + 1] as usize]
    }
}

/// The rows of one block, in a buffer with space for all of them; `n` is the number of edges so far.
struct Rows<'a> {
    ends: &'a mut [u32],
    class: &'a mut [u8],
    n: usize,
}

impl Rows<'_> {
    /// Merges the `list` of a slot with `all` slots that list its record; both are ascending. About `most` of `all` are used.
    /// `score_class` returns the class of an entry of the list.
    fn add(
        &mut self,
        list: &[RecordId],
        all: &[(u32, u8)],
        slots_per_record: usize,
        most: usize,
        score_class: impl Fn(usize) -> u8,
    ) {
        // Slots are in random order, so evenly spaced ones are a fair sample.
        let every = all.len().div_ceil(most).max(1);
        let n_reverse = all.len().div_ceil(every);
        let class = |side: Side, of_score: u8| (side as usize * SCORE_CLASSES) as u8 + of_score;
        let own = slots_per_record as u32;
        let room = self.n..self.n + list.len() + n_reverse;
        let (ends, classes) = (&mut self.ends[room.clone()], &mut self.class[room]);
        let mut to = 0;
        let mut put = |end: u32, class: u8, stays: bool| {
            (ends[to], classes[to]) = (end, class);
            to += usize::from(stays);
        };
        // Branches would be unpredictable, so steps are added instead.
        let (mut at, mut reverse, mut mutual) = (0, 0, u32::MAX);
        while at < list.len() && reverse < n_reverse {
            let (mine, (by, of_score)) = (list[at].0, all[reverse * every]);
            // Records have one or two slots.
            let theirs = by >> (own - 1);
            let (is_mine, is_theirs) = (mine <= theirs, theirs <= mine);
            let side = if is_theirs { Side::Mutual } else { Side::Forward };
            let of_mine = class(side, score_class(at));
            let of_theirs = class(Side::Reverse, of_score);
            let end = if is_mine { mine * own } else { by };
            // If a record is mutual already, its other slot adds nothing.
            put(end, if is_mine { of_mine } else { of_theirs }, is_mine | (theirs != mutual));
            mutual = if is_mine & is_theirs { theirs } else { mutual };
            at += usize::from(is_mine);
            reverse += usize::from(is_theirs);
        }
        for (at, record) in list.iter().enumerate().skip(at) {
            put(record.0 * own, class(Side::Forward, score_class(at)), true);
        }
        for &(by, of_score) in all.iter().step_by(every).skip(reverse) {
            put(by, class(Side::Reverse, of_score), by >> (own - 1) != mutual);
        }
        self.n += to;
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
        slot: usize,
        of_score: &dyn Fn(usize) -> u8,
    ) -> Vec<(u32, u8)> {
        let class =
            |side: Side, entry: usize| (side as usize * SCORE_CLASSES) as u8 + of_score(entry);
        let entry = |slot: usize, at: usize| lists.offsets()[slot] as usize + at;
        let own = RecordId::from_index(slot / per);
        let place = |by: usize| Some((by, lists.of(by).iter().position(|&record| record == own)?));
        let named_by: Vec<(usize, usize)> = (0..lists.n_slots()).filter_map(place).collect();
        let most = 3 * lists.records().len().div_ceil(lists.n_slots());
        let reverse = named_by.iter().step_by(named_by.len().div_ceil(most).max(1));
        let list = lists.of(slot);
        let mut edges = Vec::new();
        for (at, record) in list.iter().enumerate() {
            let is_mutual = reverse.clone().any(|by| by.0 / per == record.index());
            let side = if is_mutual { Side::Mutual } else { Side::Forward };
            edges.push((record.0 * per as u32, class(side, entry(slot, at))));
        }
        for &(by, at) in reverse {
            if !list.contains(&RecordId::from_index(by / per)) {
                edges.push((by as u32, class(Side::Reverse, entry(by, at))));
            }
        }
        edges.sort_unstable_by_key(|edge| edge.0);
        edges
    }

    #[test]
    fn edges_are_those_found_one_by_one() {
        for per in [1, 2] {
            let lists = lists(2 * BLOCK + 77, per);
            let on = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| Graph::new(&lists, per))
            };
            let (one, three) = (on(1), on(3));
            let bounds = score_bounds(&lists);
            let of_score = |entry| score_class(&lists, &bounds, entry);
            let mut n_edges = 0;
            for slot in 0..lists.n_slots() {
                let expected = expected(&lists, per, slot, &of_score);
                n_edges += expected.len();
                for (ends, class) in [one.of(slot), three.of(slot)] {
                    let found: Vec<_> = ends.iter().copied().zip(class.iter().copied()).collect();
                    assert_eq!(found, expected, "slot {slot}");
                }
            }
            assert_eq!([one.len(), three.len()], [n_edges; 2]);
        }
    }
}
