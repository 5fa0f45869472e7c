//! The lists a solver reads: as given, or mixed to see what chance alone yields.

use std::borrow::Cow;
use std::ops::Range;

use super::chunks::CHUNK;
use super::graph::Graph;
use crate::neighbors::{Neighborhoods, ShelvedLists};
use crate::simd::prefetch;
use crate::{About, Error, RecordId};

/// The lists of all slots, wherever they are.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Listed<'a> {
    /// In memory.
    Here(&'a Neighborhoods),
    /// On a shelf.
    Away(&'a ShelvedLists),
    /// Who lists whom in both directions, on a shelf; where records have one slot.
    Edges(&'a Graph, About),
}

impl<'a> Listed<'a> {
    /// Where each list starts; one more entry than there are slots.
    pub(crate) fn offsets(&self) -> &'a [u64] {
        match self {
            Self::Here(lists) => lists.offsets(),
            Self::Away(lists) => lists.offsets(),
            Self::Edges(graph, _) => graph.offsets(),
        }
    }

    /// Number of slots.
    pub(crate) fn n_slots(&self) -> usize {
        self.offsets().len() - 1
    }

    /// Number of entries of all lists.
    pub(crate) fn n_entries(&self) -> u64 {
        self.offsets().last().copied().unwrap_or(0)
    }

    /// Whether entries have scores.
    pub(crate) fn has_scores(&self) -> bool {
        match self {
            Self::Here(lists) => lists.scores().is_some(),
            Self::Away(lists) => lists.has_scores(),
            Self::Edges(..) => false,
        }
    }

    /// Which released map the lists are of, and what their rows are counted by.
    pub(crate) fn about(&self) -> About {
        match self {
            Self::Here(lists) => lists.about(),
            Self::Away(lists) => lists.about(),
            Self::Edges(_, about) => *about,
        }
    }

    /// Slots whose lists are read at a time; all, where they are in memory.
    pub(crate) fn windows(&self) -> Vec<Range<usize>> {
        match self {
            Self::Here(lists) => std::iter::once(0..lists.n_slots()).collect(),
            Self::Away(lists) => lists.windows(),
            Self::Edges(graph, _) => graph.windows(),
        }
    }

    /// The lists of `slots`.
    ///
    /// # Errors
    /// When they cannot be read.
    pub(crate) fn rows(&self, slots: &Range<usize>) -> Result<Rows<'a>, Error> {
        let offsets = &self.offsets()[slots.start..=slots.end];
        let records = match self {
            Self::Here(lists) => {
                Cow::Borrowed(&lists.records()[offsets[0] as usize..offsets[slots.len()] as usize])
            }
            Self::Away(lists) => Cow::Owned(lists.records(slots)?),
            Self::Edges(graph, _) => {
                Cow::Owned(graph.rows(slots)?.ends().iter().map(|&end| RecordId(end)).collect())
            }
        };
        Ok(Rows { first: slots.start, offsets, records })
    }

    /// The record of the entry `at` of all.
    fn record(&self, at: u64) -> Result<RecordId, Error> {
        match self {
            Self::Here(lists) => Ok(lists.records()[at as usize]),
            Self::Away(lists) => lists.record(at),
            Self::Edges(graph, _) => graph.edge(at).map(|(end, _)| RecordId(end)),
        }
    }
}

/// Lists of consecutive slots.
#[derive(Debug)]
pub(crate) struct Rows<'a> {
    first: usize,
    offsets: &'a [u64],
    records: Cow<'a, [RecordId]>,
}

impl Rows<'_> {
    /// The list of `slot`, which is among them.
    #[inline(always)]
    pub(crate) fn of(&self, slot: usize) -> &[RecordId] {
        row(self.first, self.offsets, &self.records, slot)
    }

    /// All lists end to end.
    pub(crate) fn records(&self) -> &[RecordId] {
        &self.records
    }
}

#[inline(always)]
fn row<'a>(first: usize, offsets: &[u64], records: &'a [RecordId], slot: usize) -> &'a [RecordId] {
    let (from, at) = (offsets[0], slot - first);
    &records[(offsets[at] - from) as usize..(offsets[at + 1] - from) as usize]
}

/// Lists as a solver reads them: as given, or with every entry replaced by one from another slot's list.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Lists<'a> {
    /// Of consecutive slots, as they are.
    Given {
        /// The first of them.
        first: usize,
        /// Where each of their lists starts.
        offsets: &'a [u64],
        /// All of these end to end.
        records: &'a [RecordId],
    },
    /// Of all slots, which have a record each, mixed.
    Mixed {
        /// Where each list starts.
        offsets: &'a [u64],
        /// All of them end to end.
        records: &'a [RecordId],
    },
    /// Of a sample of slots.
    Picked(&'a Picked),
}

/// Mixed lists take entries this share of all entries apart (the golden section spreads them
/// evenly), so that no two of them come from one list.
const SPREAD: f64 = 0.618_033_988_749_895;
/// So many entries are looked at for each that a mixed list takes: enough wherever there are others to find.
const TRIES: usize = 8;

