//! Which of a paired line's two descriptors belongs to which of its points (supplement B).

use std::ops::Range;

use rayon::prelude::*;

use super::map::lists::{Listed, Rows};
use crate::released::Released;
use crate::{Descriptors, Error};

/// Per slot of `records` the released descriptor row said to belong to it; `None` unless records hide two points
/// and have descriptors.
///
/// The cheaper of the two bijections wins, where a descriptor and a neighborhood cost the sum of
/// its distances to the listed records, each counted with the nearer of its two descriptors.
/// Positions play no part.
///
/// # Errors
/// When lists cannot be read, which are on a shelf.
pub(super) fn descriptor_rows<const D: usize>(
    released: &Released<D>,
    lists: Listed<'_>,
    records: Range<usize>,
) -> Result<Option<Vec<u32>>, Error> {
    let Some(descriptors) = released.descriptors().filter(|_| released.slots_per_record() == 2)
    else {
        return Ok(None);
    };
    let mut rows = vec![0u32; 2 * records.len()];
    for window in lists.windows() {
        let part = records.start.max(window.start / 2)..records.end.min(window.end / 2);
        if part.start < part.end {
            let own = 2 * (part.start - records.start)..2 * (part.end - records.start);
            assign(descriptors, &lists.rows(&window)?, part, &mut rows[own]);
        }
    }
    Ok(Some(rows))
}

/// The rows of `records`, whose lists are among `lists`.
fn assign(descriptors: &Descriptors, lists: &Rows<'_>, records: Range<usize>, rows: &mut [u32]) {
    rows.par_chunks_mut(2).enumerate().for_each(|(at, rows)| {
        let record = records.start + at;
        let [a, b] = [2 * record, 2 * record + 1];
        let cost = |row: usize, slot: usize| affinity_cost(descriptors, row, lists, slot);
        let straight = cost(a, a) + cost(b, b);
        let crossed = cost(a, b) + cost(b, a);
        let first = if straight <= crossed { [a, b] } else { [b, a] };
        rows.copy_from_slice(&first.map(|row| row as u32));
    });
}

fn affinity_cost(descriptors: &Descriptors, row: usize, lists: &Rows<'_>, slot: usize) -> f64 {
    let to_record = |record: usize| {
        let one = descriptors.squared_distance(row, 2 * record);
        let other = descriptors.squared_distance(row, 2 * record + 1);
        f64::from(one.min(other).sqrt())
    };
    lists.of(slot).iter().map(|record| to_record(record.index())).sum()
}
