//! Ranking with perfect lists: longer lists give smaller errors, and errors are smaller than those
//! of joint recovery, also for rays from anchors, where a layout of the neighbors is the start.

use unlift::recover::{Builtin, RecoverOptions, recover};

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
