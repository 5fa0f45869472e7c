//! Lists of records per slot, in compressed rows.

use std::ops::Range;

use crate::released::Released;
use crate::{About, Error, RecordId, RowOrder};

/// Per slot, the records that are said to hide its neighbors, by record id, because an order by distance would reveal more than a set. The
/// released map and the order of rows are stored, because positions made from lists are meaningless without them.
#[derive(Clone, Debug, PartialEq)]
pub struct Neighborhoods {
    offsets: Vec<u64>,
    records: Vec<RecordId>,
    scores: Option<Vec<f32>>,
    /// Per entry, the slot that it means: one of the two of its record.
    slots: Option<Vec<u32>>,
    about: About,
}

impl Neighborhoods {
    /// Creates lists for all slots of a map with `n_records` records. Slot `s` has `records[offsets[s]..offsets[s + 1]]`, in any order.
    ///
    /// # Errors
    /// When the offsets do not partition `records`, a record is out of range, twice in a list or the slot's own, a score is
    /// not finite, or columns differ in length.
    pub fn try_new(
        offsets: Vec<u64>,
        mut records: Vec<RecordId>,
        mut scores: Option<Vec<f32>>,
        n_records: usize,
        slots_per_record: usize,
    ) -> Result<Self, Error> {
        let n_slots = n_records * slots_per_record;
        if offsets.len() != n_slots + 1 {
            let expected = format!("{n_slots} slots, as the released map has");
            return Err(Error::new("neighborhoods", expected, offsets.len().saturating_sub(1)));
        }
        let ends = (offsets[0], offsets[n_slots]);
        if ends != (0, records.len() as u64) || !offsets.is_sorted() {
            let expected = format!("ascending from 0 to {}", records.len());
            return Err(Error::new("neighborhood offsets", expected, "another sequence"));
        }
        if let Some(scores) = &scores {
            Error::check_len("neighborhood scores", scores.len(), records.len(), " rows")?;
            if let Some(at) = scores.iter().position(|x| !x.is_finite()) {
                let what = format!("neighborhood score {at}");
                return Err(Error::new(what, "a finite number", scores[at]));
            }
        }
        for slot in 0..n_slots {
            let range = offsets[slot] as usize..offsets[slot + 1] as usize;
            let row = &mut records[range.clone()];
            sort_row(row, scores.as_mut().map(|scores| &mut scores[range]));
            let wrong = |expected: String, found: String| {
                Err(Error::new(format!("neighborhood of slot {slot}"), expected, found))
            };
            if let Some(pair) = row.windows(2).find(|w| w[0] == w[1]) {
                return wrong("each record once".into(), format!("record {} twice", pair[0].0));
            }
            if let Some(last) = row.last().filter(|last| last.index() >= n_records) {
                return wrong(format!("records below {n_records}"), last.0.to_string());
            }
            let own = RecordId::from_index(slot / slots_per_record);
            if row.binary_search(&own).is_ok() {
                return wrong("other records".into(), format!("its own record {}", own.0));
            }
        }
        Ok(Self { offsets, records, scores, slots: None, about: About::default() })
    }

    /// Creates lists of a released map from the (score, record) of each slot, in any order.
    ///
    /// # Errors
    /// When a record is out of range, twice in a list or the slot's own, or a score is not finite.
    pub(super) fn scored<const D: usize>(
        rows: impl IntoIterator<Item = Vec<(f32, RecordId)>>,
        released: &Released<D>,
        order: RowOrder,
    ) -> Result<Self, Error> {
        let (mut offsets, mut records, mut scores) = (vec![0u64], Vec::new(), Vec::new());
        for row in rows {
            scores.extend(row.iter().map(|&(score, _)| score));
            records.extend(row.iter().map(|&(_, record)| record));
            offsets.push(records.len() as u64);
        }
        let (n_records, slots) = (released.n_records(), released.slots_per_record());
        let lists = Self::try_new(offsets, records, Some(scores), n_records, slots)?;
        Ok(lists.with_about(About { map: Some(released.fingerprint()), order, ..About::default() }))
    }

