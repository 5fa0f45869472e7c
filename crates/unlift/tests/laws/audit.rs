//! Tests of an audit: the strongest attack, two baselines, and parts that cannot be audited.

use std::sync::Arc;

use unlift::audit::{Bound, NeighborsBy, Outcome, Plan, Row, Silent, run};
use unlift::geometry::frame::Bounds;
use unlift::neighbors::{Geometric, Neighborhoods};
use unlift::obfuscate::{Lifted, Scheme, SchemeOptions, scheme};
use unlift::recover::{Builtin, RecoverOptions, Recovered, Solver, Unknown};
use unlift::released::{Lines, Obfuscation, Released};
use unlift::seed::{Key, Stage};
use unlift::truth::Original;
use unlift::{Error, PointSet, Unit, synthetic};

fn original(points: Vec<[f64; 3]>) -> Original<3> {
    Original::new(PointSet::try_new(points, Unit::Meter).unwrap())
}

fn room(n: usize) -> Original<3> {
    original(synthetic::room(3, n).points)
}

fn plan(schemes: &[&str]) -> Plan<3> {
    let mut plan = Plan::new(Unit::Meter);
    plan.schemes.retain(|scheme| schemes.contains(&scheme.name()));
    plan.inlier_ratios = vec![0.5];
    plan.k = 20;
    plan
}

fn audit(original: &Original<3>, plan: &Plan<3>) -> Outcome {
    run(original, None, plan, &mut Silent).unwrap()
}

#[test]
fn a_usual_audit_has_a_row_for_what_joint_recovery_starts_from() {
    let (room, mut plan) = (room(900), plan(&["olc", "ppl", "ray", "cp"]));
    plan.records_alone = false;
    let usual = audit(&room, &plan);
    let solvers: Vec<&str> = usual.rows.iter().map(|row| &*row.solver).collect();
    assert_eq!(solvers, ["ranking", "joint", "joint-start"].repeat(4));
    // `joint-start` gives the same rows with and without `joint`, in either order.
    for solvers in [
        Builtin::list(&[Builtin::JointStart]),
        Builtin::list(&[Builtin::JointStart, Builtin::Joint]),
    ] {
        plan.solvers = solvers;
        for row in audit(&room, &plan).rows {
            assert!(usual.rows.contains(&row), "{} by {}", row.scheme, row.solver);
        }
    }
    for (row, seconds) in usual.rows.iter().zip(&usual.seconds.rows) {
        let is_start = row.solver == "joint-start";
        assert_eq!(seconds.recover == 0.0, is_start, "no run of its own");
        let reason = if is_start { Unknown::OtherSolver } else { Unknown::SmallMap };
        assert_eq!(row.sure_unknown, Some(reason));
        assert!(row.reliability.is_none());
    }
}

#[test]
fn the_best_attack_on_the_records_alone_is_the_second_baseline() {
    let (room, plan) = (room(3_000), plan(&["olc", "ppl", "plane", "cp"]));
    let outcome = audit(&room, &plan);
    assert!(outcome.seconds.records_alone > 0.0);
    for row in &outcome.rows {
        let best = |at: usize| row.best_alone(at).map(|(_, percent)| percent);
        if row.scheme == "plane" {
            assert_eq!((row.records_alone.len(), best(0)), (0, None), "planes alone tell nothing");
            assert_eq!(row.baseline_percent(0), row.blind_percent[0]);
            continue;
        }
        let named = |name: &str| row.records_alone.iter().find(|a| a.name == name);
        let tomography = &named("tomography").unwrap().percent;
        for (at, percent) in tomography.iter().enumerate() {
            assert!(best(at).unwrap() >= *percent, "{}: at least tomography", row.scheme);
            assert!(row.baseline_percent(at) >= row.blind_percent[at].max(*percent));
        }
        assert!(named("geometric, joint").is_some(), "{}", row.scheme);
    }
    // Records alone recover much of a room from `olc`, so the blind baseline is too weak.
    let olc = &outcome.rows[0];
    assert!(olc.baseline_percent(1) > olc.blind_percent[1] + 20.0, "{olc:?}");
}

