//! Obfuscation: applies a scheme, then the steps that all schemes share (origin, shuffling).

use super::changed::Change;
use super::scheme::{LocalPoints, Scheme};
use crate::geometry::frame::{Bounds, rounded_origin};
use crate::geometry::vector::{quantile_of, sub};
use crate::released::Released;
use crate::seed::{Key, Stage};
use crate::truth::{Original, Secret};
use crate::{Descriptors, Error};

/// Hides `original`, whose rows `descriptors` have, with `scheme`. Returns the released map and the
/// secret. All randomness comes from `key`; use [`Key::fresh`] for a map that is released.
///
/// # Errors
/// When numbers of rows differ, the scheme fails, or coordinates cannot be worked with.
pub fn obfuscate<const D: usize>(
    scheme: &dyn Scheme<D>,
    original: &Original<D>,
    descriptors: Option<&Descriptors>,
    key: &Key,
) -> Result<(Released<D>, Secret), Error> {
    let points = original.reveal();
    let n = points.len();
    let n_rows = descriptors.map_or(n, Descriptors::len);
    Error::check_len("descriptors", n_rows, n, " rows, one per point")?;
    let mut changed = None;
    for change in scheme.changes() {
        if let (Some(rows), Change::Mitigation(by, _)) = (changed.as_ref().or(descriptors), change)
            && by.changes_descriptors()
        {
            changed = Some(by.descriptors(rows, key)?);
        }
    }
    let descriptors = changed.as_ref().or(descriptors);
    check_size(points.positions())?;
    // The center of known bounds reveals nothing about the points.
    let bounds = original.bounds();
    let origin =
        bounds.map_or_else(|| rounded_origin(points.positions()), |bounds| bounds.center());
    let local: Vec<[f64; D]> = points.positions().iter().map(|p| sub(p, &origin)).collect();
    let local = LocalPoints { positions: &local, bounds: bounds.map(|b| b.about(&origin)) };
    let lifted = scheme.lift(&local, key)?;

    let slots = lifted.slots_per_record;
    let n_records = lifted.obfuscation.len();
    let order = key.draws(Stage::Shuffle, 0).permutation(n_records);
    let (slot_key, row_key) = (key.stage(Stage::SlotOrder), key.stage(Stage::DescriptorOrder));
    let in_order = |axes: Vec<u8>| order.iter().map(|&from| axes[from as usize]).collect();
    let swapped_axis = lifted.swapped_axis.map(in_order);
    let (mut hidden, mut descriptor_row) = (Vec::new(), Vec::new());
    for (record, &from) in order.iter().enumerate() {
        let (from, to) = (from as usize, record * slots);
        hidden.extend_from_slice(&lifted.hidden[from * slots..][..slots]);
        descriptor_row.extend(to as u32..(to + slots) as u32);
        if slots > 1 {
            slot_key.draws(record as u64).shuffle(&mut hidden[to..]);
            row_key.draws(record as u64).shuffle(&mut descriptor_row[to..]);
        }
    }
    // Released row r holds the descriptor of the original whose slot was given row r.
    let mut source = vec![0; hidden.len()];
    for (slot, &row) in descriptor_row.iter().enumerate() {
        source[row as usize] = hidden[slot].0;
    }
    let protection = scheme.changes().into_iter().find_map(Change::protection);
    let protected = descriptors.zip(protection).map(|(rows, by)| by.protect(rows, key));
    let protected = protected.transpose()?;
    let plain = descriptors.filter(|_| protected.is_none()).map(|rows| rows.select(&source));
    let records = lifted.obfuscation.select(&order);
    let mut released = Released::try_new(records, slots, origin, points.unit(), plain)?;
    if let Some(protected) = protected {
        released = released.with_protected(protected.select(&source))?;
    }
    let released = released.with_bounds(bounds);
    let dropped = lifted.dropped;
    let secret = Secret::try_new(hidden, swapped_axis, descriptor_row, dropped, n, slots)?;
    let secret = secret.with_map(Some(released.fingerprint()));
    Ok((released, secret))
}

/// Allowed size of a map in its own unit: `f32` must represent cubes of lengths.
const SIZES: std::ops::RangeInclusive<f64> = 1e-10..=1e12;
/// Minimum size of a map, in steps between adjacent doubles.
const STEPS: f64 = 1e4;

/// Rejects maps from which little could be recovered because of their numbers.
fn check_size<const D: usize>(points: &[[f64; D]]) -> Result<(), Error> {
    // Quantiles ignore a few outliers.
    let Some(bounds) = Bounds::quantiles(points, 0.05) else { return Ok(()) };
    let size = bounds.longest_side();
    let middle = |c: usize| quantile_of(points.iter().map(|p| p[c]), 0.5).abs();
    let step = (0..D).map(middle).fold(0.0, f64::max) * f64::EPSILON;
    // Coincident points differ by rounding only.
    if size <= 4.0 * step {
        return Ok(());
    }
    if !SIZES.contains(&size) {
        let (least, most) = (SIZES.start(), SIZES.end());
        let expected =
            format!("a size between {least:e} and {most:e} units (use another unit or scale)");
        return Err(Error::new("map", expected, format!("{size:.1e}")));
    }
    if size < STEPS * step {
        let expected = "coordinates nearer to the origin: doubles there are too coarse for a map";
        let found = format!("steps of {step:.1e} in a size of {size:.1e}");
        return Err(Error::new("map", expected, found));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_that_cannot_be_worked_with_are_refused() {
        let line = |from: f64, step: f64| -> Vec<[f64; 3]> {
            (0..100).map(|i| [from + step * f64::from(i), from, 0.0]).collect()
        };
        let usual = [(0.0, 0.1), (5e6, 0.01), (0.0, 1e-9), (-1e9, 1.0), (1e15, 0.0), (0.0, 1e9)];
        let refused = [(0.0, 1e-14), (0.0, 1e11), (1e15, 0.1)];
        for (from, step) in usual.into_iter().chain(refused) {
            let is_usual = usual.contains(&(from, step));
            assert_eq!(check_size(&line(from, step)).is_ok(), is_usual, "{from} {step}");
        }
        let far = [line(0.0, 0.1), vec![[1e30; 3]]].concat();
        assert!(check_size(&far).is_ok() && check_size::<2>(&[]).is_ok());
    }
}
