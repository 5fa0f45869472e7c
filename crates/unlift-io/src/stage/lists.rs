//! Neighborhoods: lists of records per slot, or of original points per point.

use std::path::Path;

use unlift::RecordId;
use unlift::neighbors::Neighborhoods;

use super::arrays::{Arrays, Class, NONE};
use super::kind::Kind;
use super::write::{Written, write_file};
use crate::Error;
use crate::atomic::Access;

/// Writes neighborhoods, one row per slot: `records` and, if present, `slots` and `scores`. Shorter lists end with -1 (and a score of NaN).
pub fn write_neighborhoods(path: &Path, neighborhoods: &Neighborhoods) -> Result<(), Error> {
    write_file(path, Access::Private, written(neighborhoods))
}

pub(super) fn written(lists: &Neighborhoods) -> Written<'_> {
    let (n, k) = (lists.n_slots(), lists.longest());
    let mut written = Written::new(Kind::Neighborhoods, n);
    written.state_about(lists.about());
    let records = (0..n).flat_map(move |slot| {
        let list = lists.of(slot).iter().map(|record| record.0 as i32);
        list.chain(std::iter::repeat(-1)).take(k)
    });
    written.array("records", &[n, k], records);
    if let Some(slots) = lists.slots() {
        let slots = lists.offsets().windows(2).flat_map(move |ends| {
            let list = slots[ends[0] as usize..ends[1] as usize].iter().map(|&slot| slot as i32);
            list.chain(std::iter::repeat(-1)).take(k)
        });
        written.array("slots", &[n, k], slots);
    }
    if lists.scores().is_some() {
        let scores = (0..n).flat_map(move |slot| {
            let scores = lists.scores_of(slot).unwrap_or_default().iter().copied();
            scores.chain(std::iter::repeat(f32::NAN)).take(k)
        });
        written.array("scores", &[n, k], scores);
    }
    written
}

/// Reads neighborhoods for a released map of `n_records` records with `slots_per_record` slots
/// each. Every slot has a row, in which -1 stands for no record.
///
/// # Errors
/// When the file differs from `docs/formats.md`, such as another number of rows than slots, or a
/// list with a record that is out of range, listed twice or the slot's own.
pub fn read_neighborhoods(
    path: &Path,
    n_records: usize,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    neighborhoods_of(&Arrays::open(path)?, n_records, slots_per_record)
}

pub(super) fn neighborhoods_of(
    arrays: &Arrays<'_>,
    n_records: usize,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    arrays.expect(Kind::Neighborhoods)?;
    let about = arrays.meta.about()?;
    let lists = lists_of(arrays, "records", n_records, slots_per_record)?;
    Ok(lists.with_about(about))
}

/// Reads neighborhoods of the `n_points` original points: `neighbors` and, optionally, `scores`. The
/// rows are in the order of points; -1 stands for no neighbor. A point is a record of one slot.
///
/// # Errors
/// When the file differs from `docs/formats.md`, such as a list with a point that is out of range, listed twice or the list's own.
pub fn read_point_neighborhoods(path: &Path, n_points: usize) -> Result<Neighborhoods, Error> {
    let arrays = Arrays::open(path)?;
    arrays.expect(Kind::PointNeighborhoods)?;
    lists_of(&arrays, "neighbors", n_points, 1)
}

/// Reads the lists in the array `name`.
fn lists_of(
    arrays: &Arrays<'_>,
    name: &str,
    n_records: usize,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    let n_rows = n_records * slots_per_record;
    let (ids, [_, k]) = arrays.integers(name, [Some(n_rows), None], n_records, true)?;
    let is_record = |id: &u32| *id != NONE;
    let scores = arrays.optional("scores", |name| {
        let single = |x: f64| Some(x as f32).filter(|x| !x.is_infinite());
        let sides = [Some(n_rows), Some(k)];
        let (given, _) = arrays.numbers(name, sides, Class::Any, "a number", single)?;
        let kept = given.into_iter().zip(&ids).filter(|(_, id)| is_record(id));
        Ok(kept.map(|(score, _)| score).collect())
    })?;
    let slots = arrays.optional("slots", |name| {
        let (given, _) = arrays.integers(name, [Some(n_rows), Some(k)], n_rows, true)?;
        let kept = given.into_iter().zip(&ids).filter(|(_, id)| is_record(id));
        Ok(kept.map(|(slot, _)| slot).collect())
    })?;
    let mut offsets = vec![0];
    for row in 0..n_rows {
        let n = ids[row * k..(row + 1) * k].iter().filter(|id| is_record(id)).count();
        offsets.push(offsets[row] + n as u64);
    }
    let records = ids.into_iter().filter(is_record).map(RecordId).collect();
    let lists = Neighborhoods::try_new(offsets, records, scores, n_records, slots_per_record);
    let lists = match slots {
        Some(slots) => lists.and_then(|lists| lists.with_slots(slots)),
        None => lists,
    };
    lists.map_err(|source| arrays.refused(source))
}
