//! Descriptor rows in a canonical order, and the conversion of rankings to lists of records.

use std::borrow::Cow;

use super::Neighborhoods;
use super::kind::comparable;
use crate::descriptors::Values;
use crate::released::Released;
use crate::{Descriptors, Error, RecordId, RowOrder};

/// Partners of a row, best first.
pub(super) type Ranked = Vec<(f32, u32)>;

fn records_of(slots: &[u32], slots_per_record: usize) -> Vec<u32> {
    slots.iter().map(|&slot| slot / slots_per_record as u32).collect()
}

/// Returns the rows of `descriptors` sorted by content; equal ones by their numbers.
pub fn by_content(descriptors: &Descriptors) -> Vec<u32> {
    let mut slots: Vec<u32> = (0..descriptors.len() as u32).collect();
    let row = |slot: u32| descriptors.range(slot as usize);
    match descriptors.values() {
        Values::U8(v) => {
            slots.sort_unstable_by(|&a, &b| v[row(a)].cmp(&v[row(b)]).then(a.cmp(&b)));
        }
        Values::F32(v) => slots.sort_unstable_by(|&a, &b| {
            let unequal = v[row(a)].iter().zip(&v[row(b)]).map(|(x, y)| x.total_cmp(y));
            unequal.into_iter().find(|order| order.is_ne()).unwrap_or_else(|| a.cmp(&b))
        }),
    }
    slots
}

/// Descriptor rows sorted by content: permuting the records of a released map permutes its lists, except for equal rows. Rows of zeros
/// say nothing and are left out if others suffice: they have empty lists, and no list names them.
pub struct Rows<'a> {
    /// All descriptors, by slot, as they are compared.
    pub descriptors: Cow<'a, Descriptors>,
    pub slots: Vec<u32>,
    pub records: Vec<u32>,
    slots_per_record: usize,
}

impl<'a> Rows<'a> {
    /// Creates the rows of a released map with descriptors, for lists of `k` records.
    pub fn new<const D: usize>(released: &'a Released<D>, k: usize) -> Result<Self, Error> {
        let descriptors = released.descriptors().ok_or_else(|| {
            Error::new("released map", "descriptors, which this source compares", "none")
        })?;
        let mut rows = Self::of_map(descriptors, released, k)?;
        let told = rows.slots.iter().copied().filter(|&slot| !descriptors.is_zero(slot as usize));
        let told: Vec<u32> = told.collect();
        if told.len() > rows.enough_for(k) {
            rows.reorder(told);
        }
        Ok(Self { descriptors: comparable(&[descriptors]).remove(0), ..rows })
    }

    /// Creates the rows of a released map from a matrix with a row per slot, for lists of `k` records, of at least one and all others.
    pub fn of_map<const D: usize>(
        descriptors: &'a Descriptors,
        released: &Released<D>,
        k: usize,
    ) -> Result<Self, Error> {
        let n_records = released.n_records();
        if k == 0 || n_records < k + 1 {
            let expected = format!("between 1 and {} (other records)", n_records.saturating_sub(1));
            return Err(Error::new("k", expected, k));
        }
        let slots = by_content(descriptors);
        let slots_per_record = released.slots_per_record();
        let records = records_of(&slots, slots_per_record);
        Ok(Self { descriptors: Cow::Borrowed(descriptors), slots, records, slots_per_record })
    }

    /// Creates rows from `descriptors` in their order; each is a record.
    pub fn of_all(descriptors: &'a Descriptors) -> Self {
        let slots: Vec<u32> = (0..descriptors.len() as u32).collect();
        let records = slots.clone();
        Self { descriptors: Cow::Borrowed(descriptors), slots, records, slots_per_record: 1 }
    }

    /// Returns the same rows, each as a record of its own.
    pub fn apart(&self) -> Rows<'_> {
        let (slots, records) = (self.slots.clone(), (0..self.len() as u32).collect());
        Rows { descriptors: Cow::Borrowed(&self.descriptors), slots, records, slots_per_record: 1 }
    }

    pub fn reorder(&mut self, slots: Vec<u32>) {
        self.records = records_of(&slots, self.slots_per_record);
        self.slots = slots;
    }

    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Returns how many rows to keep so that they contain `k` records: a record may have several rows.
    pub fn enough_for(&self, k: usize) -> usize {
        k * self.slots_per_record
    }

    /// Returns lists of `released` with the first `k` records of each row's ranking, `ranked[row]`, best first.
    pub fn lists<const D: usize>(
        &self,
        released: &Released<D>,
        ranked: &[Ranked],
        k: usize,
    ) -> Result<Neighborhoods, Error> {
        let mut ranked_of: Vec<&[(f32, u32)]> = vec![&[]; released.n_slots()];
        for (ranked, &slot) in ranked.iter().zip(&self.slots) {
            ranked_of[slot as usize] = ranked;
        }
        let record = |slot: u32| RecordId(slot / self.slots_per_record as u32);
        let list = |ranked: &[(f32, u32)]| {
            let mut list: Vec<(f32, u32)> = Vec::with_capacity(k);
            for &(score, partner) in ranked {
                let slot = self.slots[partner as usize];
                if list.len() < k && list.iter().all(|entry| record(entry.1) != record(slot)) {
                    list.push((score, slot));
                }
            }
            list
        };
        let rows: Vec<Vec<(f32, u32)>> = ranked_of.into_iter().map(list).collect();
        let records =
            |row: &Vec<(f32, u32)>| row.iter().map(|&(x, slot)| (x, record(slot))).collect();
        let order = RowOrder::DescriptorRows;
        let lists = Neighborhoods::scored(rows.iter().map(records), released, order)?;
        match self.slots_per_record {
            1 => Ok(lists),
            _ => lists.with_slots(rows.into_iter().flatten().map(|entry| entry.1).collect()),
        }
    }
}
