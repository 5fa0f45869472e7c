//! Neighborhoods: lists of records per slot, or of original points per point.

use std::path::Path;

use unlift::RecordId;
use unlift::neighbors::Neighborhoods;

use super::arrays::{Arrays, Class, NONE};
use super::kind::Kind;
use super::write::{Written, write_file};
use crate::Error;
use crate::atomic::Access;

/// Writes neighborhoods, one row per slot: `records` and, if present, `scores`. Shorter lists end
/// with -1 (and a score of NaN).
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
    let lists = lists_of(arrays, ("records", "record"), n_records, slots_per_record)?;
    Ok(lists.with_about(about))
}

/// Reads neighborhoods of the `n_points` original points: `neighbors` and, optionally, `scores`. The
/// rows are in the order of points; -1 stands for no neighbor. A point is a record of one slot.
///
/// # Errors
/// When the file differs from `docs/formats.md`, such as a list with a point that is out of range,
/// listed twice or the list's own.
pub fn read_point_neighborhoods(path: &Path, n_points: usize) -> Result<Neighborhoods, Error> {
    let arrays = Arrays::open(path)?;
    arrays.expect(Kind::PointNeighborhoods)?;
    lists_of(&arrays, ("neighbors", "point"), n_points, 1)
}

/// Reads the lists in the array `name`, of records that are called `word`.
fn lists_of(
    arrays: &Arrays<'_>,
    (name, word): (&str, &str),
    n_records: usize,
    slots_per_record: usize,
) -> Result<Neighborhoods, Error> {
    let n_rows = n_records * slots_per_record;
    let (ids, [_, k]) = arrays.integers(name, [Some(n_rows), None], n_records, true)?;
    let given = arrays.optional("scores", |name| {
        let sides = [Some(n_rows), Some(k)];
        let single = |x: f64| Some(x as f32).filter(|x| !x.is_infinite());
        Ok(arrays.numbers(name, sides, Class::Any, "a number", single)?.0)
    })?;
    let (mut offsets, mut neighbors) = (vec![0], Vec::with_capacity(ids.len()));
    let mut scores = given.as_ref().map(|scores| Vec::with_capacity(scores.len()));
    for row in 0..n_rows {
        let first = neighbors.len();
        for at in row * k..(row + 1) * k {
            if ids[at] == NONE {
                continue;
            }
            neighbors.push(RecordId(ids[at]));
            if let (Some(to), Some(given)) = (&mut scores, &given) {
                if given[at].is_nan() {
                    let expected = format!("a score for each {word}");
                    return Err(arrays.wrong("scores", row, expected, "NaN"));
                }
                to.push(given[at]);
            }
        }
        let own = (row / slots_per_record) as u32;
        if neighbors[first..].contains(&RecordId(own)) {
            let found = format!("its own {word} {own}");
            return Err(arrays.wrong(name, row, format!("other {word}s"), found));
        }
        let mut sorted = neighbors[first..].to_vec();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            let found = format!("{word} {} twice", pair[0].0);
            return Err(arrays.wrong(name, row, format!("each {word} once"), found));
        }
        offsets.push(neighbors.len() as u64);
    }
    Neighborhoods::try_new(offsets, neighbors, scores, n_records, slots_per_record)
        .map_err(|source| arrays.refused(source))
}
