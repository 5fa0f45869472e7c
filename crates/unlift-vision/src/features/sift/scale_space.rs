//! Scale space: rows of values, Gaussian smoothing, and four levels of one octave at a time.

use unlift::simd::{Kernel, dispatch};

use super::LEVELS;
use crate::features::GrayImage;

/// Values per step of a filter.
const LANES: usize = 32;
/// Pixels per step of the other vector loops, which may read as many columns beyond a row.
pub(crate) const BLOCK: usize = 16;

/// Rows of `f32`, longer than the image is wide, by finite but undefined values.
#[derive(Default)]
pub(crate) struct Plane {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Length of a row with its slack, a multiple of [`LANES`].
    stride: usize,
    values: Vec<f32>,
}

impl Plane {
    /// Resizes to `width` x `height` undefined values; keeps the memory.
    pub(crate) fn reshape(&mut self, width: usize, height: usize) {
        self.width = width;
        self.height = height;
        self.stride = (width + BLOCK).next_multiple_of(LANES);
        self.values.resize(self.stride * height, 0.0);
    }

    #[inline(always)]
    pub(crate) fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.stride..(y + 1) * self.stride]
    }

    #[inline(always)]
    pub(crate) fn row_mut(&mut self, y: usize) -> &mut [f32] {
        &mut self.values[y * self.stride..(y + 1) * self.stride]
    }

    #[inline(always)]
    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.stride + x]
    }

    /// Doubles an image linearly; the last pixel is repeated. Pixel `i` moves to `2 i`.
    pub(crate) fn double(&mut self, image: &GrayImage) {
        let (width, height) = (image.width(), image.height());
        self.reshape(2 * width, 2 * height);
        for y in 0..2 * height {
            let [above, below] = [y / 2, y.div_ceil(2).min(height - 1)].map(|y| image.row(y));
            let (row, slack) = self.row_mut(y).split_at_mut(2 * width);
            for (x, pair) in row.as_chunks_mut::<2>().0.iter_mut().enumerate() {
                let next = (x + 1).min(width - 1);
                let between = |row: &[f32]| 0.5 * (row[x] + row[next]);
                // Where both rows or columns are the same, the means are their exact values.
                *pair = [0.5 * (above[x] + below[x]), 0.5 * (between(above) + between(below))];
            }
            slack.fill(0.0);
        }
    }

    /// Keeps every second value of every second row of `from`.
    pub(crate) fn halve(&mut self, from: &Self) {
        self.reshape(from.width / 2, from.height / 2);
        for y in 0..self.height {
            let row = self.row_mut(y);
            row.fill(0.0);
            for (value, pair) in row.iter_mut().zip(from.row(2 * y)[..from.width].chunks_exact(2)) {
                *value = pair[0];
            }
        }
    }
}

#[inline(always)]
pub(crate) fn lanes<const N: usize>(row: &[f32], at: usize) -> [f32; N] {
    let mut values = [0.0; N];
    values.copy_from_slice(&row[at..at + N]);
    values
}

/// Radius of the widest filter, that from level 4 to level 5.
const MAX_RADIUS: usize = 13;

/// Returns a Gaussian of standard deviation `sigma` pixels, truncated at four of them: its middle and
/// one side. Value `i` is the weight of both neighbors at distance `i`.
fn gaussian(sigma: f64) -> Vec<f32> {
    let radius = libm::ceil(4.0 * sigma) as usize;
    let weight = |at: usize| libm::exp(-0.5 * (at as f64 / sigma) * (at as f64 / sigma));
    let total: f64 = 1.0 + 2.0 * (1..=radius).map(weight).sum::<f64>();
    (0..=radius).map(|at| (weight(at) / total) as f32).collect()
}

/// Smooths `from` into `to` with a Gaussian, repeating values at the border. `line` is a buffer.
fn smooth(taps: &[f32], from: &Plane, to: &mut Plane, line: &mut Vec<f32>) {
    to.reshape(from.width, from.height);
    line.resize(from.stride + 2 * MAX_RADIUS, 0.0);
    dispatch(Smooth { from, to, line, taps });
}

/// Filters columns, then rows, one output row at a time, which stays in the cache.
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
            let line = &mut line[..from.stride + 2 * radius];
            let middle = from.row(y).as_chunks::<LANES>().0;
            let mut sides = [(middle, middle); MAX_RADIUS];
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

/// Assumed smoothing of a photo, in pixels.
const NOMINAL: f64 = 0.5;
/// Smoothing of the first level of an octave, in pixels of the octave.
const FIRST: f64 = 1.6;

/// The filters, the same for every octave.
pub(crate) struct Ladder {
    /// From the image to the first level.
    first: Vec<f32>,
    /// From each level to the next.
    steps: Vec<Vec<f32>>,
}

impl Default for Ladder {
    fn default() -> Self {
        let ratio = libm::exp2(1.0 / LEVELS as f64);
        // The image is doubled.
        let nominal = 2.0 * NOMINAL;
        let first = libm::sqrt(FIRST * FIRST - nominal * nominal);
        let step = FIRST * libm::sqrt(ratio * ratio - 1.0);
        let steps = (0..LEVELS + 2)
            .map(|level| gaussian(step * libm::exp2(level as f64 / LEVELS as f64)))
            .collect();
        Self { first: gaussian(first), steps }
    }
}

/// Returns the smoothing at `level`, in pixels of the octave; level 1 is the first with keypoints.
pub(crate) fn sigma(level: f64) -> f64 {
    FIRST * libm::exp2(level / LEVELS as f64)
}

/// Four consecutive levels of an octave, each smoother than the previous one by the same factor.
///
/// An extremum of the middle difference needs no other level. Lowe 2004, Sec. 3.
#[derive(Default)]
pub(crate) struct Octave {
    pub(crate) levels: [Plane; 4],
    line: Vec<f32>,
}

impl Octave {
    /// Computes the first four levels of the first octave.
    pub(crate) fn start(&mut self, image: &GrayImage, ladder: &Ladder) {
        let [level, .., spare] = &mut self.levels;
        spare.double(image);
        smooth(&ladder.first, spare, level, &mut self.line);
        self.fill(ladder);
    }

    /// Computes the first four levels of the next octave, after the last step of this one.
    pub(crate) fn next(&mut self, ladder: &Ladder) {
        // At half the resolution, the second level is the first of the next octave.
        let [first, second, ..] = &mut self.levels;
        first.halve(second);
        self.fill(ladder);
    }

    fn fill(&mut self, ladder: &Ladder) {
        for (at, taps) in ladder.steps[..3].iter().enumerate() {
            let (done, rest) = self.levels.split_at_mut(at + 1);
            smooth(taps, &done[at], &mut rest[0], &mut self.line);
        }
    }

    /// Moves on by a level: to the four that start at `level`.
    pub(crate) fn step(&mut self, level: usize, ladder: &Ladder) {
        self.levels.rotate_left(1);
        let [.., from, to] = &mut self.levels;
        smooth(&ladder.steps[level + 2], from, to, &mut self.line);
    }
}
