//! Columns of neighbors' estimates, and how likely they are about a place.

use super::pieces::Piece;
use super::places::distance2;
use crate::recover::lanes::{LANES, Lanes, ln};

/// Vectors are filled up with estimates this far away: beyond any reach, and still a number when squared.
const BEYOND: f32 = 1e19;

/// Estimates with the odds that they are a true neighbor's, in columns.
#[derive(Debug)]
pub(crate) struct Columns<const D: usize> {
    x: [Vec<f32>; D],
    odds: Vec<f32>,
    slot: Vec<u32>,
    /// Squared distance to the piece last looked at.
    apart2: Vec<f32>,
    kept: Vec<u32>,
}

impl<const D: usize> Default for Columns<D> {
    fn default() -> Self {
        let x = std::array::from_fn(|_| Vec::new());
        Self { x, odds: Vec::new(), slot: Vec::new(), apart2: Vec::new(), kept: Vec::new() }
    }
}

impl<const D: usize> Columns<D> {
    /// `n` rows, to be [`set`](Self::set).
    #[inline(always)]
    pub(crate) fn resize(&mut self, n: usize) {
        self.x.iter_mut().for_each(|column| column.resize(n, 0.0));
        self.odds.resize(n, 0.0);
        self.slot.resize(n, 0);
    }

    /// Writes row `i`.
    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize, x: &[f32; D], odds: f32, slot: u32) {
        for (column, x) in self.x.iter_mut().zip(x) {
            column[i] = *x;
        }
        self.odds[i] = odds;
        self.slot[i] = slot;
    }

    /// Number of estimates.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.slot.len()
    }

    /// The estimate in row `i`.
    #[inline(always)]
    pub(crate) fn at(&self, i: usize) -> [f32; D] {
        std::array::from_fn(|c| self.x[c][i])
    }

    /// All estimates, a vector at a time; the last one is filled up with estimates far away.
    #[inline(always)]
    pub(crate) fn vectors(&self) -> [&[Lanes]; D] {
        std::array::from_fn(|c| self.x[c].as_chunks().0)
    }

    /// Records of estimates within `1 / sqrt(inverse_kernel2)` of `x`: both slots of a paired line are one, and
    /// stand side by side.
    #[inline(always)]
    pub(crate) fn n_records(
        &mut self,
        slots_per_record: usize,
        x: &[f32; D],
        inverse_kernel2: f32,
    ) -> u32 {
        let n = self.len();
        self.apart2.resize(n, 0.0);
        for i in 0..n {
            self.apart2[i] = distance2(&self.at(i), x);
        }
        let within = |&apart2: &f32| 1.0 - apart2 * inverse_kernel2 > 0.0;
        let all: u32 = self.apart2.iter().map(|apart2| u32::from(within(apart2))).sum();
        let is_pair = |slots: &[u32]| slots_per_record == 2 && slots[0] / 2 == slots[1] / 2;
        let pairs = self.apart2.windows(2).zip(self.slot.windows(2));
        let twice = |(apart2, slots): (&[f32], &[u32])| {
            u32::from(within(&apart2[0]) & within(&apart2[1]) & is_pair(slots))
        };
        all - pairs.map(twice).sum::<u32>()
    }

    /// The slot whose estimate is in row `i`.
    #[inline(always)]
    pub(crate) fn slot(&self, i: usize) -> usize {
        self.slot[i] as usize
    }

    /// Puts the estimates within `reach` of `piece` into `near`, but not those within `blind` of a center.
    #[inline(always)]
    pub(crate) fn near(&mut self, piece: &Piece<D>, reach: f32, blind: f32, near: &mut Self) {
        let n = self.len();
        self.apart2.resize(n, 0.0);
        let columns: [&[f32]; D] = std::array::from_fn(|c| &self.x[c][..n]);
        let apart2 = &mut self.apart2[..n];
        for i in 0..n {
            let x: [f32; D] = std::array::from_fn(|c| columns[c][i]);
            let y = piece.project(&x);
            let mut sum = 0.0;
            for c in 0..D {
                sum += (x[c] - y[c]) * (x[c] - y[c]);
            }
            apart2[i] = sum;
        }
        if piece.from_center {
            for i in 0..n {
                let mut sum = 0.0;
                for (column, from) in columns.iter().zip(&piece.through) {
                    sum += (column[i] - from) * (column[i] - from);
                }
                apart2[i] = if sum < blind * blind { f32::INFINITY } else { apart2[i] };
            }
        }
        // Every number is written, and stays if it is near: no branch to guess.
        self.kept.resize(n, 0);
        let mut n_kept = 0;
        for i in 0..n {
            self.kept[n_kept] = i as u32;
            n_kept += usize::from(self.apart2[i] < reach * reach);
        }
        near.resize(n_kept);
        for (to, &i) in self.kept[..n_kept].iter().enumerate() {
            let i = i as usize;
            near.set(to, &self.at(i), self.odds[i], self.slot[i]);
        }
        near.pad();
    }

    /// Fills up the last vector with estimates that say nothing.
    fn pad(&mut self) {
        let n = self.odds.len().next_multiple_of(LANES);
        self.x.iter_mut().for_each(|column| column.resize(n, BEYOND));
        self.odds.resize(n, 0.0);
    }

    /// The logarithm of how much likelier these estimates are about a point at `x` than by chance:
    /// the sum of `ln(1 + odds * gain * (1 + r^2 / a^2)^-3)`.
    #[inline(always)]
    pub(crate) fn log_likelihood(&self, x: &[f32; D], gain: f32, inverse_a2: f32) -> f32 {
        let mut sums = [0.0f32; LANES];
        let (odds, _) = self.odds.as_chunks::<LANES>();
        let columns: [&[Lanes]; D] =
            std::array::from_fn(|c| &self.x[c].as_chunks().0[..odds.len()]);
        let likelier = |i: usize, lane: usize| {
            let mut r2 = 0.0;
            for c in 0..D {
                let d = columns[c][i][lane] - x[c];
                r2 += d * d;
            }
            let q = 1.0 / (1.0 + r2 * inverse_a2);
            1.0 + odds[i][lane] * gain * (q * q * q)
        };
        // One logarithm of two at a time: no product comes near the end of `f32`.
        for i in 0..odds.len() / 2 {
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum += ln(likelier(2 * i, lane) * likelier(2 * i + 1, lane));
            }
        }
        if odds.len() % 2 == 1 {
            for (lane, sum) in sums.iter_mut().enumerate() {
                *sum += ln(likelier(odds.len() - 1, lane));
            }
        }
        sums.iter().sum()
    }
}
