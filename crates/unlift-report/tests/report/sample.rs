//! A synthetic audit of a synthetic room, and of images. No figure was measured.

use unlift::Unit;
use unlift::seed::{Draws, Stage};
use unlift_report::ByAttack;
use unlift_report::document::*;
use unlift_report::pictures::{Graph, Marks, Picture, ReleasedView};
use unlift_report::scene::{ObfuscationView, Scene3d, Shapes};

pub const SCHEMES: [&str; 7] = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"];
const RATIOS: [f64; 6] = [1.0, 0.75, 0.5, 0.3, 0.2, 0.1];
/// Percent within both thresholds at each of [`RATIOS`], by a blind guess, and by the records alone.
type Shares = ([f64; 6], [f64; 6], [f64; 2], Option<[f64; 2]>);
#[rustfmt::skip]
const SHARES: [Shares; 7] = [
    ([93.4, 93.1, 92.3, 90.8, 89.0, 85.6], [98.1, 98.0, 97.5, 96.4, 95.2, 93.3], [1.9, 6.4], Some([58.6, 76.4])),
    ([90.2, 89.9, 89.1, 86.2, 81.4, 70.3], [96.4, 96.2, 96.0, 93.8, 90.1, 81.2], [1.2, 6.0], Some([7.3, 14.8])),
    ([90.9, 90.4, 89.7, 86.9, 82.0, 71.1], [96.6, 96.4, 96.1, 94.0, 90.5, 81.7], [1.1, 5.8], Some([7.1, 14.2])),
    ([87.3, 86.8, 85.2, 80.7, 74.1, 58.4], [95.2, 94.8, 93.6, 89.8, 84.0, 69.3], [3.2, 9.7], Some([21.5, 44.0])),
    ([86.1, 85.4, 83.3, 77.9, 70.2, 52.8], [94.0, 93.5, 92.0, 87.1, 80.3, 63.9], [5.9, 14.1], Some([20.8, 43.7])),
    ([90.1, 89.0, 83.7, 66.4, 41.2, 11.8], [97.2, 96.6, 92.4, 75.3, 50.1, 18.2], [0.2, 1.1], None),
    ([89.3, 88.1, 85.4, 74.6, 60.3, 21.9], [93.2, 92.3, 90.1, 80.2, 66.8, 27.5], [4.8, 12.9], Some([16.2, 31.9])),
];

/// Returns a whole audit; without a scale lengths are multiples of the usual distance to the K-th neighbor.
pub fn document(metric: bool) -> Document {
    let thresholds = if metric { ["0.10", "0.25"] } else { ["1.0", "2.5"] };
    let all = |solver| (0..7).flat_map(move |s| (0..6).map(move |r| (s, r, solver)));
    let all = all("consensus").chain(all("ransac"));
    let results: Vec<Row> =
        all.map(|(s, r, solver)| row(s, r, solver, thresholds, metric)).collect();
    let point = |s: usize, solver: &str, threshold: &str| {
        let below = SHARES[s].0[5] >= 50.0;
        let ratio = if below { 0.1 } else { 0.17 + 0.01 * s as f64 };
        let bound = if below { Bound::BelowTested } else { Bound::Interpolated };
        BreakEven {
            scheme: SCHEMES[s].into(),
            solver: solver.into(),
            oracle_noise: Some("uniform".into()),
            threshold: threshold.into(),
            inlier_ratio: ratio,
            bound,
        }
    };
    let break_even = ["consensus", "ransac"].into_iter().flat_map(|solver| {
        (0..7).flat_map(move |s| thresholds.map(|threshold| point(s, solver, threshold)))
    });
    let rows = vec![serde_json::json!({"recover": 0.31}); results.len()];
    let document = serde_json::json!({
        "unlift": "0.1.0", "schema": SCHEMA, "seed": 0, "results": results,
        "break_even": break_even.collect::<Vec<_>>(),
        "input": {
            "path": "maps/furnished-room/sparse/0", "sha256": "9f86d081", "n_points": 21_149,
            "scale_m_per_unit": metric.then_some(1.0), "unit_in_map_units": if metric { 1.0 } else { 0.0834 },
            "longest_side": (!metric).then_some(25.0),
        },
        "options": {"schemes": SCHEMES, "k": 50, "solver": ["consensus", "ransac"], "thresholds": thresholds},
        "gates": [
            {"gate": "ppl@0.5:0.10<=20", "found_percent": 89.1, "bound_percent": 20.0, "passed": false},
            {"gate": "plane@0.1:0.10<=20", "found_percent": 11.8, "bound_percent": 20.0, "passed": true},
        ],
        "run": {
            "command": "unlift audit map maps/furnished-room --scale 1 --solver consensus", "threads": 2,
            "peak_memory_bytes": 412_000_000, "seconds": {"total": 41.7, "rows": rows},
        },
    });
    serde_json::from_value(document).expect("a document")
}

