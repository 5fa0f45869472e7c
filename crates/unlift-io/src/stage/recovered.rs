//! Recovered points: a position or a reason per slot.

use std::path::Path;

use unlift::Unit;
use unlift::recover::{Confidence, Estimate, Recovered, Status, Unknown};

use super::arrays::{Arrays, Class, NONE};
use super::kind::Kind;
use super::meta::WHY_UNKNOWN;
use super::write::{Written, write_file};
use crate::Error;
use crate::atomic::Access;

/// Writes recovered points, one row per slot. Positions are in the map's frame (the origin is added).
///
/// Adding the origin loses digits of points that are closer to it than 2^-29 of its size (2 mm at
/// coordinates of 10^6 m), by at most 10^-10 m. No position in the map's frame changes.
///
/// # Errors
/// When an evidence or delta is not finite.
pub fn write_recovered<const D: usize>(path: &Path, recovered: &Recovered<D>) -> Result<(), Error> {
    write_file(path, Access::Private, written(path, recovered)?)
}

pub(super) fn written<'a, const D: usize>(
    path: &Path,
    recovered: &'a Recovered<D>,
) -> Result<Written<'a>, Error> {
    if let Some(slot) = recovered.evidence().iter().position(|x| !x.is_finite()) {
        let found = recovered.evidence()[slot].to_string();
        let place = format!("array evidence, row {slot}");
        return Err(Error::new(path, place, "a finite number", found));
    }
    if !(recovered.delta().is_finite() && recovered.delta() >= 0.0) {
        let found = recovered.delta().to_string();
        return Err(Error::new(path, "delta", "a number of at least 0", found));
    }
    let n = recovered.n_slots();
    let mut written = Written::new(Kind::Recovered, n);
    written.state("unit", recovered.unit().name());
    written.state("delta", recovered.delta());
    written.state_about(recovered.about());
    let unknown = recovered.confidence_unknown().filter(|&why| why != Unknown::NotGiven);
    written.state(WHY_UNKNOWN, unknown.map(Unknown::name));
    let positions = (0..n).flat_map(|slot| recovered.position(slot).unwrap_or([f64::NAN; D]));
    written.array("position", &[n, D], positions);
    written.array("status", &[n], recovered.status().iter().map(|&status| status as u8));
    written.array("support", &[n], recovered.support().iter().copied());
    written.array("evidence", &[n], recovered.evidence().iter().copied());
    if let Some(confidence) = recovered.confidence() {
        written.array("found", &[n], confidence.iter().map(|confidence| confidence.found));
        written.array("error_scale", &[n], confidence.iter().map(|confidence| confidence.scale));
    }
    if let Some(axis) = recovered.axis() {
        let axis = axis.iter().zip(recovered.status());
        let axis = axis.map(|(&axis, &status)| if status == Status::Ok { axis as i8 } else { -1 });
        written.array("axis", &[n], axis);
    }
    if let Some(rows) = recovered.descriptor_row() {
        written.array("descriptor_row", &[n], rows.iter().map(|&row| row as i32));
    }
    written.array("origin", &[D], recovered.origin().into_iter());
    Ok(written)
}

/// Reads recovered points of dimension `D`, in `usual` units unless the file states others.
///
/// Only `position` is required. Without `status`, a point is recovered, or without support if its
/// coordinates are NaN; `support` and `evidence` default to 0. Confidence requires both of its arrays.
pub fn read_recovered<const D: usize>(
    path: &Path,
    usual: Option<Unit>,
) -> Result<Recovered<D>, Error> {
    recovered_of(&Arrays::open(path)?, usual)
}

