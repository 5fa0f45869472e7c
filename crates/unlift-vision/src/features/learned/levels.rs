//! Feature maps of ALIKED: four levels of different resolution, joined at a pixel.

use super::maxima::corners;
use crate::network::Tensor;

const CHANNELS: usize = 32;
pub(crate) const DIM: usize = 4 * CHANNELS;

/// The four levels of ALIKED over an image that was padded on all sides.
///
/// Resizing the coarse levels to all pixels would need 512 bytes per pixel, so only requested
/// pixels are computed.
pub(crate) struct Levels {
    /// `(1, 32, height, width)`.
    fine: Tensor,
    /// `(1, height / s, width / s, 32)` for s = 2, 8, 32.
    coarse: [Tensor; 3],
    /// Pixels of padding on the left and above.
    pub padding: [usize; 2],
    /// Width and height of the image without padding.
    pub size: [usize; 2],
}

impl Levels {
    pub(crate) fn new(levels: [Tensor; 4], padding: [usize; 2], size: [usize; 2]) -> Self {
        let [fine, a, b, c] = levels;
        Self { fine, coarse: [a, b, c], padding, size }
    }

    /// Describes the position `(x, y)` by bilinear interpolation of four pixels.
    pub(crate) fn between(&self, x: f32, y: f32, out: &mut [f32]) {
        out.fill(0.0);
        let mut pixel = [0.0; DIM];
        for ([x, y], weight) in corners(x, y) {
            self.pixel(x, y, &mut pixel);
            out.iter_mut().zip(&pixel).for_each(|(out, value)| *out += weight * value);
        }
    }

    /// Describes the pixel in column `x` of row `y` by 128 values of length 1; zeros outside the
    /// image.
    pub(crate) fn pixel(&self, x: isize, y: isize, out: &mut [f32]) {
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

/// Interpolates a coarse level at pixel `(x, y)` of an image of `size`; the corners of both
/// coincide.
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

    /// Levels of a padded image of 64 x 32 whose channels hold `value(channel, x, y)` in 0..1.
    fn levels(value: impl Fn(usize, f32, f32) -> f32) -> Levels {
        let fine = (0..CHANNELS * 32 * 64)
            .map(|at| value(at / (32 * 64), (at % 64) as f32 / 63.0, (at / 64 % 32) as f32 / 31.0));
        let coarse = [(16, 32), (4, 8), (1, 2)].map(|(rows, columns): (usize, usize)| {
            let part = |at: usize, n: usize| at as f32 / (n.max(2) - 1) as f32;
            let values = (0..rows * columns * CHANNELS).map(|at| {
                let (pixel, channel) = (at / CHANNELS, at % CHANNELS);
                value(channel, part(pixel % columns, columns), part(pixel / columns, rows))
            });
            Tensor::try_new(&[1, rows, columns, CHANNELS], values.collect()).unwrap()
        });
        let fine = Tensor::try_new(&[1, CHANNELS, 32, 64], fine.collect()).unwrap();
        let [a, b, c] = coarse;
        Levels::new([fine, a, b, c], [3, 5], [58, 22])
    }

    #[test]
    fn corners_of_all_levels_lie_on_each_other() {
        // A ramp from left to right is the same ramp on every level.
        let levels = levels(|_, x, _| 1.0 + x);
        let mut pixel = [0.0; DIM];
        levels.pixel(20, 7, &mut pixel);
        assert!((square(&pixel) - 1.0).abs() < 1e-6);
        assert!(pixel.iter().all(|value| (value - pixel[0]).abs() < 1e-6), "{pixel:?}");
    }

    #[test]
    fn outside_the_image_there_is_nothing() {
        let levels = levels(|channel, _, _| channel as f32);
        let mut pixel = [1.0; DIM];
        for (x, y) in [(-1, 0), (0, -1), (58, 0), (0, 22)] {
            levels.pixel(x, y, &mut pixel);
            assert_eq!(pixel, [0.0; DIM]);
        }
        // Half of it is outside.
        levels.between(57.5, 3.0, &mut pixel);
        assert!((square(&pixel).sqrt() - 0.5).abs() < 1e-6);
    }
}
