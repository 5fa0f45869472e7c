//! SuperPoint: keypoints on pixels, descriptors interpolated between cells of 8 x 8 pixels.
//!
//! Source: DeTone, Malisiewicz, Rabinovich, "SuperPoint: Self-Supervised Interest Point Detection
//! and Description", CVPR workshops 2018. Its license forbids distributing the weights: users
//! supply them, converted to ONNX by `training/export/superpoint.py`.

use unlift::Error;

use super::LearnedFeatures;
use super::maxima::{Scores, corners};
use crate::features::image::{fitted, unshrunk};
use crate::features::{ColorImage, Extraction};
use crate::network::{Network, Tensor};

const MODEL: &str = "superpoint";
/// Side of a cell in pixels.
const CELL: usize = 8;
/// Radius in pixels without other keypoints, and width of the border without any.
const RADIUS: usize = 4;

/// Extracts the features of an image with a network that has the inputs and outputs of SuperPoint.
///
/// # Errors
/// If an option is out of range, or its outputs do not fit together.
pub fn superpoint(
    network: &Network,
    options: &Extraction,
    image: &ColorImage,
) -> Result<LearnedFeatures, Error> {
    options.check()?;
    let small = fitted(image, options.max_image_size);
    let small = small.as_ref().unwrap_or(image);
    let size = [small.width() as usize, small.height() as usize];
    if size[0].min(size[1]) < CELL {
        return Ok(LearnedFeatures::default());
    }
    let pixels = small.pixels().map(|color| gray(color.0)).collect();
    let input = Tensor::try_new(&[1, 1, size[1], size[0]], pixels)?;
    let [score, coarse] = network.run(vec![("image", input)], ["score", "coarse"])?;
    let &[_, height, width] = score.shape() else {
        let found = format!("{:?}", score.shape());
        return Err(Error::new(MODEL, "scores of shape (1, any, any)", found));
    };
    if coarse.shape()[..3] != [1, height / CELL, width / CELL] || height < CELL || width < CELL {
        let expected =
            format!("descriptors of cells of {CELL} pixels of ({height}, {width}) scores");
        return Err(Error::new(MODEL, expected, format!("{:?}", coarse.shape())));
    }
    let scores = Scores { width, height, values: score.into_values() };
    let maxima = scores.maxima(RADIUS, options);
    let dim = coarse.shape().last().copied().unwrap_or(0);
    let mut descriptors = vec![0.0; maxima.len() * dim];
    for (&pixel, out) in maxima.iter().zip(descriptors.chunks_exact_mut(dim)) {
        describe(&coarse, pixel, [width, height], out);
    }
    let keypoint = |pixel: &[usize; 2]| unshrunk(image, small, pixel.map(|at| at as f32));
    Ok(LearnedFeatures {
        keypoints: maxima.iter().map(keypoint).collect(),
        scores: maxima.iter().map(|&[x, y]| scores.values[y * width + x]).collect(),
        descriptors,
        dim,
    })
}

/// Converts to gray in 0..1 with the weights of Rec. 601, as OpenCV does.
fn gray([red, green, blue]: [u8; 3]) -> f32 {
    let [red, green, blue] = [red, green, blue].map(f32::from);
    (0.299 * red + 0.587 * green + 0.114 * blue).round() / 255.0
}

/// Interpolates the descriptor of a pixel from the four cells around it, to length 1.
///
/// A cell's descriptor is at its middle. The scale, slightly less than eight, is the authors'.
fn describe(coarse: &Tensor, place: [usize; 2], size: [usize; 2], out: &mut [f32]) {
    let dim = out.len();
    let cells = [coarse.shape()[2], coarse.shape()[1]];
    let place = [0, 1].map(|side| {
        let middle = (CELL as f32 - 1.0) / 2.0;
        let share = (place[side] as f32 - middle) / (size[side] as f32 - (CELL as f32 + 1.0) / 2.0);
        share * (cells[side] - 1) as f32
    });
    for ([x, y], weight) in corners(place, cells) {
        let at = (y * cells[0] + x) * dim;
        let cell = &coarse.values()[at..at + dim];
        out.iter_mut().zip(cell).for_each(|(out, value)| *out += weight * value);
    }
    let length = out.iter().map(|value| value * value).sum::<f32>().sqrt().max(1e-12);
    out.iter_mut().for_each(|value| *value /= length);
}
