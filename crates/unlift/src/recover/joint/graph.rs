//! The neighborhood graph as evidence: who lists whom, in both directions.
//!
//! A slot's own list names some of its neighbors; those who name its record are as likely to be
//! neighbors. Whether an edge is named by one end, by the other or by both tells how likely it is true,
//! and so do the scores of a source: edges of one class share an inlier ratio, which recovery learns.

use rayon::prelude::*;

use crate::neighbors::Neighborhoods;
use crate::{Error, RecordId};

/// Reverse entries of a row at most, as a multiple of the mean list: whoever is named by everyone is
/// named by mistake.
const MOST_REVERSE: usize = 3;

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
const SCORE_CLASSES: usize = 8;
/// Where score classes begin, as shares of all entries: finer at the top, where most neighbors are.
const SCORE_RANKS: [f64; SCORE_CLASSES - 1] = [0.3, 0.55, 0.72, 0.84, 0.91, 0.955, 0.98];
/// Classes of edges at most.
pub(crate) const CLASSES: usize = 3 * SCORE_CLASSES;

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

/// Rows of edges in order of their other ends, a class beside each.
pub(crate) struct Graph {
    offsets: Vec<u64>,
    /// Slots; the first of a record's where it is not known which.
    ends: Vec<u32>,
    class: Vec<u8>,
}

impl Graph {
    /// The edges of `lists`, in both directions.
    pub(crate) fn new(lists: &Neighborhoods, slots_per_record: usize) -> Self {
        let n_slots = lists.n_slots();
        let score_class = score_classes(lists);
        let named_by = NamedBy::new(lists, slots_per_record);
        let most = MOST_REVERSE * lists.records().len().div_ceil(n_slots.max(1)).max(1);
        let parts: Vec<Rows> = (0..n_slots.div_ceil(PART))
            .into_par_iter()
            .map(|part| {
                let slots = part * PART..((part + 1) * PART).min(n_slots);
                let mut rows = Rows::default();
                rows.reserve(lists, &named_by, slots.clone(), slots_per_record);
                for slot in slots {
                    rows.add(lists, &named_by, slot, slots_per_record, most, &score_class);
                }
                rows
            })
            .collect();
        let total: usize = parts.iter().map(|rows| rows.ends.len()).sum();
        let (mut offsets, mut ends, mut class) =
            (Vec::with_capacity(n_slots + 1), Vec::with_capacity(total), Vec::with_capacity(total));
        offsets.push(0);
        for rows in parts {
            let before = ends.len() as u64;
            offsets.extend(rows.row_ends.iter().map(|&end| before + u64::from(end)));
            ends.extend(rows.ends);
            class.extend(rows.class);
        }
        Self { offsets, ends, class }
    }

    /// The other ends of the edges of `slot`, and the class of each.
    #[inline(always)]
    pub(crate) fn of(&self, slot: usize) -> (&[u32], &[u8]) {
        let range = self.offsets[slot] as usize..self.offsets[slot + 1] as usize;
        (&self.ends[range.clone()], &self.class[range])
    }

    /// The other end and the class of the edge at `at` of all edges.
    #[inline(always)]
    pub(crate) fn edge(&self, at: usize) -> (u32, u8) {
        (self.ends[at], self.class[at])
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
    pub(crate) fn times_listed(&self, n_records: usize, slots_per_record: usize) -> Vec<u32> {
        // Sums of integers: the same however threads share the work.
        self.ends
            .par_chunks(self.ends.len().div_ceil(rayon::current_num_threads()).max(1))
            .map(|ends| {
                let mut counts = vec![0; n_records];
                ends.iter().for_each(|&end| counts[end as usize / slots_per_record] += 1);
                counts
            })
            .reduce_with(|mut a, b| {
                a.iter_mut().zip(&b).for_each(|(a, b)| *a += b);
                a
            })
            .unwrap_or_else(|| vec![0; n_records])
    }

    /// The edges as neighborhoods (records with one slot each).
    pub(crate) fn neighborhoods(&self) -> Result<Neighborhoods, Error> {
        let records = self.ends.iter().map(|&end| RecordId(end)).collect();
        Neighborhoods::try_new(self.offsets.clone(), records, None, self.offsets.len() - 1, 1)
    }
}

/// Slots whose rows are put together by one thread at a time.
const PART: usize = 1 << 12;

/// Per record the entries that name it, in order of slot.
struct NamedBy {
    blocks: Vec<Block>,
}

/// The same for [`BLOCK`] records.
struct Block {
    offsets: Vec<u32>,
    /// The slot that names it, and the place of the entry.
    by: Vec<(u32, u32)>,
}

/// Records whose entries are sorted at a time: they stay in the cache.
const BLOCK: usize = 1 << 13;

/// An entry on its way: the record it names, its slot and its place.
type Entry = (u32, u32, u32);

impl NamedBy {
    fn new(lists: &Neighborhoods, slots_per_record: usize) -> Self {
        let (n_slots, n_records) = (lists.n_slots(), lists.n_slots() / slots_per_record);
        let n_blocks = n_records.div_ceil(BLOCK);
        // Entries go to the blocks of the records they name first, part by part.
        let parts: Vec<Vec<Vec<Entry>>> = (0..n_slots.div_ceil(PART))
            .into_par_iter()
            .map(|part| {
                let slots = part * PART..((part + 1) * PART).min(n_slots);
                let mut counts = vec![0; n_blocks];
                for record in slots.clone().flat_map(|slot| lists.of(slot)) {
                    counts[record.index() / BLOCK] += 1;
                }
                let mut to: Vec<_> = counts.into_iter().map(Vec::with_capacity).collect();
                for slot in slots {
                    let first = lists.offsets()[slot];
                    for (at, record) in lists.of(slot).iter().enumerate() {
                        let entry = (record.0, slot as u32, (first + at as u64) as u32);
                        to[record.index() / BLOCK].push(entry);
                    }
                }
                to
            })
            .collect();
        let blocks = (0..n_blocks)
            .into_par_iter()
            .map(|block| {
                let first = block * BLOCK;
                Block::new(first, BLOCK.min(n_records - first), || {
                    parts.iter().flat_map(|to| &to[block])
                })
            })
            .collect();
        Self { blocks }
    }

