//! Estimates from lists, and mixed lists, which measure chance.

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::recover::result::{Estimate, Status, stored_support};

/// Slots per chunk: fixed, so that results do not depend on the number of threads.
pub(crate) const CHUNK: usize = 64;

pub(crate) fn found<const D: usize>(
    position: [f32; D],
    support: u32,
    axis: usize,
    evidence: f32,
) -> Estimate<D> {
    let (status, support, axis) = (Status::Ok, stored_support(support), axis as u8);
    Estimate { position, status, support, axis, evidence }
}

/// Creates the estimate of a slot whose neighbors do not fix a point; `n` of them may vote.
pub(crate) fn not_fixed<const D: usize>(n: usize) -> Estimate<D> {
    Estimate::lost(if n < 2 { Status::TooFewNeighbors } else { Status::Degenerate })
}

/// Distance between the entries of a mixed list, as a fraction of all entries. The golden section spreads them evenly, so that
/// no two come from one list.
const SPREAD: f64 = 0.618_033_988_749_895;
/// Entries tried per entry of a mixed list.
const TRIES: usize = 8;

/// Returns lists without information for some `slots` (ascending): as long as their own lists, but with entries of other lists.
pub(crate) fn mixed(
    lists: &Neighborhoods,
    slots: &[usize],
    slots_per_record: usize,
) -> Neighborhoods {
    let step = (lists.records().len() as f64 * SPREAD) as usize;
    let (mut offsets, mut records) = (vec![0], Vec::<RecordId>::new());
    for &slot in slots {
        let first = records.len();
        offsets.resize(slot + 1, first as u64);
        let len = lists.of(slot).len();
        let own = (slot / slots_per_record) as u32;
        // If lists hold a large part of all records, own entries are allowed.
        let few = 4 * len * slots_per_record > lists.n_slots();
        let mut at = lists.offsets()[slot] as usize;
        for _ in 0..TRIES * len {
            at = (at + step) % lists.records().len();
            let entry = lists.records()[at];
            // A record in a list twice would agree with itself.
            if few || (entry.0 != own && !records[first..].contains(&entry)) {
                records.push(entry);
            }
            if records.len() == first + len {
                break;
            }
        }
        offsets.push(records.len() as u64);
    }
    offsets.resize(lists.n_slots() + 1, records.len() as u64);
    Neighborhoods::unchecked(offsets, records)
}
