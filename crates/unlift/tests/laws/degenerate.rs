//! Properties of recovery from inputs that determine no points: a status, never a NaN, never a
//! panic.

use std::collections::BTreeSet;

use proptest::prelude::*;
use unlift::Unit;
use unlift::neighbors::Neighborhoods;
use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, Delta, RecoverOptions, Status, recover};
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};
use unlift::seed::{Draws, Stage};

use crate::maps::*;

/// Returns the solvers that read lists, with extremely small and large deltas.
fn harsh_options() -> Vec<Options> {
    let mut options = all_options();
    for solver in Builtin::FROM_LISTS {
        for delta in [1e-18, 1e-9, 1e9, 1e18] {
            let delta = Delta::Fixed(delta);
            options.push((solver, RecoverOptions { delta, ..RecoverOptions::default() }));
        }
    }
    options
}

/// Returns for each slot the records that it lists or that list its own, as joint recovery uses
/// them.
fn both_ways<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Vec<BTreeSet<usize>> {
    let per = released.slots_per_record();
    let mut rows = vec![BTreeSet::new(); lists.n_slots()];
    for slot in 0..lists.n_slots() {
        for record in lists.of(slot) {
            rows[slot].insert(record.index());
            (0..per).for_each(|other| _ = rows[record.index() * per + other].insert(slot / per));
        }
    }
    rows
}

/// Solves with all options and checks the results. Returns the statuses.
pub fn statuses<const D: usize>(
    what: &str,
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &[Options],
) -> Vec<Status> {
    let mut all = Vec::new();
    let both_ways = both_ways(released, lists);
    for (solver, options) in options {
        let recovered = recover(released, lists, solver, options)
            .unwrap_or_else(|error| panic!("{what}, {solver:?}, {options:?}: {error}"));
        assert_eq!(recovered.n_slots(), both_ways.len(), "{what}");
        for (slot, both_ways) in both_ways.iter().enumerate() {
            let ok = recovered.status()[slot] == Status::Ok;
            let position = recovered.positions()[slot];
            assert_eq!(ok, position.iter().all(|x| x.is_finite()), "{what}: {position:?}");
            assert_eq!(ok, recovered.position(slot).is_some(), "{what}");
            let evidence = recovered.evidence()[slot];
            assert!(evidence >= 0.0 && evidence.is_finite(), "{what}: evidence {evidence}");
            let asked = match solver {
                Builtin::Joint | Builtin::JointStart | Builtin::Ranking => both_ways.len(),
                // Attacks on the records alone count something else.
                Builtin::Density | Builtin::Tomography => usize::MAX,
                _ => lists.of(slot).len(),
            };
            let support = usize::from(recovered.support()[slot]);
            assert!(
                support <= asked,
                "{what}, {solver:?}, {options:?}: support {support} of {asked}"
            );
        }
        assert!(recovered.delta().is_finite() && recovered.delta() > 0.0, "{what}");
        all.extend(recovered.status());
    }
    all
}

#[test]
fn deltas_beyond_f32_are_refused() {
    for delta in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-30, 1e30] {
        let delta = Delta::Fixed(delta);
        assert!(RecoverOptions { delta, ..Default::default() }.check().is_err(), "{delta:?}");
    }
}

fn short_lists<const D: usize>(name: &str, scheme: &Entry, seed: u64) {
    let hidden = hide::<D>(scheme, &room(seed, 120), seed);
    let (n, per) = (hidden.released.n_slots(), hidden.released.slots_per_record());
    let mut draws = Draws::new(seed, Stage::Synthetic, 30);
    for length in [0, 1, 2, 3, 4] {
        let row = |slot: usize| {
            let mut row: Vec<u32> = (0..length)
                .map(|_| draws.below(hidden.released.n_records() as u64) as u32)
                .filter(|&record| record as usize != slot / per)
                .collect();
            row.sort_unstable();
            row.dedup();
            row
        };
        let lists = hidden.lists_of(&(0..n).map(row).collect::<Vec<_>>());
        let what = format!("{name}, lists of {length}");
        let got = statuses(&what, &hidden.released, &lists, &harsh_options());
        // Joint recovery uses lists in both directions, so a slot with a list of one may have two
        // neighbors.
        let both_ways = [Builtin::Joint, Builtin::JointStart, Builtin::Ranking];
        let by_lists = |options: &Options| !both_ways.contains(&options.0) || length == 0;
        let told = harsh_options().iter().flat_map(|o| vec![by_lists(o); n]).collect::<Vec<_>>();
        if length < 2 {
            let few = |(&s, told): (&Status, bool)| !told || s == Status::TooFewNeighbors;
            assert!(got.iter().zip(told).all(few), "{what}: {got:?}");
        }
    }
}

