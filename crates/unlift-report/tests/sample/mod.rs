//! A made-up audit of a made-up room, for tests and for looking at the page.

#![allow(dead_code, reason = "each user of this file uses a part of it")]

use indexmap::IndexMap;
use unlift_report::Given;
use unlift_report::document::{
    Bound, BreakEven, Distinct, Document, GateResult, ImageCounts, ImageFigures, ImageRow, Input,
    LengthUnit, NotAudited, ReliabilityBin, Row, Run, SCHEMA, Seconds,
};
use unlift_report::pictures::{Graph, Marks, Picture, RecoveredView, ReleasedView};
use unlift_report::scene::{ObfuscationView, Scene3d, SceneBox, Shapes, View};

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

/// The same for the best attack on the records alone, where there is one.
const RECORDS_ALONE: [(&str, [f64; 2]); 6] = [
    ("olc", [58.6, 76.4]),
    ("ppl", [7.3, 14.8]),
    ("ppl+", [7.1, 14.2]),
    ("ray", [21.5, 44.0]),
    ("ray-voxel", [20.8, 43.7]),
    ("cp", [16.2, 31.9]),
];

/// A whole audit; without a scale lengths are times the usual distance of neighbors.
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
        break_even,
        gates: vec![gate("ppl@0.5:0.10<=20", 89.1, 20.0), gate("plane@0.1:0.10<=20", 11.8, 20.0)],
        images: Vec::new(),
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

/// The same with neighborhoods of an attacker's own, at ratios that differ from scheme to scheme: `overlap`
/// for all schemes, `geometric` where records tell something.
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
            // Half or more are too far off for any percentile that is listed.
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
    // Error over percent, straight on a log scale between the shares within the thresholds.
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

/// An audit of two images under two schemes.
pub fn images() -> Document {
    let mut document = document(true);
    let by_threshold = |values: [f64; 4]| -> IndexMap<String, f64> {
        ["1", "5", "10", "25"].map(str::to_owned).into_iter().zip(values).collect()
    };
    document
        .results
        .retain(|row| row.solver == "consensus" && ["olc", "cp"].contains(&&*row.scheme));
    for (at, row) in document.results.iter_mut().enumerate() {
        row.scheme = if row.scheme == "olc" { "lines2d" } else { "cp2d" }.into();
        let less = at as f64;
        row.recovered_percent = by_threshold([21.5 - less, 61.5 - less, 81.5 - less, 95.5 - less]);
        row.blind_percent = by_threshold([0.5, 2.25, 4.5, 11.0]);
        (row.unit, row.reliability) = (LengthUnit::Pixel, None);
        (row.sure_percent, row.sure_correct_percent) = (None, None);
        row.sure_unknown = Some("nobody has compared it with what comes true in images".into());
        (row.records_alone_percent, row.records_alone_by) = (None, None);
        row.distinct = Some(Distinct {
            n_places: 17_000,
            recovered_percent: by_threshold([20.25, 60.25, 80.25, 94.25]),
            blind_percent: row.blind_percent.clone(),
        });
    }
    document.break_even.clear();
    document.gates.clear();
    document.run.seconds.rows.clear();
    document.input.images = Some(ImageCounts { found: 4, used: 2, unusable: 1, too_small: 1 });
    document.images = ["kitchen/secret.jpg", "b.jpg"]
        .map(|name| ImageFigures {
            name: Some(name.into()),
            n_points: 10_574,
            rows: document
                .results
                .iter()
                .map(|row| ImageRow {
                    recovered_percent: row.recovered_percent.clone(),
                    distinct_percent: row.recovered_percent.clone(),
                    inlier_ratio: row.inlier_ratio,
                    median_error: Some(3.25),
                })
                .collect(),
        })
        .into();
    document
}

/// A picture of the first image of [`images`].
pub fn picture() -> Picture {
    let place = |i: u64| [0, 1].map(|c| unit_random(2 * i + c) * [640.0, 480.0][c as usize]);
    let keypoints: Vec<[f32; 2]> = (0..300).map(place).collect();
    let given = Given { neighbors: "oracle".into(), oracle_noise: None, inlier_ratio: 0.5 };
    let views = ["lines2d", "cp2d"].map(|scheme| RecoveredView {
        scheme: scheme.into(),
        given: given.clone(),
        solver: "joint".into(),
        recovered: keypoints.iter().map(|p| Some(p.map(|x| x + 4.0))).collect(),
    });
    let lines = keypoints.iter().map(|p| Some([[p[0], 0.0], [p[0], 479.0]])).collect();
    let released = vec![
        ReleasedView { scheme: "lines2d".into(), marks: Marks::Lines(lines) },
        ReleasedView {
            scheme: "cp2d".into(),
            marks: Marks::Points(keypoints.iter().map(|p| Some([p[0], 7.0])).collect()),
        },
    ];
    let graphs = vec![Graph {
        given,
        neighbors: (0..300).map(|i| (1..6).map(|j| place((i + j) % 300)).collect()).collect(),
    }];
    let name = "kitchen/secret.jpg".into();
    let note = "median".into();
    Picture {
        name,
        note,
        size: [640, 480],
        photo: None,
        keypoints,
        released,
        views: views.into(),
        graphs,
    }
}

