//! The owner's file: originals, and which slot hides which.

use super::column::{Type, coordinate_names};
use super::header::{Kind, insert_fingerprint, new_meta, to_text};
use super::order::permutation;
use super::table::Table;
use super::write::{field, numbers, optional_numbers, write_table};
use crate::Error;
use crate::atomic::Access;
use arrow_array::types::{Float64Type, UInt8Type, UInt32Type};
use arrow_array::{ArrayRef, StringArray};
use arrow_schema::DataType::{Float64, UInt8, UInt32, Utf8};
use arrow_schema::Field;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;
use unlift::truth::{DropReason, Dropped, Original, Secret};
use unlift::{OriginalId, PointSet};

/// Writes the truth of an obfuscation, one row per original point: first the slots in their order,
/// then the points that were dropped, with their reason.
///
/// # Errors
/// When `secret` is about another number of points, or the file cannot be written.
pub fn write_truth<const D: usize>(
    path: &Path,
    original: &Original<D>,
    secret: &Secret,
) -> Result<(), Error> {
    let points = original.reveal();
    if points.len() != secret.n_originals() {
        let expected = format!("{} originals, as in the secret", secret.n_originals());
        return Err(Error::new(path, "", expected, points.len().to_string()));
    }
    let mut meta = new_meta(Kind::Truth);
    meta.insert("dimension".into(), json!(D));
    meta.insert("unit".into(), json!(points.unit().name()));
    meta.insert("slots_per_record".into(), json!(secret.slots_per_record()));
    insert_fingerprint(&mut meta, secret.map());
    let mut fields = vec![Field::new("slot", UInt32, true), field("original", UInt32)];
    fields.extend(coordinate_names::<D>("").map(|name| field(name, Float64)));
    if secret.swapped_axis().is_some() {
        fields.push(Field::new("swapped_axis", UInt8, true));
    }
    fields.push(Field::new("descriptor_row", UInt32, true));
    fields.push(Field::new("dropped", Utf8, true));
    let n_slots = secret.n_slots();
    let dropped = secret.dropped().iter().map(|d| d.original);
    let ids: Vec<OriginalId> = secret.hidden().iter().copied().chain(dropped).collect();
    write_table((path, Access::Private), to_text(meta), fields, points.len(), |rows| {
        let slot = |row: usize| (row < n_slots).then_some(row);
        let mut columns = vec![
            optional_numbers::<UInt32Type>(rows.clone().map(|row| slot(row).map(|s| s as u32))),
            numbers::<UInt32Type>(ids[rows.clone()].iter().map(|id| id.0)),
        ];
        columns.extend((0..D).map(|axis| {
            let ids = ids[rows.clone()].iter();
            numbers::<Float64Type>(ids.map(|id| points.positions()[id.index()][axis]))
        }));
        if let Some(axes) = secret.swapped_axis() {
            let axes = rows.clone().map(|row| slot(row).map(|s| axes[s]));
            columns.push(optional_numbers::<UInt8Type>(axes));
        }
        let descriptor_rows = rows.clone().map(|row| slot(row).map(|s| secret.descriptor_row()[s]));
        columns.push(optional_numbers::<UInt32Type>(descriptor_rows));
        let reasons =
            rows.map(|row| Some(secret.dropped()[row.checked_sub(n_slots)?].reason.name()));
        columns.push(Arc::new(reasons.collect::<StringArray>()) as ArrayRef);
        columns
    })
}

/// Reads the truth of an obfuscation of dimension `D` (see [`peek`](super::peek)): the owner's side
/// only.
///
/// # Errors
/// When the file is not as `docs/formats.md` describes it.
pub fn read_truth<const D: usize>(path: &Path) -> Result<(Original<D>, Secret), Error> {
    let core = |source| Error::core(path, source);
    let table = Table::open_kind(path, Kind::Truth)?;
    table.meta().expect_dimension::<D>()?;
    let unit = table.meta().unit()?;
    let n_rows = table.n_rows();
    let with_axis = table.has("swapped_axis");
    let coordinates = coordinate_names::<D>("");
    let mut columns = vec![
        ("slot", Type::Integer),
        ("original", Type::Integer),
        ("descriptor_row", Type::Integer),
        ("dropped", Type::Text),
    ];
    columns.extend(coordinates.iter().map(|name| (name.as_str(), Type::Float)));
    if with_axis {
        columns.push(("swapped_axis", Type::Integer));
    }
    let (mut originals, mut positions) = (Vec::new(), Vec::new());
    let (mut slots, mut hidden, mut axes, mut rows) = (vec![], vec![], vec![], vec![]);
    let mut dropped = Vec::new();
    table.read(&columns, |batch| {
        let ids = batch.integers("original", n_rows)?;
        batch.vectors(&coordinates, &mut positions)?;
        let slot = batch.optional_integers("slot", n_rows)?;
        let descriptor_row = batch.optional_integers("descriptor_row", n_rows)?;
        let axis = match with_axis {
            true => batch.optional_integers("swapped_axis", D as u64)?,
            false => vec![None; batch.len()],
        };
        let reasons = batch.texts("dropped");
        for (row, &id) in ids.iter().enumerate() {
            let original = OriginalId(id);
            let Some(slot) = slot[row] else {
                let reason = reasons[row].and_then(DropReason::from_name);
                let names = || DropReason::ALL.map(DropReason::name).join(", ");
                let reason = reason.ok_or_else(|| {
                    let expected = format!("one of {}, as slot is null", names());
                    batch.wrong("dropped", row, expected, reasons[row].unwrap_or("null"))
                })?;
                dropped.push(Dropped { original, reason });
                continue;
            };
            if let Some(reason) = reasons[row] {
                return Err(batch.wrong("dropped", row, "null, as there is a slot", reason));
            }
            let needed = |name: &str, value: Option<u32>| {
                value.ok_or_else(|| batch.wrong(name, row, "a number, as there is a slot", "null"))
            };
            slots.push(slot);
            hidden.push(original);
            rows.push(needed("descriptor_row", descriptor_row[row])?);
            if with_axis {
                axes.push(needed("swapped_axis", axis[row])? as u8);
            }
        }
        originals.extend(ids);
        Ok(())
    })?;
    if let Some(&slot) = slots.iter().find(|&&slot| slot as usize >= slots.len()) {
        let expected = format!("slots below {}, as many have one", slots.len());
        return Err(Error::new(path, "column slot", expected, slot.to_string()));
    }
    let order = permutation(path, "slot", &slots)?;
    let row_of = permutation(path, "original", &originals)?;
    let positions = row_of.iter().map(|&row| positions[row as usize]).collect();
    let points = PointSet::try_new(positions, unit).map_err(core)?;
    let secret = Secret::try_new(
        order.iter().map(|&at| hidden[at as usize]).collect(),
        with_axis.then(|| order.iter().map(|&at| axes[at as usize]).collect()),
        order.iter().map(|&at| rows[at as usize]).collect(),
        dropped,
        n_rows as usize,
    );
    let secret = secret.map_err(core)?;
    // Files of earlier versions do not say: where descriptor rows are crossed, records hide two points.
    let slots = match table.meta().count("slots_per_record")? {
        None => secret.slots_per_record(),
        Some(slots) => slots,
    };
    let secret = secret.of_map(table.meta().fingerprint()?, slots).map_err(core)?;
    Ok((Original::new(points), secret))
}