#[test]
fn break_even_takes_the_strongest_attack_at_every_ratio() {
    let (room, mut plan) = (room(600), plan(&["olc", "cp"]));
    (plan.records_alone, plan.inlier_ratios) = (false, vec![0.5, 0.1]);
    plan.solvers.push(Arc::new(Builtin::Ransac));
    let outcome = audit(&room, &plan);
    let mut rows = outcome.rows.clone();
    // Different solvers win at the two ratios.
    for row in rows.iter_mut().filter(|row| row.scheme == "olc") {
        row.recovered_percent[0] = match (&*row.solver, row.inlier_ratio) {
            ("joint", 0.5) | ("ransac", 0.1) => 60.0,
            _ => 40.0,
        };
    }
    let found = unlift::audit::break_even(&plan, &rows);
    let of =
        |solver: &str| found.iter().find(|b| (&*b.scheme, &*b.solver) == ("olc", solver)).unwrap();
    assert_eq!(of("strongest").inlier_ratio, 0.1, "half comes back at the lowest ratio");
    assert!((of("joint").inlier_ratio - 0.3).abs() < 1e-12);
    assert_eq!(found.len(), 2 * 5);
    plan.solvers = Builtin::list(&[Builtin::Joint]);
    let mut by_joint = outcome.rows.clone();
    by_joint.retain(|row| row.solver == "joint");
    by_joint.iter_mut().for_each(|row| row.blind_percent.fill(0.0));
    let alone = unlift::audit::break_even(&plan, &by_joint);
    assert!(alone.iter().all(|b| b.solver == "joint"), "one attack has no strongest");
}

/// Returns points of one plane, for which a scheme that avoids lines within surfaces finds no line.
fn flat(n: usize) -> Original<3> {
    let place = |i: usize| [0.01 * ((i * 7919) % 1000) as f64, 0.01 * ((i * 104_729) % 997) as f64];
    original((0..n).map(|i| [place(i)[0], place(i)[1], 1.0]).collect())
}

#[test]
fn a_scheme_that_a_map_does_not_allow_is_told_and_the_audit_goes_on() {
    let mut plan = Plan::new(Unit::Meter);
    (plan.inlier_ratios, plan.records_alone) = (vec![1.0, 0.5], false);
    let outcome = audit(&flat(400), &plan);
    let missing: Vec<&str> = outcome.not_audited.iter().map(|m| &*m.scheme).collect();
    assert_eq!(missing, ["ppl+"], "{:?}", outcome.not_audited);
    let told = &outcome.not_audited[0];
    assert_eq!(told.neighbors, None, "the scheme itself");
    assert!(told.reason.contains("ppl+ leaves out") && told.reason.contains("of 400"), "{told:?}");
    assert!(outcome.rows.iter().all(|row| row.scheme != "ppl+"));
    for scheme in plan.schemes.iter().filter(|scheme| scheme.name() != "ppl+") {
        let n = outcome.rows.iter().filter(|row| row.scheme == scheme.name()).count();
        assert_eq!(n, 6, "{}", scheme.name());
    }
    assert_eq!(outcome.rows.len(), outcome.seconds.rows.len());

    plan.schemes.retain(|scheme| scheme.name() == "ppl+");
    let error = run(&flat(400), None, &plan, &mut Silent).unwrap_err().to_string();
    let begin =
        "schemes: expected one that can be applied to this map, found none: ppl+: k: expected";
    assert!(error.starts_with(begin), "{error}");
}

