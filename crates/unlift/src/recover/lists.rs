//! The lists a solver reads: as given, or mixed to see what chance alone yields.

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::simd::prefetch;

/// Neighborhoods as given, or with every entry replaced by one from another slot's list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lists<'a> {
    neighborhoods: &'a Neighborhoods,
    mixed: bool,
}

/// Mixed lists take entries this share of all entries apart (the golden section spreads them
/// evenly), so that no two of them come from one list.
const SPREAD: f64 = 0.618_033_988_749_895;

impl<'a> Lists<'a> {
    /// The lists as they are.
    pub(crate) fn given(neighborhoods: &'a Neighborhoods) -> Self {
        Self { neighborhoods, mixed: false }
    }

    /// Lists as long as the given ones, with the same records listed as often, that tell nothing.
    pub(crate) fn mixed(neighborhoods: &'a Neighborhoods) -> Self {
        Self { neighborhoods, mixed: true }
    }

    /// The same lists, mixed.
    pub(crate) fn turned_to_mixed(&self) -> Self {
        Self::mixed(self.neighborhoods)
    }

    /// The list of `slot`; `buffer` is where a mixed one is put together.
    #[inline(always)]
    pub(crate) fn of<'b>(&'b self, slot: usize, buffer: &'b mut Vec<RecordId>) -> &'b [RecordId] {
        let given = self.neighborhoods.of(slot);
        if !self.mixed {
            return given;
        }
        let entries = self.entries();
        let step = (entries.len() as f64 * SPREAD) as usize;
        let mut at = self.neighborhoods.offsets()[slot] as usize;
        buffer.clear();
        for _ in given {
            at = (at + step) % entries.len();
            buffer.push(entries[at]);
        }
        buffer
    }

    /// Brings the rows near that `slot` lists, if there is such a slot.
    #[inline(always)]
    pub(crate) fn prefetch<T>(&self, slot: usize, rows: &[T]) {
        // Mixed lists are of small samples.
        if slot < self.n_slots() && !self.mixed {
            for record in self.neighborhoods.of(slot) {
                prefetch(rows, record.index());
            }
        }
    }

    /// All entries of all lists.
    pub(crate) fn entries(&self) -> &'a [RecordId] {
        self.neighborhoods.records()
    }

    /// Number of slots.
    pub(crate) fn n_slots(&self) -> usize {
        self.neighborhoods.n_slots()
    }
}