    /// Sets which of the two slots of its record each entry means. Without them, an entry means either.
    ///
    /// `slots` has one list after the other, each in any order. Slots are numbered as the lists are.
    ///
    /// # Errors
    /// When the slots of a list are not one of each of its records.
    pub fn with_slots(mut self, mut slots: Vec<u32>) -> Result<Self, Error> {
        Error::check_len("slots of neighborhoods", slots.len(), self.records.len(), " entries")?;
        for slot in 0..self.n_slots() {
            let named = &mut slots[self.range(slot)];
            named.sort_unstable();
            let is_other = |(named, record): &(&u32, &RecordId)| *named / 2 != record.0;
            if let Some((named, record)) = named.iter().zip(self.of(slot)).find(is_other) {
                let what = format!("neighborhood of slot {slot}");
                return Err(Error::new(what, format!("a slot of record {}", record.0), named));
            }
        }
        self.slots = Some(slots);
        Ok(self)
    }

    /// Creates empty lists for `n_slots` slots.
    pub fn empty(n_slots: usize) -> Self {
        Self::unchecked(vec![0; n_slots + 1], Vec::new())
    }

    /// Creates lists from rows of checked lists, without checks.
    pub(crate) fn unchecked(offsets: Vec<u64>, records: Vec<RecordId>) -> Self {
        Self { offsets, records, scores: None, slots: None, about: About::default() }
    }

    /// Sets the released map and the row order of the lists.
    #[must_use]
    pub fn with_about(self, about: About) -> Self {
        Self { about, ..self }
    }

    /// The released map and the row order of the lists.
    pub fn about(&self) -> About {
        self.about
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The range of the list of `slot` in the columns of entries.
    #[inline(always)]
    pub(crate) fn range(&self, slot: usize) -> Range<usize> {
        self.offsets[slot] as usize..self.offsets[slot + 1] as usize
    }

    /// The records listed for `slot`, ascending.
    #[inline(always)]
    pub fn of(&self, slot: usize) -> &[RecordId] {
        &self.records[self.range(slot)]
    }

    /// The scores of [`of`](Self::of), if the source gave any.
    pub fn scores_of(&self, slot: usize) -> Option<&[f32]> {
        self.scores.as_ref().map(|scores| &scores[self.range(slot)])
    }

    /// Returns what an entry means: a slot where lists have slots, else a record.
    #[inline(always)]
    pub(crate) fn target(&self, slot: usize, at: usize) -> usize {
        let at = self.offsets[slot] as usize + at;
        self.slots.as_ref().map_or_else(|| self.records[at].index(), |slots| slots[at] as usize)
    }

    /// Returns what the entries of `slot` mean, ascending.
    #[inline(always)]
    pub(crate) fn targets(&self, slot: usize) -> impl ExactSizeIterator<Item = usize> {
        (0..self.range(slot).len()).map(move |at| self.target(slot, at))
    }

    /// Number of slots that an entry may mean, if records have `slots_per_record`.
    pub(crate) fn slots_per_target(&self, slots_per_record: usize) -> usize {
        if self.slots.is_some() { 1 } else { slots_per_record }
    }

    /// All lists, one after another.
    pub fn records(&self) -> &[RecordId] {
        &self.records
    }

    /// Start of each list; one more entry than there are slots.
    pub fn offsets(&self) -> &[u64] {
        &self.offsets
    }

    /// The slot that each entry means, if the source says which of the two slots of a record that is.
    pub fn slots(&self) -> Option<&[u32]> {
        self.slots.as_deref()
    }

    /// All scores, if the source gave any.
    pub fn scores(&self) -> Option<&[f32]> {
        self.scores.as_deref()
    }

    /// Mean length of the lists that are not empty, at least 1.
    pub(crate) fn mean_length(&self) -> f64 {
        let n_lists = self.offsets.windows(2).filter(|w| w[0] < w[1]).count();
        self.records.len().max(1) as f64 / n_lists.max(1) as f64
    }

    /// Length of the longest list.
    pub fn longest(&self) -> usize {
        self.offsets.windows(2).map(|w| (w[1] - w[0]) as usize).max().unwrap_or(0)
    }
}

fn sort_row(records: &mut [RecordId], scores: Option<&mut [f32]>) {
    let Some(scores) = scores else { return records.sort_unstable() };
    let mut both: Vec<(RecordId, f32)> =
        records.iter().copied().zip(scores.iter().copied()).collect();
    both.sort_by_key(|&(record, _)| record);
    for (at, both) in both.into_iter().enumerate() {
        (records[at], scores[at]) = both;
    }
}
