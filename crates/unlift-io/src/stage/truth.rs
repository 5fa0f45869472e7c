//! The owner's file: originals, and the slot that hides each of them.

use super::column::{Batch, Type, coordinate_names};
use super::header::{Kind, insert_fingerprint, new_meta};
use super::order::permutation;
use super::table::Table;
use super::write::{Written, write_table};
use crate::Error;
use crate::atomic::Access;
use arrow_array::StringArray;
use arrow_array::types::{Float64Type, UInt8Type, UInt32Type};
use arrow_schema::DataType::Utf8;
use arrow_schema::Field;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;
use unlift::truth::{DropReason, Dropped, Original, Secret};
use unlift::{OriginalId, PointSet};

/// Writes the ground truth of an obfuscation, one row per original point: first the slots in order,
/// then the dropped points with their reasons.
///
/// # Errors
/// When `secret` has another number of points, or the file cannot be written.
pub fn write_truth<const D: usize>(
    path: &Path,
    original: &Original<D>,
    secret: &Secret,
) -> Result<(), Error> {
    write_table((path, Access::Private), &written(path, original, secret)?)
}

pub(super) fn written<'a, const D: usize>(
    path: &Path,
    original: &'a Original<D>,
    secret: &'a Secret,
) -> Result<Written<'a>, Error> {
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
    let n_slots = secret.n_slots();
    let dropped = secret.dropped().iter().map(|d| d.original);
    let ids: Arc<[OriginalId]> = secret.hidden().iter().copied().chain(dropped).collect();
    let slot = move |row: usize| (row < n_slots).then_some(row);
    let mut written = Written::new(meta, points.len());
    written.optional_numbers::<UInt32Type>("slot", move |row| slot(row).map(|slot| slot as u32));
    let of_row = ids.clone();
    written.numbers::<UInt32Type>("original", move |row| of_row[row].0);
    for (axis, name) in coordinate_names::<D>("").into_iter().enumerate() {
        let of_row = ids.clone();
        let coordinate = move |row: usize| points.positions()[of_row[row].index()][axis];
        written.numbers::<Float64Type>(name, coordinate);
    }
    if let Some(axes) = secret.swapped_axis() {
        let axis = move |row| slot(row).map(|slot| axes[slot]);
        written.optional_numbers::<UInt8Type>("swapped_axis", axis);
    }
    let descriptor_row = move |row| slot(row).map(|slot| secret.descriptor_row()[slot]);
    written.optional_numbers::<UInt32Type>("descriptor_row", descriptor_row);
    written.column(Field::new("dropped", Utf8, true), move |rows| {
        let reason = |row: usize| Some(secret.dropped()[row.checked_sub(n_slots)?].reason.name());
        Arc::new(rows.map(reason).collect::<StringArray>())
    });
    Ok(written)
}

/// Reads the ground truth of an obfuscation of dimension `D` (see [`peek`](super::peek)).
///
/// Some columns are optional: `slot` and `original` if they equal the order of rows, `dropped` if
/// every point is in a record, `descriptor_row` if records have one slot.
///
/// # Errors
/// When the file differs from `docs/formats.md`.
pub fn read_truth<const D: usize>(path: &Path) -> Result<(Original<D>, Secret), Error> {
    truth_of(&Table::open_kind(path, Kind::Truth)?)
}

#[derive(Default)]
struct Rows<const D: usize> {
    originals: Vec<u32>,
    positions: Vec<[f64; D]>,
    /// The points that are in a record, in the order of rows.
    slots: Vec<u32>,
    hidden: Vec<OriginalId>,
    axes: Vec<u8>,
    descriptor_rows: Vec<Option<u32>>,
    dropped: Vec<Dropped>,
}

