//! Joint recovery with perfect lists: longer lists give smaller errors, and errors are smaller than
//! those of consensus, also for rays from anchors, where a layout of the neighbors is the start.

use unlift::recover::{Confidence, recover_from};

use crate::maps::*;

/// Returns the median error of all slots, from perfect lists of `k` records.
fn median_error<const D: usize>(
    (scheme, points): (&str, &[[f64; D]]),
    solver: Builtin,
    k: usize,
) -> f64 {
    let hidden = hide::<D>(entry(scheme), points, 3);
    let options = (solver, RecoverOptions::default());
    let recovered = solve(&hidden.released, &hidden.lists(k, 1.0, 3), options);
    let errors = (0..recovered.n_slots()).map(|slot| hidden.error(&recovered, slot));
    median(&mut errors.collect::<Vec<_>>())
}

fn errors_fall<const D: usize>(scheme: &str) {
    let points = room::<D>(3, 1_500);
    let error = |solver, k| median_error((scheme, &points), solver, k);
    let [short, long] = [6, 40].map(|k| error(Builtin::Joint, k));
    assert!(long < short, "{scheme}: {short}, {long}");
    let consensus = error(Builtin::Consensus, 40);
    assert!(long < 0.3 * consensus, "{scheme}: {long}, consensus {consensus}");
}

#[test]
fn longer_lists_give_smaller_errors() {
    ["olc", "ppl", "plane", "cp"].into_iter().for_each(errors_fall::<3>);
    errors_fall::<2>("lines2d");
}

#[test]
fn neighbors_place_points_on_rays_from_anchors() {
    let points = uniform::<2>(3, 1_500);
    let [consensus, joint] = [Builtin::Consensus, Builtin::Joint]
        .map(|solver| median_error(("dcl2d", &points), solver, 20));
    assert!(joint < 0.9 * consensus, "{joint}, consensus {consensus}");
}

#[test]
fn known_positions_stay_and_place_their_neighbors() {
    let points = uniform::<2>(3, 600);
    let hidden = hide::<2>(entry("dcl2d"), &points, 3);
    let (lists, released) = (hidden.lists(20, 0.8, 3), &hidden.released);
    let options = RecoverOptions::default();
    let is_known = |slot: usize| slot.is_multiple_of(3);
    let position = |slot: usize| hidden.local(slot).map(|x| x as f32);
    let slots = || 0..released.n_slots();
    let known = |slot: usize| if is_known(slot) { position(slot) } else { [f32::NAN; 2] };
    let known: Vec<[f32; 2]> = slots().map(known).collect();
    let sure = vec![Confidence { found: 0.9, scale: 1.0 }; released.n_slots()];
    let known = Recovered::from_positions(released, &lists, &known).unwrap();
    let known = known.with_confidence(sure).unwrap();
    let with = recover_from(&known, released, &lists, &options).unwrap();
    let without = recover(released, &lists, &Builtin::Joint, &options).unwrap();
    let mut known = slots().filter(|&slot| is_known(slot));
    assert!(known.all(|slot| with.positions()[slot] == position(slot)));
    let [with, without] = [&with, &without].map(|recovered| {
        let unknown = slots().filter(|&slot| !is_known(slot));
        median(&mut unknown.map(|slot| hidden.error(recovered, slot)).collect::<Vec<_>>())
    });
    assert!(with < 0.5 * without, "{with}, without {without}");
}