/// A number in 0..1 from a counter.
fn unit_random(counter: u64) -> f32 {
    let mut z = counter.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x51_7C_C1_B7_27_22_0A_95;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

/// A room of 6 x 4.5 x 2.6 with a table, a shelf and two boxes.
fn room(n: usize) -> Vec<[f32; 3]> {
    let boxes: [([f32; 3], [f32; 3]); 8] = [
        ([0.0, 0.0, 0.0], [6.0, 4.5, 2.6]),
        ([2.0, 1.4, 0.70], [3.9, 2.6, 0.75]),
        ([2.1, 1.5, 0.0], [2.2, 1.6, 0.7]),
        ([3.7, 2.4, 0.0], [3.8, 2.5, 0.7]),
        ([0.1, 0.2, 0.0], [0.5, 1.9, 2.0]),
        ([5.2, 3.4, 0.0], [5.9, 4.3, 0.9]),
        ([2.6, 1.7, 0.75], [2.9, 2.0, 1.1]),
        ([4.6, 0.1, 0.0], [5.6, 0.5, 1.4]),
    ];
    let point = |i: usize| {
        let at = |lane: u64| unit_random(8 * i as u64 + lane);
        // Furniture is denser than walls.
        let which = if at(0) < 0.45 { 0 } else { 1 + (at(1) * 6.999) as usize };
        let (low, high) = boxes[which];
        let axis = (at(2) * 2.999) as usize;
        let mut p: [f32; 3] =
            std::array::from_fn(|a| low[a] + at(3 + a as u64) * (high[a] - low[a]));
        p[axis] = if at(6) < 0.5 { low[axis] } else { high[axis] };
        p.map(|x| x + 0.012 * (at(7) - 0.5))
    };
    (0..n).map(point).collect()
}

/// Points of the room and what came back of them, in keeping with the figures of `document`.
pub fn scene(document: &Document, n: usize) -> Scene3d {
    let originals = room(n);
    let bounds = SceneBox::robust(&originals);
    let direction = |i: usize| -> [f32; 3] {
        std::array::from_fn(|a| unit_random(900_000 + 3 * i as u64 + a as u64) - 0.5)
    };
    let center = [3.0, 2.2, 1.3];
    let obfuscations = SCHEMES.map(|scheme| {
        let indices = 0..1_500.min(n);
        let shapes = match scheme {
            "plane" => Shapes::Patches(
                indices
                    .step_by(10)
                    .filter_map(|i| bounds.axis_patch(i / 10 % 3, originals[i][i / 10 % 3]))
                    .collect(),
            ),
            "cp" => Shapes::Points(
                originals
                    .iter()
                    .enumerate()
                    .map(|(i, p)| {
                        let mut q = *p;
                        q[i % 3] = originals[(i * 7 + 1) % n][i % 3];
                        q
                    })
                    .collect(),
            ),
            "ray" | "ray-voxel" => Shapes::Segments(
                indices
                    .filter_map(|i| {
                        let d = std::array::from_fn(|a| originals[i][a] - center[a]);
                        bounds.clip_ray(center, d)
                    })
                    .collect(),
            ),
            _ => Shapes::Segments(
                indices.filter_map(|i| bounds.clip_line(originals[i], direction(i))).collect(),
            ),
        };
        // Every hundredth point is left out by one scheme.
        let withheld = (0..if scheme == "ppl+" { n } else { 0 }).step_by(100).collect();
        ObfuscationView { scheme: scheme.into(), shapes, n_records: n as u64, withheld }
    });
    let views = document.results.iter().enumerate().map(|(r, row)| {
        let share = row.recovered_percent[0] as f32 / 100.0;
        let recovered = originals.iter().enumerate().map(|(i, p)| {
            let chance = |lane: u64| unit_random(77 + 16 * (i as u64 + n as u64 * r as u64) + lane);
            if chance(0) < row.n_lost as f32 / row.n_points as f32 {
                return [f32::NAN; 3];
            }
            let size =
                if chance(1) < share { 0.05 * chance(2) } else { 0.15 + 4.0 * chance(2).powi(3) };
            std::array::from_fn(|a| p[a] + size * (chance(3 + a as u64) - 0.5))
        });
        View {
            scheme: row.scheme.clone(),
            given: Given {
                neighbors: row.neighbors.clone(),
                oracle_noise: row.oracle_noise.clone(),
                inlier_ratio: row.inlier_ratio,
            },
            solver: row.solver.clone(),
            recovered: recovered.collect(),
        }
    });
    let views = views.collect();
    let cameras = (0..40).map(|i| {
        let angle = i as f32 * 0.157;
        [3.0 + 1.6 * angle.cos(), 2.2 + 1.1 * angle.sin(), 1.5]
    });
    Scene3d {
        n_points: document.input.n_points,
        cameras: cameras.collect(),
        up: None,
        obfuscations: obfuscations.into(),
        views,
        originals,
    }
}
