//! SIFT descriptors: 4 x 4 histograms of gradient directions, and the bytes that COLMAP stores.

use std::f64::consts::TAU;
use std::ops::Range;

use unlift::simd::{Kernel, dispatch};

use super::gradient::{Gradients, TURN};
use super::orientation::{Place, weigh};
use super::scale_space::{BLOCK, Plane, lanes};

/// Directions of a histogram.
pub(crate) const BINS: usize = 8;
/// Histograms in a row and in a column.
pub(crate) const CELLS: usize = 4;
/// Values of a descriptor.
pub(crate) const LENGTH: usize = CELLS * CELLS * BINS;

/// Side of a histogram in scales of the keypoint.
const MAGNIFICATION: f64 = 3.0;
/// Standard deviation of the window, in sides of a histogram.
const WINDOW: f64 = 2.0;
/// Cells in a row with a rim: pixels near the outer edge also vote for cells outside.
const RIM: usize = CELLS + 2;
/// Allocated cells; a power of two, so that indices need no bounds check.
const ROOM: usize = 64;

/// Returns unnormalized histograms of the pixels around `place`, rotated by `angle` radians: value
/// `(row * 4 + column) * 8 + direction`. Lowe 2004, Sec. 6.1.
pub(crate) fn describe(
    gradients: &mut Gradients,
    level: &Plane,
    place: Place,
    angle: f64,
    weights: &mut [Vec<f32>; 2],
) -> [f32; LENGTH] {
    let side = MAGNIFICATION * place.sigma;
    // Half the diagonal of the cells, with half a cell of rim.
    let radius = (std::f64::consts::SQRT_2 * side * (CELLS + 1) as f64 / 2.0 + 0.5) as usize;
    weigh(place, radius, WINDOW * side, weights);
    // Blocks read beyond the last pixel of a row.
    weights[0].resize(2 * radius + 1 + BLOCK, 0.0);
    let (column, row) = place.pixel();
    // Gradients at the border are one-sided, so they are omitted.
    let rows = row.saturating_sub(radius).max(1)..(row + radius + 1).min(level.height - 1);
    let columns = column.saturating_sub(radius).max(1)..(column + radius + 1).min(level.width - 1);
    gradients.prepare(level, rows.clone());
    let (sin, cos) = libm::sincos(angle);
    let frame = Frame { sin: sin / side, cos: cos / side, turn: (angle * 8.0 / TAU) as f32 };
    let cells = dispatch(Votes { gradients, place, frame, rows, columns, radius, weights });
    let mut histograms = [0.0; LENGTH];
    for (at, bins) in histograms.as_chunks_mut::<BINS>().0.iter_mut().enumerate() {
        *bins = cells[(at / CELLS + 1) * RIM + at % CELLS + 1];
    }
    histograms
}

/// The transform from pixels to cells and directions.
#[derive(Clone, Copy)]
struct Frame {
    /// Sine and cosine of the orientation, divided by the side of a cell.
    sin: f64,
    cos: f64,
    /// The orientation in eighths of a turn.
    turn: f32,
}

impl Frame {
    /// Returns the offsets from the middle that the histograms cover in the row `dy` below it.
    #[inline(always)]
    fn covered(self, dy: f64) -> (f64, f64) {
        let half = (CELLS + 1) as f64 / 2.0;
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (slope, at) in [(self.cos, self.sin * dy), (-self.sin, self.cos * dy)] {
            if slope.abs() > 1e-12 {
                let ends = ((-half - at) / slope, (half - at) / slope);
                low = low.max(ends.0.min(ends.1));
                high = high.min(ends.0.max(ends.1));
            } else if at.abs() >= half {
                high = f64::NEG_INFINITY;
            }
        }
        (low, high)
    }
}

struct Votes<'a> {
    gradients: &'a Gradients,
    place: Place,
    frame: Frame,
    rows: Range<usize>,
    columns: Range<usize>,
    radius: usize,
    weights: &'a [Vec<f32>; 2],
}

/// The votes of some pixels: cell, direction and weight in each of four cells.
struct Block {
    cell: [u32; BLOCK],
    direction: [f32; BLOCK],
    shares: [[f32; BLOCK]; 4],
}

impl Kernel for Votes<'_> {
    type Output = [[f32; BINS]; ROOM];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { gradients, place, frame, rows, columns, radius, weights } = self;
        let (column, row) = place.pixel();
        let mut cells = [[0.0; BINS]; ROOM];
        for y in rows {
            let dy = y as f64 - place.y;
            let (low, high) = frame.covered(dy);
            let low = libm::ceil(low + place.x).max(columns.start as f64);
            let end = (libm::floor(high + place.x) + 1.0).min(columns.end as f64);
            if low >= end {
                continue;
            }
            let (low, end) = (low as usize, end as usize);
            let down = weights[1][y + radius - row];
            let across = &weights[0][low + radius - column..];
            let (lengths, angles) = (gradients.length.row(y), gradients.angle.row(y));
            for at in (low..end).step_by(BLOCK) {
                let dx = (at as f64 - place.x) as f32;
                let block = Block::new(
                    frame,
                    (dx, dy as f32),
                    lanes(lengths, at),
                    lanes(angles, at),
                    lanes(across, at - low),
                    down,
                );
                for i in 0..(end - at).min(BLOCK) {
                    block.vote(i, &mut cells);
                }
            }
        }
        cells
    }
}

