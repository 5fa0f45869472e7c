//! Neighborhoods: lists of records per slot, or of original points per point.

use super::column::Type;
use super::header::{Kind, insert_about, new_meta};
use super::order::rows_by_key;
use super::table::Table;
use super::write::{Written, write_table};
use crate::Error;
use crate::atomic::Access;
use arrow_array::types::{Float32Type, UInt32Type};
use std::ops::Range;
use std::path::Path;
use unlift::RecordId;
use unlift::neighbors::Neighborhoods;

/// Lists of original points, one per point: neighborhoods before an obfuscation assigns points to
/// records.
#[derive(Clone, Debug, PartialEq)]
pub struct PointNeighborhoods {
    offsets: Vec<u64>,
    neighbors: Vec<u32>,
    scores: Option<Vec<f32>>,
}

impl PointNeighborhoods {
    /// The number of points.
    pub fn n_points(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The rows of the original points in the list of `point`.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn of(&self, point: usize) -> &[u32] {
        &self.neighbors[self.offsets[point] as usize..self.offsets[point + 1] as usize]
    }

    /// The start of each list in [`neighbors`](Self::neighbors), and the end of the last:
    /// `(n_points + 1)`.
    pub fn offsets(&self) -> &[u64] {
        &self.offsets
    }

    /// All lists, concatenated: rows of original points.
    pub fn neighbors(&self) -> &[u32] {
        &self.neighbors
    }

    /// The score of each neighbor, if the file has scores.
    pub fn scores(&self) -> Option<&[f32]> {
        self.scores.as_deref()
    }
}

/// Writes neighborhoods, one row per slot: `slot`, `records` and, if present, `scores`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_neighborhoods(path: &Path, neighborhoods: &Neighborhoods) -> Result<(), Error> {
    write_table((path, Access::Private), &written(neighborhoods))
}

pub(super) fn written(neighborhoods: &Neighborhoods) -> Written<'_> {
    let mut meta = new_meta(Kind::Neighborhoods);
    insert_about(&mut meta, neighborhoods.about());
    let mut written = Written::new(meta, neighborhoods.n_slots());
    written.numbers::<UInt32Type>("slot", |slot| slot as u32);
    let lists = |slots: Range<usize>| {
        let offsets = &neighborhoods.offsets()[slots.start..=slots.end];
        let lengths = offsets.windows(2).map(|w| (w[1] - w[0]) as usize).collect();
        (offsets[0] as usize..offsets[slots.len()] as usize, lengths)
    };
    written.lists::<UInt32Type>("records", move |slots| {
        let (range, lengths) = lists(slots);
        (neighborhoods.records()[range].iter().map(|record| record.0).collect(), lengths)
    });
    if let Some(scores) = neighborhoods.scores() {
        written.lists::<Float32Type>("scores", move |slots| {
            let (range, lengths) = lists(slots);
            (scores[range].to_vec(), lengths)
        });
    }
    written
}

/// Reads neighborhoods for a released map of `n_records` records with `slots_per_record` slots
/// each.
///
/// Rows are in the order of slots, or in any order if there is a column `slot`. Every slot has a
/// row; its list may be empty or null.
///
/// # Errors
/// When the file differs from `docs/formats.md`, such as another number of rows than slots, or a
/// list with a record that is out of range, listed twice or the slot's own.
pub fn read_neighborhoods(
    path: &Path,
    n_records: usize,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    neighborhoods_of(&Table::open_kind(path, Kind::Neighborhoods)?, n_records, slots_per_record)
}

pub(super) fn neighborhoods_of(
    table: &Table<'_>,
    n_records: usize,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    let path = table.path();
    let n_slots = n_records * slots_per_record;
    if table.n_rows() != n_slots as u64 {
        let expected = format!("{n_slots} rows, one per slot of the released map");
        return Err(Error::new(path, "", expected, table.n_rows().to_string()));
    }
    let key = table.has("slot").then_some("slot");
    let lists =
        Lists::read(table, key, "records", n_slots, n_records)?.by_key(path, key, n_slots)?;
    for slot in 0..n_slots {
        // The core checks this, too, but cannot name the column.
        let own = (slot / slots_per_record) as u32;
        check_list(path, "records", ("slot", slot), ("record", own), lists.of(slot))?;
    }
    let records = lists.ids.into_iter().map(RecordId).collect();
    let about = table.meta().about()?;
    Neighborhoods::try_new(lists.offsets, records, lists.scores, n_records, slots_per_record)
        .map(|lists| lists.with_about(about))
        .map_err(|source| table.refused(source))
}

