//! Audits whose gates would hold without doubts, because the attack was weak or the ground truth was of another map.

use std::path::Path;
use std::sync::Arc;

use unlift::audit::doubts::of_descriptors;
use unlift::audit::{NeighborsBy, Plan, Threshold};
use unlift::descriptors::Values;
use unlift::geometry::vector::sub;
use unlift::neighbors::Geometric;
use unlift::obfuscate::obfuscate;
use unlift::recover::Builtin;
use unlift::released::{Lines, Obfuscation, Released};
use unlift::seed::{Key, Stage};
use unlift::truth::{Original, OriginalId, Secret};
use unlift::{Descriptors, PointSet, Unit};
use unlift_audit::{Audited, Error, Hidden, Input, Map, Prepared};
use unlift_io::read;

use crate::{audited, plan, prepared, schemes};

const N: usize = 1500;

fn room() -> Vec<[f64; 3]> {
    unlift::synthetic::room(1, N).points
}

/// Hides points under `olc`.
fn hidden(points: Vec<[f64; 3]>, unit: Unit) -> (Released<3>, Secret) {
    let original = Original::new(PointSet::try_new(points, unit).unwrap());
    obfuscate(&*schemes(&["olc"], unit)[0], &original, None, &Key::from_seed(1)).unwrap()
}

fn audit(
    prepared: &Prepared,
    hidden: Option<&(Released<3>, Secret)>,
    plan: Plan<3>,
    gate: &str,
) -> Result<Audited, Error> {
    let map = Map { plan, ..Map::new(prepared) };
    let input = match hidden {
        Some(release) => Input::Released(map, Hidden { release, published: Vec::new() }),
        None => Input::Map(map),
    };
    audited(prepared, &input, &[gate])
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
    let plan = plan(&["olc", "ppl", "ppl+", "ray", "plane", "cp"]);
    let document = audit(&prepared(&room()), None, plan, "all:joint:0.25<=100").unwrap().document;
    assert_eq!(document.notes, Vec::<String>::new());
    assert!(document.gates[0].passed);
}

/// Long lists of a small map may recover less, and the audit notes it.
#[test]
fn lists_that_are_long_for_a_map_are_said() {
    let points = prepared(&unlift::synthetic::room(1, 800).points);
    let within = |k: usize| {
        let found = audit(&points, None, Plan { k, ..plan(&["olc"]) }, "olc:0.25<=100");
        found.unwrap().document.notes
    };
    let (said, nothing) = (within(50), within(10));
    assert!(said[0].starts_with("K = 50 is 6 % of the map's points"), "{said:?}");
    assert!(nothing.is_empty(), "{nothing:?}");
}

/// One of two centers is near the far point, so the distance of centers is not related to the map's
/// size. The quartiles of all offsets of planes are those of neither part.
#[test]
fn far_points_and_parts_are_no_protection() {
    let recovered = |points: &[[f64; 3]], scheme: &str| {
        let gate = format!("{scheme}:0.25<=100");
        let document = audit(&prepared(points), None, plan(&[scheme]), &gate).unwrap().document;
        assert_eq!(document.notes, Vec::<String>::new());
        document.results[0].recovered_percent["0.25"]
    };
    let (usual, mut far) = (room(), room());
    far[5] = [1e4, -1e4, 3e3];
    let mut along: Vec<f64> = usual.iter().map(|point| point[0]).collect();
    along.sort_by(f64::total_cmp);
    let away = |x: f64| if x < along[N / 2] { x } else { x + 1e3 };
    let apart = usual.iter().map(|&[x, y, z]| [away(x), y, z]).collect();
    for (points, scheme) in [(far, "ray"), (apart, "plane")] {
        let [usual, other] = [&usual, &points].map(|points| recovered(points, scheme));
        assert!(other > usual - 10.0, "{scheme}: {usual} {other}");
    }
}

#[test]
fn a_gate_that_no_attack_could_break_is_refused() {
    let thresholds = ["1e-6", "0.25"].map(|label| Threshold::parse(label).unwrap());
    let plan = Plan { thresholds: thresholds.to_vec(), ..plan(&["olc"]) };
    let error = audit(&prepared(&room()), None, plan, "olc:1e-6<=1").expect_err("an error");
    let error = error.to_string();
    assert!(error.starts_with("--gate olc:1e-6<=1: expected points less"), "{error}");
}

