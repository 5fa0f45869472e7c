//! Audits of maps at the limits of geometry: counted losses or a reason, never a NaN.

use crate::maps::{audit, *};

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
