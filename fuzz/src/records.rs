//! Recovery from arbitrary records and lists: each point is finite or lost with a reason.

use unlift::neighbors::Neighborhoods;
use unlift::recover::{Builtin, Delta, RecoverOptions, Status, recover};
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};
use unlift::{About, Error, RecordId, Unit};

use super::bytes::Bytes;

/// Recovers from records, lists and options. Two bytes choose dimension, family and solver.
pub fn recovery(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    if bytes.byte().is_multiple_of(4) { of::<2>(&mut bytes) } else { of::<3>(&mut bytes) }
}

fn of<const D: usize>(bytes: &mut Bytes<'_>) {
    let (family, solver) = (bytes.byte(), bytes.byte());
    let n = usize::from(bytes.byte() % 48) + 1;
    let Ok(released) = released::<D>(bytes, family, n) else { return };
    let Ok(lists) = lists(bytes, &released) else { return };
    let delta = match bytes.byte() {
        0 => Delta::Fixed(bytes.number()),
        _ => Delta::Auto,
    };
    let options = RecoverOptions { delta, ..RecoverOptions::default() };
    let solver = Builtin::ALL[usize::from(solver) % Builtin::ALL.len()];
    let Ok(recovered) = recover(&released, &lists, &solver, &options) else { return };
    assert_eq!(recovered.n_slots(), released.n_slots());
    assert!(recovered.delta().is_finite() && recovered.delta() >= 0.0);
    assert!(recovered.evidence().iter().all(|x| x.is_finite()));
    for (slot, status) in recovered.status().iter().enumerate() {
        let place = recovered.position(slot);
        assert_eq!(place.is_some(), *status == Status::Ok, "slot {slot}");
        assert!(place.iter().flatten().all(|x| x.is_finite()), "slot {slot}");
    }
    for confidence in recovered.confidence().iter().flat_map(|rows| rows.iter()) {
        assert!((0.0..=1.0).contains(&confidence.found) && confidence.scale >= 0.0);
    }
}

fn released<const D: usize>(
    bytes: &mut Bytes<'_>,
    family: u8,
    n: usize,
) -> Result<Released<D>, Error> {
    let mut vectors = |n: usize| -> Vec<[f64; D]> {
        (0..n).map(|_| std::array::from_fn(|_| bytes.number())).collect()
    };
    let (slots, obfuscation) = match family % 5 {
        0 => (1, Obfuscation::Lines(Lines::through(&vectors(n), &vectors(n))?)),
        1 => (2, Obfuscation::Lines(Lines::through(&vectors(n), &vectors(n))?)),
        2 => {
            let (centers, directions) = (vectors(2), vectors(n));
            let center = (0..n).map(|_| bytes.byte() % 2).collect();
            let rays = Rays::try_new(&centers, center, &directions)?;
            (1, Obfuscation::Rays(rays))
        }
        3 => {
            let axis = (0..n).map(|_| bytes.byte() % D as u8).collect();
            let offset: Vec<f64> = (0..n).map(|_| bytes.number()).collect();
            (1, Obfuscation::AxisPlanes(AxisPlanes::try_new(axis, &offset)?))
        }
        _ => (1, Obfuscation::AxisCandidates(AxisCandidates::try_new(&vectors(n))?)),
    };
    let origin = std::array::from_fn(|_| bytes.number());
    let unit = if D == 2 { Unit::Pixel } else { Unit::Meter };
    Released::try_new(obfuscation, slots, origin, unit, None)
}

fn lists<const D: usize>(
    bytes: &mut Bytes<'_>,
    released: &Released<D>,
) -> Result<Neighborhoods, Error> {
    let (n, slots) = (released.n_records(), released.slots_per_record());
    let (mut offsets, mut records) = (vec![0u64], Vec::new());
    for _ in 0..n * slots {
        for _ in 0..bytes.byte() % 16 {
            records.push(RecordId(u32::from(bytes.byte()) % n as u32));
        }
        offsets.push(records.len() as u64);
    }
    let scores = match bytes.byte() % 2 {
        0 => None,
        _ => Some(records.iter().map(|_| bytes.number() as f32).collect()),
    };
    let by_oracle = bytes.byte().is_multiple_of(2);
    let lists = Neighborhoods::try_new(offsets, records, scores, n, slots)?;
    Ok(lists.with_about(About { by_oracle, ..About::default() }))
}