/// Ground truth of a map that was scaled later: its points are nearer to their own records than to others, but not near.
#[test]
fn a_truth_in_another_scale_is_no_protection() {
    let audit = |factor: f64, by: f64| {
        let points = room().iter().map(|point| point.map(|x| factor * x + by)).collect();
        let wrong = hidden(points, Unit::Meter);
        audit(&prepared(&room()), Some(&wrong), plan(&["olc"]), "olc:0.10<=100")
    };
    let error = audit(0.01, 0.0).expect_err("meters and centimeters").to_string();
    assert!(error.contains("not measured"), "{error}");
    let found = audit(1.3, 0.0).unwrap();
    let told = format!("of {N} points are 0.100 m or more away from their own records");
    assert!(reason(&found).contains(&told), "{}", reason(&found));
    // Moved by 9 cm, no point is 10 cm away.
    let found = audit(1.0, 0.052).unwrap();
    assert!(reason(&found).contains("truth: half of the points are 0.0"), "{}", reason(&found));
}

/// A scheme that moves points before it hides them is measured. Its noise is part of the figures, which others may average away.
#[test]
fn noise_of_records_is_measured_and_no_protection() {
    let truth = prepared(&room());
    let mut draws = Key::from_seed(7).draws(Stage::Scheme, 1);
    for (noise, held) in [(0.005, [true; 2]), (0.02, [false, true]), (0.5, [false; 2])] {
        let moved = room().iter().map(|p| p.map(|x| x + noise * draws.normal())).collect();
        let hidden = hidden(moved, Unit::Meter);
        for (threshold, held) in ["0.10", "0.25"].into_iter().zip(held) {
            let gate = format!("olc:joint:{threshold}<=100");
            let found = audit(&truth, Some(&hidden), plan(&["olc"]), &gate).unwrap();
            assert_eq!(found.document.gates[0].passed, held, "{noise} {gate}");
            assert!(held || reason(&found).contains("off their records, as by noise"));
        }
    }
}

/// Lengths in millimeters are declared as multiples of the distance to the K-th neighbor.
#[test]
fn a_unit_that_is_only_stated_is_no_protection() {
    let points: Vec<_> = room().iter().map(|point| point.map(|x| 1000.0 * x)).collect();
    let set = PointSet::try_new(points.clone(), Unit::KthNeighbor).unwrap();
    let prepared = Prepared::of(Original::new(set));
    let hidden = hidden(points, Unit::KthNeighbor);
    let plan = Plan { thresholds: vec![Threshold::parse("2.5").unwrap()], ..plan(&["olc"]) };
    let found = audit(&prepared, Some(&hidden), plan, "olc:2.5<=20").unwrap();
    assert!(reason(&found).starts_with("unit: expected a usual distance"), "{}", reason(&found));
}

#[test]
fn a_gate_that_names_no_attack_needs_the_best_of_each_kind() {
    let values = (0..N * 8).map(|at| (at * 37 % 101) as u8).collect();
    let rows = Descriptors::try_new(Values::U8(values), 8).expect("descriptors");
    let alone = || plan(&["olc"]);
    let neighbors = vec![NeighborsBy::Source(Arc::new(Geometric))];
    let both = || Plan { records_alone: true, ..alone() };
    let weaker = || Plan { solvers: Builtin::list(&[Builtin::Consensus]), ..both() };
    let records = "records alone were not tried, which this gate counts";
    let best = "neighbors by descriptors, the best source, were not tried, and no attack is named";
    let joint = "joint, the strongest solver, was not tried, and none is named";
    for (gate, plan, described, expected) in [
        ("olc:0.25<=100", alone(), false, records),
        ("olc@0.5:0.25<=100", alone(), false, records),
        ("olc:geometric:0.25<=100", Plan { neighbors, ..alone() }, false, records),
        ("olc:joint:0.25<=100", alone(), false, ""),
        ("olc:0.25<=100", both(), true, best),
        ("olc:0.25<=100", both(), false, ""),
        ("olc@0.5:0.25<=100", both(), true, ""),
        ("olc:0.25<=100", weaker(), false, joint),
        ("olc:consensus:0.25<=100", weaker(), false, ""),
        ("olc:0.25<=100", Plan { inlier_ratios: vec![1.0], ..both() }, true, ""),
    ] {
        let descriptors = described.then(|| rows.clone());
        let points = Prepared { descriptors, ..prepared(&room()) };
        let found = &audit(&points, None, plan, gate).expect("an audit").document.gates[0];
        let reason = found.reason.as_deref().unwrap_or_default();
        assert_eq!((found.passed, reason), (expected.is_empty(), expected), "{gate}");
    }
}

