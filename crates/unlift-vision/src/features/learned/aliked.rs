//! ALIKED: sub-pixel keypoints, and descriptors from positions that the network chooses.
//!
//! Source: Zhao et al., "ALIKED: A Lighter Keypoint and Descriptor Extraction Network via
//! Deformable Transformation", IEEE TIM 2023; the weights are the authors' aliked-n16rot.

use unlift::Error;

use super::LearnedFeatures;
use super::maxima::{Scores, corners};
use crate::features::image::{fitted, unshrunk};
use crate::features::{ColorImage, Extraction};
use crate::network::{Network, Tensor};

/// The network halves an image five times.
const MULTIPLE: usize = 32;
/// Radius of the window that determines the sub-pixel position and holds no other keypoint.
const RADIUS: usize = 2;
/// Softmax temperature of the sub-pixel position; with a smaller one the best score decides more.
const TEMPERATURE: f32 = 0.1;
/// Sample positions of a descriptor.
const SAMPLES: usize = 16;
/// Pixels around a keypoint from which the network computes these positions.
const PATCH: usize = 9;
/// Keypoints that are described at a time: 13 MB.
const BATCH: usize = 1024;

/// Extracts the features of an image with the network `aliked-n16rot`. Uses about 330 bytes of memory per pixel after downsizing.
///
/// # Errors
/// If an option is out of range, or the network has other inputs or outputs.
pub fn aliked(
    network: &Network,
    options: &Extraction,
    image: &ColorImage,
) -> Result<LearnedFeatures, Error> {
    options.check()?;
    let small = fitted(image, options.max_image_size);
    let small = small.as_ref().unwrap_or(image);
    let (scores, levels) = dense(network, small)?;
    let maxima = scores.maxima(RADIUS, options);
    let places: Vec<[f32; 2]> = maxima.into_iter().map(|pixel| refined(&scores, pixel)).collect();
    let mut descriptors = Vec::with_capacity(places.len() * DIM);
    for places in places.chunks(BATCH) {
        descriptors.extend(describe(network, &levels, places)?);
    }
    let scores = places.iter().map(|&place| scores.at(place)).collect();
    let keypoints = places.into_iter().map(|place| unshrunk(image, small, place)).collect();
    Ok(LearnedFeatures { keypoints, scores, descriptors, dim: DIM })
}

/// Returns the scores of all pixels, and the maps from which descriptors are made.
fn dense(network: &Network, image: &ColorImage) -> Result<(Scores, Levels), Error> {
    let size = [image.width() as usize, image.height() as usize];
    let padded = size.map(|side| side.next_multiple_of(MULTIPLE));
    let padding = [0, 1].map(|side| (padded[side] - size[side]) / 2);
    let inner = |at: usize, side: usize| at.saturating_sub(padding[side]).min(size[side] - 1);
    let [width, height] = padded;
    let mut planes = vec![0.0; 3 * width * height];
    for y in 0..height {
        for x in 0..width {
            let colors = image.get_pixel(inner(x, 0) as u32, inner(y, 1) as u32).0;
            for (channel, value) in colors.into_iter().enumerate() {
                planes[(channel * height + y) * width + x] = f32::from(value) / 255.0;
            }
        }
    }
    let input = Tensor::try_new(&[1, 3, height, width], planes)?;
    let outputs = ["score", "level1", "level2", "level3", "level4"];
    let [score, fine, coarse @ ..] = network.run(vec![("image", input)], outputs)?;
    let rows = score.values().chunks_exact(width).skip(padding[1]).take(size[1]);
    let values = rows.flat_map(|row| &row[padding[0]..padding[0] + size[0]]).copied().collect();
    let scores = Scores { width: size[0], height: size[1], values };
    Ok((scores, Levels { fine, coarse, padding, size }))
}

/// Returns the descriptors at these positions, one after the other.
fn describe(network: &Network, levels: &Levels, places: &[[f32; 2]]) -> Result<Vec<f32>, Error> {
    let n = places.len();
    let mut patches = vec![0.0; n * PATCH * DIM];
    for (place, patch) in places.iter().zip(patches.chunks_exact_mut(PATCH * DIM)) {
        let [x, y] = place.map(|at| at as isize);
        for (at, out) in patch.chunks_exact_mut(DIM).enumerate() {
            levels.pixel(x + at as isize % 3 - 1, y + at as isize / 3 - 1, out);
        }
    }
    let patches = Tensor::try_new(&[n, PATCH, DIM], patches)?;
    let [offsets] = network.run(vec![("patch", patches)], ["offsets"])?;
    let limit = levels.size[0].max(levels.size[1]) as f32 / 4.0;
    let mut samples = vec![0.0; n * SAMPLES * DIM];
    let of_each = samples.chunks_exact_mut(SAMPLES * DIM);
    let offsets = offsets.values().chunks_exact(2 * SAMPLES);
    for (([x, y], offsets), samples) in places.iter().zip(offsets).zip(of_each) {
        for (at, out) in samples.chunks_exact_mut(DIM).enumerate() {
            let [across, down] = [offsets[at], offsets[SAMPLES + at]];
            levels.between(x + across.clamp(-limit, limit), y + down.clamp(-limit, limit), out);
        }
    }
    let samples = Tensor::try_new(&[n, SAMPLES, DIM], samples)?;
    let [descriptors] = network.run(vec![("samples", samples)], ["descriptors"])?;
    Ok(descriptors.into_values())
}

