//! A synthetic audit of a synthetic room, for tests and for a look at the page.

#![allow(dead_code, unused_imports, reason = "each user of this file uses a part of it")]

mod images;
mod scene;

use indexmap::IndexMap;
use unlift_report::document::{
    Bound, BreakEven, Document, GateResult, Input, LengthUnit, NotAudited, ReliabilityBin, Row,
    Run, SCHEMA, Seconds,
};

pub use images::{images, picture};
pub use scene::scene;

pub const SCHEMES: [&str; 7] = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"];
pub const RATIOS: [f64; 6] = [1.0, 0.75, 0.5, 0.3, 0.2, 0.1];

/// Percent within the first and the second threshold, at each of [`RATIOS`].
const SHARES: [[[f64; 6]; 2]; 7] = [
    [[93.4, 93.1, 92.3, 90.8, 89.0, 85.6], [98.1, 98.0, 97.5, 96.4, 95.2, 93.3]],
    [[90.2, 89.9, 89.1, 86.2, 81.4, 70.3], [96.4, 96.2, 96.0, 93.8, 90.1, 81.2]],
    [[90.9, 90.4, 89.7, 86.9, 82.0, 71.1], [96.6, 96.4, 96.1, 94.0, 90.5, 81.7]],
    [[87.3, 86.8, 85.2, 80.7, 74.1, 58.4], [95.2, 94.8, 93.6, 89.8, 84.0, 69.3]],
    [[86.1, 85.4, 83.3, 77.9, 70.2, 52.8], [94.0, 93.5, 92.0, 87.1, 80.3, 63.9]],
    [[90.1, 89.0, 83.7, 66.4, 41.2, 11.8], [97.2, 96.6, 92.4, 75.3, 50.1, 18.2]],
    [[89.3, 88.1, 85.4, 74.6, 60.3, 21.9], [93.2, 92.3, 90.1, 80.2, 66.8, 27.5]],
];
const BLIND: [[f64; 2]; 7] =
    [[1.9, 6.4], [1.2, 6.0], [1.1, 5.8], [3.2, 9.7], [5.9, 14.1], [0.2, 1.1], [4.8, 12.9]];

/// Percent by the best attack on the records alone within both thresholds, if there is one.
const RECORDS_ALONE: [(&str, [f64; 2]); 6] = [
    ("olc", [58.6, 76.4]),
    ("ppl", [7.3, 14.8]),
    ("ppl+", [7.1, 14.2]),
    ("ray", [21.5, 44.0]),
    ("ray-voxel", [20.8, 43.7]),
    ("cp", [16.2, 31.9]),
];

/// Returns a whole audit; without a scale lengths are multiples of the usual distance to the K-th neighbor.
pub fn document(metric: bool) -> Document {
    let thresholds = if metric { ["0.10", "0.25"] } else { ["1.0", "2.5"] };
    let unit = if metric { LengthUnit::Meter } else { LengthUnit::KthNeighbor };
    let mut results = Vec::new();
    let mut break_even = Vec::new();
    for solver in ["consensus", "ransac"] {
        for (s, scheme) in SCHEMES.iter().enumerate() {
            results.extend((0..RATIOS.len()).map(|r| row(s, r, solver, thresholds, unit)));
            let last = SHARES[s][0][5] >= 50.0;
            break_even.extend(thresholds.map(|threshold| BreakEven {
                scheme: (*scheme).into(),
                solver: solver.into(),
                oracle_noise: Some("uniform".into()),
                threshold: threshold.into(),
                inlier_ratio: Some(if last { 0.1 } else { 0.17 + 0.01 * s as f64 }),
                bound: if last { Bound::BelowTested } else { Bound::Interpolated },
            }));
        }
    }
    let seconds = results
        .iter()
        .map(|_| IndexMap::from([("recover".into(), 0.31), ("evaluate".into(), 0.002)]));
    let rows = seconds.collect();
    let gate = |gate: &str, found_percent: f64, bound_percent: f64| GateResult {
        gate: gate.into(),
        found_percent: Some(found_percent),
        of: None,
        bound_percent,
        passed: found_percent <= bound_percent,
        reason: None,
    };
    Document {
        unlift: "0.1.0".into(),
        schema: SCHEMA,
        input: Input {
            path: Some("maps/furnished-room/sparse/0".into()),
            sha256: Some("9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".into()),
            n_points: 21_149,
            scale_m_per_unit: metric.then_some(1.0),
            unit_in_map_units: Some(if metric { 1.0 } else { 0.0834 }),
            other_sha256: IndexMap::new(),
            images: None,
        },
        options: serde_json::json!({
            "schemes": SCHEMES, "inlier-ratios": RATIOS, "k": 50, "solver": ["consensus", "ransac"],
            "neighbors": "oracle", "delta": "auto", "thresholds": thresholds
        })
        .as_object()
        .expect("an object")
        .clone(),
        seed: 0,
        results,
        not_audited: Vec::new(),
        notes: Vec::new(),
        break_even,
        gates: vec![gate("ppl@0.5:0.10<=20", 89.1, 20.0), gate("plane@0.1:0.10<=20", 11.8, 20.0)],
        images: Vec::new(),
        tiles: Vec::new(),
        localization: Vec::new(),
        run: Run {
            command: Some(
                "unlift audit map maps/furnished-room --scale 1 --solver consensus".into(),
            ),
            threads: 2,
            peak_memory_bytes: Some(412_000_000),
            seconds: Seconds { total: 41.7, rows, stages: IndexMap::new() },
        },
    }
}