fn coincident_maps<const D: usize>(name: &str, scheme: &Entry, seed: u64) {
    for (places, copies) in [(1, 30), (2, 15), (1, 2), (30, 1)] {
        let hidden = hide::<D>(scheme, &piles(seed, places, copies, 0.0), seed);
        let n = hidden.released.n_records();
        let per = hidden.released.slots_per_record();
        let row = |slot: usize| (0..n as u32).filter(|&r| r as usize != slot / per).collect();
        let lists = hidden.lists_of(&(0..n * per).map(row).collect::<Vec<_>>());
        let what = format!("{name}, {places} places");
        statuses(&what, &hidden.released, &lists, &harsh_options());
    }
}

/// Returns lists in which every record lists all others.
fn everyone<const D: usize>(obfuscation: Obfuscation<D>) -> (Released<D>, Neighborhoods) {
    let n = obfuscation.len();
    let rows: Vec<Vec<u32>> =
        (0..n).map(|own| (0..n as u32).filter(|&r| r as usize != own).collect()).collect();
    let released = Released::try_new(obfuscation, 1, [0.0; D], Unit::Meter, None).unwrap();
    (released, lists_of(&rows, n, 1))
}

proptest! {
    #![proptest_config(cases(3))]

    #[test]
    fn lists_of_a_few(seed: u64) {
        over_schemes!(short_lists, seed);
    }

    #[test]
    fn maps_of_coincident_points(seed: u64) {
        over_schemes!(coincident_maps, seed);
    }
}

#[test]
fn parallel_lines_fix_no_point() {
    let points: Vec<[f64; 3]> = uniform(3, 40);
    let directions = vec![[0.3, -0.5, 0.81]; 40];
    let (released, lists) =
        everyone(Obfuscation::Lines(Lines::through(&points, &directions).unwrap()));
    let got = statuses("parallel lines", &released, &lists, &all_options());
    assert!(got.iter().all(|&status| status == Status::Degenerate), "{got:?}");
    statuses("parallel lines", &released, &lists, &harsh_options());
}

#[test]
fn rays_of_one_center_fix_no_point() {
    let directions: Vec<[f64; 3]> = uniform(3, 40);
    let rays = Rays::try_new(&[[1.0, 2.0, 3.0]], vec![0; 40], &directions).unwrap();
    let (released, lists) = everyone(Obfuscation::Rays(rays));
    let got = statuses("rays of one center", &released, &lists, &all_options());
    assert!(got.iter().all(|&status| status == Status::TooFewNeighbors), "{got:?}");
    statuses("rays of one center", &released, &lists, &harsh_options());
}

#[test]
fn planes_of_one_axis_fix_no_point() {
    let offsets: Vec<f64> = uniform::<3>(3, 40).iter().map(|p| p[0]).collect();
    let planes = AxisPlanes::<3>::try_new(vec![0; 40], &offsets).unwrap();
    let (released, lists) = everyone(Obfuscation::AxisPlanes(planes));
    let got = statuses("planes of one axis", &released, &lists, &harsh_options());
    assert!(got.iter().all(|&status| status == Status::Degenerate), "{got:?}");
}

#[test]
fn identical_records_give_no_nan() {
    let point = [1.5, -2.5, 0.25];
    let lines = Lines::through(&[point; 30], &[[0.0, 1.0, 1.0]; 30]).unwrap();
    let (released, lists) = everyone(Obfuscation::Lines(lines));
    statuses("identical lines", &released, &lists, &harsh_options());
    let rays = Rays::try_new(&[point, point], [0, 1].repeat(15), &[[0.0, 1.0, 0.0]; 30]);
    let (released, lists) = everyone(Obfuscation::Rays(rays.unwrap()));
    statuses("identical rays", &released, &lists, &harsh_options());
    let candidates = AxisCandidates::try_new(&[point; 30]).unwrap();
    let (released, lists) = everyone(Obfuscation::AxisCandidates(candidates));
    statuses("identical candidates", &released, &lists, &harsh_options());
    let planes = AxisPlanes::<3>::try_new([0, 1, 2].repeat(10), &[1.0; 30]).unwrap();
    let (released, lists) = everyone(Obfuscation::AxisPlanes(planes));
    statuses("identical planes", &released, &lists, &harsh_options());
}

#[test]
fn an_empty_map_is_recovered_at_once() {
    let empty: &[[f64; 3]] = &[];
    for obfuscation in [
        Obfuscation::Lines(Lines::through(empty, empty).unwrap()),
        Obfuscation::Rays(Rays::try_new(&[[0.0; 3]], vec![], empty).unwrap()),
        Obfuscation::AxisPlanes(AxisPlanes::try_new(vec![], &[]).unwrap()),
        Obfuscation::AxisCandidates(AxisCandidates::try_new(empty).unwrap()),
    ] {
        let (released, lists) = everyone(obfuscation);
        assert_eq!(statuses("an empty map", &released, &lists, &harsh_options()), []);
    }
}
