//! Tests of an audit: the strongest attack, two baselines, and parts that cannot be audited.

use std::sync::atomic::{AtomicU32, Ordering};

use unlift::audit::{Bound, NeighborsBy, break_even};
use unlift::neighbors::{Geometric, Needs, Similarity, Source};
use unlift::obfuscate::{Lifted, LocalPoints};

use crate::maps::{self, *};

const OURS: [Builtin; 1] = [Builtin::Joint];

fn room(n: usize) -> Original<3> {
    original(synthetic::room(3, n).points)
}

fn plan(schemes: &[&str], ratios: &[f64]) -> Plan<3> {
    Plan { k: 20, ..maps::plan(Unit::Meter, schemes, ratios, &OURS) }
}

#[test]
fn the_best_attack_on_the_records_alone_is_the_second_baseline() {
    let mut plan = plan(&["olc", "ppl", "plane", "cp"], &[0.5]);
    plan.records_alone = true;
    let outcome = audit(&room(3_000), &plan);
    assert!(outcome.seconds.records_alone > 0.0);
    for row in &outcome.rows {
        let (alone, best) = (&row.parts.alone, &row.records_alone_percent);
        if row.scheme == "plane" {
            assert_eq!((alone.len(), best), (0, &None), "planes alone tell nothing");
            assert_eq!(row.baseline_percent("0.10"), Some(row.blind_percent["0.10"]));
            continue;
        }
        let named = |name: &str| alone.iter().find(|a| a.name == name);
        let tomography = &named("tomography").unwrap().shares;
        for (label, share) in tomography {
            let best = best.as_ref().unwrap()[label];
            assert!(best >= share.percent(), "{}: at least tomography", row.scheme);
            let baseline = row.baseline_percent(label);
            assert_eq!(baseline, Some(row.blind_percent[label].max(best)));
        }
        assert!(named("geometric, joint").is_some(), "{}", row.scheme);
    }
    // Records alone recover much of a room from `olc`, so the blind baseline is too weak.
    let olc = &outcome.rows[0];
    assert!(olc.baseline_percent("0.25") > Some(olc.blind_percent["0.25"] + 20.0), "{olc:?}");
}

#[test]
fn break_even_takes_the_strongest_attack_at_every_ratio() {
    let mut plan = plan(&["olc", "cp"], &[0.5, 0.1]);
    plan.solvers.push(Arc::new(Builtin::Ransac));
    let mut rows = audit(&room(600), &plan).rows;
    // Different solvers win at the two ratios.
    for row in &mut rows {
        let wins = matches!((&*row.solver, row.inlier_ratio), ("joint", 0.5) | ("ransac", 0.1));
        row.recovered_percent[0] = if wins { 60.0 } else { 40.0 };
        row.blind_percent[0] = 0.0;
    }
    let of = |rows: &[Row], scheme: &str, solver: &str| {
        let found = break_even(&plan, rows);
        assert_eq!(found.len(), 2 * 3);
        let it = found.iter().find(|b| (&*b.scheme, &*b.solver) == (scheme, solver)).unwrap();
        (it.inlier_ratio, it.bound)
    };
    assert_eq!(of(&rows, "olc", "strongest").0, 0.1, "half comes back at the lowest ratio");
    // No ratio is interpolated over the wide gap below 0.5.
    assert_eq!(of(&rows, "olc", "joint"), (0.5, Bound::BelowTested));
    // Regression: on a flat map the blind guess was better than every list, but break-even was "above".
    for row in &mut rows {
        (row.recovered_percent[0], row.blind_percent[0]) = (25.0, 96.0);
    }
    for scheme in ["olc", "cp"] {
        assert_eq!(of(&rows, scheme, "strongest"), (0.1, Bound::BelowTested));
        assert_eq!(of(&rows, scheme, "joint"), (0.5, Bound::AboveTested));
    }
    plan.solvers = Builtin::list(&OURS);
    rows.retain(|row| row.solver == "joint");
    rows.iter_mut().for_each(|row| row.blind_percent[0] = 0.0);
    let alone = break_even(&plan, &rows);
    assert!(alone.iter().all(|b| b.solver == "joint"), "one attack has no strongest");
}

/// Returns points of one plane, for which a scheme that avoids lines within surfaces finds no line.
fn flat(n: usize) -> Original<3> {
    let place = |i: usize| [0.01 * ((i * 7919) % 1000) as f64, 0.01 * ((i * 104_729) % 997) as f64];
    original((0..n).map(|i| [place(i)[0], place(i)[1], 1.0]).collect())
}

