//! Which of a paired line's two descriptors belongs to which of its points (supplement B).

use std::ops::Range;

use rayon::prelude::*;

use crate::neighbors::Neighborhoods;
use crate::released::Released;
use crate::{Descriptors, RecordId};

/// Per slot of `records` the released descriptor row said to belong to it; `None` unless records hide two points
/// and have descriptors.
///
/// The cheaper of the two bijections wins, where a descriptor and a neighborhood cost the sum of
/// its distances to the listed records, each counted with the nearer of its two descriptors.
/// Positions play no part.
pub(super) fn descriptor_rows<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    records: Range<usize>,
) -> Option<Vec<u32>> {
    let descriptors = released.descriptors().filter(|_| released.slots_per_record() == 2)?;
    let rows_of = |record: usize| {
        let [a, b] = [2 * record, 2 * record + 1];
        let cost = |row: usize, slot: usize| affinity_cost(descriptors, row, lists.of(slot));
        let straight = cost(a, a) + cost(b, b);
        let crossed = cost(a, b) + cost(b, a);
        let first = if straight <= crossed { [a, b] } else { [b, a] };
        first.map(|row| row as u32)
    };
    Some(records.into_par_iter().flat_map_iter(rows_of).collect())
}

fn affinity_cost(descriptors: &Descriptors, row: usize, listed: &[RecordId]) -> f64 {
    let to_record = |record: usize| {
        let one = descriptors.squared_distance(row, 2 * record);
        let other = descriptors.squared_distance(row, 2 * record + 1);
        f64::from(one.min(other).sqrt())
    };
    listed.iter().map(|record| to_record(record.index())).sum()
}
