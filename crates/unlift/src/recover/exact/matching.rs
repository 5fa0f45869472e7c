//! The probability of every pair when each record is in at most one: belief propagation on the
//! monomer-dimer model, whose fixed point is unique, so that order and start do not matter.
//!
//! Fixing sure pairs one by one would be final; here a rival of either side takes its share of
//! every pair until the end.

use rayon::prelude::*;

use super::partners::{PART, Partners};

/// Passes at most: a bound for pairs that settle slowly.
const PASSES: usize = 30;

/// Messages along pairs: `at[e]` is what the record of entry `e` tells the partner: how free it is.
pub(super) struct Messages {
    at: Vec<f32>,
    next: Vec<f32>,
}

impl Messages {
    pub(super) fn new(partners: &Partners) -> Self {
        let n = partners.of.len();
        Self { at: vec![0.5; n], next: vec![0.0; n] }
    }

    /// Sends messages until none moves by more than a share `settled`. `weight` is that of each pair (the same from both sides),
    /// `alone` that of each record without one.
    pub(super) fn settle(
        &mut self,
        partners: &Partners,
        weight: &[f32],
        alone: &[f32],
        settled: f32,
    ) {
        for _ in 0..PASSES {
            let at = &self.at;
            let moves: Vec<bool> = by_part(partners, &mut self.next)
                .into_par_iter()
                .map(|(part, out)| {
                    let records = part * PART..alone.len().min((part + 1) * PART);
                    let first = partners.offsets[records.start];
                    let mut moves = false;
                    for i in records {
                        let entries = partners.entries(i);
                        let offer = |e: usize| weight[e] * at[partners.back[e] as usize];
                        let all: f32 = alone[i] + entries.clone().map(offer).sum::<f32>();
                        for e in entries {
                            // Never below what is there without any offer.
                            let free = 1.0 / (all - offer(e)).max(alone[i]);
                            moves |= (free - at[e]).abs() >= settled * at[e];
                            out[e - first] = free;
                        }
                    }
                    moves
                })
                .collect();
            std::mem::swap(&mut self.at, &mut self.next);
            if !moves.contains(&true) {
                break;
            }
        }
    }

    /// The probability of the pair at entry `e`.
    #[inline(always)]
    pub(super) fn probability(&self, partners: &Partners, weight: &[f32], e: usize) -> f32 {
        // The product of both messages first: the same from both sides to the last bit.
        let odds = weight[e] * (self.at[e] * self.at[partners.back[e] as usize]);
        odds / (1.0 + odds)
    }
}

/// `column` cut at the parts of the records.
pub(super) fn by_part<'a, T>(
    partners: &Partners,
    mut column: &'a mut [T],
) -> Vec<(usize, &'a mut [T])> {
    let n = partners.offsets.len() - 1;
    let mut parts = Vec::with_capacity(n.div_ceil(PART));
    for part in 0..n.div_ceil(PART) {
        let (first, last) = (part * PART, n.min((part + 1) * PART));
        let (head, tail) = column.split_at_mut(partners.offsets[last] - partners.offsets[first]);
        parts.push((part, head));
        column = tail;
    }
    parts
}
