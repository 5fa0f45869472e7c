//! Random values of every kind, from a seed.

use unlift::descriptors::Values;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::Neighborhoods;
use unlift::recover::{Estimate, Recovered, Status};
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};
use unlift::seed::{Draws, Stage};
use unlift::truth::{DropReason, Dropped, Original, Secret};
use unlift::{About, Descriptors, Fingerprint, OriginalId, PointSet, RecordId, RowOrder, Unit};

pub fn draws(seed: u64) -> Draws {
    Draws::new(seed, Stage::Synthetic, 0)
}

pub fn points<const D: usize>(draws: &mut Draws, n: usize) -> Vec<[f64; D]> {
    let mut point = || std::array::from_fn(|_| draws.between(-9.0, 9.0));
    (0..n).map(|_| point()).collect()
}

fn descriptors(draws: &mut Draws, n: usize) -> Option<Descriptors> {
    let dim = 1 + draws.below(200) as usize;
    let values = match draws.below(3) {
        0 => return None,
        1 => Values::U8((0..n * dim).map(|_| draws.below(256) as u8).collect()),
        _ => Values::F32((0..n * dim).map(|_| draws.normal() as f32).collect()),
    };
    Some(Descriptors::try_new(values, dim).unwrap())
}

/// One released map per family; lines with one and with two slots per record.
pub fn released<const D: usize>(seed: u64, n: usize) -> Vec<Released<D>> {
    let draws = &mut draws(seed);
    let directions =
        |draws: &mut Draws| -> Vec<[f64; D]> { (0..n).map(|_| draws.direction()).collect() };
    let indices = |draws: &mut Draws, below| (0..n).map(|_| draws.below(below) as u8).collect();
    let lines = |draws: &mut Draws| {
        Obfuscation::Lines(Lines::through(&points(draws, n), &directions(draws)).unwrap())
    };
    let rays = Rays::try_new(&points(draws, 3), indices(draws, 3), &directions(draws));
    let offsets: Vec<f64> = points::<1>(draws, n).concat();
    let planes = AxisPlanes::try_new(indices(draws, D as u64), &offsets);
    let candidates = AxisCandidates::try_new(&points(draws, n));
    let families = [
        (lines(draws), 1),
        (lines(draws), 2),
        (Obfuscation::Rays(rays.unwrap()), 1),
        (Obfuscation::AxisPlanes(planes.unwrap()), 1),
        (Obfuscation::AxisCandidates(candidates.unwrap()), 1),
    ];
    let with_rest = |(obfuscation, slots)| {
        let origin = std::array::from_fn(|_| draws.between(-4e6, 4e6));
        let unit = [Unit::Meter, Unit::Pixel, Unit::KthNeighbor][draws.below(3) as usize];
        let descriptors = descriptors(draws, n * slots);
        let released = Released::try_new(obfuscation, slots, origin, unit, descriptors).unwrap();
        // Of an image, the size is released, too.
        let image = Bounds { low: [-9.5; D], high: [90.25; D] };
        released.with_bounds((D == 2).then_some(image))
    };
    families.map(with_rest).into()
}

/// A ground truth with `n` slots and a few dropped points; `swapped_axis` for every second seed.
pub fn truth<const D: usize>(seed: u64, n: usize) -> (Original<D>, Secret) {
    let mut draws = draws(seed);
    let n_all = n + draws.below(6) as usize;
    let original = PointSet::try_new(points(&mut draws, n_all), Unit::Meter).unwrap();
    let order: Vec<OriginalId> = draws.permutation(n_all).into_iter().map(OriginalId).collect();
    // Files have them in this order.
    let mut without_slot = order[n..].to_vec();
    without_slot.sort();
    let reason = |original: OriginalId| DropReason::ALL[original.index() % DropReason::ALL.len()];
    let dropped =
        without_slot.into_iter().map(|original| Dropped { original, reason: reason(original) });
    let axes = (0..n).map(|_| draws.below(D as u64) as u8).collect();
    let slots = if n.is_multiple_of(2) { 1 + seed as usize % 2 } else { 1 };
    // The rows of a record are its slots in some order.
    let crossed = |record: usize| u32::from(slots == 2 && record.is_multiple_of(3));
    let row = |slot: usize| slot as u32 ^ crossed(slot / slots);
    let hidden = order[..n].to_vec();
    let axes = seed.is_multiple_of(2).then_some(axes);
    let rows = (0..n).map(row).collect();
    let secret = Secret::try_new(hidden, axes, rows, dropped.collect(), n_all, slots).unwrap();
    (Original::new(original), secret.with_map(about(seed).map))
}

/// Lists of up to ten records; scores for every second seed.
pub fn neighborhoods(seed: u64, n_records: usize, slots_per_record: usize) -> Neighborhoods {
    let mut draws = draws(seed);
    let (mut offsets, mut records) = (vec![0], Vec::new());
    for slot in 0..n_records * slots_per_record {
        let own = (slot / slots_per_record) as u32;
        let length = draws.below(11.min(n_records as u64)) as usize;
        let others = draws.permutation(n_records).into_iter().filter(|&r| r != own);
        records.extend(others.take(length).map(RecordId));
        offsets.push(records.len() as u64);
    }
    let scores = records.iter().map(|_| draws.normal() as f32).collect();
    let scores = seed.is_multiple_of(2).then_some(scores);
    let slots = records.iter().map(|record| 2 * record.0 + draws.below(2) as u32).collect();
    let lists = Neighborhoods::try_new(offsets, records, scores, n_records, slots_per_record);
    let lists = lists.unwrap().with_about(about(seed));
    match slots_per_record == 2 && seed.is_multiple_of(3) {
        true => lists.with_slots(slots).unwrap(),
        false => lists,
    }
}

fn about(seed: u64) -> About {
    let order = RowOrder::STATED.get(seed as usize % 4).copied().unwrap_or(RowOrder::Unstated);
    let map = (!seed.is_multiple_of(3)).then_some(Fingerprint([seed as u8; 16]));
    About { map, order, by_oracle: seed.is_multiple_of(2) }
}

/// Recovered points, a fifth of them lost; axis and descriptor rows for every second seed.
pub fn recovered<const D: usize>(seed: u64, n: usize) -> Recovered<D> {
    let mut draws = draws(seed);
    let estimates: Vec<Estimate<D>> = points::<D>(&mut draws, n)
        .into_iter()
        .map(|p| match draws.below(5) {
            0 => Estimate::lost(Status::ALL[1 + draws.below(3) as usize]),
            _ => Estimate {
                position: p.map(|x| x as f32),
                status: Status::Ok,
                support: draws.below(1 << 16) as u16,
                axis: draws.below(D as u64) as u8,
                evidence: draws.unit() as f32,
            },
        })
        .collect();
    let odd = seed % 2 == 1;
    let rows = odd.then(|| draws.permutation(n));
    let origin = std::array::from_fn(|_| draws.between(-5.0, 5.0));
    let recovered = Recovered::try_new(&estimates, odd, rows, origin, Unit::Meter, 0.08);
    recovered.unwrap().with_about(about(seed))
}
