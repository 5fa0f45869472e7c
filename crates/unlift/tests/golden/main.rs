//! Golden tests of recovered shares: on a synthetic room, and on a real map if it is present. All
//! options are automatic; the seed is 0.

mod floors;

use std::path::Path;

use floors::{Floor, REAL, ROOM, SOLVERS};
use unlift::audit::{Plan, Row, Silent, run};
use unlift::recover::Builtin;
use unlift::truth::Original;
use unlift::{PointSet, Unit};

const POINTS: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/redkitchen/model/points3D.bin");

/// Reads the points of a COLMAP `points3D.bin`, by ascending id. The core must not depend on the
/// readers in `unlift-io`.
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

/// Returns the map, or prints that the test is skipped.
fn redkitchen() -> Option<Vec<[f64; 3]>> {
    let Ok(bytes) = std::fs::read(Path::new(POINTS)) else {
        eprintln!("skipped: the data set redkitchen is not beside the repository");
        return None;
    };
    let points = colmap_points(&bytes);
    assert_eq!(points.len(), 21_149);
    Some(points)
}

fn rows(points: Vec<[f64; 3]>, k: usize, floors: &[Floor]) -> Vec<Row> {
    let original = Original::new(PointSet::try_new(points, Unit::Meter).unwrap());
    let mut ratios: Vec<f64> = floors.iter().map(|&(_, ratio, _)| ratio).collect();
    ratios.dedup();
    let usual = Plan::new(Unit::Meter);
    let plan = Plan {
        inlier_ratios: ratios,
        k,
        solvers: Builtin::list(&SOLVERS),
        records_alone: false,
        ..usual
    };
    let rows = run(&original, None, &plan, &mut Silent).unwrap().rows;
    assert_eq!(rows.len(), SOLVERS.len() * floors.len(), "a row for every floor");
    rows
}

/// Checks every row against its floor. Prints the results in the form of the floors.
fn stand(rows: &[Row], floors: &[Floor]) {
    let mut missed = Vec::new();
    for &(scheme, ratio, least) in floors {
        let found = SOLVERS.map(|solver| {
            let is_it = |row: &&Row| {
                row.scheme == scheme && row.inlier_ratio == ratio && row.solver == solver.name()
            };
            let row = rows.iter().find(is_it).expect("a row for every floor");
            [row.recovered_percent[0], row.recovered_percent[1]]
        });
        eprintln!("    (\"{scheme}\", {ratio:?}, {found:.1?}),");
        for (solver, (found, least)) in SOLVERS.iter().zip(found.iter().zip(least)) {
            for (percent, least) in found.iter().zip(least) {
                if *percent < least {
                    let what = format!("{scheme} at {ratio}, {}", solver.name());
                    missed.push(format!("{what}: {percent:.2} < {least}"));
                }
            }
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn a_room_comes_back_as_far_as_before() {
    let room = unlift::synthetic::room(1, 4_000).points;
    stand(&rows(room, 20, ROOM), ROOM);
}

#[test]
fn a_real_map_comes_back_as_far_as_before() {
    let Some(points) = redkitchen() else { return };
    let rows = rows(points, 50, REAL);
    stand(&rows, REAL);
    ransac_is_no_straw_man(&rows);
}

/// Checks that `ransac` is within two points of `consensus` at inlier ratios from 0.5 on.
/// Exceptions: `cp`, where its vote on the axis fails, and `ray-voxel`.
fn ransac_is_no_straw_man(rows: &[Row]) {
    let mut missed = Vec::new();
    let judged =
        |row: &&Row| ["olc", "ppl", "ray"].contains(&&*row.scheme) && row.inlier_ratio >= 0.5;
    let judged: Vec<&Row> = rows.iter().filter(judged).collect();
    let of = |solver: &'static str| judged.iter().filter(move |row| row.solver == solver);
    assert_eq!(of("consensus").count(), 6);
    for (consensus, ransac) in of("consensus").zip(of("ransac")) {
        assert!(consensus.scheme == ransac.scheme && consensus.inlier_ratio == ransac.inlier_ratio);
        for (a, b) in consensus.recovered_percent.iter().zip(&ransac.recovered_percent) {
            if b + 2.0 < *a {
                let place = format!("{} at {}", consensus.scheme, consensus.inlier_ratio);
                missed.push(format!("{place}: {b:.2} against {a:.2}"));
            }
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}
