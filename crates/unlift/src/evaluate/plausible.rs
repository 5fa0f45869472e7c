//! Whether positions that do not say which map they are of can be of this one.

use crate::geometry::vector::distance;
use crate::recover::Recovered;
use crate::truth::{Original, Secret};

/// Of how many recovered positions, how many are nearer to a point of their own record than to one of a record half
/// a map away. Records stand in random order: of positions of another map, or in another order, it is half of them.
/// Who knows no more than the records gets clearly more.
pub fn nearer_to_own<const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &Secret,
) -> (usize, usize) {
    let points = original.reveal().positions();
    let slots = secret.slots_per_record();
    let n_records = secret.n_slots() / slots;
    let nearest = |position: &[f64; D], record: usize| {
        let hidden = &secret.hidden()[record * slots..(record + 1) * slots];
        let away = hidden.iter().map(|id| distance(position, &points[id.index()]));
        away.fold(f64::INFINITY, f64::min)
    };
    let (mut nearer, mut n) = (0, 0);
    for slot in 0..recovered.n_slots().min(secret.n_slots()) {
        let Some(position) = recovered.position(slot) else { continue };
        let record = slot / slots;
        let other = (record + n_records.div_ceil(2)) % n_records;
        n += 1;
        nearer += usize::from(nearest(&position, record) < nearest(&position, other));
    }
    (nearer, n)
}
