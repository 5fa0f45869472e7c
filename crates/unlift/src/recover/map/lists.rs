//! The lists a solver reads: as given, or mixed to see what chance alone yields.

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::simd::prefetch;

/// Neighborhoods as given, or with every entry replaced by one from another slot's list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lists<'a> {
    neighborhoods: &'a Neighborhoods,
    /// Slots per record of a map whose lists are mixed.
    mixed: Option<usize>,
}

/// Mixed lists take entries this share of all entries apart (the golden section spreads them
/// evenly), so that no two of them come from one list.
const SPREAD: f64 = 0.618_033_988_749_895;
/// So many entries are looked at for each that a mixed list takes: enough wherever there are others to find.
const TRIES: usize = 8;

impl<'a> Lists<'a> {
    /// The lists as they are.
    pub(crate) fn given(neighborhoods: &'a Neighborhoods) -> Self {
        Self { neighborhoods, mixed: None }
    }

    /// Lists as long as the given ones, with the same records listed as often, that tell nothing.
    pub(crate) fn mixed(neighborhoods: &'a Neighborhoods, slots_per_record: usize) -> Self {
        Self { neighborhoods, mixed: Some(slots_per_record) }
    }

    /// The same lists, mixed; of a map with one slot per record.
    pub(crate) fn turned_to_mixed(&self) -> Self {
        Self::mixed(self.neighborhoods, 1)
    }

    /// The list of `slot`; `buffer` is where a mixed one is put together.
    #[inline(always)]
    pub(crate) fn of<'b>(&'b self, slot: usize, buffer: &'b mut Vec<RecordId>) -> &'b [RecordId] {
        let given = self.neighborhoods.of(slot);
        let Some(slots_per_record) = self.mixed else { return given };
        let entries = self.entries();
        let step = (entries.len() as f64 * SPREAD) as usize;
        let mut at = self.neighborhoods.offsets()[slot] as usize;
        buffer.clear();
        let own = (slot / slots_per_record) as u32;
        // Of a handful of records there are no other lists than these.
        let few = 4 * given.len() * slots_per_record > self.n_slots();
        let mut tries = TRIES * given.len();
        while buffer.len() < given.len() && tries > 0 {
            at = (at + step) % entries.len();
            tries -= 1;
            // A record that is listed twice would agree with itself.
            if few || (entries[at].0 != own && !buffer.contains(&entries[at])) {
                buffer.push(entries[at]);
            }
        }
        buffer
    }

    /// Brings the rows near that `slot` lists, if there is such a slot.
    #[inline(always)]
    pub(crate) fn prefetch<T>(&self, slot: usize, rows: &[T]) {
        // Mixed lists are of small samples.
        if slot < self.n_slots() && self.mixed.is_none() {
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
        for slot in 0..n {
            let mixed = Lists::mixed(&lists, 1);
            let mut row: Vec<u32> = mixed.of(slot, &mut buffer).iter().map(|r| r.0).collect();
            assert_eq!(row.len(), k);
            assert!(!row.contains(&(slot as u32)), "slot {slot} is listed for itself");
            row.sort_unstable();
            row.dedup();
            assert_eq!(row.len(), k, "slot {slot} lists a record twice");
        }
    }
}
