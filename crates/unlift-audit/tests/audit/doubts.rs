//! Audits whose gates would hold without doubts, because the attack was weak or the ground truth
//! was of another map.

use std::sync::Arc;
use std::time::Instant;

use unlift::audit::{Plan, Threshold};
use unlift::obfuscate::obfuscate;
use unlift::recover::{Builtin, Delta};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::{Original, Secret};
use unlift::{PointSet, Unit};
use unlift_audit::{Audited, Error, Gate, Job, Preparation, Prepared, maps, prepare};

use crate::schemes;

const N: usize = 1500;

fn room() -> Vec<[f64; 3]> {
    unlift::synthetic::room(1, N).points
}

fn prepared(points: &[[f64; 3]]) -> Prepared {
    let preparation = Preparation { scale: Some(1.0), k: 20, ..Preparation::default() };
    prepare(points, None, &preparation).expect("points")
}

fn plan(names: &[&str]) -> Plan<3> {
    let usual = Plan::new(Unit::Meter);
    Plan {
        schemes: schemes(names, Unit::Meter),
        inlier_ratios: vec![0.5],
        k: 20,
        solvers: vec![Arc::new(Builtin::Joint)],
        records_alone: false,
        ..usual
    }
}

fn audit(
    prepared: &Prepared,
    hidden: Option<&(Released<3>, Secret)>,
    plan: Plan<3>,
    gate: &str,
) -> Result<Audited, Error> {
    let job = Job {
        hidden,
        plan,
        notes: prepared.notes.clone(),
        doubts: prepared.doubts.clone(),
        gates: vec![Gate::parse(gate).expect("a gate")],
        ..Job::of(&prepared.original, Instant::now())
    };
    maps::find(job)
}

/// Returns the doubt with which the only gate does not hold. The notes contain it, too.
fn reason(found: &Audited) -> &str {
    let [gate] = &found.document.gates[..] else { panic!("{:?}", found.document.gates) };
    assert!(!gate.passed && gate.found_percent <= Some(gate.bound_percent), "{gate:?}");
    let reason = gate.reason.as_deref().expect("a reason");
    assert!(found.document.notes.iter().any(|note| note == reason), "{:?}", found.document.notes);
    reason
}

#[test]
fn usual_maps_are_not_doubted() {
    let all = ["olc", "ppl", "ppl+", "ray", "plane", "cp"];
    let found = audit(&prepared(&room()), None, plan(&all), "all:0.25<=100").expect("an audit");
    assert_eq!(found.document.notes, Vec::<String>::new());
    assert!(found.document.gates[0].passed);
}

/// Long lists of a small map recover less, and the audit notes it.
#[test]
fn lists_that_are_long_for_a_map_are_said() {
    let points = prepared(&unlift::synthetic::room(1, 800).points);
    let within = |k: usize| {
        let found = audit(&points, None, Plan { k, ..plan(&["olc"]) }, "olc:0.25<=100");
        let document = found.expect("an audit").document;
        (document.results[0].recovered_percent["0.25"], document.notes)
    };
    let ((long, said), (short, nothing)) = (within(50), within(10));
    assert!(short > long + 10.0, "{long} {short}");
    assert!(said[0].starts_with("K = 50 is 6 % of the map's points"), "{said:?}");
    assert!(nothing.is_empty(), "{nothing:?}");
}

/// Returns the share of `points` that is recovered under `scheme` within 0.25 m, in percent; there
/// are no doubts.
fn recovered(points: &[[f64; 3]], scheme: &str) -> f64 {
    let gate = format!("{scheme}:0.25<=100");
    let found = audit(&prepared(points), None, plan(&[scheme]), &gate).expect("an audit");
    assert_eq!(found.document.notes, Vec::<String>::new());
    found.document.results[0].recovered_percent["0.25"]
}

/// One of two centers is near the far point, so the distance of centers is not related to the map's
/// size.
#[test]
fn a_far_point_is_no_protection() {
    let mut points = room();
    let usual = recovered(&points, "ray");
    points[5] = [1e4, -1e4, 3e3];
    let far = recovered(&points, "ray");
    assert!(far > usual - 10.0, "{usual} {far}");
}

/// The quartiles of all offsets are those of neither part.
#[test]
fn parts_far_apart_are_no_protection() {
    let points = room();
    let mut along: Vec<f64> = points.iter().map(|point| point[0]).collect();
    along.sort_by(f64::total_cmp);
    let away = |x: f64| if x < along[N / 2] { x } else { x + 1e3 };
    let apart: Vec<_> = points.iter().map(|&[x, y, z]| [away(x), y, z]).collect();
    let (usual, apart) = (recovered(&points, "plane"), recovered(&apart, "plane"));
    assert!(apart > usual - 10.0, "{usual} {apart}");
}

#[test]
fn a_delta_of_nothing_is_no_protection() {
    let plan = Plan { delta: Delta::Fixed(1e-6), ..plan(&["olc"]) };
    let found = audit(&prepared(&room()), None, plan, "olc:0.10<=50").expect("an audit");
    assert!(reason(&found).contains("1.0e-6 m, is far from"), "{}", reason(&found));
}

#[test]
fn a_gate_that_no_attack_could_break_is_refused() {
    let thresholds = ["1e-6", "0.25"].map(|label| Threshold::parse(label).expect("a threshold"));
    let plan = Plan { thresholds: thresholds.to_vec(), ..plan(&["olc"]) };
    let error = audit(&prepared(&room()), None, plan, "olc:1e-6<=1").expect_err("an error");
    let error = error.to_string();
    assert!(error.starts_with("--gate olc:1e-6<=1: expected points less"), "{error}");
}

/// Ground truth of a map that was scaled later: its points are nearer to their own records than to
/// others, but not near.
#[test]
fn a_truth_in_another_scale_is_no_protection() {
    let prepared_truth = prepared(&room());
    let olc = &schemes(&["olc"], Unit::Meter)[0];
    let hide = |original| obfuscate(&**olc, original, None, &Key::from_seed(1)).expect("hidden");
    let right = hide(&prepared_truth.original);
    let found = audit(&prepared_truth, Some(&right), plan(&["olc"]), "olc:0.10<=100");
    assert!(found.expect("an audit").document.gates[0].passed);
    let scaled = room().iter().map(|point| point.map(|x| 1.3 * x)).collect();
    let scaled = Original::new(PointSet::try_new(scaled, Unit::Meter).expect("points"));
    let wrong = hide(&scaled);
    let found = audit(&prepared_truth, Some(&wrong), plan(&["olc"]), "olc:0.10<=20");
    let found = found.expect("an audit");
    let told = format!("of {N} points are 0.100 m or more away from their own records");
    assert!(reason(&found).contains(&told), "{}", reason(&found));
}

/// Lengths in millimeters are declared as multiples of the distance to the K-th neighbor.
#[test]
fn a_unit_that_is_only_stated_is_no_protection() {
    let points = room().iter().map(|point| point.map(|x| 1000.0 * x)).collect();
    let points = PointSet::try_new(points, Unit::KthNeighbor).expect("points");
    let prepared = Prepared::of(Original::new(points));
    let olc = &schemes(&["olc"], Unit::KthNeighbor)[0];
    let hidden = obfuscate(&**olc, &prepared.original, None, &Key::from_seed(1)).expect("hidden");
    let plan =
        Plan { thresholds: vec![Threshold::parse("2.5").expect("a threshold")], ..plan(&["olc"]) };
    let found = audit(&prepared, Some(&hidden), plan, "olc:2.5<=20").expect("an audit");
    assert!(reason(&found).starts_with("unit: expected a usual distance"), "{}", reason(&found));
}
