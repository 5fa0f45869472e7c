//! The figures of a real map, where it is at hand: 21,149 points of 7-Scenes RedKitchen, K = 50,
//! everything automatic, seed 0. Floors are what a prototype reached.

use std::path::Path;

use unlift::audit::{Plan, Row, Silent, run};
use unlift::recover::Solver;
use unlift::truth::Original;
use unlift::{PointSet, Unit};

const POINTS: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/redkitchen/model/points3D.bin");

/// (inlier ratio, scheme, percent within 10 cm, within 25 cm) at least.
const FLOORS: &[(f64, &str, f64, f64)] = &[
    (1.0, "olc", 93.0, 98.0),
    (1.0, "ppl", 90.0, 96.0),
    (1.0, "ray", 87.0, 95.0),
    (1.0, "plane", 90.0, 97.0),
    (1.0, "cp", 89.0, 93.0),
    (0.5, "cp", 85.0, 90.0),
    (0.3, "plane", 66.0, 75.0),
    (0.1, "olc", 85.0, 93.0),
    (0.1, "ppl", 70.0, 81.0),
    (0.1, "ray", 58.0, 69.0),
];

/// The points of a COLMAP `points3D.bin`, by ascending id. The core reads no formats (the crate
/// `unlift-io` does); these few lines keep its tests free of it.
fn colmap_points(bytes: &[u8]) -> Vec<[f64; 3]> {
    let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    let mut points = Vec::new();
    let mut at = 8;
    for _ in 0..u64_at(0) {
        let position = [8, 16, 24].map(|field| f64::from_bits(u64_at(at + field)));
        points.push((u64_at(at), position));
        // Id, position, color, error, then a track of two 32-bit ids per entry.
        at += 51 + 8 * u64_at(at + 43) as usize;
    }
    assert_eq!(at, bytes.len(), "points3D.bin");
    points.sort_unstable_by_key(|&(id, _)| id);
    points.into_iter().map(|(_, position)| position).collect()
}

/// The map, or a message that the test is skipped.
fn redkitchen() -> Option<Original<3>> {
    let Ok(bytes) = std::fs::read(Path::new(POINTS)) else {
        eprintln!("skipped: the data set redkitchen is not beside the repository");
        return None;
    };
    let points = PointSet::try_new(colmap_points(&bytes), Unit::Meter).unwrap();
    assert_eq!(points.len(), 21_149);
    Some(Original::new(points))
}

fn rows(original: &Original<3>, schemes: &[&str], ratios: &[f64], solvers: &[Solver]) -> Vec<Row> {
    let mut plan = Plan::new(Unit::Meter);
    plan.schemes.retain(|scheme| schemes.contains(&scheme.name()));
    plan.inlier_ratios = ratios.to_vec();
    plan.solvers = solvers.to_vec();
    let rows = run(original, None, &plan, &mut Silent).unwrap().rows;
    for row in &rows {
        let [near, far] = row.recovered_percent[..] else { panic!("two thresholds") };
        eprintln!(
            "{:10} {:9} {:4} {near:5.1} {far:5.1} delta {:.3}",
            row.scheme, row.solver, row.inlier_ratio, row.delta
        );
    }
    rows
}

#[test]
fn consensus_and_joint_reach_the_prototype() {
    let Some(original) = redkitchen() else { return };
    let solvers = [Solver::Consensus, Solver::Joint];
    let mut missed = Vec::new();
    for ratio in [1.0, 0.5, 0.3, 0.1] {
        let floors: Vec<_> = FLOORS.iter().filter(|floor| floor.0 == ratio).collect();
        let schemes: Vec<&str> = floors.iter().map(|floor| floor.1).collect();
        let rows = rows(&original, &schemes, &[ratio], &solvers);
        let floors = floors.into_iter().flat_map(|floor| [floor, floor]);
        for (row, floor) in rows.iter().zip(floors) {
            for (percent, least) in row.recovered_percent.iter().zip([floor.2, floor.3]) {
                if *percent < least {
                    let what = format!("{} at {ratio}, {}", row.scheme, row.solver);
                    missed.push(format!("{what}: {percent:.2} < {least}"));
                }
            }
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

/// The paper's loop is no straw man.
#[test]
fn ransac_is_within_two_points_of_consensus() {
    let Some(original) = redkitchen() else { return };
    let solvers = [Solver::Consensus, Solver::Ransac];
    let rows = rows(&original, &["olc", "ppl", "ray"], &[1.0, 0.5], &solvers);
    let mut missed = Vec::new();
    for pair in rows.as_chunks::<2>().0 {
        let [consensus, ransac] = pair;
        assert_eq!((consensus.solver, ransac.solver), ("consensus", "ransac"));
        for (a, b) in consensus.recovered_percent.iter().zip(&ransac.recovered_percent) {
            if b + 2.0 < *a {
                let place = format!("{} at {}", consensus.scheme, consensus.inlier_ratio);
                missed.push(format!("{place}: {b:.2} against {a:.2}"));
            }
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}
