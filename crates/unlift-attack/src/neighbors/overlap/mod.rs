//! Neighborhoods from SIFT descriptors alone: near keypoints describe overlapping pixels.
//!
//! Two patches are compared by the cells that they share under a hypothesis, a turn and a shift; the
//! best hypothesis counts. A short walk over the best matches reaches neighbors whose patches do not
//! overlap. Nothing is trained.

mod hypotheses;
mod patches;

pub use patches::{Patches, check};

use super::Neighborhoods;
use super::compare::{MOST_ROWS, note, search};
use super::rows::Rows;
use super::source::{Needs, Source};
use super::walk::{self, Walk};
use crate::released::Released;
use crate::{Descriptors, Error};

/// How far the best hypothesis shifts: not at all, by one cell, by more.
pub const REACHES: usize = 3;

/// Patches of near points need not overlap: neighbors are some steps apart.
pub const WALK: Walk = Walk { steps: 5, decay: 0.7 };

/// The `k` records whose patches overlap each slot's patch most, or that a short walk over such
/// records reaches. Scores: log of the (discounted) probability to be reached.
///
/// Exact up to 131,072 slots (`MOST_ROWS`). Of more, each is compared with those that look alike on the whole, which finds
/// fewer of its partners.
///
/// # Errors
/// When the map has no SIFT descriptors, or fewer than `k` other records.
pub fn overlap<const D: usize>(released: &Released<D>, k: usize) -> Result<Neighborhoods, Error> {
    let mut rows = Rows::new(released, k)?;
    let enough = rows.enough_for(k);
    let patches = Patches::of(rows.descriptors)?;
    let found = search(&patches, &mut rows, enough.max(walk::CANDIDATES), MOST_ROWS)?;
    let ranked = walk::standardized(&found);
    rows.lists(&walk::walk(&ranked, &rows.records, enough, WALK), k)
}

/// [`overlap`] as a source.
#[derive(Clone, Copy, Debug)]
pub struct Overlap;

impl<const D: usize> Source<D> for Overlap {
    fn name(&self) -> &str {
        "overlap"
    }

    fn needs(&self) -> Needs {
        Needs::Descriptors
    }

    fn k(&self, _: &Released<D>) -> usize {
        // Of an image's fewer keypoints only the first of a ranking are near.
        if D == 2 { 10 } else { 35 }
    }

    fn lists(&self, released: &Released<D>, k: usize, _: u64) -> Result<Neighborhoods, Error> {
        overlap(released, k)
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        check(descriptors)
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        note("overlap", n_slots)
    }
}
