//! Lists that are not in memory: on a shelf, read some slots at a time.

use std::ops::Range;

use super::neighborhoods::{check_row, check_scores, sort_row};
use crate::shelf::{Column, Number, Shelf, windows};
use crate::{About, Error, RecordId};

/// What [`Neighborhoods`](super::Neighborhoods) hold, in files: 8 bytes per slot are in memory, the records of some slots are read when they are
/// needed. [`recover_shelved`](crate::recover::recover_shelved) takes them.
#[derive(Debug)]
pub struct ShelvedLists {
    offsets: Vec<u64>,
    records: Column<RecordId>,
    scores: Option<Column<f32>>,
    /// Of the map: its records, and slots of each.
    map: (usize, usize),
    about: About,
    window: usize,
}

impl ShelvedLists {
    /// No list yet, of a map with so many records and slots per record; with a score beside each entry or not.
    ///
    /// # Errors
    /// When the shelf has no files.
    pub fn new(map: (usize, usize), has_scores: bool, shelf: &dyn Shelf) -> Result<Self, Error> {
        let mut offsets = Vec::with_capacity(map.0 * map.1 + 1);
        offsets.push(0);
        let scores = has_scores.then(|| Column::new(shelf)).transpose()?;
        let (records, about, window) = (Column::new(shelf)?, About::default(), shelf.window());
        Ok(Self { offsets, records, scores, map, about, window })
    }

    /// Appends the lists of the next slots, of so many entries each, in any order within a list.
    ///
    /// # Errors
    /// As of [`Neighborhoods::try_new`](super::Neighborhoods::try_new), and when they cannot be written.
    pub fn push(
        &mut self,
        lengths: impl IntoIterator<Item = usize>,
        mut records: Vec<RecordId>,
        mut scores: Option<Vec<f32>>,
    ) -> Result<(), Error> {
        let (n_records, slots_per_record) = self.map;
        let n_scores = scores.as_ref().map(Vec::len);
        if n_scores != self.scores.is_some().then_some(records.len()) {
            let expected = match self.scores {
                Some(_) => format!("{} rows", records.len()),
                None => "none".to_owned(),
            };
            let found = n_scores.map_or("none".to_owned(), |n| n.to_string());
            return Err(Error::new("neighborhood scores", expected, found));
        }
        if let Some(scores) = &scores {
            check_scores(self.records.len() as usize, scores)?;
        }
        let mut from = 0;
        for length in lengths {
            let slot = self.offsets.len() - 1;
            if slot == n_records * slots_per_record || length > records.len() - from {
                let expected = format!("{} slots", n_records * slots_per_record);
                return Err(Error::new("neighborhoods", expected, "more entries"));
            }
            let range = from..from + length;
            sort_row(&mut records[range.clone()], scores.as_mut().map(|s| &mut s[range.clone()]));
            check_row(slot, &records[range], n_records, slots_per_record)?;
            from += length;
            self.offsets.push(self.offsets[slot] + length as u64);
        }
        if from != records.len() {
            let found = format!("{} entries more", records.len() - from);
            return Err(Error::new("neighborhoods", "as many entries as lengths say", found));
        }
        self.records.push_all(&records)?;
        match (&mut self.scores, scores) {
            (Some(column), Some(scores)) => column.push_all(&scores),
            _ => Ok(()),
        }
    }

    /// All of them, said to be of a released map and counted in an order.
    ///
    /// # Errors
    /// When a slot has no list.
    pub fn finish(self, about: About) -> Result<Self, Error> {
        let n_slots = self.map.0 * self.map.1;
        if self.n_slots() != n_slots {
            let expected = format!("{n_slots} slots, as the released map has");
            return Err(Error::new("neighborhoods", expected, self.n_slots().to_string()));
        }
        Ok(Self { about, ..self })
    }

    /// Which released map the lists are of, and what their rows are counted by.
    pub fn about(&self) -> About {
        self.about
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Where each list starts among all entries; one more entry than there are slots.
    pub fn offsets(&self) -> &[u64] {
        &self.offsets
    }

    /// Whether entries have scores.
    pub fn has_scores(&self) -> bool {
        self.scores.is_some()
    }

    /// Slots whose lists may be in memory at a time, one range after the other; of whole records.
    pub(crate) fn windows(&self) -> Vec<Range<usize>> {
        windows(&self.offsets, (self.window / RecordId::BYTES) as u64, self.map.1)
    }

    /// The records listed for `slots`, end to end.
    ///
    /// # Errors
    /// When they cannot be read.
    pub(crate) fn records(&self, slots: &Range<usize>) -> Result<Vec<RecordId>, Error> {
        self.records.read(self.offsets[slots.start]..self.offsets[slots.end])
    }

    /// The record listed by the entry `at` of all.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(crate) fn record(&self, at: u64) -> Result<RecordId, Error> {
        Ok(self.records.read(at..at + 1)?[0])
    }

    /// The scores of the entries at places `range` of all; none where there are no scores.
    ///
    /// # Errors
    /// When they cannot be read.
    pub(crate) fn scores(&self, range: Range<u64>) -> Result<Option<Vec<f32>>, Error> {
        self.scores.as_ref().map(|scores| scores.read(range)).transpose()
    }
}
