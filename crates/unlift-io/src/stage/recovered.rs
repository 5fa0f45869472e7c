//! Recovered points: a position or a reason per slot.

use super::column::{Batch, Type, coordinate_names};
use super::header::{Kind, insert_about, new_meta};
use super::order::permutation;
use super::table::Table;
use super::write::{Written, write_table};
use crate::Error;
use crate::atomic::Access;
use arrow_array::StringArray;
use arrow_array::types::{Float32Type, Float64Type, UInt8Type, UInt16Type, UInt32Type};
use arrow_schema::DataType::Utf8;
use arrow_schema::Field;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;
use unlift::Unit;
use unlift::recover::{Confidence, Estimate, Recovered, Status, Unknown};

/// The reason why confidence is unknown.
const WHY_UNKNOWN: &str = "confidence_unknown";

/// Writes recovered points, one row per slot. Positions are in the map's frame (the origin is
/// added).
///
/// Adding the origin loses digits of points that are closer to it than 2^-29 of its size (2 mm at
/// coordinates of 10^6 m), by at most 10^-10 m. No position in the map's frame changes.
///
/// # Errors
/// When an evidence or delta is not finite, or the file cannot be written.
pub fn write_recovered<const D: usize>(path: &Path, recovered: &Recovered<D>) -> Result<(), Error> {
    write_table((path, Access::Private), &written(path, recovered)?)
}

pub(super) fn written<'a, const D: usize>(
    path: &Path,
    recovered: &'a Recovered<D>,
) -> Result<Written<'a>, Error> {
    let finite = |x: &f32| x.is_finite();
    if let Some(slot) = recovered.evidence().iter().position(|x| !finite(x)) {
        let found = recovered.evidence()[slot].to_string();
        let place = format!("column evidence, row {slot}");
        return Err(Error::new(path, place, "a finite number", found));
    }
    if !(recovered.delta().is_finite() && recovered.delta() >= 0.0) {
        let found = recovered.delta().to_string();
        return Err(Error::new(path, "delta", "a number of at least 0", found));
    }
    let mut meta = new_meta(Kind::Recovered);
    meta.insert("dimension".into(), json!(D));
    meta.insert("origin".into(), json!(recovered.origin().to_vec()));
    meta.insert("unit".into(), json!(recovered.unit().name()));
    meta.insert("delta".into(), json!(recovered.delta()));
    insert_about(&mut meta, recovered.about());
    let unknown = recovered.confidence_unknown().filter(|&why| why != Unknown::NotGiven);
    meta.extend(unknown.map(|why| (WHY_UNKNOWN.to_owned(), json!(why.name()))));
    let mut written = Written::new(meta, recovered.n_slots());
    written.numbers::<UInt32Type>("slot", |slot| slot as u32);
    for (axis, name) in coordinate_names::<D>("").into_iter().enumerate() {
        let coordinate = move |slot| recovered.position(slot).map(|position| position[axis]);
        written.optional_numbers::<Float64Type>(name, coordinate);
    }
    written.column(Field::new("status", Utf8, false), |slots| {
        let names = recovered.status()[slots].iter().map(|status| status.name());
        Arc::new(StringArray::from_iter_values(names))
    });
    written.numbers::<UInt16Type>("support", |slot| recovered.support()[slot]);
    written.numbers::<Float32Type>("evidence", |slot| recovered.evidence()[slot]);
    if let Some(confidence) = recovered.confidence() {
        written.numbers::<Float32Type>("found", |slot| confidence[slot].found);
        // A lost slot has no error scale.
        let scale = |slot: usize| Some(confidence[slot].scale).filter(|scale| scale.is_finite());
        written.optional_numbers::<Float32Type>("error_scale", scale);
    }
    if let Some(axis) = recovered.axis() {
        written.numbers::<UInt8Type>("axis", |slot| axis[slot]);
    }
    if let Some(row) = recovered.descriptor_row() {
        written.numbers::<UInt32Type>("descriptor_row", |slot| row[slot]);
    }
    Ok(written)
}

