//! Neighborhoods that do not fit into memory: read onto a shelf, written as they are made.

use super::column::Type;
use super::header::{Kind, insert_about, new_meta};
use super::neighborhoods::{Columns, check_list, check_rows};
use super::pages::Stay;
use super::table::Table;
use super::write::{Written, field, list_field, lists, numbers, write_table};
use crate::Error;
use crate::atomic::Access;
use arrow_array::types::UInt32Type;
use arrow_schema::DataType::UInt32;
use std::cell::RefCell;
use std::ops::Range;
use std::path::Path;
use unlift::neighbors::ShelvedLists;
use unlift::{About, RecordId, Shelf};

/// Reads neighborhoods of a released map of `map` records and slots per record, some thousand rows at a time, onto `shelf`: for
/// files that do not fit into memory.
///
/// # Errors
/// As of [`read_neighborhoods`](super::read_neighborhoods), and when a column `slot` is not in order or the shelf cannot be written.
pub fn shelve_neighborhoods(
    path: &Path,
    map: (usize, usize),
    shelf: &dyn Shelf,
) -> Result<ShelvedLists, Error> {
    let table = Table::open_kind(path, Kind::Neighborhoods)?;
    let (n_records, slots_per_record) = map;
    let n_slots = n_records * slots_per_record;
    check_rows(&table, n_slots)?;
    let columns = Columns::of(&table, table.has("slot").then_some("slot"), "records", Stay::Rows);
    let has_scores = columns.with_scores && !all_null(&table)?;
    let refused = |source| table.refused(source);
    let mut away = ShelvedLists::new(map, has_scores, shelf).map_err(refused)?;
    let mut first = 0;
    columns.read(&table, n_slots, n_records, |batch, rows| {
        if rows.scores.is_some() != has_scores {
            let (expected, found) = ("a list in every row, or in none", "both");
            return Err(Error::new(path, "column scores", expected, found));
        }
        for (row, slot) in (first..).take(rows.offsets.len() - 1).enumerate() {
            if let Some(&key) = rows.keys.get(row)
                && key as usize != slot
            {
                let expected = format!("{slot} (lists that are not in memory stand in order)");
                return Err(batch.wrong("slot", row, expected, key.to_string()));
            }
            let own = (slot / slots_per_record) as u32;
            check_list(path, "records", ("slot", slot), ("record", own), rows.of(row))?;
        }
        first += rows.offsets.len() - 1;
        let lengths: Vec<usize> = rows.offsets.windows(2).map(|w| (w[1] - w[0]) as usize).collect();
        let records = rows.ids.into_iter().map(RecordId).collect();
        away.push(lengths, records, rows.scores).map_err(refused)
    })?;
    away.finish(table.meta().about()?).map_err(refused)
}

/// Whether no row has scores.
fn all_null(table: &Table<'_>) -> Result<bool, Error> {
    let (mut n, mut null) = (0, 0);
    table.read_to(&[("scores", Type::Floats)], Stay::Rows, |batch| {
        n += batch.len();
        null += if batch.is_null("scores") { batch.len() } else { 0 };
        Ok(())
    })?;
    Ok(n > 0 && null == n)
}

/// Writes lists of `k` records each for `n_slots` slots, which `make(slots)` makes as they are needed, end to end in ascending
/// order: the file that [`write_neighborhoods`](super::write_neighborhoods) writes of all of them.
///
/// # Errors
/// When the file cannot be written.
pub fn write_neighborhoods_as_made(
    path: &Path,
    (n_slots, k): (usize, usize),
    about: About,
    make: impl Fn(Range<usize>) -> Vec<RecordId>,
) -> Result<(), Error> {
    let mut meta = new_meta(Kind::Neighborhoods);
    insert_about(&mut meta, about);
    let fields = vec![field("slot", UInt32), list_field("records", UInt32)];
    // More are made than are written at a time: neighbors of many slots are found faster together.
    let made = RefCell::new((0..0, Vec::new()));
    let columns = Box::new(move |slots: Range<usize>| {
        let mut made = made.borrow_mut();
        if slots.end > made.0.end {
            let part = slots.start..n_slots.min(slots.start + MADE_TOGETHER.max(slots.len()));
            made.1 = Vec::new();
            made.1 = make(part.clone());
            made.0 = part;
        }
        let first = made.0.start;
        let values = &made.1[(slots.start - first) * k..(slots.end - first) * k];
        let lengths = std::iter::repeat_n(k, slots.len());
        vec![
            numbers::<UInt32Type>(slots.map(|slot| slot as u32)),
            lists::<UInt32Type>(values.iter().map(|record| record.0), lengths),
        ]
    });
    write_table((path, Access::Private), Written { meta, fields, n_rows: n_slots, columns })
}

/// Slots whose lists are made together, a multiple of those that are written together.
const MADE_TOGETHER: usize = 1 << 19;
