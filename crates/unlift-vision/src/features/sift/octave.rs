//! Scale space: four levels of one octave at a time.

use super::blur::Gaussian;
use super::options::SiftOptions;
use super::plane::Plane;
use crate::features::image::GrayImage;

/// Assumed smoothing of a photo, in pixels.
const NOMINAL: f64 = 0.5;
/// Smoothing of the first level of an octave, in pixels of the octave.
const FIRST: f64 = 1.6;

/// Standard deviations and filters, the same for every octave.
pub(crate) struct Ladder {
    /// From the image to the first level.
    first: Gaussian,
    /// From each level to the next.
    steps: Vec<Gaussian>,
    levels: usize,
}

impl Ladder {
    pub(crate) fn new(options: &SiftOptions) -> Self {
        let ratio = libm::exp2(1.0 / options.levels as f64);
        let nominal = if options.doubled { 2.0 * NOMINAL } else { NOMINAL };
        let first = libm::sqrt(FIRST * FIRST - nominal * nominal);
        let step = FIRST * libm::sqrt(ratio * ratio - 1.0);
        let steps = (0..options.levels + 2)
            .map(|level| Gaussian::new(step * libm::exp2(level as f64 / options.levels as f64)))
            .collect();
        Self { first: Gaussian::new(first), steps, levels: options.levels }
    }

    /// Returns the smoothing at `level`, in pixels of the octave; level 1 is the first one with
    /// keypoints.
    pub(crate) fn sigma(&self, level: f64) -> f64 {
        FIRST * libm::exp2(level / self.levels as f64)
    }
}

/// Four consecutive levels of an octave, each smoother than the previous one by the same factor.
///
/// An extremum of the middle difference needs only the three differences between them, so no other
/// level is in memory. Lowe 2004, Sec. 3.
#[derive(Default)]
pub(crate) struct Octave {
    levels: [Plane; 4],
    line: Vec<f32>,
}

impl Octave {
    /// Computes the first four levels of the first octave.
    pub(crate) fn start(&mut self, image: &GrayImage, doubled: bool, ladder: &Ladder) {
        let [level, .., spare] = &mut self.levels;
        if doubled {
            spare.double(image);
        } else {
            spare.copy(image);
        }
        ladder.first.smooth(spare, level, &mut self.line);
        self.fill(ladder);
    }

    /// Computes the first four levels of the next octave, after the last step of this one.
    pub(crate) fn next(&mut self, ladder: &Ladder) {
        // The second level has twice the smoothing of the octave's first level: at half the
        // resolution it is the first level of the next octave.
        let [first, second, ..] = &mut self.levels;
        first.halve(second);
        self.fill(ladder);
    }

    fn fill(&mut self, ladder: &Ladder) {
        for (at, gaussian) in ladder.steps[..3].iter().enumerate() {
            let (done, rest) = self.levels.split_at_mut(at + 1);
            gaussian.smooth(&done[at], &mut rest[0], &mut self.line);
        }
    }

    /// Moves on by a level: to the four that start at `level`.
    pub(crate) fn step(&mut self, level: usize, ladder: &Ladder) {
        self.levels.rotate_left(1);
        let [.., from, to] = &mut self.levels;
        ladder.steps[level + 2].smooth(from, to, &mut self.line);
    }

    pub(crate) fn levels(&self) -> &[Plane; 4] {
        &self.levels
    }

    pub(crate) fn size(&self) -> (usize, usize) {
        (self.levels[0].width, self.levels[0].height)
    }
}