impl<'a> Lists<'a> {
    /// The lists as they are.
    pub(crate) fn given(rows: &'a Rows<'_>) -> Self {
        Self::Given { first: rows.first, offsets: rows.offsets, records: &rows.records }
    }

    /// Lists as long as the given ones, which are those of all slots of a map with a slot per record, with the same records
    /// listed as often, that tell nothing.
    pub(crate) fn turned_to_mixed(&self) -> Self {
        match *self {
            Self::Given { offsets, records, .. } => Self::Mixed { offsets, records },
            other => other,
        }
    }

    /// The list of `slot`; `buffer` is where a mixed one is put together.
    #[inline(always)]
    pub(crate) fn of<'b>(&'b self, slot: usize, buffer: &'b mut Vec<RecordId>) -> &'b [RecordId] {
        match self {
            Self::Given { first, offsets, records } => row(*first, offsets, records, slot),
            Self::Picked(picked) => picked.of(slot),
            Self::Mixed { offsets, records } => mixed(offsets, records, slot, buffer),
        }
    }

    /// Brings the rows near that `slot` lists, if there is such a slot.
    #[inline(always)]
    pub(crate) fn prefetch<T>(&self, slot: usize, rows: &[T]) {
        // The others are of small samples.
        if let Self::Given { first, offsets, records } = self
            && slot < self.n_slots()
        {
            for record in row(*first, offsets, records, slot) {
                prefetch(rows, record.index());
            }
        }
    }

    /// Number of slots, those before the given ones with them.
    pub(crate) fn n_slots(&self) -> usize {
        match self {
            Self::Given { first, offsets, .. } => first + offsets.len() - 1,
            Self::Mixed { offsets, .. } => offsets.len() - 1,
            Self::Picked(picked) => picked.n_slots,
        }
    }
}

/// The list of `slot`, mixed, put together in `buffer`.
#[inline(never)]
fn mixed<'b>(
    offsets: &[u64],
    records: &[RecordId],
    slot: usize,
    buffer: &'b mut Vec<RecordId>,
) -> &'b [RecordId] {
    // What is in memory can be read.
    let _ = mix(offsets, (slot, 1), buffer, |at| Ok(records[at as usize]));
    buffer
}

/// Puts a list in `buffer` that is as long as that of `slot` and made of entries of others, where a record has so many slots and
/// the entry at a place of all is a `record`.
fn mix(
    offsets: &[u64],
    (slot, slots_per_record): (usize, usize),
    buffer: &mut Vec<RecordId>,
    record: impl Fn(u64) -> Result<RecordId, Error>,
) -> Result<(), Error> {
    let n_slots = offsets.len() - 1;
    let n_entries = offsets[n_slots];
    let len = (offsets[slot + 1] - offsets[slot]) as usize;
    let step = (n_entries as f64 * SPREAD) as u64;
    let mut at = offsets[slot];
    buffer.clear();
    let own = (slot / slots_per_record) as u32;
    // Of a handful of records there are no other lists than these.
    let few = 4 * len * slots_per_record > n_slots;
    let mut tries = TRIES * len;
    while buffer.len() < len && tries > 0 {
        at = (at + step) % n_entries;
        tries -= 1;
        let entry = record(at)?;
        // A record that is listed twice would agree with itself.
        if few || (entry.0 != own && !buffer.contains(&entry)) {
            buffer.push(entry);
        }
    }
    Ok(())
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
    /// Those of the `chunks` (ascending) of `listed`, as they are.
    ///
    /// # Errors
    /// When they cannot be read.
    pub(crate) fn given(listed: Listed<'_>, chunks: &[usize]) -> Result<Self, Error> {
        let mut picked = Self::none(listed, chunks);
        for &chunk in chunks {
            let rows = listed.rows(&picked.slots_of(chunk))?;
            for slot in picked.slots_of(chunk) {
                picked.push(rows.of(slot));
            }
        }
        Ok(picked)
    }

    /// Lists as long, with the same records listed as often, that tell nothing.
    ///
    /// # Errors
    /// When they cannot be read.
    pub(crate) fn mixed(
        listed: Listed<'_>,
        chunks: &[usize],
        slots_per_record: usize,
    ) -> Result<Self, Error> {
        let mut picked = Self::none(listed, chunks);
        let mut buffer = Vec::new();
        for &chunk in chunks {
            for slot in picked.slots_of(chunk) {
                let of = (slot, slots_per_record);
                mix(listed.offsets(), of, &mut buffer, |at| listed.record(at))?;
                picked.push(&buffer);
            }
        }
        Ok(picked)
    }

    fn none(listed: Listed<'_>, chunks: &[usize]) -> Self {
        let (chunks, n_slots) = (chunks.to_vec(), listed.n_slots());
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
        let rows = Listed::Here(&lists).rows(&(0..n)).unwrap();
        let mixed = Lists::given(&rows).turned_to_mixed();
        let chunks = [0];
        let picked = Picked::mixed(Listed::Here(&lists), &chunks, 1).unwrap();
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
