//! Records in order of nearness to an original.

use crate::RecordId;
use crate::geometry::knn::Knn;
use crate::truth::Secret;

/// Own partner, shared records and dropped points cost places: how much further is looked at once.
const MARGIN: usize = 8;

/// What is made of a slot: its nearest records in order, and the row to fill.
pub(super) type Make<'a> = dyn Fn(usize, &mut [RecordId], &mut [RecordId]) + Sync + 'a;

/// A search over originals, read as a search over records.
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

    /// Calls `make(slot, the first n records from its original, row)` for every slot; `rows` holds
    /// rows of one length, slot by slot. So many other records must exist.
    pub(super) fn each(&self, n: usize, rows: &mut [RecordId], make: &Make<'_>) {
        let hidden = self.secret.hidden();
        let length = (rows.len() / hidden.len().max(1)).max(1);
        // In spatial order, so that one slot finds the neighbors of the last one in cache.
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

    /// The first `n` records from `original` (fewer when there are fewer), into `records`.
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

    /// The record that hides `original`; `None` for dropped ones.
    pub(super) fn record_of(&self, original: usize) -> Option<RecordId> {
        self.record_of[original]
    }

    /// The first `n` records that hide one of `found`: never that of `original`, each once.
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

/// The record that hides each original; `None` for dropped ones.
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

/// Whether `records` holds `record`: looks at all of them, which is faster than to stop at a hit.
#[inline(always)]
pub(super) fn listed(records: &[RecordId], record: RecordId) -> bool {
    records.iter().fold(false, |hit, &other| hit | (other == record))
}
