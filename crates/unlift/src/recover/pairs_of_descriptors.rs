//! Which of a paired line's two descriptors belongs to which of its points (supplement B).

use std::ops::Range;

use rayon::prelude::*;

use crate::Descriptors;
use crate::neighbors::Neighborhoods;
use crate::released::Released;

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
    let descriptors = released.descriptors()?;
    if released.slots_per_record() != 2 {
        return None;
    }
    let mut rows = vec![0u32; 2 * records.len()];
    rows.par_chunks_mut(2).enumerate().for_each(|(at, rows)| {
        let record = records.start + at;
        let [a, b] = [2 * record, 2 * record + 1];
        let cost = |row: usize, slot: usize| affinity_cost(descriptors, row, lists, slot);
        let straight = cost(a, a) + cost(b, b);
        let crossed = cost(a, b) + cost(b, a);
        let first = if straight <= crossed { [a, b] } else { [b, a] };
        rows.copy_from_slice(&first.map(|row| row as u32));
    });
    Some(rows)
}

fn affinity_cost(descriptors: &Descriptors, row: usize, lists: &Neighborhoods, slot: usize) -> f64 {
    let to_record = |record: usize| {
        let one = descriptors.squared_distance(row, 2 * record);
        let other = descriptors.squared_distance(row, 2 * record + 1);
        f64::from(one.min(other).sqrt())
    };
    lists.of(slot).iter().map(|record| to_record(record.index())).sum()
}