/// Reads recovered points of dimension `D` (see [`peek`](super::peek)).
///
/// Only the coordinates are required. Without `status`, a point is `ok`, or `no_support` if its
/// coordinates are null or NaN; `support` and `evidence` default to 0. Confidence requires both of
/// its columns. Rows are in the order of slots, or in any order if there is a column `slot`.
///
/// # Errors
/// When the file differs from `docs/formats.md`.
pub fn read_recovered<const D: usize>(path: &Path) -> Result<Recovered<D>, Error> {
    let table = Table::open_kind(path, Kind::Recovered)?;
    recovered_of(&table, None)
}

/// Reads recovered points like [`read_recovered`], with `unit` as the default unit.
///
/// # Errors
/// When [`read_recovered`] would fail for another reason than a missing unit.
pub fn read_recovered_in<const D: usize>(path: &Path, unit: Unit) -> Result<Recovered<D>, Error> {
    let table = Table::open_kind(path, Kind::Recovered)?;
    recovered_of(&table, Some(unit))
}

pub(super) fn recovered_of<const D: usize>(
    table: &Table<'_>,
    usual: Option<Unit>,
) -> Result<Recovered<D>, Error> {
    let path = table.path();
    let meta = table.meta();
    table.expect_dimension::<D>()?;
    let (origin, unit) = (meta.origin::<D>()?, table.unit::<D>(usual)?);
    let delta = meta.number_or_0("delta")?;
    let about = meta.about()?;
    let coordinates = coordinate_names::<D>("");
    let optional = [
        ("slot", Type::Integer),
        ("status", Type::Text),
        ("support", Type::Integer),
        ("evidence", Type::Float),
        ("found", Type::Float),
        ("error_scale", Type::Float),
        ("axis", Type::Integer),
        ("descriptor_row", Type::Integer),
    ];
    let mut columns = table.present(&optional);
    columns.extend(coordinates.iter().map(|name| (name.as_str(), Type::Float)));
    let mut estimates: Vec<Estimate<D>> = Vec::new();
    let (mut slots, mut rows): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
    let mut confidence: Vec<Confidence> = Vec::new();
    let with_confidence = table.has("found") && table.has("error_scale");
    let why_unknown = match meta.optional_text(WHY_UNKNOWN)? {
        None => Unknown::NotGiven,
        Some(name) => Unknown::from_name(&name).ok_or_else(|| {
            let names = Unknown::ALL.map(Unknown::name);
            meta.wrong(WHY_UNKNOWN, format!("one of {}", names.join(", ")))
        })?,
    };
    let n_slots = table.n_rows();
    table.read(&columns, |batch| {
        if table.has("slot") {
            slots.extend(batch.integers("slot", n_slots)?);
        }
        if table.has("descriptor_row") {
            rows.extend(batch.integers("descriptor_row", n_slots)?);
        }
        let first = estimates.len();
        read_estimates(table, batch, &coordinates, &origin, &mut estimates)?;
        match with_confidence {
            true => read_confidence(batch, &estimates[first..], &mut confidence),
            false => Ok(()),
        }
    })?;
    if table.has("slot") {
        let order = permutation(path, "slot", &slots)?;
        estimates = order.iter().map(|&row| estimates[row as usize]).collect();
        if with_confidence {
            confidence = order.iter().map(|&row| confidence[row as usize]).collect();
        }
        if !rows.is_empty() {
            rows = order.iter().map(|&row| rows[row as usize]).collect();
        }
    }
    let rows = table.has("descriptor_row").then_some(rows);
    let with_axis = table.has("axis");
    Recovered::try_new(&estimates, with_axis, rows, origin, unit, delta)
        .and_then(|recovered| match with_confidence {
            true => recovered.with_confidence(confidence),
            false => Ok(recovered.without_confidence(why_unknown)),
        })
        .map(|recovered| recovered.with_about(about))
        .map_err(|source| table.refused(source))
}

