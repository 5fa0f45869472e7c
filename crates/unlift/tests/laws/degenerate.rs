//! Recovery from inputs that determine no points, and audits of maps at the limits of geometry: a status, counted losses or a reason,
//! never a NaN, never a panic.

use std::collections::BTreeSet;

use unlift::neighbors::geometric;

use crate::maps::*;

/// Returns the solvers that read lists, also with extremely small and large deltas.
fn harsh_options() -> Vec<Options> {
    [all_options(), options_with(&[1e-18, 1e-9, 1e9, 1e18].map(Delta::Fixed))].concat()
}

/// Returns for each slot the number of records that it lists or that list its own.
fn both_ways<const D: usize>(released: &Released<D>, lists: &Neighborhoods) -> Vec<usize> {
    let per = released.slots_per_record();
    let mut rows = vec![BTreeSet::new(); lists.n_slots()];
    for slot in 0..lists.n_slots() {
        for record in lists.of(slot) {
            rows[slot].insert(record.index());
            (0..per).for_each(|other| _ = rows[record.index() * per + other].insert(slot / per));
        }
    }
    rows.iter().map(BTreeSet::len).collect()
}

/// Solves with each of the options and checks the results. Returns the statuses of each.
fn statuses<const D: usize>(
    what: &str,
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &[Options],
) -> Vec<(Options, Vec<Status>)> {
    let both_ways = both_ways(released, lists);
    let of = |&options: &Options| {
        let what = format!("{what}, {options:?}");
        let recovered = recover(released, lists, &options.0, &options.1)
            .unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(recovered.n_slots(), both_ways.len(), "{what}");
        for (slot, &both_ways) in both_ways.iter().enumerate() {
            let ok = recovered.status()[slot] == Status::Ok;
            let position = recovered.positions()[slot];
            assert_eq!(ok, position.iter().all(|x| x.is_finite()), "{what}: {position:?}");
            let evidence = recovered.evidence()[slot];
            assert!(evidence >= 0.0 && evidence.is_finite(), "{what}: evidence {evidence}");
            let most = match options.0 {
                // Attacks on the records alone count something else.
                Builtin::Density | Builtin::Tomography => usize::MAX,
                Builtin::Joint => both_ways,
                _ => lists.of(slot).len(),
            };
            let support = usize::from(recovered.support()[slot]);
            assert!(support <= most, "{what}: support {support} of {most}");
        }
        assert!(recovered.delta().is_finite() && recovered.delta() > 0.0, "{what}");
        (options, recovered.status().to_vec())
    };
    options.iter().map(of).collect()
}

#[test]
fn deltas_beyond_f32_are_refused() {
    for delta in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-30, 1e30] {
        let delta = Delta::Fixed(delta);
        assert!(RecoverOptions { delta, ..Default::default() }.check().is_err(), "{delta:?}");
    }
}

fn short_lists<const D: usize>(name: &str, scheme: &Entry, seed: u64) {
    let hidden = hide::<D>(scheme, &room(seed, 60), seed);
    let (n, per) = (hidden.released.n_slots(), hidden.released.slots_per_record());
    let mut draws = Draws::new(seed, Stage::Synthetic, 30);
    for length in [0, 1, 2, 3, 4] {
        let row = |slot: usize| {
            let records = 0..hidden.released.n_records() as u64;
            let row = (0..length).map(|_| draws.below(records.end) as u32);
            let row = row.filter(|&record| record as usize != slot / per);
            row.collect::<BTreeSet<u32>>().into_iter().collect()
        };
        let lists = hidden.lists_of(&(0..n).map(row).collect::<Vec<_>>());
        let what = format!("{name}, lists of {length}");
        for (options, got) in statuses(&what, &hidden.released, &lists, &harsh_options()) {
            // In both directions a slot with a list of one may have two neighbors.
            if length == 0 || length == 1 && options.0 != Builtin::Joint {
                let few = got.iter().all(|&status| status == Status::TooFewNeighbors);
                assert!(few, "{what}, {options:?}: {got:?}");
            }
        }
    }
}

fn odd_maps<const D: usize>(name: &str, scheme: &Entry, seed: u64) {
    let pile = |places, copies| piles(seed, places, copies, 0.0);
    let far = [vec![[1e6; D]; 3], uniform(seed, 60)].concat();
    let near = piles(seed, 2, 40, 1e-7);
    for points in [pile(1, 30), pile(2, 15), pile(1, 2), pile(30, 1), near, uniform(seed, 9), far] {
        let what = format!("{name}, {} points", points.len());
        let released = hide::<D>(scheme, &points, seed).released;
        let lists = everyone(released.n_records(), released.slots_per_record());
        statuses(&what, &released, &lists, &harsh_options());
        statuses(&what, &released, &lists, &alone_options());
        if let Ok(lists) = geometric(&released, 5) {
            assert_eq!(lists.n_slots(), released.n_slots(), "{what}");
        }
    }
}

#[test]
fn lists_of_a_few_and_maps_of_few_places() {
    for seed in seeds(1) {
        over_schemes!(short_lists, seed);
        over_schemes!(odd_maps, seed);
    }
}

