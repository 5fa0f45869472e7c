//! The probability of every pair when each record is in at most one: belief propagation on the
//! monomer-dimer model, one pass whenever the law is learned anew.
//!
//! Fixing sure pairs one by one would be final; here a rival of either side takes its share of
//! every pair until the end.

use rayon::prelude::*;

use super::partners::{PART, Partners};

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

    /// Sends every message once. `weight` is that of each pair (the same from both sides), `alone` that of each record
    /// without one.
    pub(super) fn send(&mut self, partners: &Partners, weight: &[f32], alone: &[f32]) {
        let at = &self.at;
        by_part(partners, &mut self.next).into_par_iter().for_each(|(part, out)| {
            let records = part * PART..alone.len().min((part + 1) * PART);
            let first = partners.offsets[records.start];
            for i in records {
                let entries = partners.entries(i);
                let offer = |e: usize| weight[e] * at[partners.back[e] as usize];
                let all: f32 = alone[i] + entries.clone().map(offer).sum::<f32>();
                for e in entries {
                    // Never below what is there without any offer.
                    out[e - first] = 1.0 / (all - offer(e)).max(alone[i]);
                }
            }
        });
        std::mem::swap(&mut self.at, &mut self.next);
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
