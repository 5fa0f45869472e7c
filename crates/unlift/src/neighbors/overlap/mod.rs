//! Neighborhoods from SIFT descriptors alone: near keypoints describe overlapping pixels.
//!
//! Two patches are compared by the cells that they share under a hypothesis, a turn and a shift; the
//! best hypothesis counts. A short walk over the best matches reaches neighbors whose patches do not
//! overlap. Nothing is trained.

mod hypotheses;
mod patches;

use patches::Patches;

use super::rows::Rows;
use super::{Neighborhoods, all_pairs, walk};
use crate::Error;
use crate::released::Released;

/// Partners that a row keeps for the walk, at least.
const CANDIDATES: usize = 64;

/// The `k` records whose patches overlap each slot's patch most, or that a short walk over such
/// records reaches. Scores: log of the (discounted) probability to be reached.
///
/// # Errors
/// When the map has no SIFT descriptors, or fewer than `k` other records.
pub fn overlap<const D: usize>(released: &Released<D>, k: usize) -> Result<Neighborhoods, Error> {
    let rows = Rows::new(released, k)?;
    all_pairs::check(rows.len())?;
    let enough = rows.enough_for(k);
    let patches = Patches::new(rows.descriptors, &rows.slots)?;
    let found = all_pairs::compare(&patches, &rows.records, enough.max(CANDIDATES));
    drop(patches);
    let ranked = walk::standardized(&found);
    rows.lists(&walk::walk(&ranked, &rows.records, enough), k)
}