pub(super) fn truth_of<const D: usize>(table: &Table<'_>) -> Result<(Original<D>, Secret), Error> {
    let path = table.path();
    let core = |source| table.refused(source);
    table.expect_dimension::<D>()?;
    let unit = table.unit::<D>(None)?;
    let n_rows = table.n_rows();
    let coordinates = coordinate_names::<D>("");
    let optional = [
        ("slot", Type::Integer),
        ("original", Type::Integer),
        ("descriptor_row", Type::Integer),
        ("dropped", Type::Text),
        ("swapped_axis", Type::Integer),
    ];
    let mut columns = table.present(&optional);
    columns.extend(coordinates.iter().map(|name| (name.as_str(), Type::Float)));
    let declared = table.meta().count("slots_per_record")?;
    let with_axis = table.has("swapped_axis");
    let paired = declared.is_some_and(|slots| slots > 1) || table.has("descriptor_row");
    let mut rows = Rows::<D>::default();
    table.read(&columns, |batch| {
        batch.vectors(&coordinates, &mut rows.positions)?;
        read_rows(table, batch, paired, &mut rows)
    })?;
    let Rows { originals, positions, slots, hidden, axes, descriptor_rows, dropped } = rows;
    if let Some(&slot) = slots.iter().find(|&&slot| slot as usize >= slots.len()) {
        let expected = format!("slots below {}, the number of slots", slots.len());
        return Err(Error::new(path, "column slot", expected, slot.to_string()));
    }
    let order = permutation(path, "slot", &slots)?;
    let row_of = permutation(path, "original", &originals)?;
    let positions = row_of.iter().map(|&row| positions[row as usize]).collect();
    let points = PointSet::try_new(positions, unit).map_err(core)?;
    let own = |(slot, &at): (usize, &u32)| descriptor_rows[at as usize].unwrap_or(slot as u32);
    let secret = Secret::try_new(
        order.iter().map(|&at| hidden[at as usize]).collect(),
        with_axis.then(|| order.iter().map(|&at| axes[at as usize]).collect()),
        order.iter().enumerate().map(own).collect(),
        dropped,
        n_rows as usize,
    );
    let secret = secret.map_err(core)?;
    // Earlier versions did not state the number of slots; crossed descriptor rows imply two.
    let slots = declared.unwrap_or(secret.slots_per_record());
    let secret = secret.of_map(table.meta().fingerprint()?, slots).map_err(core)?;
    Ok((Original::new(points), secret))
}

fn read_rows<const D: usize>(
    table: &Table<'_>,
    batch: &Batch<'_>,
    paired: bool,
    to: &mut Rows<D>,
) -> Result<(), Error> {
    let n_rows = table.n_rows();
    let first = to.originals.len() as u32;
    let originals = match table.has("original") {
        true => batch.integers("original", n_rows)?,
        false => (first..first + batch.len() as u32).collect(),
    };
    let slot = batch.optional_integers("slot", n_rows)?;
    let descriptor_row = batch.optional_integers("descriptor_row", n_rows)?;
    let axis = batch.optional_integers("swapped_axis", D as u64)?;
    let reasons = batch.texts("dropped");
    for (row, &id) in originals.iter().enumerate() {
        let original = OriginalId(id);
        // Without slots, points that were not dropped are in the order of slots.
        let in_order =
            (!table.has("slot") && reasons[row].is_none()).then_some(to.slots.len() as u32);
        let Some(slot) = slot[row].or(in_order) else {
            let reason = reasons[row].and_then(DropReason::from_name);
            let names = || DropReason::ALL.map(DropReason::name).join(", ");
            let reason = reason.ok_or_else(|| {
                let expected = format!("one of {}, as slot is null", names());
                batch.wrong("dropped", row, expected, reasons[row].unwrap_or("null"))
            })?;
            to.dropped.push(Dropped { original, reason });
            continue;
        };
        if let Some(reason) = reasons[row] {
            return Err(batch.wrong("dropped", row, "null, as there is a slot", reason));
        }
        let needed = |name: &str, value: Option<u32>| {
            value.ok_or_else(|| batch.wrong(name, row, "a number, as there is a slot", "null"))
        };
        to.slots.push(slot);
        to.hidden.push(original);
        to.descriptor_rows.push(match paired {
            true => Some(needed("descriptor_row", descriptor_row[row])?),
            false => None,
        });
        if table.has("swapped_axis") {
            to.axes.push(needed("swapped_axis", axis[row])? as u8);
        }
    }
    to.originals.extend(originals);
    Ok(())
}