/// Reads neighborhoods in the point form: columns `point`, `neighbors` (both rows of the `n_points`
/// original points) and, optionally, `scores`.
///
/// Rows may be in any order; points without a row have an empty list.
///
/// # Errors
/// When the file differs from `docs/formats.md`, such as a point that is out of range or has two
/// rows, or a list with a point that is out of range, listed twice or the list's own.
pub fn read_point_neighborhoods(path: &Path, n_points: usize) -> Result<PointNeighborhoods, Error> {
    let table = Table::open_kind(path, Kind::PointNeighborhoods)?;
    if table.n_rows() > n_points as u64 {
        let expected = format!("at most {n_points} rows, one per point of the map");
        return Err(Error::new(path, "", expected, table.n_rows().to_string()));
    }
    let key = Some("point");
    let lists = Lists::read(&table, key, "neighbors", n_points, n_points)?;
    let lists = lists.by_key(path, key, n_points)?;
    for point in 0..n_points {
        let own = ("point", point as u32);
        check_list(path, "neighbors", ("point", point), own, lists.of(point))?;
    }
    Ok(PointNeighborhoods { offsets: lists.offsets, neighbors: lists.ids, scores: lists.scores })
}

struct Lists {
    keys: Vec<u32>,
    offsets: Vec<u64>,
    ids: Vec<u32>,
    scores: Option<Vec<f32>>,
}

impl Lists {
    /// Reads the lists of ids below `n_ids` in `column`, the keys below `n_keys` in the column
    /// `key`, and `scores`, if present.
    fn read(
        table: &Table,
        key: Option<&str>,
        column: &str,
        n_keys: usize,
        n_ids: usize,
    ) -> Result<Self, Error> {
        let with_scores = table.has("scores");
        let mut columns = vec![(column, Type::Integers)];
        columns.extend(key.map(|key| (key, Type::Integer)));
        columns.extend(with_scores.then_some(("scores", Type::Floats)));
        let (mut keys, mut offsets, mut ids, mut scores) = (vec![], vec![0], vec![], vec![]);
        let mut n_unscored = 0;
        table.read(&columns, |batch| {
            if let Some(key) = key {
                keys.extend(batch.integers(key, n_keys as u64)?);
            }
            let first = offsets.len() - 1;
            // Ids are unique, so no list is longer than the number of ids.
            batch.integer_lists(column, n_ids as u64, n_ids as u64, &mut offsets, &mut ids)?;
            if !with_scores || batch.is_null("scores") {
                n_unscored += batch.len();
                return Ok(());
            }
            // Their lengths are compared with the lists, which are limited.
            let lengths = batch.float_lists("scores", u64::MAX, &mut scores)?;
            for (row, (length, ends)) in lengths.iter().zip(offsets[first..].windows(2)).enumerate()
            {
                let n = ends[1] - ends[0];
                if *length as u64 != n {
                    let expected = format!("{n} values, one for each of {column}");
                    return Err(batch.wrong("scores", row, expected, length.to_string()));
                }
            }
            Ok(())
        })?;
        let with_scores = with_scores && !table.is_without("scores", n_unscored)?;
        Ok(Self { keys, offsets, ids, scores: with_scores.then_some(scores) })
    }

    /// Sorts the lists by key, from 0 to `n - 1`. The list of a missing key is empty.
    fn by_key(self, path: &Path, key: Option<&str>, n: usize) -> Result<Self, Error> {
        let in_order = |keys: &[u32]| keys.iter().enumerate().all(|(row, &k)| row == k as usize);
        let Some(key) = key.filter(|_| self.keys.len() != n || !in_order(&self.keys)) else {
            return Ok(self);
        };
        let rows = rows_by_key(path, key, &self.keys, n)?;
        let mut sorted = Self {
            keys: Vec::new(),
            offsets: vec![0],
            ids: Vec::with_capacity(self.ids.len()),
            scores: self.scores.as_ref().map(|s| Vec::with_capacity(s.len())),
        };
        for row in rows {
            if let Some(row) = row {
                let range = self.range(row as usize);
                sorted.ids.extend_from_slice(&self.ids[range.clone()]);
                if let (Some(to), Some(scores)) = (&mut sorted.scores, &self.scores) {
                    to.extend_from_slice(&scores[range]);
                }
            }
            sorted.offsets.push(sorted.ids.len() as u64);
        }
        Ok(sorted)
    }

    fn of(&self, row: usize) -> &[u32] {
        &self.ids[self.range(row)]
    }

    fn range(&self, row: usize) -> Range<usize> {
        self.offsets[row] as usize..self.offsets[row + 1] as usize
    }
}

/// Returns an error if a list contains its own id, or an id twice. `of` and `own` are a word and a
/// number each.
fn check_list(
    path: &Path,
    column: &str,
    of: (&str, usize),
    own: (&str, u32),
    list: &[u32],
) -> Result<(), Error> {
    let wrong = |expected: String, found: String| {
        let place = format!("column {column}, {} {}", of.0, of.1);
        Err(Error::new(path, place, expected, found))
    };
    let word = own.0;
    if list.contains(&own.1) {
        let found = format!("its own {word} {}", own.1);
        return wrong(format!("other {word}s"), found);
    }
    let mut sorted = list.to_vec();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        None => Ok(()),
        Some(pair) => wrong(format!("each {word} once"), format!("{word} {} twice", pair[0])),
    }
}
