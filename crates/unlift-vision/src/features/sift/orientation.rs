//! Orientations of a keypoint: peaks of a histogram of gradient directions.

use std::f64::consts::TAU;
use std::ops::Range;

use unlift::simd::{Kernel, dispatch};

use super::gradient::{Gradients, TURN};
use super::scale_space::Plane;

/// Maximum number of keypoints per position, each with its own orientation.
const MAX_ORIENTATIONS: usize = 2;
/// Bins of the histogram.
const BINS: usize = 36;
/// Standard deviation of the window, in scales of the keypoint.
const WINDOW: f64 = 1.5;
/// Number of times that the histogram is averaged with its neighbors.
const SMOOTHED: usize = 6;
/// Minimum height of a peak, as a share of the highest.
const SHARE: f32 = 0.8;

/// A position in an octave: pixels of the octave, the middle of the first pixel at 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) sigma: f64,
}

impl Place {
    pub(crate) fn pixel(self) -> (usize, usize) {
        ((self.x + 0.5) as usize, (self.y + 0.5) as usize)
    }
}

/// Computes Gaussian weights of the columns and of the rows within `radius` pixels of the middle
/// one, by the distance from `place`. Windows are their products, so no pixel needs an exponential.
///
/// Quotients of neighboring weights are geometric, so each needs two multiplications.
pub(crate) fn weigh(place: Place, radius: usize, sigma: f64, weights: &mut [Vec<f32>; 2]) {
    let (column, row) = place.pixel();
    let shift = [column as f64 - place.x, row as f64 - place.y];
    let falloff = 0.5 / (sigma * sigma);
    let change = libm::exp(-2.0 * falloff);
    for (weights, shift) in weights.iter_mut().zip(shift) {
        let first = shift - radius as f64;
        let mut weight = libm::exp(-falloff * first * first);
        let mut quotient = libm::exp(-falloff * (2.0 * first + 1.0));
        weights.clear();
        for _ in 0..2 * radius + 1 {
            weights.push(weight as f32);
            weight *= quotient;
            quotient *= change;
        }
    }
}

/// Returns the orientations of `place`, in radians within `0..TAU`, in the order of their bins. Lowe
/// 2004, Sec. 5, with a smoothed histogram and linear votes.
pub(crate) fn orientations(
    gradients: &mut Gradients,
    level: &Plane,
    place: Place,
    weights: &mut [Vec<f32>; 2],
) -> Vec<f64> {
    let window = WINDOW * place.sigma;
    let radius = ((3.0 * window) as usize).max(1);
    weigh(place, radius, window, weights);
    let row = place.pixel().1;
    let rows = row.saturating_sub(radius)..(row + radius + 1).min(level.height);
    gradients.prepare(level, rows.clone());
    let mut histogram = dispatch(Votes { gradients, place, rows, radius, weights });
    for _ in 0..SMOOTHED {
        histogram = std::array::from_fn(|bin| {
            (histogram[(bin + BINS - 1) % BINS] + histogram[bin] + histogram[(bin + 1) % BINS])
                / 3.0
        });
    }
    peaks(&histogram)
}

struct Votes<'a> {
    gradients: &'a Gradients,
    place: Place,
    rows: Range<usize>,
    radius: usize,
    weights: &'a [Vec<f32>; 2],
}

impl Kernel for Votes<'_> {
    type Output = [f32; BINS];

    #[inline(always)]
    fn run(self) -> [f32; BINS] {
        let Self { gradients, place, rows, radius, weights } = self;
        let (column, row) = place.pixel();
        let shift = (column as f64 - place.x, row as f64 - place.y);
        let reach = (radius * radius) as f64 + 0.6;
        // Bins -1 and 36 have their own places here and are added to the last and first bin below.
        let mut histogram = [0.0_f32; BINS + 2];
        for y in rows {
            let dy = y as f64 - row as f64 + shift.1;
            let half = libm::sqrt((reach - dy * dy).max(0.0));
            // Integer pixels within the circle around the middle pixel.
            let middle = column as f64 - shift.0;
            let low =
                libm::ceil(middle - half).max(column as f64 - radius as f64).max(0.0) as usize;
            let high = libm::floor(middle + half).min((column + radius) as f64) as usize;
            let end = (high + 1).min(gradients.length.width);
            if low >= end {
                continue;
            }
            let lengths = &gradients.length.row(y)[low..end];
            let angles = &gradients.angle.row(y)[low..end];
            let across = &weights[0][low + radius - column..];
            let down = weights[1][y + radius - row];
            for ((&length, &angle), &across) in lengths.iter().zip(angles).zip(across) {
                // Bin centers are at one half, and bins are stored with offset one.
                let at = angle * (BINS as f32 / TURN) + 0.5;
                let bin = at as usize;
                let (part, vote) = (at - bin as f32, length * across * down);
                let bin = bin.min(BINS);
                histogram[bin] += (1.0 - part) * vote;
                histogram[bin + 1] += part * vote;
            }
        }
        let mut bins: [f32; BINS] = std::array::from_fn(|bin| histogram[bin + 1]);
        bins[BINS - 1] += histogram[0];
        bins[0] += histogram[BINS + 1];
        bins
    }
}

/// Finds the peaks of a histogram, each moved to the vertex of the parabola through its neighbors.
fn peaks(histogram: &[f32; BINS]) -> Vec<f64> {
    let highest = histogram.iter().copied().fold(0.0, f32::max);
    let peak = |bin: usize| {
        let around = [bin + BINS - 1, bin, bin + 1].map(|bin| histogram[bin % BINS]);
        let [before, here, after] = around;
        let is_peak = here > SHARE * highest && here > before && here > after;
        let [before, here, after] = around.map(f64::from);
        let offset = -0.5 * (after - before) / (after + before - 2.0 * here);
        is_peak.then(|| TAU * (bin as f64 + offset + 0.5) / BINS as f64)
    };
    (0..BINS).filter_map(peak).take(MAX_ORIENTATIONS).collect()
}
