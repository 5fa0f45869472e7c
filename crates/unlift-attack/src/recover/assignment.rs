//! Assignment of the two descriptors of a paired line to its two points (supplement B).

use rayon::prelude::*;

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::released::Released;

/// Per slot, the released descriptor row that belongs to it (supplement B); `None` unless records have two slots and
/// descriptors.
///
/// The cheaper of the two assignments wins. The cost of a descriptor and a list is the sum of the distances from the descriptor to
/// the listed records, each taken to the nearer of the record's two descriptors.
pub(super) fn descriptor_rows<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Option<Vec<u32>> {
    let descriptors = released.descriptors().filter(|_| released.slots_per_record() == 2)?;
    let cost = |row: usize, slot: usize| {
        let to_record = |record: &RecordId| {
            let [one, other] =
                [0, 1].map(|side| descriptors.squared_distance(row, 2 * record.index() + side));
            f64::from(one.min(other).sqrt())
        };
        lists.of(slot).iter().map(to_record).sum::<f64>()
    };
    let rows_of = |record: usize| {
        let [a, b] = [2 * record, 2 * record + 1];
        let is_straight = cost(a, a) + cost(b, b) <= cost(a, b) + cost(b, a);
        let first = if is_straight { [a, b] } else { [b, a] };
        first.map(|row| row as u32)
    };
    Some((0..released.n_records()).into_par_iter().flat_map_iter(rows_of).collect())
}
