//! A synthetic audit of images, and a picture of one of them.

use indexmap::IndexMap;
use unlift_report::Given;
use unlift_report::document::{
    Distinct, Document, ImageCounts, ImageFigures, ImageRow, LengthUnit,
};
use unlift_report::pictures::{Graph, Marks, Picture, RecoveredView, ReleasedView};

use super::{document, unit_random};

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

/// Returns a picture of the first image of [`images`].
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