#[test]
fn a_scheme_that_a_map_does_not_allow_is_told_and_the_audit_goes_on() {
    let mut plan = maps::plan(Unit::Meter, &[], &[1.0, 0.5], &OURS);
    let outcome = audit(&flat(400), &plan);
    let [missing] = &outcome.not_audited[..] else { panic!("{:?}", outcome.not_audited) };
    assert_eq!((&*missing.scheme, &missing.neighbors), ("ppl+", &None), "the scheme itself");
    let reason = &missing.reason;
    assert!(reason.contains("ppl+ leaves out") && reason.contains("of 400"), "{reason}");
    for scheme in &plan.schemes {
        let n = outcome.rows.iter().filter(|row| row.scheme == scheme.name()).count();
        assert_eq!(n, if scheme.name() == "ppl+" { 0 } else { 2 }, "{}", scheme.name());
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
    let neighbors = vec![NeighborsBy::Oracle, NeighborsBy::Source(Arc::new(Geometric))];
    let plan = Plan { neighbors, repeats: 2, ..plan(&["olc", "plane"], &[0.5]) };
    let outcome = audit(&room(500), &plan);
    let [missing] = &outcome.not_audited[..] else { panic!("{:?}", outcome.not_audited) };
    assert_eq!((&*missing.scheme, missing.neighbors.as_deref()), ("plane", Some("geometric")));
    assert!(missing.reason.ends_with("found planes"), "{}", missing.reason);
    let of = |row: &Row| format!("{} {}", row.scheme, row.neighbors);
    assert!(outcome.rows.iter().map(of).eq(["olc oracle", "olc geometric", "plane oracle"]));
}

#[test]
fn a_map_too_small_for_wrong_neighbors_loses_these_rows_alone() {
    let plan = Plan { k: 50, ..plan(&["olc"], &[1.0, 0.1]) };
    let outcome = audit(&room(60), &plan);
    assert!(outcome.rows.iter().all(|row| row.inlier_ratio == 1.0) && outcome.rows.len() == 1);
    let [missing] = &outcome.not_audited[..] else { panic!("{:?}", outcome.not_audited) };
    assert_eq!((missing.inlier_ratio, missing.oracle_noise), (Some(0.1), Some("uniform")));
}

/// A scheme with a bug.
#[derive(Debug)]
enum Wrong {
    /// `olc` that reports the hidden points in another order.
    Order,
    /// Lines one meter beside their points.
    Beside,
    /// Other lines in every call.
    Calls(AtomicU32),
}

impl Scheme<3> for Wrong {
    fn name(&self) -> &str {
        "wrong"
    }

    fn lift(&self, points: &LocalPoints<'_, 3>, key: &Key) -> Result<Lifted<3>, Error> {
        let (off, turn) = match self {
            Self::Order => {
                let mut lifted = unlift::obfuscate::olc::ENTRY.lift(points, key)?;
                key.draws(Stage::Scheme, 1).shuffle(&mut lifted.hidden);
                return Ok(lifted);
            }
            Self::Beside => (1.0, 0),
            Self::Calls(calls) => (0.0, calls.fetch_add(1, Ordering::Relaxed)),
        };
        let points = points.positions;
        let through: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1] + off, p[2]]).collect();
        let lines = Lines::through(&through, &vec![[1.0, 0.0, f64::from(turn)]; points.len()])?;
        Ok(Lifted::one_each(Obfuscation::Lines(lines)))
    }
}

/// Regression: almost nothing was recovered from such records, so a gate held.
#[test]
fn a_scheme_that_breaks_a_law_has_no_row() {
    let room = room(900);
    for (wrong, law) in [
        (Wrong::Order, "points nearer to their own records"),
        (Wrong::Beside, "on their own records, found 900 of 900"),
        (Wrong::Calls(AtomicU32::new(0)), "the same for the same key"),
    ] {
        let mut plan = plan(&["olc"], &[0.5]);
        plan.schemes.push(Arc::new(wrong));
        let outcome = audit(&room, &plan);
        assert!(outcome.rows.iter().all(|row| row.scheme == "olc"));
        let [missing] = &outcome.not_audited[..] else { panic!("{:?}", outcome.not_audited) };
        assert!(missing.scheme == "wrong" && missing.reason.contains(law), "{}", missing.reason);
        plan.schemes.remove(0);
        let error = run(&room, None, &plan, &mut Silent).unwrap_err().to_string();
        assert!(error.contains(law), "{error}");
    }
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
    let mut plan = plan(&["olc", "plane"], &[0.5]);
    plan.solvers = vec![Arc::new(AtFoot("foot")), Arc::new(Builtin::Joint)];
    let outcome = audit(&room(400), &plan);
    let of = |row: &Row| format!("{} {}", row.scheme, row.solver);
    assert!(outcome.rows.iter().map(of).eq(["olc foot", "olc joint", "plane joint"]));
    assert_eq!(outcome.rows[0].sure_unknown, Some(Unknown::OtherSolver.reason().to_owned()));
    let [missing] = &outcome.not_audited[..] else { panic!("{:?}", outcome.not_audited) };
    assert_eq!((&*missing.scheme, missing.neighbors.as_deref()), ("plane", Some("oracle")));
    let expected = "solver foot: records: expected lines, found";
    assert!(missing.reason.starts_with(expected), "{}", missing.reason);
    // Reports describe `joint` as the built-in solver.
    plan.solvers = vec![Arc::new(AtFoot("joint"))];
    let error = run(&room(400), None, &plan, &mut Silent).unwrap_err();
    let expected = "solver: expected a name that no solver of unlift has, found joint";
    assert_eq!(error.to_string(), expected);
}

/// A source whose lists of rays are longer.
#[derive(Debug)]
struct ByFamily;

impl Source<3> for ByFamily {
    fn name(&self) -> &str {
        "by-family"
    }

    fn needs(&self) -> Needs {
        Needs::DescriptorsAlone
    }

    fn k(&self, released: &Released<3>) -> usize {
        if matches!(released.obfuscation(), Obfuscation::Rays(_)) { 10 } else { 7 }
    }

    fn lists(&self, released: &Released<3>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        Similarity.lists(released, k, seed)
    }
}

/// A scheme's row is the same alone and after schemes with other lists, which an audit keeps.
#[test]
fn lists_are_kept_by_their_length() {
    let (original, descriptors) = (room(60), random_descriptors(1, 60, 8));
    let rows = |schemes: &[&str]| {
        let mut plan = plan(schemes, &[0.5]);
        plan.neighbors = vec![NeighborsBy::Source(Arc::new(ByFamily))];
        run(&original, Some(&descriptors), &plan, &mut Silent).unwrap().rows
    };
    let schemes = ["olc", "ray", "plane"];
    assert_eq!(rows(&schemes), schemes.map(|scheme| rows(&[scheme])).concat());
}