/// Returns the mean of the pixels around a keypoint, weighted by the softmax of their scores.
fn refined(scores: &Scores, [x, y]: [usize; 2]) -> [f32; 2] {
    let side = 2 * RADIUS + 1;
    let around = |at: usize| {
        let [dx, dy] = [at % side, at / side];
        (scores.values[(y + dy - RADIUS) * scores.width + x + dx - RADIUS], [dx, dy])
    };
    let best = (0..side * side).map(|at| around(at).0).fold(f32::MIN, f32::max);
    let (mut sum, mut moved) = (0.0, [0.0; 2]);
    for (score, offset) in (0..side * side).map(around) {
        let weight = libm::expf((score - best) / TEMPERATURE);
        sum += weight;
        for (moved, offset) in moved.iter_mut().zip(offset) {
            *moved += weight * (offset as f32 - RADIUS as f32);
        }
    }
    [x as f32 + moved[0] / sum, y as f32 + moved[1] / sum]
}

const CHANNELS: usize = 32;
const DIM: usize = 4 * CHANNELS;

/// The four levels of ALIKED over an image that was padded on all sides.
///
/// All pixels would need 512 bytes each, so only requested ones are computed.
struct Levels {
    /// `(1, 32, height, width)`.
    fine: Tensor,
    /// `(1, height / s, width / s, 32)` for s = 2, 8, 32.
    coarse: [Tensor; 3],
    /// Pixels of padding on the left and above.
    padding: [usize; 2],
    /// Width and height of the image without padding.
    size: [usize; 2],
}

impl Levels {
    /// Describes the position `(x, y)` by bilinear interpolation of four pixels.
    fn between(&self, x: f32, y: f32, out: &mut [f32]) {
        out.fill(0.0);
        let mut pixel = [0.0; DIM];
        for ([x, y], weight) in corners([x, y], self.size) {
            self.pixel(x as isize, y as isize, &mut pixel);
            out.iter_mut().zip(&pixel).for_each(|(out, value)| *out += weight * value);
        }
    }

    /// Describes a pixel by 128 values of length 1; zeros outside the image.
    fn pixel(&self, x: isize, y: isize, out: &mut [f32]) {
        let [width, height] = self.size;
        if !(0..width as isize).contains(&x) || !(0..height as isize).contains(&y) {
            return out.fill(0.0);
        }
        let (x, y) = (x as usize + self.padding[0], y as usize + self.padding[1]);
        let [height, width] = [self.fine.shape()[2], self.fine.shape()[3]];
        let (fine, coarse) = out.split_at_mut(CHANNELS);
        let channels = self.fine.values().chunks_exact(width * height);
        fine.iter_mut().zip(channels).for_each(|(out, map)| *out = map[y * width + x]);
        for (level, out) in self.coarse.iter().zip(coarse.chunks_exact_mut(CHANNELS)) {
            enlarged(level, [x, y], [width, height], out);
        }
        let length = square(out).sqrt().max(1e-12);
        out.iter_mut().for_each(|value| *value /= length);
    }
}

/// Interpolates a coarse level at a pixel of an image whose corners coincide with its own.
fn enlarged(level: &Tensor, [x, y]: [usize; 2], size: [usize; 2], out: &mut [f32]) {
    let [rows, columns] = [level.shape()[1], level.shape()[2]];
    let place = |at: usize, small: usize, large: usize| {
        let place = (small - 1) as f32 / (large - 1) as f32 * at as f32;
        let first = (place as usize).min(small - 1);
        (first, (first + 1).min(small - 1), place - first as f32)
    };
    let (left, right, across) = place(x, columns, size[0]);
    let (top, bottom, down) = place(y, rows, size[1]);
    let pixel = |x: usize, y: usize| {
        let at = (y * columns + x) * CHANNELS;
        &level.values()[at..at + CHANNELS]
    };
    let (a, b) = (pixel(left, top), pixel(right, top));
    let (c, d) = (pixel(left, bottom), pixel(right, bottom));
    for (at, out) in out.iter_mut().enumerate() {
        let upper = (1.0 - across) * a[at] + across * b[at];
        let lower = (1.0 - across) * c[at] + across * d[at];
        *out = (1.0 - down) * upper + down * lower;
    }
}

/// Returns the sum of squares, accumulated in eight lanes.
fn square(values: &[f32]) -> f32 {
    let mut sums = [0.0; 8];
    for eight in values.as_chunks::<8>().0 {
        sums.iter_mut().zip(eight).for_each(|(sum, value)| *sum += value * value);
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_all_levels_lie_on_each_other() {
        // Levels of a padded image of 64 x 32: a ramp from left to right is the same on each.
        let ramp = |x: usize, columns: usize| 1.0 + x as f32 / (columns - 1) as f32;
        let fine = (0..CHANNELS * 32 * 64).map(|at| ramp(at % 64, 64)).collect();
        let coarse = [(16, 32), (4, 8), (1, 2)].map(|(rows, columns)| {
            let value = |at: usize| ramp(at / CHANNELS % columns, columns);
            let values = (0..rows * columns * CHANNELS).map(value).collect();
            Tensor::try_new(&[1, rows, columns, CHANNELS], values).unwrap()
        });
        let fine = Tensor::try_new(&[1, CHANNELS, 32, 64], fine).unwrap();
        let levels = Levels { fine, coarse, padding: [3, 5], size: [58, 22] };
        let mut pixel = [0.0; DIM];
        levels.pixel(20, 7, &mut pixel);
        assert!((square(&pixel) - 1.0).abs() < 1e-6);
        assert!(pixel.iter().all(|value| (value - pixel[0]).abs() < 1e-6), "{pixel:?}");
    }
}
