//! Feature images, compared with those of training.

use safetensors::SafeTensors;
use unlift::descriptors::Values;
use unlift::{Descriptors, Error};
use unlift_vision::network::Tensor;
use unlift_vision::pictures::{CELL, Points, feature_image};

use crate::{assert_close, floats};

/// `training/inversion/batches.py` makes this file.
const GOLDEN: &[u8] = include_bytes!("../data/feature-image.safetensors");
const SIZE: [usize; 2] = [30, 22];
const COLUMNS: usize = 8;
/// Number of cells.
const PLANE: usize = 6 * 8;

/// Points of one image in columns.
struct Columns {
    places: Vec<[f32; 2]>,
    descriptors: Descriptors,
    weights: Vec<f32>,
    depths: Vec<f32>,
}

impl Columns {
    /// Reads the golden points, whose positions count from the corner of the first pixel.
    fn golden() -> Self {
        let file = SafeTensors::deserialize(GOLDEN).unwrap();
        let places = floats(&file, "places");
        let weights = floats(&file, "weights");
        let values = Values::F32(floats(&file, "descriptors"));
        Self {
            places: places.as_chunks::<2>().0.iter().map(|xy| xy.map(|x| x - 0.5)).collect(),
            descriptors: Descriptors::try_new(values, COLUMNS).unwrap(),
            depths: (0..weights.len()).map(|at| (at * 7 % 31) as f32 + 1.0).collect(),
            weights,
        }
    }

    fn image(&self, with_depths: bool, colored: bool) -> Result<Tensor, Error> {
        let Self { places, descriptors, weights, depths } = self;
        let depths = with_depths.then_some(&depths[..]);
        feature_image(&Points { places, descriptors, weights, depths }, SIZE, colored)
    }
}

/// Sums in another order.
const TOLERANCE: f32 = 1e-5;

#[test]
fn the_feature_image_is_that_of_training_and_colors_are_zero() {
    let columns = Columns::golden();
    let file = SafeTensors::deserialize(GOLDEN).unwrap();
    let plain = columns.image(false, false).unwrap();
    assert_eq!(plain.shape(), [1, COLUMNS + 3, 6, 8]);
    assert_close("features", plain.values(), &floats(&file, "features"), TOLERANCE);
    let colorless = columns.image(false, true).unwrap();
    let (before, rest) = colorless.values().split_at(COLUMNS * PLANE);
    let (colors, after) = rest.split_at(4 * PLANE);
    assert!(colors.iter().all(|x| *x == 0.0));
    assert_eq!([before, after].concat(), plain.values());
}

#[test]
fn with_depths_the_nearest_point_of_a_cell_replaces_the_mean() {
    let all = Columns::golden();
    let cell = |at: usize| all.places[at].map(|x| ((x + 0.5) / CELL as f32).floor() as i64);
    let counts = |at: usize| {
        let inside = |c: usize| (-0.5..SIZE[c] as f32 - 0.5).contains(&all.places[at][c]);
        all.weights[at] > 0.0 && inside(0) && inside(1)
    };
    let n = all.places.len();
    // The first one of several nearest points.
    let nearest = |&at: &usize| {
        let nearer = |other: usize| (all.depths[other], other) < (all.depths[at], at);
        counts(at) && !(0..n).any(|other| counts(other) && cell(other) == cell(at) && nearer(other))
    };
    let kept: Vec<usize> = (0..n).filter(nearest).collect();
    let rows: Vec<u32> = kept.iter().map(|&at| at as u32).collect();
    let alone = Columns {
        places: kept.iter().map(|&at| all.places[at]).collect(),
        descriptors: all.descriptors.select(&rows),
        weights: kept.iter().map(|&at| all.weights[at]).collect(),
        depths: Vec::new(),
    };
    assert!((10..n / 2).contains(&kept.len()), "{} of {n}", kept.len());
    let (image, expected) = (all.image(true, false).unwrap(), alone.image(false, false).unwrap());
    assert_close("nearest", image.values(), expected.values(), TOLERANCE);
}

#[test]
fn wrong_columns_and_implausible_sizes_are_refused() {
    let mut columns = Columns::golden();
    let Columns { places, descriptors, weights, depths } = &columns;
    let points = Points { places, descriptors, weights, depths: Some(depths) };
    // A camera may declare any size, and memory depends on it.
    for size in [[1, 22], [30, 0], [16_384, 16_384], [usize::MAX, 2], [1 << 23, 3]] {
        let error = feature_image(&points, size, false).unwrap_err();
        assert_eq!(error.expected(), "at least 2 x 2 and at most 16777216 pixels", "{size:?}");
    }
    columns.places.iter_mut().for_each(|place| place[0] = f32::NAN);
    assert!(columns.image(false, false).unwrap().values().iter().all(|x| *x == 0.0));
    columns.weights.pop();
    let error = columns.image(true, false).unwrap_err().to_string();
    assert_eq!(error, "weights: expected 150, one per point, found 149");
}
