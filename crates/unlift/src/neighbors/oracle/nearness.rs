//! Records in the order of their distance to an original.

use crate::RecordId;
use crate::geometry::knn::Knn;
use crate::truth::Secret;

/// Additional originals to search, because own partners, shared records and dropped points do not
/// count.
const MARGIN: usize = 8;

/// Callback with a slot, its nearest records in order, and the row to fill.
pub(super) type Make<'a> = dyn Fn(usize, &mut [RecordId], &mut [RecordId]) + Sync + 'a;

/// A search over originals that returns records.
pub(super) struct Nearness<'a, const D: usize> {
    knn: &'a Knn<'a, D>,
    secret: &'a Secret,
    record_of: Vec<Option<RecordId>>,
    slots_per_record: usize,
}

impl<'a, const D: usize> Nearness<'a, D> {
    pub(super) fn new(knn: &'a Knn<'a, D>, secret: &'a Secret, slots_per_record: usize) -> Self {
        let record_of = record_of_originals(secret, slots_per_record);
        Self { knn, secret, record_of, slots_per_record }
    }

    /// Calls `make(slot, the n records nearest to its original, row)` for every slot. `rows` holds
    /// rows of equal length, slot by slot. At least `n` other records must exist.
    pub(super) fn each(&self, n: usize, rows: &mut [RecordId], make: &Make<'_>) {
        let hidden = self.secret.hidden();
        let length = (rows.len() / hidden.len().max(1)).max(1);
        // Spatial order keeps the neighbors of consecutive slots in the cache.
        let mut of_original: Vec<_> = (0..self.secret.n_originals()).map(|_| None).collect();
        for ((slot, row), original) in rows.chunks_mut(length).enumerate().zip(hidden) {
            of_original[original.index()] = Some((slot as u32, row));
        }
        let in_order = |&original: &u32| of_original[original as usize].take();
        let mut ordered: Vec<_> = self.knn.spatial_order().iter().map(in_order).collect();
        drop(of_original);
        self.knn.each(n + MARGIN, &mut ordered, |original, found, entry| {
            let Some((slot, row)) = entry else { return };
            let mut records = Vec::with_capacity(n);
            self.keep_records(original, n, found, &mut records);
            if records.len() < n {
                self.from(original, n, &mut records);
            }
            make(*slot as usize, &mut records, row);
        });
    }

    /// Writes the `n` records nearest to `original` (fewer if there are fewer) to `records`.
    pub(super) fn from(&self, original: usize, n: usize, records: &mut Vec<RecordId>) {
        let mut found = Vec::new();
        let mut reach = n + MARGIN;
        loop {
            self.knn.nearest(original, reach, &mut found);
            self.keep_records(original, n, &found, records);
            if records.len() == n || found.len() < reach {
                return;
            }
            reach *= 2;
        }
    }

    pub(super) fn record_of(&self, original: usize) -> Option<RecordId> {
        self.record_of[original]
    }

    /// Keeps the first `n` records that hide one of `found`, each once, without the record of
    /// `original`.
    fn keep_records(
        &self,
        original: usize,
        n: usize,
        found: &[(f64, u32)],
        records: &mut Vec<RecordId>,
    ) {
        let own = self.record_of[original];
        let several = self.slots_per_record > 1;
        records.clear();
        for &(_, at) in found {
            if let Some(record) = self.record_of[at as usize]
                && Some(record) != own
                && !(several && listed(records, record))
            {
                records.push(record);
                if records.len() == n {
                    return;
                }
            }
        }
    }
}

/// Returns the record that hides each original; `None` for dropped points.
pub(super) fn record_of_originals(
    secret: &Secret,
    slots_per_record: usize,
) -> Vec<Option<RecordId>> {
    let mut record_of = vec![None; secret.n_originals()];
    for (slot, original) in secret.hidden().iter().enumerate() {
        record_of[original.index()] = Some(RecordId::from_index(slot / slots_per_record));
    }
    record_of
}

/// Returns true if `records` contains `record`. Comparing all of them is faster than stopping
/// early.
#[inline(always)]
pub(super) fn listed(records: &[RecordId], record: RecordId) -> bool {
    records.iter().fold(false, |hit, &other| hit | (other == record))
}
