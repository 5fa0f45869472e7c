//! Properties of released maps: points on records, normal form, shape, determinism.

use proptest::prelude::*;
use unlift::evaluate::{away_from_own, belongs};
use unlift::obfuscate::Entry;
use unlift::recover::Builtin;
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays};
use unlift::truth::Original;
use unlift::{PointSet, Unit};

use crate::maps::*;

/// Records are stored in `f32`: a few units in the last place of the largest coordinate.
const F32: f64 = 5e-7;

/// Each original lies on its record; for axis candidates also on the line of the exchanged axis.
fn originals_lie_on_their_records<const D: usize>(
    name: &str,
    scheme: &Entry,
    n: usize,
    seed: u64,
    shift: f64,
) {
    let points: Vec<[f64; D]> = room(seed, n).iter().map(|p| p.map(|x| x + shift)).collect();
    let hidden = hide::<D>(scheme, &points, seed);
    // Differences of far coordinates are exact only to their own last place.
    let tolerance = F32 * 8.0 + shift * f64::EPSILON;
    for slot in 0..hidden.secret.n_slots() {
        let local = hidden.local(slot);
        let record = slot / hidden.released.slots_per_record();
        let off = hidden.distance(record, &local);
        assert!(off <= tolerance, "{name}: slot {slot} is {off} off its record");
        let axes = hidden.secret.swapped_axis();
        if let Obfuscation::AxisCandidates(candidates) = hidden.released.obfuscation() {
            let swapped = usize::from(axes.expect("candidates have a secret axis")[slot]);
            for c in (0..D).filter(|&c| c != swapped) {
                let published = f64::from(candidates.position()[record][c]);
                assert!((published - local[c]).abs() <= tolerance, "{name}: slot {slot} axis {c}");
            }
        } else {
            assert!(axes.is_none(), "{name}");
        }
    }
}

fn normal_form_is_idempotent<const D: usize>(name: &str, scheme: &Entry, n: usize, seed: u64) {
    let hidden = hide::<D>(scheme, &room(seed, n), seed);
    let stored = hidden.released.obfuscation();
    let widen = |rows: &[[f32; D]]| rows.iter().map(|r| r.map(f64::from)).collect::<Vec<_>>();
    let again = match stored {
        Obfuscation::Lines(lines) => Obfuscation::Lines(
            Lines::through(&widen(lines.foot()), &widen(lines.direction())).unwrap(),
        ),
        Obfuscation::Rays(rays) => Obfuscation::Rays(
            Rays::try_new(&widen(rays.centers()), rays.center().to_vec(), &widen(rays.direction()))
                .unwrap(),
        ),
        Obfuscation::AxisPlanes(planes) => {
            let offset: Vec<f64> = planes.offset().iter().map(|&x| f64::from(x)).collect();
            Obfuscation::AxisPlanes(AxisPlanes::try_new(planes.axis().to_vec(), &offset).unwrap())
        }
        Obfuscation::AxisCandidates(candidates) => Obfuscation::AxisCandidates(
            AxisCandidates::try_new(&widen(candidates.position())).unwrap(),
        ),
    };
    assert!(record_bytes(stored) == record_bytes(&again), "{name}: normal form is not stable");
}

/// Every original has one slot or one reason. Records are full, and nothing else is released.
fn every_original_is_accounted_for<const D: usize>(
    name: &str,
    scheme: &Entry,
    points: &[[f64; D]],
    seed: u64,
) {
    let hidden = match try_hide::<D>(scheme, points, 0.5, seed) {
        Ok(hidden) => hidden,
        // Too few points are an error.
        Err(error) => {
            assert!(points.len() < 2, "{name} refuses {} points: {error}", points.len());
            return;
        }
    };
    let (released, secret) = (&hidden.released, &hidden.secret);
    let mut seen = vec![0; points.len()];
    for id in secret.hidden().iter().copied().chain(secret.dropped().iter().map(|d| d.original)) {
        seen[id.index()] += 1;
    }
    assert!(seen.iter().all(|&times| times == 1), "{name}: {seen:?}");
    assert_eq!(secret.n_originals(), points.len(), "{name}");
    assert_eq!(secret.n_slots(), released.n_slots(), "{name}");
    assert_eq!(released.n_slots(), released.n_records() * released.slots_per_record(), "{name}");
    assert!(secret.swapped_axis().is_none_or(|axes| axes.iter().all(|&a| usize::from(a) < D)));
    let mut rows = secret.descriptor_row().to_vec();
    for (record, rows) in rows.chunks_mut(released.slots_per_record()).enumerate() {
        rows.sort_unstable();
        let first = (record * released.slots_per_record()) as u32;
        assert!(rows.iter().zip(first..).all(|(&row, own)| row == own), "{name}: {record}");
    }
}

