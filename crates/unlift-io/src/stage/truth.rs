//! The owner's file: originals, and the slot that hides each of them.

use std::path::Path;

use unlift::truth::{DropReason, Dropped, Original, Secret};
use unlift::{OriginalId, PointSet};

use super::arrays::{Arrays, NONE};
use super::kind::Kind;
use super::write::{Written, write_file};
use crate::Error;
use crate::atomic::Access;

/// Writes the ground truth of an obfuscation, one row per original point.
///
/// # Errors
/// When `secret` has another number of points.
pub fn write_truth<const D: usize>(
    path: &Path,
    original: &Original<D>,
    secret: &Secret,
) -> Result<(), Error> {
    write_file(path, Access::Private, written(path, original, secret)?)
}

pub(super) fn written<'a, const D: usize>(
    path: &Path,
    original: &'a Original<D>,
    secret: &Secret,
) -> Result<Written<'a>, Error> {
    let points = original.reveal();
    let n = secret.n_originals();
    if points.len() != n {
        return Err(Error::new(path, "", format!("{n} originals, as in the secret"), points.len()));
    }
    let mut written = Written::new(Kind::Truth, n);
    written.state("unit", points.unit().name());
    written.state("slots_per_record", secret.slots_per_record());
    written.state("fingerprint", secret.map().map(|map| map.to_string()));
    written.vectors("position", points.positions());
    // Returns a value of each slot in the order of originals, -1 for dropped ones.
    let by_original = |of_slot: &dyn Fn(usize) -> i32| {
        let mut values = vec![-1; n];
        for (slot, original) in secret.hidden().iter().enumerate() {
            values[original.index()] = of_slot(slot);
        }
        values.into_iter()
    };
    written.array("slot", &[n], by_original(&|slot| slot as i32));
    if !secret.dropped().is_empty() {
        let mut reasons = vec![0u8; n];
        for dropped in secret.dropped() {
            let code = DropReason::ALL.iter().position(|reason| *reason == dropped.reason);
            reasons[dropped.original.index()] = 1 + code.unwrap_or_default() as u8;
        }
        written.array("dropped", &[n], reasons.into_iter());
    }
    if let Some(axes) = secret.swapped_axis() {
        let axes = by_original(&|slot| axes[slot].into()).map(|axis| axis as i8);
        written.array("swapped_axis", &[n], axes);
    }
    if secret.slots_per_record() > 1 {
        let rows = by_original(&|slot| secret.descriptor_row()[slot] as i32);
        written.array("descriptor_row", &[n], rows);
    }
    Ok(written)
}

/// Reads the ground truth of an obfuscation of dimension `D`.
///
/// Some arrays are optional: `slot` if the originals are in the order of slots, `dropped` if the
/// reasons are unknown, `descriptor_row` if records have one slot.
pub fn read_truth<const D: usize>(path: &Path) -> Result<(Original<D>, Secret), Error> {
    truth_of(&Arrays::open(path)?)
}

pub(super) fn truth_of<const D: usize>(
    arrays: &Arrays<'_>,
) -> Result<(Original<D>, Secret), Error> {
    arrays.expect(Kind::Truth)?;
    let core = |source| arrays.refused(source);
    let unit = arrays.meta.unit::<D>(None)?;
    let positions = arrays.vectors("position", None)?;
    let n = positions.len();
    let slot = arrays.column("slot", n, n, true)?.unwrap_or_else(|| (0..n as u32).collect());
    let n_slots = slot.iter().filter(|&&slot| slot != NONE).count();
    let mut hidden = vec![NONE; n_slots];
    for (original, &slot) in slot.iter().enumerate().filter(|(_, slot)| **slot != NONE) {
        match hidden.get_mut(slot as usize) {
            Some(place) if *place == NONE => *place = original as u32,
            Some(earlier) => {
                let found = format!("{slot} as in row {earlier}");
                return Err(arrays.wrong("slot", original, "each slot once", found));
            }
            None => {
                let expected = format!("slots below {n_slots}, the number of slots");
                return Err(arrays.wrong("slot", original, expected, slot));
            }
        }
    }
    // Returns an array of a number below `below` per hidden point, in the order of slots.
    let by_slot = |name: &str, below: usize| -> Result<Option<Vec<u32>>, Error> {
        let Some(values) = arrays.column(name, n, below, true)? else { return Ok(None) };
        for (original, (value, slot)) in values.iter().zip(&slot).enumerate() {
            if (*value == NONE) != (*slot == NONE) {
                let (expected, found) = match *slot {
                    NONE => ("-1, as there is no slot", value.to_string()),
                    _ => ("a number, as there is a slot", "-1".to_owned()),
                };
                return Err(arrays.wrong(name, original, expected, found));
            }
        }
        Ok(Some(hidden.iter().map(|&original| values[original as usize]).collect()))
    };
    let axes =
        by_slot("swapped_axis", D)?.map(|axes| axes.into_iter().map(|axis| axis as u8).collect());
    let slots = arrays.meta.slots_per_record()?;
    let rows = match by_slot("descriptor_row", n)? {
        Some(rows) => rows,
        None if slots == Some(2) => {
            let expected = "the descriptor row of each point, as records have two slots";
            let (place, found) = ("array descriptor_row", "no such array");
            return Err(Error::new(arrays.path, place, expected, found));
        }
        None => (0..n_slots as u32).collect(),
    };
    let dropped = dropped(arrays, &slot)?;
    let hidden = hidden.into_iter().map(OriginalId).collect();
    // Crossed descriptor rows imply two slots.
    let are_crossed = || rows.iter().enumerate().any(|(slot, &row)| row as usize != slot);
    let slots = slots.unwrap_or_else(|| 1 + usize::from(are_crossed()));
    let secret = Secret::try_new(hidden, axes, rows, dropped, n, slots).map_err(core)?;
    let secret = secret.with_map(arrays.meta.fingerprint()?);
    let points = PointSet::try_new(positions, unit).map_err(core)?;
    Ok((Original::new(points), secret))
}

/// Returns the originals without a slot, with their reasons.
fn dropped(arrays: &Arrays<'_>, slot: &[u32]) -> Result<Vec<Dropped>, Error> {
    let reasons = arrays.column("dropped", slot.len(), 1 + DropReason::ALL.len(), false)?;
    let mut dropped = Vec::new();
    for (original, &slot) in slot.iter().enumerate() {
        let code = reasons.as_ref().map(|reasons| reasons[original] as usize);
        let reason = match (slot, code) {
            (NONE, None) => DropReason::Other,
            (NONE, Some(0)) => {
                let expected = "the code of a reason, as there is no slot";
                return Err(arrays.wrong("dropped", original, expected, "0"));
            }
            (NONE, Some(code)) => DropReason::ALL[code - 1],
            (_, None | Some(0)) => continue,
            (_, Some(code)) => {
                return Err(arrays.wrong("dropped", original, "0, as there is a slot", code));
            }
        };
        dropped.push(Dropped { original: OriginalId(original as u32), reason });
    }
    Ok(dropped)
}
