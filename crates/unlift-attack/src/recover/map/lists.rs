//! The lists a solver reads: as given, or mixed to see what chance alone yields.

use std::ops::Range;

use rayon::prelude::*;

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::result::{Estimate, Status};
use crate::simd::prefetch;

/// Lists as a solver reads them: as given, or with every entry replaced by one from another slot's list.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Lists<'a> {
    /// As they are.
    Given(&'a Neighborhoods),
    /// Mixed; every record has one slot.
    Mixed(&'a Neighborhoods),
    /// Of a sample of slots.
    Picked(&'a Picked),
}

/// Mixed lists take entries this share of all entries apart (the golden section spreads them
/// evenly), so that no two of them come from one list.
const SPREAD: f64 = 0.618_033_988_749_895;
/// So many entries are looked at for each that a mixed list takes: enough wherever there are others to find.
const TRIES: usize = 8;

impl<'a> Lists<'a> {
    /// Lists as long as these, with the same records listed as often, that tell nothing.
    pub(crate) fn mixed(&self) -> Self {
        match *self {
            Self::Given(lists) => Self::Mixed(lists),
            other => other,
        }
    }

    /// The list of `slot`; `buffer` is where a mixed one is put together.
    #[inline(always)]
    pub(crate) fn of<'b>(&'b self, slot: usize, buffer: &'b mut Vec<RecordId>) -> &'b [RecordId] {
        match self {
            Self::Given(lists) => lists.of(slot),
            Self::Picked(picked) => picked.of(slot),
            Self::Mixed(lists) => mixed(lists, slot, buffer),
        }
    }

    /// Brings the rows near that `slot` lists, if there is such a slot.
    #[inline(always)]
    pub(crate) fn prefetch<T>(&self, slot: usize, rows: &[T]) {
        // The others are of small samples.
        if let Self::Given(lists) = self
            && slot < lists.n_slots()
        {
            for record in lists.of(slot) {
                prefetch(rows, record.index());
            }
        }
    }

    /// Number of slots.
    pub(crate) fn n_slots(&self) -> usize {
        match self {
            Self::Given(lists) | Self::Mixed(lists) => lists.n_slots(),
            Self::Picked(picked) => picked.n_slots,
        }
    }
}

/// The list of `slot`, mixed, put together in `buffer`.
#[inline(never)]
fn mixed<'b>(lists: &Neighborhoods, slot: usize, buffer: &'b mut Vec<RecordId>) -> &'b [RecordId] {
    mix(lists, slot, 1, buffer);
    buffer
}

/// Puts a list in `buffer` that is as long as that of `slot` and made of entries of other lists.
fn mix(lists: &Neighborhoods, slot: usize, slots_per_record: usize, buffer: &mut Vec<RecordId>) {
    let (offsets, records) = (lists.offsets(), lists.records());
    let n_slots = lists.n_slots();
    let n_entries = records.len();
    let len = lists.of(slot).len();
    let step = (n_entries as f64 * SPREAD) as usize;
    let mut at = offsets[slot] as usize;
    buffer.clear();
    let own = (slot / slots_per_record) as u32;
    // Of a handful of records there are no other lists than these.
    let few = 4 * len * slots_per_record > n_slots;
    let mut tries = TRIES * len;
    while buffer.len() < len && tries > 0 {
        at = (at + step) % n_entries;
        tries -= 1;
        let entry = records[at];
        // A record that is listed twice would agree with itself.
        if few || (entry.0 != own && !buffer.contains(&entry)) {
            buffer.push(entry);
        }
    }
}

/// The lists of some chunks of slots.
#[derive(Debug)]
pub(crate) struct Picked {
    chunks: Vec<usize>,
    n_slots: usize,
    offsets: Vec<u32>,
    records: Vec<RecordId>,
}

impl Picked {
    /// The given `lists` of the slots in `chunks` (ascending).
    pub(crate) fn given(lists: &Neighborhoods, chunks: &[usize]) -> Self {
        let mut picked = Self::none(lists, chunks);
        for &chunk in chunks {
            for slot in picked.slots_of(chunk) {
                picked.push(lists.of(slot));
            }
        }
        picked
    }

    /// Lists as long, with the same records listed as often, that tell nothing.
    pub(crate) fn mixed(lists: &Neighborhoods, chunks: &[usize], slots_per_record: usize) -> Self {
        let mut picked = Self::none(lists, chunks);
        let mut buffer = Vec::new();
        for &chunk in chunks {
            for slot in picked.slots_of(chunk) {
                mix(lists, slot, slots_per_record, &mut buffer);
                picked.push(&buffer);
            }
        }
        picked
    }