/// Changes the rows of a scheme.
pub fn change(document: &mut Document, scheme: &str, change: impl Fn(&mut Row)) {
    document.results.iter_mut().filter(|row| row.scheme == scheme).for_each(change);
}

/// Sets what a row recovers and a blind guess, in percent; the records alone were not attacked.
pub fn set(row: &mut Row, recovered: f64, blind: f64) {
    row.recovered_percent.values_mut().for_each(|percent| *percent = recovered);
    row.blind_percent.values_mut().for_each(|percent| *percent = blind);
    (row.records_alone_percent, row.records_alone_by) = (None, None);
}

/// Makes a row one by another source than the oracle.
pub fn by(row: &mut Row, source: &str) {
    (row.neighbors, row.oracle_noise) = (source.to_owned(), None);
}

/// Makes rows by `source` those of the best attack by descriptors.
pub fn by_best(document: &mut Document, source: &str) {
    for row in document.results.iter_mut().filter(|row| row.neighbors == source) {
        by(row, "descriptors");
        row.solver = row.solver.replace("consensus", "joint");
    }
}

/// Keeps the rows of some schemes.
pub fn retain(document: &mut Document, is_kept: impl Fn(&str) -> bool) {
    document.results.retain(|row| is_kept(&row.scheme));
    document.break_even.retain(|point| is_kept(&point.scheme));
    document.run.seconds.rows.clear();
}

fn row(s: usize, r: usize, solver: &str, thresholds: [&str; 2], metric: bool) -> Row {
    let penalty = if solver == "ransac" { 0.4 + 1.1 * r as f64 } else { 0.0 };
    let shares = [SHARES[s].0[r], SHARES[s].1[r]];
    let shares = shares.map(|share| ((share - penalty) * 10.0).round() / 10.0);
    let scale = if metric { 1.0 } else { 10.0 };
    let by = |values: [f64; 2]| -> ByThreshold {
        thresholds.map(str::to_owned).into_iter().zip(values).collect()
    };
    let alone = SHARES[s].3;
    let bin = |at: usize| {
        let middle = (10 * at + 5) as f64 / 100.0;
        let observed = Some(middle + 0.002 * (at as f64 - 5.0));
        ReliabilityBin { predicted: Some(middle), observed, n: 500 + 400 * at }
    };
    let errors = [("50", 0.03), ("75", 0.07), ("90", 0.2), ("95", 0.6), ("99", 1.8)];
    let has = |schemes: &[&str], value: f64| schemes.contains(&SCHEMES[s]).then_some(value);
    let lost = 12 + 40 * r;
    Row {
        scheme: SCHEMES[s].into(),
        neighbors: "oracle".into(),
        oracle_noise: Some("uniform".into()),
        inlier_ratio: RATIOS[r],
        k: 50,
        solver: solver.into(),
        delta: 0.08 * scale,
        unit: if metric { Unit::Meter } else { Unit::KthNeighbor },
        n_points: 21_148,
        n_lost: lost,
        lost: [("degenerate".into(), 12), ("no_support".into(), lost - 12)].into(),
        dropped: has(&["ppl"], 0.0).map(|_| ("odd_point".into(), 1)).into_iter().collect(),
        recovered_percent: by(shares),
        blind_percent: by(SHARES[s].2),
        records_alone_percent: alone.map(by),
        records_alone_by: alone
            .map(|_| thresholds.map(|typed| (typed.into(), "tomography".into())).into()),
        axis_accuracy_percent: has(&["cp"], 97.3 - 6.0 * r as f64),
        exact_percent: has(&["cp"], 26.1 - 3.0 * r as f64),
        assignment_accuracy_percent: has(&["ppl", "ppl+"], 98.0 - 3.0 * r as f64),
        median_error: Some(0.03 * scale),
        blind_median_error: Some(1.25 * scale),
        error_percentiles: errors.map(|(p, error)| (p.into(), Some(error * scale))).into(),
        sure_percent: Some((8.0 * shares[0]).round() / 10.0),
        sure_correct_percent: Some(97.0),
        reliability: Some((0..10).map(bin).collect()),
        ransac_trials: (solver == "ransac").then(|| vec![(10, 9_000), (100, 12_148)]),
        repeats: 1,
        ..Row::default()
    }
}

