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
        for column in &mut self.position {
            column.resize(records.len(), 0.0);
        }
        for (j, record) in records.iter().enumerate() {
            let row = &rows[record.index()];
            for c in 0..D {
                self.position[c][j] = row[c];
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
        let (at, miss2, bend) = (&mut out.at[..n], &mut out.miss2[..n], &mut out.bend[..n]);
        for j in 0..n {
            let (mut sum, mut largest) = (0.0f32, 0.0f32);
            for c in 0..D {
                let d = if c == axis { 0.0 } else { position[c][j] - own[c] };
                sum += d * d;
                largest = largest.max(d * d);
            }
            let parallel = sum <= delta2;
            let crossing = (sum - largest).max(0.0);
            at[j] = if parallel { 0.0 } else { position[axis][j] };
            bend[j] = if parallel { 0.0 } else { 1.0 };
            miss2[j] = if parallel {
                sum
            } else if crossing <= delta2 {
                crossing
            } else {
                NO_VOTE
            };
        }
    }
}
