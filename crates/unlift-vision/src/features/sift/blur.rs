//! Gaussian smoothing, which makes one level of scale space from the previous one.

use unlift::simd::{Kernel, dispatch};

use super::plane::{LANES, Plane, lanes};

/// Radius of the widest filter: one level per octave needs 45.
const MOST_RADIUS: usize = 48;

pub(crate) struct Gaussian {
    /// The middle and one side: `taps[i]` is the weight of both neighbors at distance `i`.
    taps: Vec<f32>,
}

impl Gaussian {
    /// Creates a Gaussian of standard deviation `sigma` pixels, truncated at four of them.
    pub(crate) fn new(sigma: f64) -> Self {
        let radius = (libm::ceil(4.0 * sigma) as usize).clamp(1, MOST_RADIUS);
        let weight = |at: usize| libm::exp(-0.5 * (at as f64 / sigma) * (at as f64 / sigma));
        let total: f64 = 1.0 + 2.0 * (1..=radius).map(weight).sum::<f64>();
        Self { taps: (0..=radius).map(|at| (weight(at) / total) as f32).collect() }
    }

    /// Smooths `from` into `to`, repeating values at the border. `line` is a buffer.
    pub(crate) fn smooth(&self, from: &Plane, to: &mut Plane, line: &mut Vec<f32>) {
        to.reshape(from.width, from.height);
        line.resize(from.stride() + 2 * MOST_RADIUS, 0.0);
        dispatch(Smooth { from, to, line, taps: &self.taps });
    }
}

/// Filters columns, then rows, one output row at a time, so that intermediate values stay in the
/// cache.
struct Smooth<'a> {
    from: &'a Plane,
    to: &'a mut Plane,
    line: &'a mut [f32],
    taps: &'a [f32],
}

impl Kernel for Smooth<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { from, to, line, taps } = self;
        let (width, last, radius) = (from.width, from.height - 1, taps.len() - 1);
        for y in 0..from.height {
            let line = &mut line[..from.stride() + 2 * radius];
            let middle = from.row(y).as_chunks::<LANES>().0;
            let mut sides = [(middle, middle); MOST_RADIUS];
            for (i, side) in sides[..radius].iter_mut().enumerate() {
                let above = from.row(y.saturating_sub(i + 1));
                let below = from.row((y + i + 1).min(last));
                *side = (above.as_chunks().0, below.as_chunks().0);
            }
            columns(middle, &sides[..radius], taps, &mut line[radius..]);
            let (first, end) = (line[radius], line[radius + width - 1]);
            line[..radius].fill(first);
            line[radius + width..].fill(end);
            rows(line, taps, to.row_mut(y));
        }
    }
}

type Chunks<'a> = &'a [[f32; LANES]];

/// A loop, because `map` over an array is not inlined and not vectorized.
#[inline(always)]
fn scaled(values: &[f32; LANES], by: f32) -> [f32; LANES] {
    let mut scaled = [0.0; LANES];
    for (scaled, value) in scaled.iter_mut().zip(values) {
        *scaled = by * value;
    }
    scaled
}

#[inline(always)]
fn columns(middle: Chunks, sides: &[(Chunks, Chunks)], taps: &[f32], line: &mut [f32]) {
    for (at, (out, middle)) in line.as_chunks_mut::<LANES>().0.iter_mut().zip(middle).enumerate() {
        let mut sums = scaled(middle, taps[0]);
        for ((above, below), &tap) in sides.iter().zip(&taps[1..]) {
            let (above, below) = (&above[at], &below[at]);
            for ((sum, &a), &b) in sums.iter_mut().zip(above).zip(below) {
                *sum += tap * (a + b);
            }
        }
        *out = sums;
    }
}

/// Computes one row of sums along the row; `line` has `taps.len() - 1` values before and after it.
#[inline(always)]
fn rows(line: &[f32], taps: &[f32], out: &mut [f32]) {
    let radius = taps.len() - 1;
    for (chunk, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let at = chunk * LANES + radius;
        let mut sums = scaled(&lanes(line, at), taps[0]);
        for (i, &tap) in taps.iter().enumerate().skip(1) {
            let (left, right) = (lanes::<LANES>(line, at - i), lanes::<LANES>(line, at + i));
            for ((sum, &a), &b) in sums.iter_mut().zip(&left).zip(&right) {
                *sum += tap * (a + b);
            }
        }
        *out = sums;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::image::GrayImage;

    fn plane(width: usize, height: usize) -> Plane {
        let value = |i: usize| ((i * 7919) % 101) as f32 / 101.0;
        let pixels = (0..width * height).map(value).collect();
        let mut plane = Plane::default();
        plane.copy(&GrayImage::try_new(width, height, pixels).unwrap());
        plane
    }

    #[test]
    fn smoothing_is_the_plain_double_sum() {
        for (width, height) in [(1, 1), (5, 70), (70, 5), (33, 34)] {
            let from = plane(width, height);
            let gaussian = Gaussian::new(1.6);
            let mut to = Plane::default();
            gaussian.smooth(&from, &mut to, &mut Vec::new());
            let radius = gaussian.taps.len() as isize - 1;
            assert_eq!(radius, 7);
            for (x, y) in [(0, 0), (width / 2, height / 2), (width - 1, height - 1)] {
                let mut sum = 0.0;
                for dy in -radius..=radius {
                    for dx in -radius..=radius {
                        let at = |i: usize, d: isize, n: usize| {
                            (i as isize + d).clamp(0, n as isize - 1) as usize
                        };
                        let tap =
                            gaussian.taps[dx.unsigned_abs()] * gaussian.taps[dy.unsigned_abs()];
                        sum += tap * from.at(at(x, dx, width), at(y, dy, height));
                    }
                }
                assert!((to.at(x, y) - sum).abs() < 1e-5, "{width}x{height} at {x}, {y}");
            }
        }
    }

    #[test]
    fn both_twins_give_the_same_bits() {
        let from = plane(101, 23);
        let gaussian = Gaussian::new(3.1);
        let [mut fast, mut plain] = [Plane::default(), Plane::default()];
        gaussian.smooth(&from, &mut fast, &mut Vec::new());
        plain.reshape(101, 23);
        let mut line = vec![0.0; from.stride() + 2 * MOST_RADIUS];
        Smooth { from: &from, to: &mut plain, line: &mut line, taps: &gaussian.taps }.run();
        for y in 0..23 {
            assert_eq!(fast.row(y)[..101], plain.row(y)[..101]);
        }
    }
}