/// Appends the confidence of one batch to `to`. It may be null for lost points.
fn read_confidence<const D: usize>(
    batch: &Batch<'_>,
    estimates: &[Estimate<D>],
    to: &mut Vec<Confidence>,
) -> Result<(), Error> {
    let (found, scale) = (batch.optional_floats("found")?, batch.optional_floats("error_scale")?);
    for (row, (found, scale)) in found.into_iter().zip(scale).enumerate() {
        let found = match found {
            None if estimates[row].status != Status::Ok => 0.0,
            None => return Err(batch.wrong("found", row, "a probability", "null")),
            Some(found) if (0.0..=1.0).contains(&found) => found,
            Some(found) => {
                return Err(batch.wrong("found", row, "a probability", found.to_string()));
            }
        };
        if let Some(negative) = scale.filter(|&scale| scale < 0.0) {
            return Err(batch.wrong("error_scale", row, "a length", negative.to_string()));
        }
        let scale = scale.map_or(f32::INFINITY, |scale| scale as f32);
        to.push(Confidence { found: found as f32, scale });
    }
    Ok(())
}

fn read_estimates<const D: usize>(
    table: &Table<'_>,
    batch: &Batch<'_>,
    coordinates: &[String; D],
    origin: &[f64; D],
    to: &mut Vec<Estimate<D>>,
) -> Result<(), Error> {
    let mut position: [Vec<Option<f64>>; D] = std::array::from_fn(|_| Vec::new());
    for (column, name) in position.iter_mut().zip(coordinates) {
        *column = batch.optional_floats(name)?;
    }
    let status = batch.texts("status");
    let support = batch.optional_integers("support", 1 << 16)?;
    let axis = batch.optional_integers("axis", D as u64)?;
    let evidence = batch.optional_floats("evidence")?;
    for row in 0..batch.len() {
        let found = position[0][row].is_some();
        let mut about_origin = [f32::NAN; D];
        for (at, name) in coordinates.iter().enumerate() {
            match position[at][row] {
                Some(x) if found => {
                    about_origin[at] = (x - origin[at]) as f32;
                    if !about_origin[at].is_finite() {
                        let expected = "a number in the range of f32 about the origin";
                        return Err(batch.wrong(name, row, expected, format!("{x:?}")));
                    }
                }
                None if !found => {}
                Some(x) => return Err(batch.wrong(name, row, "null as in x", x.to_string())),
                None => return Err(batch.wrong(name, row, "a number as in x", "null")),
            }
        }
        if found && table.has("axis") && axis[row].is_none() {
            let expected = format!("a whole number below {D}, as there is a position");
            return Err(batch.wrong("axis", row, expected, "null"));
        }
        to.push(Estimate {
            position: about_origin,
            status: read_status(batch, row, status[row], found)?,
            support: support[row].unwrap_or(0) as u16,
            axis: axis[row].unwrap_or(0) as u8,
            evidence: evidence[row].unwrap_or(0.0) as f32,
        });
    }
    Ok(())
}

fn read_status(
    batch: &Batch<'_>,
    row: usize,
    name: Option<&str>,
    has_position: bool,
) -> Result<Status, Error> {
    let Some(name) = name else {
        return Ok(if has_position { Status::Ok } else { Status::NoSupport });
    };
    let wrong = |expected: String| batch.wrong("status", row, expected, name);
    let Some(status) = Status::from_name(name) else {
        let names = Status::ALL.map(Status::name).join(", ");
        return Err(wrong(format!("one of {names}")));
    };
    match (status == Status::Ok, has_position) {
        (true, false) => Err(wrong("a reason, as x is null".into())),
        (false, true) => Err(wrong("ok, as x is not null".into())),
        _ => Ok(status),
    }
}