#[test]
fn a_source_without_lists_for_a_scheme_costs_its_rows_alone() {
    let mut plan = plan(&["olc", "plane"]);
    plan.neighbors.push(NeighborsBy::Source(Arc::new(Geometric)));
    plan.repeats = 2;
    let outcome = audit(&room(500), &plan);
    let [missing] = outcome.not_audited.as_slice() else { panic!("{:?}", outcome.not_audited) };
    assert_eq!((&*missing.scheme, missing.neighbors.as_deref()), ("plane", Some("geometric")));
    assert!(missing.reason.ends_with("found planes"), "{}", missing.reason);
    let of = |row: &Row| [&row.scheme, &row.neighbors, &row.solver].map(String::clone);
    let rows: Vec<_> = outcome.rows.iter().map(of).collect();
    let row = |scheme: &str, neighbors: &str, solver: &str| {
        [scheme, neighbors, solver].map(str::to_owned)
    };
    let expected = [
        row("olc", "oracle", "ranking"),
        row("olc", "oracle", "joint"),
        row("olc", "oracle", "joint-start"),
        row("olc", "geometric", "ranking"),
        row("olc", "geometric", "joint"),
        row("olc", "geometric", "joint-start"),
        row("plane", "oracle", "ranking"),
        row("plane", "oracle", "joint"),
        row("plane", "oracle", "joint-start"),
    ];
    assert_eq!(rows, expected);
}

#[test]
fn a_map_too_small_for_wrong_neighbors_loses_these_rows_alone() {
    let mut plan = plan(&["olc"]);
    (plan.inlier_ratios, plan.k, plan.records_alone) = (vec![1.0, 0.1], 50, false);
    let outcome = audit(&room(60), &plan);
    assert!(outcome.rows.iter().all(|row| row.inlier_ratio == 1.0) && outcome.rows.len() == 3);
    let [missing] = outcome.not_audited.as_slice() else { panic!("{:?}", outcome.not_audited) };
    assert_eq!((missing.inlier_ratio, missing.oracle_noise), (Some(0.1), Some("uniform")));
}

/// On a flat map the blind guess within a meter was better than every list, but break-even was
/// reported as "above".
#[test]
fn what_needs_no_neighborhoods_counts_in_break_even() {
    let mut plan = plan(&["ray", "cp"]);
    (plan.records_alone, plan.inlier_ratios) = (false, vec![0.5, 0.1]);
    plan.solvers = vec![Arc::new(Builtin::Joint)];
    let mut rows = audit(&room(600), &plan).rows;
    for row in &mut rows {
        (row.recovered_percent[0], row.blind_percent[0]) = (25.0, 96.0);
    }
    let found = unlift::audit::break_even(&plan, &rows);
    for scheme in ["ray", "cp"] {
        let of = |solver: &str| {
            let mut found = found.iter();
            found.find(|b| b.scheme == scheme && b.solver == solver).unwrap()
        };
        assert_eq!(
            (of("strongest").inlier_ratio, of("strongest").bound),
            (0.1, Bound::BelowTested)
        );
        assert_eq!((of("joint").inlier_ratio, of("joint").bound), (0.5, Bound::AboveTested));
    }
}

/// `olc` with a bug: it reports the hidden points in the wrong order.
#[derive(Debug)]
struct Mistaken;

impl Scheme<3> for Mistaken {
    fn name(&self) -> &str {
        "mistaken"
    }

    fn lift(
        &self,
        points: &[[f64; 3]],
        bounds: Option<&Bounds<3>>,
        key: &Key,
    ) -> Result<Lifted<3>, Error> {
        let options = SchemeOptions::usual(Unit::Meter);
        let olc = scheme("olc")?.of_dimension::<3>(&options).unwrap();
        let mut lifted = olc.lift(points, bounds, key)?;
        key.draws(Stage::Scheme, 1).shuffle(&mut lifted.hidden);
        Ok(lifted)
    }
}

/// Lines one meter beside their points, or different lines in every call if `off` is zero.
#[derive(Debug, Default)]
struct Beside {
    off: f64,
    calls: std::sync::atomic::AtomicU32,
}

impl Scheme<3> for Beside {
    fn name(&self) -> &str {
        "beside"
    }