fn threads_change_no_byte<const D: usize>(name: &str, scheme: &Entry, seed: u64) {
    let points = room(seed, 700);
    let run = || {
        let hidden = hide::<D>(scheme, &points, seed);
        let lists = hidden.lists(20, 0.5, seed);
        let mut bytes = released_bytes(&hidden.released);
        bytes.extend(lists.records().iter().flat_map(|r| r.0.to_le_bytes()));
        for options in all_options() {
            let recovered = solve(&hidden.released, &lists, options);
            assert_eq!(recovered.trials().is_some(), options.0 == Builtin::Ransac);
            bytes.extend(recovered_bytes(&recovered));
            let bins = recovered.trials().into_iter().flat_map(|trials| trials.bins());
            bytes.extend(bins.flat_map(|(_, slots)| slots.to_le_bytes()));
        }
        bytes
    };
    let on = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run)
    };
    let one = on(1);
    assert!(one == on(2) && one == on(8), "{name}: threads changed a byte");
}

fn seeds_matter<const D: usize>(name: &str, scheme: &Entry) {
    let points = room(1, 200);
    let bytes = |seed| released_bytes(&hide::<D>(scheme, &points, seed).released);
    assert!(bytes(1) != bytes(2), "{name}");
}

proptest! {
    #![proptest_config(cases(6))]

    #[test]
    fn containment(n in 2usize..400, seed: u64, shift in prop_oneof![Just(0.0), Just(1e6)]) {
        over_schemes!(originals_lie_on_their_records, n, seed, shift);
    }

    #[test]
    fn normal_form(n in 2usize..2000, seed: u64) {
        over_schemes!(normal_form_is_idempotent, n, seed);
    }

    #[test]
    fn shape(n in 0usize..300, seed: u64) {
        over_schemes!(every_original_is_accounted_for, &room(seed, n), seed);
    }
}

#[test]
fn shape_of_the_smallest_maps() {
    for n in 0..8 {
        over_schemes!(every_original_is_accounted_for, &uniform(9, n), 5);
        over_schemes!(every_original_is_accounted_for, &piles(9, 1, n, 0.0), 5);
        over_schemes!(every_original_is_accounted_for, &piles(9, 2, n, 0.0), 5);
    }
}

#[test]
fn determinism() {
    over_schemes!(threads_change_no_byte, 11);
    over_schemes!(seeds_matter);
}

/// Every point is equally near to all records up to rounding.
#[test]
fn points_that_fall_together_belong_to_their_map() {
    let together = vec![[1.3, 0.7, 2.1]; 200];
    for name in ["olc", "plane", "cp"] {
        let hidden = hide::<3>(unlift::obfuscate::scheme(name).unwrap(), &together, 6);
        assert!(belongs(&hidden.original, &hidden.released, &hidden.secret).is_ok(), "{name}");
    }
}

#[test]
fn a_truth_in_another_frame_is_not_that_of_the_map() {
    let points = room::<3>(64, 200);
    let turned = points.iter().map(|p| [p[1], p[2], p[0]]).collect();
    let moved = Original::new(PointSet::try_new(turned, Unit::Meter).unwrap());
    for name in ["olc", "ppl", "ray", "plane", "cp"] {
        let hidden = hide::<3>(unlift::obfuscate::scheme(name).unwrap(), &points, 6);
        let (released, secret) = (&hidden.released, &hidden.secret);
        assert!(belongs(&hidden.original, released, secret).is_ok(), "{name}");
        assert!(belongs(&moved, released, secret).is_err(), "{name}");
        // A point lies on its record up to rounding.
        let away = away_from_own(released, &hidden.original, secret);
        assert!(away.iter().all(|&away| away < 1e-4), "{name}");
    }
}