    fn of(&self, record: usize) -> &[(u32, u32)] {
        let Block { offsets, by } = &self.blocks[record / BLOCK];
        let at = record % BLOCK;
        &by[offsets[at] as usize..offsets[at + 1] as usize]
    }
}

impl Block {
    fn new<'a, I: Iterator<Item = &'a Entry>>(
        first: usize,
        n_records: usize,
        entries: impl Fn() -> I,
    ) -> Self {
        let mut offsets = vec![0u32; n_records + 1];
        for &(record, ..) in entries() {
            offsets[record as usize - first + 1] += 1;
        }
        for r in 0..n_records {
            offsets[r + 1] += offsets[r];
        }
        let mut next = offsets.clone();
        let mut by = vec![(0, 0); offsets[n_records] as usize];
        for &(record, slot, place) in entries() {
            let to = &mut next[record as usize - first];
            by[*to as usize] = (slot, place);
            *to += 1;
        }
        Self { offsets, by }
    }
}

#[derive(Default)]
struct Rows {
    ends: Vec<u32>,
    class: Vec<u8>,
    row_ends: Vec<u32>,
}

impl Rows {
    /// Room for the rows of `slots`.
    fn reserve(
        &mut self,
        lists: &Neighborhoods,
        named_by: &NamedBy,
        slots: std::ops::Range<usize>,
        slots_per_record: usize,
    ) {
        let most = |slot| lists.of(slot).len() + named_by.of(slot / slots_per_record).len();
        let n_edges = slots.map(most).sum();
        self.ends.reserve_exact(n_edges);
        self.class.reserve_exact(n_edges);
    }

    /// Merges the list of `slot` with the entries that name its record; both are in ascending order.
    fn add(
        &mut self,
        lists: &Neighborhoods,
        named_by: &NamedBy,
        slot: usize,
        slots_per_record: usize,
        most: usize,
        score_class: &impl Fn(usize) -> u8,
    ) {
        let first = lists.offsets()[slot] as usize;
        let (list, all) = (lists.of(slot), named_by.of(slot / slots_per_record));
        // Slots are in random order: every so many of them are as good as any.
        let every = all.len().div_ceil(most).max(1);
        let n_reverse = all.len().div_ceil(every);
        let class =
            |side: Side, entry: usize| (side as usize * SCORE_CLASSES) as u8 + score_class(entry);
        let (own, mut to) = (slots_per_record as u32, self.ends.len());
        self.ends.resize(to + list.len() + n_reverse, 0);
        self.class.resize(to + list.len() + n_reverse, 0);
        let mut put = |end: u32, class: u8, stays: bool| {
            (self.ends[to], self.class[to]) = (end, class);
            to += usize::from(stays);
        };
        // Which of two lists goes on is anyone's guess: steps are added, not branched on.
        let (mut at, mut reverse, mut mutual) = (0, 0, u32::MAX);
        while at < list.len() && reverse < n_reverse {
            let (mine, (by, entry)) = (list[at].0, all[reverse * every]);
            // One or two slots make a record.
            let theirs = by >> (own - 1);
            let (is_mine, is_theirs) = (mine <= theirs, theirs <= mine);
            let of_mine = class(if is_theirs { Side::Mutual } else { Side::Forward }, first + at);
            let of_theirs = class(Side::Reverse, entry as usize);
            let end = if is_mine { mine * own } else { by };
            // The other slot of a record that is mutual already says nothing new.
            put(end, if is_mine { of_mine } else { of_theirs }, is_mine | (theirs != mutual));
            mutual = if is_mine & is_theirs { theirs } else { mutual };
            at += usize::from(is_mine);
            reverse += usize::from(is_theirs);
        }
        for (at, record) in list.iter().enumerate().skip(at) {
            put(record.0 * own, class(Side::Forward, first + at), true);
        }
        for &(by, entry) in all.iter().step_by(every).skip(reverse) {
            put(by, class(Side::Reverse, entry as usize), by >> (own - 1) != mutual);
        }
        self.ends.truncate(to);
        self.class.truncate(to);
        self.row_ends.push(self.ends.len() as u32);
    }
}

/// The class of the score of each entry: equal shares of all entries, by rank of score.
fn score_classes(lists: &Neighborhoods) -> impl Fn(usize) -> u8 + Sync + '_ {
    let bounds: Vec<f32> = lists.scores().map_or_else(Vec::new, |scores| {
        let every = scores.len().div_ceil(1 << 16).max(1);
        let mut sample: Vec<f32> = scores.iter().step_by(every).copied().collect();
        sample.sort_unstable_by(f32::total_cmp);
        SCORE_RANKS
            .iter()
            .filter_map(|share| sample.get((share * sample.len() as f64) as usize).copied())
            .collect()
    });
    move |at| match lists.scores() {
        Some(scores) => bounds.partition_point(|&bound| bound <= scores[at]) as u8,
        None => 0,
    }
}