/// Returns the audit of [`document`] with an attacker's own neighborhoods, whose ratios differ between
/// schemes: `overlap` for all schemes, `geometric` for all but planes.
pub fn mixed(metric: bool) -> Document {
    let mut document = document(metric);
    let half: Vec<Row> =
        document.results.iter().filter(|row| row.inlier_ratio == 0.5).cloned().collect();
    for row in half {
        let s = SCHEMES.iter().position(|scheme| *scheme == row.scheme).expect("one of them");
        let weaker = if row.solver == "ransac" { 3.0 } else { 0.0 };
        let mut own = |neighbors: &str, inlier_ratio, shares: [f64; 2]| {
            let mut row = row.clone();
            (row.neighbors, row.oracle_noise) = (neighbors.into(), None);
            (row.inlier_ratio, row.k) = (inlier_ratio, 35);
            // Half of the points or more are lost, so no percentile is known.
            row.median_error = None;
            row.error_percentiles.values_mut().for_each(|error| *error = None);
            for (value, share) in row.recovered_percent.values_mut().zip(shares) {
                *value = share;
            }
            document.results.push(row);
        };
        let falling = 4.5 * s as f64 + weaker;
        own("overlap", 0.08 + 0.002 * s as f64, [45.5 - falling, 66.5 - falling]);
        if row.scheme == "plane" {
            if row.solver == "consensus" {
                document.not_audited.push(NotAudited {
                    scheme: row.scheme,
                    neighbors: Some("geometric".into()),
                    reason: "planes say nothing of where points are".into(),
                });
            }
        } else {
            own("geometric", 0.05, [7.0 - weaker / 10.0, 14.0]);
        }
    }
    document.run.seconds.rows.clear();
    document
}

fn row(s: usize, r: usize, solver: &str, thresholds: [&str; 2], unit: LengthUnit) -> Row {
    let penalty = if solver == "ransac" { 0.4 + 1.1 * r as f64 } else { 0.0 };
    let share = |t: usize| ((SHARES[s][t][r] - penalty) * 10.0).round() / 10.0;
    let scale = if unit == LengthUnit::Meter { 1.0 } else { 10.0 };
    let by_threshold = |values: [f64; 2]| -> IndexMap<String, f64> {
        thresholds.iter().map(|t| (*t).to_owned()).zip(values).collect()
    };
    // Error over percent, linear on a log scale between the shares within the thresholds.
    let known = [(0.5, 0.002), (share(0), 0.10), (share(1), 0.25), (99.8, 3.0)];
    let percentiles = ["50", "75", "90", "95", "99"].map(|name| {
        let percent: f64 = name.parse().expect("a number");
        let after = known.windows(2).find(|pair| percent <= pair[1].0);
        let error = after.map(|pair| {
            let ((p, e), (q, f)): ((f64, f64), (f64, f64)) = (pair[0], pair[1]);
            e * (f / e).powf((percent - p) / (q - p)) * scale
        });
        (name.to_owned(), error)
    });
    let lost = 12 + 40 * r as u64;
    let alone = RECORDS_ALONE.iter().find(|(scheme, _)| *scheme == SCHEMES[s]).map(|x| x.1);
    let has = |schemes: &[&str], value: f64| schemes.contains(&SCHEMES[s]).then_some(value);
    Row {
        scheme: SCHEMES[s].into(),
        neighbors: "oracle".into(),
        oracle_noise: Some("uniform".into()),
        inlier_ratio: RATIOS[r],
        k: 50,
        solver: solver.into(),
        delta: Some(0.08 * scale),
        unit,
        n_points: 21_148,
        n_lost: lost,
        lost: IndexMap::from([("degenerate".into(), 12), ("no_support".into(), lost - 12)]),
        dropped: if SCHEMES[s] == "ppl" {
            IndexMap::from([("odd_point".into(), 1)])
        } else {
            IndexMap::new()
        },
        recovered_percent: by_threshold([share(0), share(1)]),
        blind_percent: by_threshold(BLIND[s]),
        records_alone_percent: alone.map(by_threshold),
        records_alone_by: alone.map(|_| {
            thresholds.iter().map(|t| ((*t).to_owned(), "tomography".to_owned())).collect()
        }),
        axis_accuracy_percent: has(&["cp"], 97.3 - 6.0 * r as f64),
        exact_percent: has(&["cp"], 26.1 - 3.0 * r as f64),
        assignment_accuracy_percent: has(&["ppl", "ppl+"], 98.0 - 3.0 * r as f64),
        metrics: IndexMap::new(),
        median_error: percentiles[0].1,
        blind_median_error: Some(1.25 * scale),
        error_percentiles: percentiles.into_iter().collect(),
        sure_unknown: None,
        sure_percent: Some((0.8 * share(0) * 10.0).round() / 10.0),
        sure_correct_percent: Some(97.0),
        reliability: Some(
            (0..10u64)
                .map(|bin| {
                    let middle = (10 * bin + 5) as f64 / 100.0;
                    ReliabilityBin {
                        predicted: Some(middle),
                        observed: Some(middle + 0.002 * (bin as f64 - 5.0)),
                        n: 500 + 400 * bin,
                    }
                })
                .collect(),
        ),
        ransac_trials: (solver == "ransac")
            .then(|| vec![(10, 9_000), (100, 10_000), (10_000, 2_148)]),
        repeats: 1,
        std: None,
        distinct: None,
    }
}

/// A number in 0..1 from a counter.
fn unit_random(counter: u64) -> f32 {
    let mut z = counter.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x51_7C_C1_B7_27_22_0A_95;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}
