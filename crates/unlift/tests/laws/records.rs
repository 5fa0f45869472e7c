//! Properties of released maps: normal form, determinism, and which truth belongs to a map. Others are in `unlift_testkit::scheme_laws`.

use proptest::prelude::*;
use unlift::evaluate::{away_from_own, belongs};
use unlift::neighbors::geometric;
use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, RecoverOptions};
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays};
use unlift::truth::Original;
use unlift::{PointSet, Unit};

use crate::maps::*;

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

fn threads_change_no_byte<const D: usize>(name: &str, scheme: &Entry, seed: u64) {
    let points = room(seed, 700);
    let run = || {
        let hidden = hide::<D>(scheme, &points, seed);
        let lists = hidden.lists(20, 0.5, seed);
        let mut bytes = released_bytes(&hidden.released);
        bytes.extend(lists.records().iter().flat_map(|r| r.0.to_le_bytes()));
        if let Ok(lists) = geometric(&hidden.released, 10) {
            bytes.extend(lists.records().iter().flat_map(|r| r.0.to_le_bytes()));
            let scores = lists.scores().unwrap_or_default();
            bytes.extend(scores.iter().flat_map(|x| x.to_bits().to_le_bytes()));
        }
        let alone = [Builtin::Density, Builtin::Tomography];
        let alone = alone.map(|solver| (solver, RecoverOptions::default()));
        for options in all_options().into_iter().chain(alone) {
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

proptest! {
    #![proptest_config(cases(6))]

    #[test]
    fn normal_form(n in 2usize..2000, seed: u64) {
        over_schemes!(normal_form_is_idempotent, n, seed);
    }
}

#[test]
fn determinism() {
    over_schemes!(threads_change_no_byte, 11);
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