impl Block {
    /// Computes the votes of pixels from offset `(dx, dy)` on, by weights `across` and `down`.
    #[inline(always)]
    fn new(
        frame: Frame,
        (dx, dy): (f32, f32),
        lengths: [f32; BLOCK],
        angles: [f32; BLOCK],
        across: [f32; BLOCK],
        down: f32,
    ) -> Self {
        // The largest value whose cell is inside the rim.
        const END: f32 = 4.999_999_5;
        let (sin, cos) = (frame.sin as f32, frame.cos as f32);
        let middle = (CELLS + 1) as f32 / 2.0;
        let mut block =
            Self { cell: [0; BLOCK], direction: [0.0; BLOCK], shares: [[0.0; BLOCK]; 4] };
        for i in 0..BLOCK {
            let dx = dx + i as f32;
            let column = (cos * dx + sin * dy + middle).clamp(0.0, END);
            let row = (cos * dy - sin * dx + middle).clamp(0.0, END);
            let (right, below) = (column - column.floor(), row - row.floor());
            // The last bits of a sum with 2^23 contain the integer; a cast would not be vectorized.
            let cell = row.floor() * RIM as f32 + column.floor();
            block.cell[i] = (cell + 8_388_608.0).to_bits();
            let turned = angles[i] - frame.turn;
            block.direction[i] = if turned < 0.0 { turned + TURN } else { turned };
            let vote = lengths[i] * across[i] * down;
            let (above, below) = (vote * (1.0 - below), vote * below);
            block.shares[0][i] = above * (1.0 - right);
            block.shares[1][i] = above * right;
            block.shares[2][i] = below * (1.0 - right);
            block.shares[3][i] = below * right;
        }
        block
    }

    /// Adds pixel `i` to the two nearest directions of its four cells.
    #[inline(always)]
    fn vote(&self, i: usize, cells: &mut [[f32; BINS]; ROOM]) {
        const DIRECTIONS: [f32; BINS] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        // All eight directions at once: linear weights around the direction, with wrap-around.
        let mut share = [0.0; BINS];
        for (share, direction) in share.iter_mut().zip(DIRECTIONS) {
            let away = (self.direction[i] - direction).abs();
            *share = (1.0 - away).max(0.0) + (away - 7.0).max(0.0);
        }
        let first = self.cell[i] as usize;
        for (cell, shares) in [0, 1, RIM, RIM + 1].into_iter().zip(&self.shares) {
            let bins = &mut cells[(first + cell) % ROOM];
            for (bin, share) in bins.iter_mut().zip(share) {
                *bin += shares[i] * share;
            }
        }
    }
}

/// Maximum value of a normalized descriptor, which limits the effect of a strong edge.
const LARGEST: f32 = 0.2;
/// Length of a descriptor in bytes.
const SCALE: f32 = 512.0;

/// Quantizes a descriptor: unit length, values clamped to 0.2, unit length again, then the root of
/// its shares (RootSIFT, Arandjelovic and Zisserman 2012) times 512.
///
/// The order of directions is reversed, as in Lowe's program. All zeros stay zeros.
pub(crate) fn quantize(mut histograms: [f32; LENGTH]) -> [u8; LENGTH] {
    normalize(&mut histograms);
    for value in &mut histograms {
        *value = value.min(LARGEST);
    }
    normalize(&mut histograms);
    let sum = sum(&histograms, |value| value);
    let mut bytes = [0; LENGTH];
    if sum > 0.0 {
        let cells = histograms.as_chunks::<BINS>().0.iter();
        for (from, to) in cells.zip(bytes.as_chunks_mut::<BINS>().0) {
            for (direction, value) in from.iter().enumerate() {
                let root = (value / sum).sqrt();
                to[(BINS - direction) % BINS] = (SCALE * root + 0.5) as u8;
            }
        }
    }
    bytes
}

fn normalize(values: &mut [f32; LENGTH]) {
    let length = sum(values, |value| value * value).sqrt() + f32::EPSILON;
    for value in values {
        *value /= length;
    }
}

/// Sums in a fixed order that compiles to eight lanes.
fn sum(values: &[f32; LENGTH], of: impl Fn(f32) -> f32) -> f32 {
    let mut lanes = [0.0; BINS];
    for chunk in values.as_chunks::<BINS>().0 {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane += of(value);
        }
    }
    lanes.iter().sum()
}