/// Returns the audit of [`document`] with an attacker's own neighborhoods, whose ratios differ between
/// schemes: `overlap` for all schemes, `geometric` for all but planes.
pub fn mixed(metric: bool) -> Document {
    let mut document = document(metric);
    let half: Vec<Row> =
        document.results.iter().filter(|row| row.inlier_ratio == 0.5).cloned().collect();
    for row in half {
        let s = SCHEMES.iter().position(|name| *name == row.scheme).unwrap() as f64;
        let weaker = if row.solver == "ransac" { 3.0 } else { 0.0 };
        let mut own = |neighbors: &str, inlier_ratio, shares: [f64; 2]| {
            let mut row = row.clone();
            (row.neighbors, row.oracle_noise) = (neighbors.into(), None);
            (row.inlier_ratio, row.k) = (inlier_ratio, 35);
            // Half of the points or more are lost, so no percentile is known.
            row.median_error = None;
            row.error_percentiles.values_mut().for_each(|error| *error = None);
            row.recovered_percent.values_mut().zip(shares).for_each(|(old, new)| *old = new);
            document.results.push(row);
        };
        let falling = 4.5 * s + weaker;
        own("overlap", 0.08 + 0.002 * s, [45.5 - falling, 66.5 - falling]);
        if row.scheme != "plane" {
            own("geometric", 0.05, [7.0 - weaker / 10.0, 14.0]);
        } else if row.solver == "consensus" {
            let reason = "planes say nothing of where points are";
            document.not_audited.push(NotAudited::new(&row.scheme, Some("geometric"), reason));
        }
    }
    document.run.seconds.rows.clear();
    document
}

/// Returns a number in 0..1 from a counter.
fn random(counter: usize) -> f32 {
    Draws::new(0, Stage::Shapes, counter as u64).unit() as f32
}

/// Returns points of a room and their recovered positions, consistent with the figures of `document`.
pub fn scene(document: &Document, n: usize) -> Scene3d {
    let point = |i: usize| [0, 1, 2].map(|c| random(3 * i + c) * [6.0, 4.5, 2.6][c]);
    let originals: Vec<[f32; 3]> = (0..n).map(point).collect();
    let obfuscations = SCHEMES.map(|scheme| {
        let some = originals.iter().take(1_500);
        let shapes = match scheme {
            "plane" => {
                let corners = [[0.0, 0.0], [4.5, 0.0], [4.5, 2.6], [0.0, 2.6]];
                let patch = |p: &[f32; 3]| corners.map(|[y, z]| [p[0], y, z]);
                Shapes::Patches(some.step_by(10).map(patch).collect())
            }
            "cp" => Shapes::Points(originals.iter().map(|p| [p[0], p[1], 1.3]).collect()),
            _ => Shapes::Segments(some.map(|p| [[p[0], 0.0, p[2]], [p[0], 4.5, p[2]]]).collect()),
        };
        ObfuscationView { scheme: scheme.into(), shapes, n_records: n as u64, withheld: Vec::new() }
    });
    let views = document.results.iter().enumerate().map(|(r, row)| {
        let recovered = originals.iter().enumerate().map(|(i, p)| {
            let near = 100.0 * random(7 + i + n * r) < row.recovered_percent[0] as f32;
            let size = if near { 0.02 } else { 1.0 };
            [0, 1, 2].map(|c| p[c] + size * (random(9 * i + c + r) - 0.5))
        });
        ByAttack { row: row.clone(), recovered: recovered.collect() }
    });
    let cameras = (0..40).map(|i| [3.0 + (0.157 * i as f32).cos(), 2.2, 1.5]).collect();
    let (n_points, views) = (document.input.n_points, views.collect());
    Scene3d { n_points, cameras, up: None, obfuscations: obfuscations.into(), views, originals }
}

