//! Lists of a map, in memory or not.

use std::borrow::Cow;
use std::ops::Range;

use super::{Neighborhoods, ShelvedLists};
use crate::{About, Error, RecordId};

/// Lists of a map, wherever they are.
#[derive(Debug)]
pub enum Listing {
    /// In memory.
    Here(Neighborhoods),
    /// On a shelf.
    Away(ShelvedLists),
}

impl Listing {
    /// Those in memory, if they are there.
    pub fn here(&self) -> Option<&Neighborhoods> {
        match self {
            Self::Here(lists) => Some(lists),
            Self::Away(_) => None,
        }
    }

    /// Which released map they are of, and what their rows are counted by.
    pub fn about(&self) -> About {
        match self {
            Self::Here(lists) => lists.about(),
            Self::Away(lists) => lists.about(),
        }
    }

    /// Where each list starts among all entries; one more entry than there are slots.
    pub fn offsets(&self) -> &[u64] {
        match self {
            Self::Here(lists) => lists.offsets(),
            Self::Away(lists) => lists.offsets(),
        }
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.offsets().len() - 1
    }

    /// Entries of all of them.
    pub fn n_entries(&self) -> usize {
        self.offsets().last().map_or(0, |&n| n as usize)
    }

    /// Slots whose lists may be in memory at a time, one range after the other.
    pub fn windows(&self) -> Vec<Range<usize>> {
        match self {
            Self::Here(lists) => std::iter::once(0..lists.n_slots()).collect(),
            Self::Away(lists) => lists.windows(),
        }
    }

    /// The records listed for `slots`, end to end.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn records(&self, slots: &Range<usize>) -> Result<Cow<'_, [RecordId]>, Error> {
        match self {
            Self::Here(lists) => Ok(Cow::Borrowed(&lists.records()[self.entries(slots)])),
            Self::Away(lists) => lists.records(slots).map(Cow::Owned),
        }
    }

    /// The scores of these entries; none where there are no scores.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn scores(&self, slots: &Range<usize>) -> Result<Option<Cow<'_, [f32]>>, Error> {
        let entries = self.entries(slots);
        match self {
            Self::Here(lists) => Ok(lists.scores().map(|scores| Cow::Borrowed(&scores[entries]))),
            Self::Away(lists) => {
                let scores = lists.scores(entries.start as u64..entries.end as u64)?;
                Ok(scores.map(Cow::Owned))
            }
        }
    }

    /// Places of the entries of `slots` among all.
    fn entries(&self, slots: &Range<usize>) -> Range<usize> {
        let offsets = self.offsets();
        offsets[slots.start] as usize..offsets[slots.end] as usize
    }
}
