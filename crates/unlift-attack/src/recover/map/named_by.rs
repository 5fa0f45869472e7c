//! Who names a record: lists turned around, a block of records at a time.
//!
//! Entries first go to the blocks of the records they name, in four bytes each; a block is then put in order only where its
//! rows are made.

use std::ops::Range;

use rayon::prelude::*;

use crate::neighbors::Neighborhoods;

/// Records in a block, and slots whose entries are turned around by one thread at a time: what belongs to them stays in the
/// cache.
pub(super) const BLOCK: usize = 1 << BITS;
/// Bits of a slot or a record within its block: 4,096.
const BITS: u32 = 12;
/// Classes of scores are less than this.
pub(super) const MOST_CLASSES: usize = 1 << CLASS_BITS;
/// Bits of a class of scores: what two times twelve leave of an entry, and no more than serves.
const CLASS_BITS: u32 = 3;
/// A slot, a record and a class side by side.
const _: () = assert!(2 * BITS + CLASS_BITS <= u32::BITS);

/// All entries by the block of the record that they name.
pub(super) struct NamedBy {
    parts: Vec<Part>,
    n_records: usize,
}

/// The entries of the lists of [`BLOCK`] slots, in order of slot within each block.
struct Part {
    /// Where blocks begin.
    offsets: Vec<u32>,
    /// From the highest bit: slot (of this part), record (of its block), class.
    entries: Vec<u32>,
}

impl NamedBy {
    /// Turns `lists` around, with the class of each entry's score.
    pub(super) fn new(
        lists: &Neighborhoods,
        slots_per_record: usize,
        score_class: &(impl Fn(usize) -> u8 + Sync),
    ) -> Self {
        let n_records = lists.n_slots() / slots_per_record;
        let n_blocks = n_records.div_ceil(BLOCK);
        let parts = (0..lists.n_slots().div_ceil(BLOCK))
            .into_par_iter()
            .map(|part| Part::new(lists, part, n_blocks, score_class))
            .collect();
        Self { parts, n_records }
    }

    /// Records of each block in turn.
    pub(super) fn blocks(&self) -> impl Iterator<Item = Range<usize>> {
        let n = self.n_records;
        (0..n.div_ceil(BLOCK)).map(move |block| block * BLOCK..((block + 1) * BLOCK).min(n))
    }

    /// Number of entries that name a record of `block`.
    pub(super) fn n_entries(&self, block: usize) -> usize {
        self.of_block(block).map(|(_, entries)| entries.len()).sum()
    }

    /// The parts' entries that name records of `block`, each with the first slot of its part.
    fn of_block(&self, block: usize) -> impl Iterator<Item = (u32, &[u32])> {
        self.parts.iter().enumerate().map(move |(part, Part { offsets, entries })| {
            let range = offsets[block] as usize..offsets[block + 1] as usize;
            ((part * BLOCK) as u32, &entries[range])
        })
    }
}

impl Part {
    fn new(
        lists: &Neighborhoods,
        part: usize,
        n_blocks: usize,
        score_class: &impl Fn(usize) -> u8,
    ) -> Self {
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
                entries[*to as usize] = packed as u32 | u32::from(score_class(first + at));
                *to += 1;
            }
        }
        Self { offsets, entries }
    }
}

/// The entries that name the records of one block, in order of slot.
#[derive(Default)]
pub(super) struct Block {
    offsets: Vec<u32>,
    /// The slot that names it, and the class of its score.
    by: Vec<(u32, u8)>,
}

impl Block {
    /// Puts the entries of `block` in order.
    pub(super) fn fill(&mut self, named_by: &NamedBy, block: usize) {
        let record = |entry: u32| (entry >> CLASS_BITS) as usize % BLOCK;
        let Self { offsets, by } = self;
        // Starts are two places ahead and become ends of the rows before as rows fill.
        offsets.clear();
        offsets.resize(BLOCK + 2, 0);
        for (_, entries) in named_by.of_block(block) {
            entries.iter().for_each(|&entry| offsets[record(entry) + 2] += 1);
        }
        for r in 0..BLOCK {
            offsets[r + 2] += offsets[r + 1];
        }
        by.resize(offsets[BLOCK + 1] as usize, (0, 0));
        for (first, entries) in named_by.of_block(block) {
            for &entry in entries {
                let slot = first + (entry >> (BITS + CLASS_BITS));
                let to = &mut offsets[record(entry) + 1];
                by[*to as usize] = (slot, (entry % MOST_CLASSES as u32) as u8);
                *to += 1;
            }
        }
    }

    /// The slots that name the record at a place of the block, and the class of each score.
    #[inline(always)]
    pub(super) fn of(&self, record: usize) -> &[(u32, u8)] {
        &self.by[self.offsets[record] as usize..self.offsets[record + 1] as usize]
    }
}