#[test]
fn descriptors_that_are_too_short_for_features_are_doubted() {
    let values = (0..N * 4).map(|at| (at * 37 % 101) as u8).collect();
    let points = PointSet::try_new(room(), Unit::Meter).unwrap();
    let descriptors = Descriptors::try_new(Values::U8(values), 4).unwrap();
    let doubts = of_descriptors(&points, &descriptors).unwrap().concat();
    assert!(doubts.contains("descriptors: of length 4, too short"), "{doubts}");
}

/// Ten orders of the rows of each real scene. Of every part of a map, as filters leave it, the right order passes.
#[test]
fn descriptors_of_real_maps_are_told_from_those_in_another_order() {
    for scene in ["castle", "fountain", "redkitchen", "redkitchen-aliked"] {
        let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
        let Ok(map) = read::open(&shared.join(scene)) else {
            println!("skipped: shared/data/{scene} is not beside the repository");
            continue;
        };
        let all = read::descriptors(&shared.join(scene).join("descriptors.bin"), &map).unwrap();
        for at in 0..10 {
            let mut draws = Key::from_seed(at).draws(Stage::Subset, 0);
            let mut order = draws.permutation(all.len());
            order.truncate(all.len() >> (at % 4));
            let place = |&row: &u32| map.positions[row as usize];
            let points = PointSet::try_new(order.iter().map(place).collect(), Unit::Meter).unwrap();
            let doubts = |order: &[u32]| of_descriptors(&points, &all.select(order)).unwrap();
            assert_eq!(doubts(&order), [""; 0], "{scene}, part {at}");
            draws.shuffle(&mut order);
            assert!(doubts(&order).concat().contains("order of rows"), "{scene}, part {at}");
        }
        let points = PointSet::try_new(map.positions.clone(), Unit::Meter).unwrap();
        let mut moved: Vec<u32> = (0..all.len() as u32).collect();
        moved.rotate_left(1);
        let doubts = of_descriptors(&points, &all.select(&moved)).unwrap().concat();
        assert!(doubts.contains("if they move by one row"), "{scene}: {doubts}");
        if let Values::U8(bytes) = all.values() {
            // The opposite order of directions in each cell, as VLFeat has it, and another one.
            for to in [|c: usize| c / 8 * 8 + (8 - c % 8) % 8, |c: usize| c * 77 % 128] {
                let row = |row: &[u8]| (0..128).map(|c| row[to(c)]).collect::<Vec<u8>>();
                let bytes = bytes.chunks_exact(128).flat_map(row).collect();
                let turned = Descriptors::try_new(Values::U8(bytes), 128).unwrap();
                let doubts = of_descriptors(&points, &turned).unwrap().concat();
                assert!(doubts.contains("order of columns"), "{scene}: {doubts}");
            }
        }
    }
}

/// Returns the release of lines through `feet`, which hide the points `order`.
fn of_lines(
    (feet, directions): (&[[f64; 3]], &[[f64; 3]]),
    order: &[u32],
    rows: Option<Descriptors>,
) -> (Released<3>, Secret) {
    let lines = Obfuscation::Lines(Lines::through(feet, directions).unwrap());
    let released = Released::try_new(lines, 1, [0.0; 3], Unit::Meter, rows).unwrap();
    let hidden = order.iter().map(|&at| OriginalId(at)).collect();
    let rows = (0..N as u32).collect();
    let secret = Secret::try_new(hidden, None, rows, Vec::new(), N, 1).unwrap();
    let secret = secret.with_map(Some(released.fingerprint()));
    (released, secret)
}