#[test]
fn records_that_fix_no_point_are_answered() {
    let points: Vec<[f64; 3]> = uniform(3, 40);
    let offsets: Vec<f64> = points.iter().map(|p| p[0]).collect();
    let lines = |points: &[[f64; 3]], direction| {
        Obfuscation::Lines(Lines::through(points, &vec![direction; points.len()]).unwrap())
    };
    let rays = |centers: &[[f64; 3]], center, directions: &[[f64; 3]]| {
        Obfuscation::Rays(Rays::try_new(centers, center, directions).unwrap())
    };
    let planes = |axis, offsets: &[f64]| {
        Obfuscation::AxisPlanes(AxisPlanes::try_new(axis, offsets).unwrap())
    };
    let candidates =
        |points: &[[f64; 3]]| Obfuscation::AxisCandidates(AxisCandidates::try_new(points).unwrap());
    let (place, up) = ([1.5, -2.5, 0.25], [0.0, 1.0, 0.0]);
    let (degenerate, few) = (Some(Status::Degenerate), Some(Status::TooFewNeighbors));
    for (what, records, usual, harsh) in [
        ("parallel lines", lines(&points, [0.3, -0.5, 0.81]), degenerate, None),
        ("rays of one center", rays(&[[1.0, 2.0, 3.0]], vec![0; 40], &points), few, None),
        ("planes of one axis", planes(vec![0; 40], &offsets), degenerate, degenerate),
        ("identical lines", lines(&[place; 30], [0.0, 1.0, 1.0]), None, None),
        ("identical rays", rays(&[place; 2], [0, 1].repeat(15), &[up; 30]), None, None),
        ("identical candidates", candidates(&[place; 30]), None, None),
        ("identical planes", planes([0, 1, 2].repeat(10), &[1.0; 30]), None, None),
        ("no lines", lines(&[], up), None, None),
        ("no rays", rays(&[[0.0; 3]], vec![], &[]), None, None),
        ("no planes", planes(vec![], &[]), None, None),
        ("no candidates", candidates(&[]), None, None),
    ] {
        let lists = everyone(records.len(), 1);
        let released = Released::try_new(records, 1, [0.0; 3], Unit::Meter, None).unwrap();
        statuses(what, &released, &lists, &alone_options());
        if ["parallel lines", "no lines"].contains(&what) {
            assert!(geometric(&released, 5).unwrap().records().is_empty());
        }
        for (options, got) in statuses(what, &released, &lists, &harsh_options()) {
            let is_usual = all_options().contains(&options);
            if let Some(status) = if is_usual { usual } else { harsh } {
                assert!(got.iter().all(|&found| found == status), "{what}, {options:?}: {got:?}");
            }
        }
    }
}

/// Audits a map under all schemes and checks conditions that hold for any map.
fn check(what: &str, points: Vec<[f64; 3]>, k: usize) {
    let plan = plan(Unit::Meter, &[], &[1.0, 0.3], &[Builtin::Joint, Builtin::Consensus]);
    let plan = Plan { k, ..plan };
    let outcome = audit(&original(points), &plan);
    for scheme in &plan.schemes {
        let is_there = outcome.rows.iter().any(|row| row.scheme == scheme.name())
            || outcome.not_audited.iter().any(|not| not.scheme == scheme.name());
        assert!(is_there, "{what}: {} is missing", scheme.name());
    }
    for row in &outcome.rows {
        let cell = format!("{what}: {} {} at {}", row.scheme, row.solver, row.inlier_ratio);
        assert!(row.delta.is_finite() && row.delta > 0.0, "{cell}: delta {}", row.delta);
        let shares = row.recovered_percent.values().chain(row.blind_percent.values());
        let mut shares = shares.chain(&row.axis_accuracy_percent).chain(&row.exact_percent);
        assert!(shares.all(|share| (0.0..=100.0).contains(share)), "{cell}: {row:?}");
        let mut errors = row.error_percentiles.values().flatten().chain(&row.blind_median_error);
        assert!(errors.all(|error| error.is_finite() && *error >= 0.0), "{cell}: {row:?}");
        assert!(row.lost.values().sum::<usize>() <= row.n_points * 2, "{cell}: {row:?}");
        let Some(reliability) = &row.parts.reliability else { continue };
        let sure = reliability.sure();
        assert!(sure.expected.is_finite(), "{cell}: {sure:?}");
        if sure.n * 100 >= reliability.n_points && sure.n >= 20 {
            let right = 100.0 * sure.within as f64 / sure.n as f64;
            assert!(right >= 85.0, "{cell}: sure of {}, of which {right:.0} % are right", sure.n);
        }
    }
}

#[test]
fn maps_at_the_limits_are_audited_or_refused_with_a_reason() {
    let room = |n: usize| synthetic::room(5, n).points;
    let mut draws = Draws::new(11, Stage::Synthetic, 77);
    let mut fallen = room(600);
    while fallen.len() < 6_000 {
        fallen.push(fallen[draws.below(600) as usize]);
    }
    let mut unit = || draws.between(0.0, 5.0);
    let far = room(3_000).into_iter().map(|p| p.map(|x| x + 1e5));
    for (what, points) in [
        ("90 % duplicates", fallen),
        ("all equal", vec![[1.0, 2.0, 3.0]; 300]),
        ("on a line", (0..2_000).map(|_| [unit(), 0.0, 0.0]).collect()),
        ("on a plane", (0..2_000).map(|_| [unit(), unit(), 0.0]).collect()),
        ("on a slanted line", (0..2_000).map(|_| [unit(); 3]).collect()),
        ("two far clusters", room(3_000).into_iter().chain(far).collect()),
    ] {
        check(what, points, 20);
    }
    [2, 3, 5, 40].into_iter().for_each(|n| check(&format!("{n} points"), room(n), n - 1));
}
