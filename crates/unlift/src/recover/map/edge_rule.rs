//! What the edges of one slot owe to the lists of all: how many who name it count, and how high a score is.

use super::bytes::{Reader, Writer};
use super::edges::{SCORE_CLASSES, score_bounds, score_class};
use crate::Error;

/// Reverse entries of a row at most, as a multiple of the mean list: whoever is named by everyone is
/// named by mistake.
const MOST_REVERSE: usize = 3;

/// The rule by which edges are made of lists.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EdgeRule {
    /// Reverse entries of a row at most.
    pub(super) most: usize,
    /// The least score of each class but the first; empty without scores.
    bounds: Vec<f32>,
}

impl EdgeRule {
    /// That of lists of `n_slots` with so many entries, of whose scores, if they have any, every
    /// [`score_step`](super::edges::score_step)-th is in `sample`.
    pub(crate) fn new(n_entries: usize, n_slots: usize, sample: Vec<f32>) -> Self {
        let most = MOST_REVERSE * n_entries.div_ceil(n_slots.max(1)).max(1);
        Self { most, bounds: score_bounds(sample) }
    }

    /// The class of the entry at `at` of `scores`.
    #[inline(always)]
    pub(super) fn class_at(&self, scores: Option<&[f32]>, at: usize) -> u8 {
        scores.map_or(0, |scores| score_class(&self.bounds, scores[at]))
    }

    /// Whether it was made of lists with scores.
    pub(crate) fn has_scores(&self) -> bool {
        !self.bounds.is_empty()
    }

    /// Appends the rule to `to`.
    pub(crate) fn write(&self, to: &mut Writer) {
        to.u64(self.most as u64);
        to.u64(self.bounds.len() as u64);
        to.f32s(&self.bounds);
    }

    /// The rule that [`write`](Self::write) appended.
    ///
    /// # Errors
    /// When it is none.
    pub(crate) fn read(from: &mut Reader<'_>) -> Result<Self, Error> {
        let most = from.count(u32::MAX as usize)?.max(1);
        let n = from.count(SCORE_CLASSES - 1)?;
        Ok(Self { most, bounds: from.f32s(n)? })
    }
}