/// Broken records cannot lead an attack to their points, large coordinates lose digits, parallel lines show two coordinates, and lines through
/// points of others want another attack: what is then recovered is too little.
#[test]
fn records_that_attacks_cannot_use_are_no_protection() {
    let mut draws = Key::from_seed(5).draws(Stage::Scheme, 2);
    let order = draws.permutation(N);
    for (broken, shift, kind, expected) in [
        (0.0, 0.0, "random", ""),
        (0.2, 0.0, "random", "points are 0.100 m or more away from their own records"),
        (0.0, 5e6, "random", "so large that 32 bits round them by about"),
        (0.0, 0.0, "parallel", "all records are nearly parallel: coordinates across"),
        (0.0, 0.0, "through others", "pass through the point of another record"),
    ] {
        let places: Vec<[f64; 3]> = room().iter().map(|p| p.map(|x| x + shift)).collect();
        let mut feet: Vec<[f64; 3]> = order.iter().map(|&at| places[at as usize]).collect();
        let direction = |at: usize| match kind {
            "random" => [0; 3].map(|_| draws.between(-1.0, 1.0)),
            "parallel" => [0.0, 0.0, 1.0],
            _ => sub(&feet[at], &feet[(at + 1) % N]),
        };
        let directions: Vec<[f64; 3]> = (0..N).map(direction).collect();
        let n_broken = (broken * N as f64) as usize;
        feet[..n_broken].iter_mut().flatten().for_each(|x| *x += draws.normal());
        let release = of_lines((&feet, &directions), &order, None);
        let found =
            audit(&prepared(&places), Some(&release), plan(&["olc"]), "olc:joint:0.10<=100");
        let gate = &found.unwrap().document.gates[0];
        assert_eq!(gate.passed, expected.is_empty(), "{:?}", gate.reason);
        assert!(gate.reason.as_ref().is_none_or(|reason| reason.contains(expected)));
    }
}

/// Lines of another program: feet that are the points, records in an order that follows places, and columns of descriptors.
#[test]
fn a_released_file_that_gives_places_away_is_no_protection() {
    let points = prepared(&room());
    let places = points.original.reveal().positions();
    let mut draws = Key::from_seed(3).draws(Stage::Scheme, 0);
    let random = draws.permutation(N);
    let mut sorted = random.clone();
    sorted.sort_by(|&a, &b| places[a as usize][0].total_cmp(&places[b as usize][0]));
    let others = draws.permutation(N);
    let mut said = |order: &[u32], described: bool, offset: f64, of_others: bool| {
        let directions: Vec<[f64; 3]> =
            order.iter().map(|_| [0; 3].map(|_| draws.between(-1.0, 1.0))).collect();
        let foot = |(&at, along): (&u32, &[f64; 3])| {
            std::array::from_fn(|c| places[at as usize][c] + offset * along[c])
        };
        let feet: Vec<[f64; 3]> = order.iter().zip(&directions).map(foot).collect();
        // The lines are through their own points, but another point may be published for each, or vectors that are a seventh as long
        // as the way to the point.
        let seventh =
            |(x, v): (&[f64; 3], &[f64; 3])| std::array::from_fn(|c| x[c] - offset * v[c] / 7.0);
        let published: Vec<Vec<[f64; 3]>> = match (of_others, offset) {
            (true, _) => vec![others.iter().map(|&at| places[at as usize]).collect()],
            (false, 20.0) => {
                vec![feet.clone(), feet.iter().zip(&directions).map(seventh).collect()]
            }
            (false, _) => vec![feet.clone()],
        };
        let heights = order.iter().flat_map(|&at| [0.5, 3.0 * places[at as usize][2] as f32]);
        let rows = Descriptors::try_new(Values::F32(heights.collect()), 2).unwrap();
        let release = of_lines((&feet, &directions), order, described.then_some(rows));
        let map = Map { plan: plan(&["olc"]), ..Map::new(&points) };
        let input = Input::Released(map, Hidden { release: &release, published });
        let document = audited(&points, &input, &["olc:joint:0.10<=100"]).unwrap().document;
        let read = document.results[0].records_alone_percent.as_ref().map(|by| by["0.10"]);
        let gate = &document.gates[0];
        assert_eq!(
            (gate.passed, &document.notes[..]),
            (gate.reason.is_none(), gate.reason.as_slice())
        );
        (read, gate.reason.clone().unwrap_or_default())
    };
    assert_eq!(said(&random, false, 30.0, false), (None, String::new()));
    assert_eq!(said(&random, false, 0.0, false), (Some(100.0), String::new()));
    assert_eq!(said(&random, false, 30.0, true), (Some(100.0), String::new()));
    assert_eq!(said(&random, false, 20.0, false), (Some(100.0), String::new()));
    let (_, order) = said(&sorted, false, 30.0, false);
    assert!(order.starts_with("order of records: in "), "{order}");
    let (_, column) = said(&random, true, 30.0, false);
    let expected = "descriptors: column 1 (from 0) follows the coordinate ";
    assert!(column.starts_with(expected), "{column}");
}
