//! Axis candidates: sections of listed records with one of a slot's own axis lines.

use super::sections::{NO_VOTE, Sections};
use crate::RecordId;

/// Neighbors gathered into one column per coordinate.
#[derive(Clone, Debug)]
pub(crate) struct CandidateColumns<const D: usize> {
    position: [Vec<f32>; D],
}

impl<const D: usize> Default for CandidateColumns<D> {
    fn default() -> Self {
        Self { position: std::array::from_fn(|_| Vec::new()) }
    }
}

impl<const D: usize> CandidateColumns<D> {
    /// Gathers `records` from `rows`.
    #[inline(always)]
    pub(crate) fn gather(&mut self, rows: &[[f32; D]], records: &[RecordId]) {
        let n = records.len();
        for column in &mut self.position {
            column.resize(n, 0.0);
        }
        let position = self.position.each_mut().map(|column| &mut column[..n]);
        for j in 0..n {
            let row = &rows[records[j].index()];
            for c in 0..D {
                position[c][j] = row[c];
            }
        }
    }

    /// The sections of the gathered records with the line through `own` along `axis`.
    ///
    /// A record stands for its `D` axis lines and counts once, with the nearest of them. Its line
    /// along `axis` is parallel to mine: if it passes within delta it agrees with every `t` (it
    /// tells nothing about the position, but it does tell about the axis). Of the others the
    /// nearest is the one whose free coordinate is that of the largest difference.
    #[inline(always)]
    pub(crate) fn sections(&self, own: &[f32; D], axis: usize, delta2: f32, out: &mut Sections) {
        let n = self.position[0].len();
        out.resize(n);
        let position: [&[f32]; D] = std::array::from_fn(|c| &self.position[c][..n]);
        let along = position[axis];
        let (at, miss2, bend) = (&mut out.at[..n], &mut out.miss2[..n], &mut out.bend[..n]);
        // Factors instead of branches keep the loop in vectors.
        let counts: [f32; D] = std::array::from_fn(|c| if c == axis { 0.0 } else { 1.0 });
        for j in 0..n {
            let (mut sum, mut largest) = (0.0f32, 0.0f32);
            for c in 0..D {
                let d = (position[c][j] - own[c]) * counts[c];
                sum += d * d;
                largest = largest.max(d * d);
            }
            let crossing = (sum - largest).max(0.0);
            let free = if sum <= delta2 { 0.0 } else { 1.0 };
            at[j] = along[j] * free;
            bend[j] = free;
            let miss = crossing + (1.0 - free) * (sum - crossing);
            // Beyond the range of f32 the difference is no number, and no vote.
            let near = (crossing <= delta2) & (sum < f32::INFINITY);
            miss2[j] = if near { miss } else { NO_VOTE };
        }
    }
}
