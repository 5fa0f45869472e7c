//! Audits of maps at the limits of geometry and of numbers: counted losses or a reason, never a
//! NaN, never "sure" of wrong positions.

use std::sync::Arc;

use unlift::audit::{Outcome, Plan, Row, Silent, Threshold, run};
use unlift::recover::Builtin;
use unlift::seed::{Draws, Stage};
use unlift::truth::Original;
use unlift::{Error, PointSet, Unit, synthetic};

/// Audits all schemes with `joint` and `joint-start`, within 0.1 and 0.25 times `unit`.
fn audit(points: Vec<[f64; 3]>, unit: f64, k: usize) -> Outcome {
    try_audit(points, unit, k).unwrap()
}

fn try_audit(points: Vec<[f64; 3]>, unit: f64, k: usize) -> Result<Outcome, Error> {
    let original = Original::new(PointSet::try_new(points, Unit::Meter).unwrap());
    let mut plan = Plan::new(Unit::Meter);
    plan.inlier_ratios = vec![1.0, 0.3];
    plan.solvers = vec![Arc::new(Builtin::Joint), Arc::new(Builtin::Consensus)];
    plan.records_alone = false;
    plan.k = k;
    plan.thresholds = [0.1, 0.25]
        .map(|length| Threshold { label: length.to_string(), value: length * unit })
        .into();
    run(&original, None, &plan, &mut Silent)
}

/// Checks conditions that hold for any map. Returns the rows of `joint`.
fn checked(what: &str, outcome: Outcome) -> Vec<Row> {
    let schemes = outcome.rows.iter().map(|row| row.scheme.as_str());
    let refused = outcome.not_audited.iter().map(|not| not.scheme.as_str());
    let mut audited: Vec<&str> = schemes.chain(refused).collect();
    audited.sort_unstable();
    audited.dedup();
    assert_eq!(
        audited.len(),
        Plan::<3>::new(Unit::Meter).schemes.len(),
        "{what}: a scheme is missing"
    );
    for row in &outcome.rows {
        let cell = format!("{what}: {} {} at {}", row.scheme, row.solver, row.inlier_ratio);
        assert!(row.delta.is_finite() && row.delta > 0.0, "{cell}: delta {}", row.delta);
        let shares = row.recovered_percent.iter().chain(&row.blind_percent);
        let mut shares = shares.chain(&row.axis_accuracy_percent).chain(&row.exact_percent);
        assert!(shares.all(|share| (0.0..=100.0).contains(share)), "{cell}: {row:?}");
        let mut errors = row.error_percentiles.iter().flatten().chain(&row.blind_median_error);
        assert!(errors.all(|error| error.is_finite() && *error >= 0.0), "{cell}: {row:?}");
        assert!(row.lost.values().sum::<usize>() <= row.n_points * 2, "{cell}: {row:?}");
        let Some(reliability) = &row.reliability else { continue };
        let sure = reliability.sure;
        assert!(sure.expected.is_finite(), "{cell}: {sure:?}");
        if sure.n * 100 >= reliability.n_points && sure.n >= 20 {
            let right = 100.0 * sure.within as f64 / sure.n as f64;
            assert!(right >= 85.0, "{cell}: sure of {}, of which {right:.0} % are right", sure.n);
        }
    }
    outcome.rows.into_iter().filter(|row| row.solver == "joint").collect()
}

fn room(n: usize) -> Vec<[f64; 3]> {
    synthetic::room(5, n).points
}

fn moved(points: Vec<[f64; 3]>, by: f64) -> Vec<[f64; 3]> {
    points.into_iter().map(|p| p.map(|x| x + by)).collect()
}

fn draws() -> Draws {
    Draws::new(11, Stage::Synthetic, 77)
}

fn shares(rows: &[Row]) -> Vec<f64> {
    rows.iter().map(|row| row.recovered_percent[0]).collect()
}

#[test]
fn a_scaled_map_comes_back_as_the_map_does() {
    let usual = checked("room", audit(room(3_000), 1.0, 20));
    for scale in [1e-9, 1e9] {
        let points = room(3_000).into_iter().map(|p| p.map(|x| x * scale)).collect();
        let scaled = checked(&format!("times {scale:e}"), audit(points, scale, 20));
        // The voxel size does not scale with the map, so `ray-voxel` is not compared.
        let pairs = usual.iter().zip(&scaled).filter(|(row, _)| row.scheme != "ray-voxel");
        for (row, scaled) in pairs {
            assert_eq!(row.scheme, scaled.scheme);
            let (a, b) = (row.recovered_percent[0], scaled.recovered_percent[0]);
            assert!(
                (a - b).abs() < 2.0,
                "{} at {} times {scale:e}: {a}, {b}",
                row.scheme,
                row.inlier_ratio
            );
        }
    }
}

#[test]
fn far_from_the_origin_a_map_comes_back_as_far_as_its_numbers_reach() {
    let usual = shares(&checked("room", audit(room(3_000), 1.0, 20)));
    let far = shares(&checked("moved by 1e9", audit(moved(room(3_000), 1e9), 1.0, 20)));
    for (usual, far) in usual.iter().zip(far) {
        assert!((usual - far).abs() < 4.0, "{usual}, {far}");
    }
    // Doubles are 0.125 apart there, so points coincide.
    let error = try_audit(moved(room(600), 1e15), 1.0, 20).unwrap_err().to_string();
    assert!(error.contains("too coarse for a map"), "{error}");
}

/// Regression: `f32` cannot represent volumes of such maps, so only a part of the points was
/// recovered, without a warning.
#[test]
fn maps_too_small_or_large_for_floats_are_refused_with_a_reason() {
    for scale in [1e-30, 1e-12, 1e13, 1e30, 1e37] {
        let points = room(600).into_iter().map(|p| p.map(|x| x * scale)).collect();
        let error = try_audit(points, scale, 20).unwrap_err().to_string();
        assert!(error.contains("a size between 1e-10 and 1e12 units"), "{error}");
    }
}

#[test]
fn points_that_fall_together_are_not_counted_as_sure() {
    let mut draws = draws();
    let mut points = room(600);
    while points.len() < 6_000 {
        points.push(points[draws.below(600) as usize]);
    }
    checked("90 % duplicates", audit(points, 1.0, 20));
    checked("all equal", audit(vec![[1.0, 2.0, 3.0]; 300], 1.0, 20));
}

#[test]
fn flat_and_thin_maps_are_audited_or_refused_with_a_reason() {
    let mut draws = draws();
    let mut unit = || draws.between(0.0, 5.0);
    checked("on a line", audit((0..2_000).map(|_| [unit(), 0.0, 0.0]).collect(), 1.0, 20));
    checked("on a plane", audit((0..2_000).map(|_| [unit(), unit(), 0.0]).collect(), 1.0, 20));
    checked("on a slanted line", audit((0..2_000).map(|_| [unit(); 3]).collect(), 1.0, 20));
}

#[test]
fn two_far_clusters_do_not_make_anybody_sure() {
    let mut points = room(3_000);
    points.extend(moved(room(3_000), 1e5));
    checked("two far clusters", audit(points, 1.0, 20));
}

#[test]
fn tiny_maps_and_lists_as_long_as_the_map_are_audited() {
    for n in [2, 3, 5, 40] {
        checked(&format!("{n} points"), audit(room(n), 1.0, n - 1));
    }
}
