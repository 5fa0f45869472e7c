//! Feature images, compared with those of training and with a slow implementation.

use safetensors::SafeTensors;
use unlift::descriptors::Values;
use unlift::{Descriptors, Error};
use unlift_vision::network::Tensor;
use unlift_vision::pictures::{CELL, Points, feature_image};

const GOLDEN: &[u8] = include_bytes!("../data/feature-image.safetensors");
const SIZE: [usize; 2] = [30, 22];
const COLUMNS: usize = 8;

struct Columns {
    places: Vec<[f32; 2]>,
    descriptors: Descriptors,
    weights: Vec<f32>,
    depths: Vec<f32>,
}

fn floats(file: &SafeTensors, name: &str) -> Vec<f32> {
    let view = file.tensor(name).unwrap();
    view.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

/// Reads the golden points, with colors, and converts positions from the corner to the middle of
/// the first pixel. Returns them and the golden feature images without and with colors.
fn columns() -> (Columns, [Vec<f32>; 2]) {
    let file = SafeTensors::deserialize(GOLDEN).unwrap();
    let places = floats(&file, "places");
    let places = places.as_chunks::<2>().0.iter().map(|place| place.map(|x| x - 0.5));
    let values = Values::F32(floats(&file, "descriptors"));
    let weights = floats(&file, "weights");
    let colors = file.tensor("colors").unwrap().data().as_chunks::<3>().0.to_vec();
    let descriptors = Descriptors::try_new(values, COLUMNS).unwrap();
    let columns = Columns {
        places: places.collect(),
        descriptors: descriptors.with_colors(colors).unwrap(),
        depths: (0..weights.len()).map(|at| (at * 7 % 31) as f32 + 1.0).collect(),
        weights,
    };
    (columns, ["features", "features_colored"].map(|name| floats(&file, name)))
}

fn image(columns: &Columns, with_depths: bool) -> Result<Tensor, Error> {
    let Columns { places, descriptors, weights, depths } = columns;
    let depths = with_depths.then_some(&depths[..]);
    feature_image(&Points { places, descriptors, weights, depths }, SIZE, false)
}

/// Computes the feature image cell by cell over all points.
fn slow(columns: &Columns, with_depths: bool) -> Vec<f32> {
    let [width, height] = SIZE.map(|side| side.div_ceil(CELL));
    let mut values = vec![0.0; (COLUMNS + 3) * width * height];
    let cell_of = |place: [f32; 2]| place.map(|x| ((x + 0.5) / CELL as f32).floor());
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let mut inside: Vec<usize> = (0..columns.places.len())
            .filter(|&at| {
                let place = columns.places[at].map(|x| x + 0.5);
                columns.weights[at] > 0.0
                    && (0..2).all(|c| place[c] >= 0.0 && place[c] < SIZE[c] as f32)
                    && cell_of(columns.places[at]) == [x as f32, y as f32]
            })
            .collect();
        if with_depths {
            inside
                .sort_by(|&a, &b| columns.depths[a].total_cmp(&columns.depths[b]).then(a.cmp(&b)));
            inside.truncate(1);
        }
        let mut set = |channel: usize, value: f64| {
            values[(channel * height + y) * width + x] = value as f32;
        };
        let total: f64 = inside.iter().map(|&at| f64::from(columns.weights[at])).sum();
        if inside.is_empty() {
            continue;
        }
        let mean = |of: &dyn Fn(usize) -> f64| {
            inside.iter().map(|&at| f64::from(columns.weights[at]) * of(at)).sum::<f64>() / total
        };
        for column in 0..COLUMNS {
            set(
                column,
                mean(&|at| {
                    let mut row = [0.0; COLUMNS];
                    columns.descriptors.read_row(at, &mut row);
                    let length = row.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
                    f64::from(row[column]) * (COLUMNS as f64).sqrt() / length
                }),
            );
        }
        for (c, corner) in [x, y].into_iter().enumerate() {
            let place = |at: usize| f64::from((columns.places[at][c] + 0.5) / CELL as f32);
            set(COLUMNS + c, mean(&|at| 2.0 * (place(at) - corner as f64) - 1.0));
        }
        let largest = inside.iter().map(|&at| columns.weights[at]).fold(0.0, f32::max);
        set(COLUMNS + 2, f64::from(largest));
    }
    values
}

fn check(found: &Tensor, expected: &[f32]) {
    assert_eq!(found.shape()[2..], [6, 8]);
    assert_eq!(found.values().len(), expected.len());
    for (at, (found, expected)) in found.values().iter().zip(expected).enumerate() {
        assert!((found - expected).abs() < 1e-5, "value {at}: {found} and {expected}");
    }
}

#[test]
fn training_sees_the_same() {
    let (columns, [golden, colored]) = columns();
    check(&image(&columns, false).unwrap(), &golden);
    let Columns { places, descriptors, weights, .. } = &columns;
    let points = Points { places, descriptors, weights, depths: None };
    check(&feature_image(&points, SIZE, true).unwrap(), &colored);
}

#[test]
fn unknown_colors_are_zero() {
    let (columns, [golden, _]) = columns();
    let values = columns.descriptors.values().clone();
    let descriptors = &Descriptors::try_new(values, COLUMNS).unwrap();
    let Columns { places, weights, .. } = &columns;
    let points = Points { places, descriptors, weights, depths: None };
    let found = feature_image(&points, SIZE, true).unwrap();
    let plane = 6 * 8;
    let (before, rest) = found.values().split_at(COLUMNS * plane);
    let (colors, after) = rest.split_at(4 * plane);
    assert!(colors.iter().all(|x| *x == 0.0));
    let found = Tensor::try_new(&[1, COLUMNS + 3, 6, 8], [before, after].concat()).unwrap();
    check(&found, &golden);
}

#[test]
fn a_slow_twin_says_the_same() {
    let (columns, _) = columns();
    for with_depths in [false, true] {
        check(&image(&columns, with_depths).unwrap(), &slow(&columns, with_depths));
    }
}

#[test]
fn points_nowhere_are_left_out() {
    let (mut columns, _) = columns();
    columns.places.iter_mut().for_each(|place| place[0] = f32::NAN);
    assert!(image(&columns, false).unwrap().values().iter().all(|x| *x == 0.0));
    columns.weights.pop();
    let error = image(&columns, true).unwrap_err().to_string();
    assert_eq!(error, "weights: expected 150, one per point, found 149");
}

/// A camera may declare any size, and memory depends on it.
#[test]
fn sizes_that_no_photo_has_are_refused() {
    let (columns, _) = columns();
    let Columns { places, descriptors, weights, depths } = &columns;
    let points = Points { places, descriptors, weights, depths: Some(depths) };
    for size in [[1, 22], [30, 0], [16_384, 16_384], [usize::MAX, 2], [1 << 23, 3]] {
        let error = feature_image(&points, size, false).unwrap_err();
        assert_eq!(error.expected(), "at least 2 x 2 and at most 16777216 pixels", "{size:?}");
    }
    feature_image(&points, [4096, 4096], false).unwrap();
}