/// Returns an audit of images.
pub fn images() -> Document {
    let mut document = document(true);
    let by = |values: [f64; 4]| -> ByThreshold {
        ["1", "5", "10", "25"].map(str::to_owned).into_iter().zip(values).collect()
    };
    let is_kept = |row: &Row| row.solver == "consensus" && ["olc", "cp"].contains(&&*row.scheme);
    document.results.retain(is_kept);
    for (at, row) in document.results.iter_mut().enumerate() {
        row.scheme = if row.scheme == "olc" { "lines2d" } else { "cp2d" }.into();
        row.recovered_percent = by([21.5, 61.5, 81.5, 95.5].map(|share| share - at as f64));
        row.blind_percent = by([0.5, 2.25, 4.5, 11.0]);
        (row.unit, row.reliability) = (Unit::Pixel, None);
        (row.sure_percent, row.sure_correct_percent) = (None, None);
        row.sure_unknown = Some("nobody has compared it with what comes true in images".into());
        (row.records_alone_percent, row.records_alone_by) = (None, None);
        let recovered_percent = by([20.25, 60.25, 80.25, 94.25]);
        let blind_percent = row.blind_percent.clone();
        row.distinct = Some(Distinct { n_places: 17_000, recovered_percent, blind_percent });
    }
    document.break_even.clear();
    document.gates.clear();
    document.run.seconds.rows.clear();
    document.input.images = Some(ImageCounts { found: 4, used: 2, unusable: 1, too_small: 1 });
    let of_row = |row: &Row| ImageRow {
        recovered_percent: row.recovered_percent.clone(),
        distinct_percent: row.recovered_percent.clone(),
        inlier_ratio: row.inlier_ratio,
        median_error: Some(3.25),
    };
    let rows: Vec<ImageRow> = document.results.iter().map(of_row).collect();
    let image =
        |name: &str| ImageFigures { name: Some(name.into()), n_points: 10_574, rows: rows.clone() };
    document.images = vec![image("kitchen/secret.jpg"), image("b.jpg")];
    document
}

/// Returns a picture of the first image of [`images`].
pub fn picture() -> Picture {
    let place = |i: usize| [0, 1].map(|c| random(2 * i + c) * [640.0, 480.0][c]);
    let keypoints: Vec<[f32; 2]> = (0..300).map(place).collect();
    let (neighbors, solver) = ("oracle".to_owned(), "joint".to_owned());
    let row = Row { neighbors, solver, inlier_ratio: 0.5, ..Row::default() };
    let views = ["lines2d", "cp2d"].map(|scheme| ByAttack {
        row: Row { scheme: scheme.into(), ..row.clone() },
        recovered: keypoints.iter().map(|p| Some(p.map(|x| x + 4.0))).collect(),
    });
    let lines = keypoints.iter().map(|p| Some([[p[0], 0.0], [p[0], 479.0]])).collect();
    let points = keypoints.iter().map(|p| Some([p[0], 7.0])).collect();
    let released = [("lines2d", Marks::Lines(lines)), ("cp2d", Marks::Points(points))];
    let released = released.map(|(scheme, marks)| ReleasedView { scheme: scheme.into(), marks });
    let neighbors = (0..300).map(|i| (1..6).map(|j| place((i + j) % 300)).collect()).collect();
    Picture {
        name: "kitchen/secret.jpg".into(),
        note: "median".into(),
        size: [640, 480],
        photo: None,
        keypoints,
        released: released.into(),
        views: views.into(),
        graphs: vec![Graph { row, neighbors }],
    }
}