pub(super) fn recovered_of<const D: usize>(
    arrays: &Arrays<'_>,
    usual: Option<Unit>,
) -> Result<Recovered<D>, Error> {
    arrays.expect(Kind::Recovered)?;
    let (meta, unit) = (&arrays.meta, arrays.meta.unit::<D>(usual)?);
    let delta = meta.number("delta")?;
    let about = meta.about()?;
    let why_unknown = match meta.text(WHY_UNKNOWN)? {
        None => Unknown::NotGiven,
        Some(name) => Unknown::named(name).ok_or_else(|| {
            let names = Unknown::ALL.map(Unknown::name);
            meta.wrong(WHY_UNKNOWN, format!("one of {}", names.join(", ")))
        })?,
    };
    let origin = arrays.origin()?;
    let estimates = estimates(arrays, &origin)?;
    let n = estimates.len();
    let has_confidence = arrays.has("found") || arrays.has("error_scale");
    let confidence = has_confidence.then(|| confidence(arrays, &estimates)).transpose()?;
    let rows = arrays.column("descriptor_row", n, n, false)?;
    Recovered::try_new(&estimates, arrays.has("axis"), rows, origin, unit, delta)
        .and_then(|recovered| match confidence {
            Some(confidence) => recovered.with_confidence(confidence),
            None => Ok(recovered.without_confidence(why_unknown)),
        })
        .map(|recovered| recovered.with_about(about))
        .map_err(|source| arrays.refused(source))
}

fn estimates<const D: usize>(
    arrays: &Arrays<'_>,
    origin: &[f64; D],
) -> Result<Vec<Estimate<D>>, Error> {
    let in_range = |x: f64| Some(x).filter(|x| !(*x as f32).is_infinite());
    let rule = "a number in the range of f32, or NaN if lost";
    let sides = [None, Some(D)];
    let (values, [n, _]) = arrays.numbers("position", sides, Class::Any, rule, in_range)?;
    let positions: &[[f64; D]] = values.as_chunks().0;
    let status = arrays.column("status", n, Status::ALL.len(), false)?;
    let support = arrays.column("support", n, 1 << 16, false)?;
    let axis = arrays.column("axis", n, D, true)?;
    let evidence = arrays.optional("evidence", |name| {
        let single = |x: f64| Some(x as f32).filter(|x| x.is_finite());
        Ok(arrays.numbers(name, [Some(n)], Class::Any, "a finite number", single)?.0)
    })?;
    let estimate = |(slot, position): (usize, &[f64; D])| {
        let has_position = !position[0].is_nan();
        if position.iter().any(|x| x.is_nan() == has_position) {
            let expected = format!("{D} numbers, or {D} NaN if lost");
            return Err(arrays.wrong("position", slot, expected, format!("{position:?}")));
        }
        let usual = if has_position { Status::Ok } else { Status::NoSupport };
        let status = status.as_ref().map_or(usual, |codes| Status::ALL[codes[slot] as usize]);
        let axis = match axis.as_ref().map(|axis| axis[slot]) {
            Some(NONE) if has_position => {
                return Err(arrays.wrong("axis", slot, "an axis, as there is a position", "-1"));
            }
            None | Some(NONE) => 0,
            Some(axis) => axis as u8,
        };
        Ok(Estimate {
            position: std::array::from_fn(|at| (position[at] - origin[at]) as f32),
            status,
            support: support.as_ref().map_or(0, |support| support[slot] as u16),
            axis,
            evidence: evidence.as_ref().map_or(0.0, |evidence| evidence[slot]),
        })
    };
    positions.iter().enumerate().map(estimate).collect()
}

/// Reads the confidence, which may be NaN for lost points.
fn confidence<const D: usize>(
    arrays: &Arrays<'_>,
    estimates: &[Estimate<D>],
) -> Result<Vec<Confidence>, Error> {
    let sides = [Some(estimates.len())];
    let probability = |x: f64| (x.is_nan() || (0.0..=1.0).contains(&x)).then_some(x as f32);
    let (found, _) = arrays.numbers("found", sides, Class::Any, "a probability", probability)?;
    let length = |x: f64| (x.is_nan() || x >= 0.0).then_some(x as f32);
    let (scale, _) = arrays.numbers("error_scale", sides, Class::Any, "a length", length)?;
    let of_slot = |slot: usize| {
        let found = match found[slot] {
            found if !found.is_nan() => found,
            _ if estimates[slot].status != Status::Ok => 0.0,
            _ => return Err(arrays.wrong("found", slot, "a probability", "NaN")),
        };
        let scale = if scale[slot].is_nan() { f32::INFINITY } else { scale[slot] };
        Ok(Confidence { found, scale })
    };
    (0..estimates.len()).map(of_slot).collect()
}
