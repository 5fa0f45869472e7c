//! The source `overlap`: the patches of near SIFT keypoints overlap. It needs no training.
//!
//! Two patches are compared on the cells that they share under a hypothesis, which is a turn and a shift. The best
//! hypothesis counts. A short walk over the best matches reaches neighbors whose patches do not overlap.

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

/// Number of classes of shifts: 0 cells, 1 cell, more.
pub const REACHES: usize = 3;

/// The walk over matches: patches of near points need not overlap, so neighbors are several steps apart.
pub const WALK: Walk = Walk { steps: 5, decay: 0.7 };

/// Lists the `k` records whose patches overlap each slot's patch most, or that a short walk over such records reaches. The score is
/// the logarithm of the discounted probability to be reached.
///
/// The search is exact up to 131,072 slots (`MOST_ROWS`). In a larger map, each block of descriptors is compared with the blocks
/// that have the most similar means, which misses some partners.
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

/// The function [`overlap`] as a source.
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
        // An image has fewer keypoints, so that only the first of a ranking are near.
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
