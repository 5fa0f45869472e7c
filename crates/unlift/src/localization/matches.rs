//! Matches of descriptors: mutually most similar rows that pass the ratio test.

use crate::descriptors::Values;
use crate::protected::{Rule, inner};
use crate::{Descriptors, Error, ProtectedDescriptors};

/// Largest ratio of the distances to the most similar descriptor and the next one.
const RATIO: f32 = 0.8;

/// A match of a keypoint with a point, by their rows.
pub type Pair = (usize, usize);

/// Descriptors scaled to unit length. Those that are zero stay zero.
#[derive(Debug, PartialEq)]
pub struct Unit32 {
    dim: usize,
    values: Vec<f32>,
}

impl Unit32 {
    /// Scales the `rows` of `descriptors`.
    pub fn of(descriptors: &Descriptors, rows: impl Iterator<Item = usize>) -> Self {
        let dim = descriptors.dim();
        let (mut values, mut descriptor) = (Vec::new(), vec![0.0; dim]);
        for row in rows {
            descriptors.read_row(row, &mut descriptor);
            let length = descriptor.iter().map(|x| x * x).sum::<f32>().sqrt();
            let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
            values.extend(descriptor.iter().map(|x| x * scale));
        }
        Self { dim, values }
    }

    pub(super) fn plain(&self) -> Result<Descriptors, Error> {
        Descriptors::try_new(Values::F32(self.values.clone()), self.dim)
    }

    fn len(&self) -> usize {
        self.values.len() / self.dim
    }

    pub(super) fn row(&self, at: usize) -> &[f32] {
        &self.values[at * self.dim..][..self.dim]
    }
}

/// Rows of one side that are compared with a block of the other at a time, so that both stay in the cache.
const BLOCK: usize = 64;

/// Returns the mutually most similar rows that pass the ratio test.
pub fn mutual(a: &Unit32, b: &Unit32) -> Vec<Pair> {
    let mut best = Best::new(a.len(), b.len());
    for from in (0..b.len()).step_by(BLOCK) {
        for i in 0..a.len() {
            for j in from..(from + BLOCK).min(b.len()) {
                best.offer(i, j, inner(a.row(i), b.row(j)));
            }
        }
    }
    best.pairs(false)
}

/// Returns the matches of keypoints with points of a map; `of_keypoints` is true if the keypoints are protected, else the points are.
pub(super) fn with_protected(
    plain: &Unit32,
    protected: &ProtectedDescriptors,
    of_keypoints: bool,
) -> Vec<Pair> {
    let turned = |(a, b)| if of_keypoints { (b, a) } else { (a, b) };
    let (n_keypoints, n_points) = turned((plain.len(), protected.len()));
    let mut best = Best::new(n_keypoints, n_points);
    for row in 0..plain.len() {
        for (at, similar) in protected.similarities(plain.row(row)).into_iter().enumerate() {
            let (keypoint, point) = turned((row, at));
            best.offer(keypoint, point, similar);
        }
    }
    // Sets of words that contain a word are equally similar to it, so the ratio test would reject all.
    best.pairs(matches!(protected.rule(), Rule::Words { .. }))
}

/// The most similar row of the other side, for the rows of both sides.
struct Best {
    /// Most similar row and the two largest similarities.
    of_a: Vec<(usize, f32, f32)>,
    of_b: Vec<(usize, f32)>,
}

impl Best {
    fn new(n_a: usize, n_b: usize) -> Self {
        Self { of_a: vec![(usize::MAX, -2.0, -2.0); n_a], of_b: vec![(usize::MAX, -2.0); n_b] }
    }

    /// Adds a pair; of equal ones, the first counts.
    fn offer(&mut self, i: usize, j: usize, similar: f32) {
        let best = &mut self.of_a[i];
        if similar > best.1 {
            *best = (j, similar, best.1);
        } else if similar > best.2 {
            best.2 = similar;
        }
        if similar > self.of_b[j].1 {
            self.of_b[j] = (i, similar);
        }
    }

    /// Returns the mutual pairs that pass the ratio test; all mutual ones if there are `ties`.
    fn pairs(&self, ties: bool) -> Vec<Pair> {
        let apart = |similar: f32| (2.0 - 2.0 * similar).max(0.0).sqrt();
        let passes = |(i, &(j, first, second)): (usize, &(usize, f32, f32))| {
            let is_mutual = j != usize::MAX && self.of_b[j].0 == i;
            let stands_out = ties || apart(first) < RATIO * apart(second);
            // Withheld descriptors are zero.
            (is_mutual && first > 0.0 && stands_out).then_some((i, j))
        };
        self.of_a.iter().enumerate().filter_map(passes).collect()
    }
}
