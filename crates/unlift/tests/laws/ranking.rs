//! Ranking with perfect lists: longer lists give smaller errors, and errors are smaller than those
//! of joint recovery, also for rays from anchors, where a layout of the neighbors is the start.

use unlift::recover::{
    Builtin, Confidence, Estimate, RecoverOptions, Recovered, Status, recover, recover_from,
};
use unlift::{About, RowOrder};

use crate::maps::{hide, room, uniform};

/// Returns the median error of all slots, from perfect lists of `k` records.
fn median_error<const D: usize>(
    (scheme, points): (&str, &[[f64; D]]),
    solver: Builtin,
    k: usize,
) -> f64 {
    let hidden = hide::<D>(unlift::obfuscate::scheme(scheme).unwrap(), points, 3);
    let lists = hidden.lists(k, 1.0, 3);
    let recovered = recover(&hidden.released, &lists, &solver, &RecoverOptions::default()).unwrap();
    let error = |slot: usize| {
        let to = hidden.local(slot);
        let from = recovered.positions()[slot];
        (0..D).map(|c| (from[c] as f64 - to[c]).powi(2)).sum::<f64>().sqrt()
    };
    let mut errors: Vec<f64> = (0..recovered.n_slots()).map(error).collect();
    errors.sort_unstable_by(f64::total_cmp);
    errors[errors.len() / 2]
}

fn errors_fall<const D: usize>(scheme: &str) {
    let points = room::<D>(3, 1_500);
    let error = |solver, k| median_error((scheme, &points), solver, k);
    let [short, long] = [6, 40].map(|k| error(Builtin::Ranking, k));
    assert!(long < short, "{scheme}: {short}, {long}");
    let joint = error(Builtin::Joint, 40);
    // Measured: 0.22 times the error of joint recovery or less.
    assert!(long < 0.3 * joint, "{scheme}: {long}, joint {joint}");
}

#[test]
fn longer_lists_give_smaller_errors() {
    ["olc", "ppl", "plane", "cp"].into_iter().for_each(errors_fall::<3>);
    errors_fall::<2>("lines2d");
}

#[test]
fn neighbors_place_points_on_rays_from_anchors() {
    let points = uniform::<2>(3, 1_500);
    let [joint, ranking] = [Builtin::Joint, Builtin::Ranking]
        .map(|solver| median_error(("dcl2d", &points), solver, 20));
    // Measured: 0.76 times the error. Photos of RedKitchen: half.
    assert!(ranking < 0.9 * joint, "{ranking}, joint {joint}");
}

#[test]
fn known_positions_stay_and_place_their_neighbors() {
    let points = uniform::<2>(3, 1_500);
    let hidden = hide::<2>(unlift::obfuscate::scheme("dcl2d").unwrap(), &points, 3);
    let (lists, released) = (hidden.lists(20, 0.8, 3), &hidden.released);
    let options = RecoverOptions::default();
    let is_known = |slot: usize| slot.is_multiple_of(3);
    let position = |slot: usize| hidden.local(slot).map(|x| x as f32);
    let estimate = |slot: usize| match is_known(slot) {
        true => {
            let (position, status) = (position(slot), Status::Ok);
            Estimate { position, status, support: 5, axis: 0, evidence: 0.0 }
        }
        false => Estimate::lost(Status::TooFewNeighbors),
    };
    let estimates: Vec<Estimate<2>> = (0..released.n_slots()).map(estimate).collect();
    let sure = |slot: usize| match is_known(slot) {
        true => Confidence { found: 0.9, scale: 1.0 },
        false => Confidence::LOST,
    };
    let about =
        About { map: Some(released.fingerprint()), order: RowOrder::Slots, ..About::default() };
    let known =
        Recovered::try_new(&estimates, false, None, released.origin(), released.unit(), 1.0)
            .and_then(|known| known.with_confidence((0..estimates.len()).map(sure).collect()))
            .unwrap()
            .with_about(about);
    let with = recover_from(&known, released, &lists, &options).unwrap();
    let without = recover(released, &lists, &Builtin::Ranking, &options).unwrap();
    let median = |recovered: &Recovered<2>| {
        let unknown = (0..recovered.n_slots()).filter(|&slot| !is_known(slot));
        let error = |slot: usize| {
            let [x, y] = [0, 1].map(|c| recovered.positions()[slot][c] - position(slot)[c]);
            x.hypot(y)
        };
        let mut errors: Vec<f32> = unknown.map(error).collect();
        errors.sort_unstable_by(f32::total_cmp);
        errors[errors.len() / 2]
    };
    let slots = (0..estimates.len()).filter(|&slot| is_known(slot));
    assert!(slots.into_iter().all(|slot| with.positions()[slot] == position(slot)));
    let [with, without] = [&with, &without].map(median);
    assert!(with < 0.5 * without, "{with}, without {without}");
}