    fn none(lists: &Neighborhoods, chunks: &[usize]) -> Self {
        let (chunks, n_slots) = (chunks.to_vec(), lists.n_slots());
        Self { chunks, n_slots, offsets: vec![0], records: Vec::new() }
    }

    fn slots_of(&self, chunk: usize) -> Range<usize> {
        chunk * CHUNK..self.n_slots.min((chunk + 1) * CHUNK)
    }

    fn push(&mut self, row: &[RecordId]) {
        self.records.extend_from_slice(row);
        self.offsets.push(self.records.len() as u32);
    }

    /// The list of `slot`; empty where it was not picked. All chunks before the last one are whole.
    // Out of line, as `mixed` is: solvers hardly ever ask for them in their loops.
    #[inline(never)]
    fn of(&self, slot: usize) -> &[RecordId] {
        let Ok(chunk) = self.chunks.binary_search(&(slot / CHUNK)) else { return &[] };
        let at = chunk * CHUNK + slot % CHUNK;
        &self.records[self.offsets[at] as usize..self.offsets[at + 1] as usize]
    }
}

// Work in fixed chunks of slots: any number of threads, the same result.

/// Slots per chunk. Records are released in random order, so the slots of a chunk have nothing to
/// do with each other.
pub(crate) const CHUNK: usize = 64;

/// The slots a run covers.
#[derive(Clone, Debug)]
pub(crate) enum Slots<'a> {
    /// One after the other.
    Range(Range<usize>),
    /// Some chunks of [`CHUNK`] slots, for choosing parameters.
    Chunks(&'a [usize]),
}

/// Calls `solve(scratch, first slot, estimates)` for every chunk; estimates come back in slot order
/// (for [`Slots::Chunks`], the slots of those chunks end to end).
pub(crate) fn solve_chunks<const D: usize, S: Send>(
    n_slots: usize,
    slots: Slots<'_>,
    scratch: impl Fn() -> S + Sync + Send,
    solve: impl Fn(&mut S, usize, &mut [Estimate<D>]) + Sync + Send,
) -> Vec<Estimate<D>> {
    let lost = Estimate::lost(Status::NoSupport);
    match slots {
        Slots::Range(slots) => {
            let mut estimates = vec![lost; slots.len()];
            estimates
                .par_chunks_mut(CHUNK)
                .enumerate()
                .for_each_init(scratch, |scratch, (chunk, out)| {
                    solve(scratch, slots.start + chunk * CHUNK, out)
                });
            estimates
        }
        Slots::Chunks(chosen) => {
            let rows: Vec<Vec<Estimate<D>>> = chosen
                .par_iter()
                .map_init(scratch, |scratch, &chunk| {
                    let first = chunk * CHUNK;
                    let mut out = vec![lost; CHUNK.min(n_slots - first)];
                    solve(scratch, first, &mut out);
                    out
                })
                .collect();
            rows.concat()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    #[test]
    fn mixed_lists_name_others_and_each_once() {
        // So few records that a careless draw repeats itself.
        let (n, k) = (60usize, 15usize);
        let mut records = Vec::new();
        for slot in 0..n {
            let mut others: Vec<u32> = (0..n as u32).filter(|&r| r as usize != slot).collect();
            Draws::new(5, Stage::Synthetic, slot as u64).shuffle(&mut others);
            records.extend(others[..k].iter().map(|&r| RecordId(r)));
        }
        let offsets = (0..=n).map(|slot| (slot * k) as u64).collect();
        let lists = Neighborhoods::try_new(offsets, records, None, n, 1).unwrap();
        let mut buffer = Vec::new();
        let mixed = Lists::Given(&lists).mixed();
        let picked = Picked::mixed(&lists, &[0], 1);
        for slot in 0..n {
            let of_picked = picked.of(slot);
            let mut row: Vec<u32> = mixed.of(slot, &mut buffer).iter().map(|r| r.0).collect();
            assert!(of_picked.iter().map(|r| r.0).eq(row.iter().copied()));
            assert_eq!(row.len(), k);
            assert!(!row.contains(&(slot as u32)), "slot {slot} is listed for itself");
            row.sort_unstable();
            row.dedup();
            assert_eq!(row.len(), k, "slot {slot} lists a record twice");
        }
    }
}