    fn lift(
        &self,
        points: &[[f64; 3]],
        _: Option<&Bounds<3>>,
        _: &Key,
    ) -> Result<Lifted<3>, Error> {
        let call = self.calls.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let through: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1] + self.off, p[2]]).collect();
        let lines = Lines::through(&through, &vec![[1.0, 0.0, f64::from(call)]; points.len()])?;
        Ok(Lifted::one_each(Obfuscation::Lines(lines)))
    }
}

/// Regression: almost nothing was recovered from such lines, so a gate held.
#[test]
fn a_scheme_that_breaks_a_law_has_no_row() {
    let room = room(600);
    for (off, law) in
        [(1.0, "on their own records, found 600 of 600"), (0.0, "the same for the same key")]
    {
        let mut plan = plan(&["olc"]);
        plan.records_alone = false;
        plan.schemes.push(Arc::new(Beside { off, ..Beside::default() }));
        let outcome = audit(&room, &plan);
        assert!(outcome.rows.iter().all(|row| row.scheme == "olc"));
        let missing = &outcome.not_audited[0];
        assert!(missing.scheme == "beside" && missing.reason.contains(law), "{}", missing.reason);
        plan.schemes.remove(0);
        let error = run(&room, None, &plan, &mut Silent).unwrap_err().to_string();
        assert!(error.contains(law), "{error}");
    }
}

/// Regression: almost nothing was recovered, so a gate held.
#[test]
fn a_scheme_whose_records_are_not_where_its_points_are_has_no_row() {
    let (room, mut plan) = (room(900), plan(&["olc"]));
    plan.records_alone = false;
    plan.schemes.push(Arc::new(Mistaken));
    let outcome = audit(&room, &plan);
    assert!(outcome.rows.iter().all(|row| row.scheme == "olc"));
    let [missing] = &outcome.not_audited[..] else { panic!("{:?}", outcome.not_audited) };
    assert_eq!(missing.scheme, "mistaken");
    assert!(missing.reason.contains("points nearer to their own records"), "{}", missing.reason);
}

/// A solver for lines only. It returns the foot of each line.
#[derive(Debug)]
struct AtFoot(&'static str);

impl Solver<3> for AtFoot {
    fn name(&self) -> &str {
        self.0
    }

    fn recover(
        &self,
        released: &Released<3>,
        lists: &Neighborhoods,
        _: &RecoverOptions,
    ) -> Result<Recovered<3>, Error> {
        let Obfuscation::Lines(lines) = released.obfuscation() else {
            return Err(Error::new("records", "lines", released.obfuscation().family()));
        };
        Recovered::from_positions(released, lists, lines.foot())
    }
}

#[test]
fn a_solver_of_ones_own_has_rows_and_loses_those_that_it_fails_on() {
    let mut plan = plan(&["olc", "plane"]);
    plan.inlier_ratios = vec![0.5];
    plan.solvers = vec![Arc::new(AtFoot("foot")), Arc::new(Builtin::Joint)];
    let outcome = audit(&room(400), &plan);
    let rows: Vec<[&str; 2]> =
        outcome.rows.iter().map(|row| [&*row.scheme, &*row.solver]).collect();
    assert_eq!(rows, [["olc", "foot"], ["olc", "joint"], ["plane", "joint"]]);
    assert_eq!(outcome.rows[0].sure_unknown, Some(Unknown::OtherSolver));
    let [missing] = outcome.not_audited.as_slice() else { panic!("{:?}", outcome.not_audited) };
    assert_eq!((&*missing.scheme, missing.neighbors.as_deref()), ("plane", Some("oracle")));
    let expected = "solver foot: records: expected lines, found";
    assert!(missing.reason.starts_with(expected), "{}", missing.reason);
    // Reports describe `joint` as the built-in solver.
    plan.solvers = vec![Arc::new(AtFoot("joint"))];
    let error = run(&room(400), None, &plan, &mut Silent).unwrap_err();
    let expected = "solver: expected a name that no solver of unlift has, found joint";
    assert_eq!(error.to_string(), expected);
}
