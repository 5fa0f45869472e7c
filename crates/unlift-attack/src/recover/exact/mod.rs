//! Exact constraints on exchanged coordinates: each of two records publishes the hidden coordinate of the other.
//!
//! Each of two partners' estimates lies near the value that the other published. The distribution of these distances is learned together
//! with the probabilities of pairs (expectation maximization), by belief propagation on the monomer-dimer model.

mod partners;

use crate::parallel;
use crate::recover::map::sorted;
use crate::recover::result::Estimate;
use crate::released::{Obfuscation, Released};
use partners::{LOST, Partners, Side};

/// Number of rounds: fixed, so that time does not depend on the map.
const ROUNDS: usize = 6;
/// Pairs below this probability do not enter learning: they are many, but weigh little together.
const LEAST_PROBABILITY: f32 = 1e-3;
/// Records per parallel task: fixed, so that sums do not depend on the number of threads.
const PART: usize = 1 << 10;
/// Number of classes of evidence, with equally many records each. More evidence means smaller distances.
const CLASSES: usize = 8;
/// Normal distributions in the mixture of distances. Each is half as wide as the one before, down to 1 / 512 of the reach.
const SCALES: usize = 9;
/// Bounds of the fraction of good estimates in a class: a fraction of 0 or 1 would never change again.
const FRACTION: (f64, f64) = (0.02, 0.995);
/// Bins of distances from 0 to the reach: as fine as the narrowest distribution.
const STEPS: usize = 1 << 9;

/// Replaces the hidden coordinate of estimates of axis candidates by the exact value where the partner is known.
pub(crate) fn settle<const D: usize>(
    released: &Released<D>,
    mut estimates: Vec<Estimate<D>>,
    delta: f64,
) -> Vec<Estimate<D>> {
    let Obfuscation::AxisCandidates(records) = released.obfuscation() else { return estimates };
    // In images, delta is narrow and values are few.
    let reach = if D == 2 { 4.0 } else { 1.0 };
    let published = records.position();
    let values = hidden_values(published, &estimates, (reach * delta) as f32);
    for (i, value) in values.into_iter().enumerate() {
        if let Some(value) = value {
            let axis = usize::from(estimates[i].axis);
            estimates[i].position = published[i];
            estimates[i].position[axis] = value;
        }
    }
    estimates
}

/// Returns the hidden value of every record, where it is known: it is published by a record whose hidden value this one publishes.
fn hidden_values<const D: usize>(
    published: &[[f32; D]],
    estimates: &[Estimate<D>],
    reach: f32,
) -> Vec<Option<f32>> {
    let n = estimates.len();
    let side = |(record, estimate): (&[f32; D], &Estimate<D>)| {
        let axis = usize::from(estimate.axis);
        match estimate.is_known() {
            true => Side { axis, published: record[axis], estimate: estimate.position[axis] },
            false => Side { axis: LOST, published: 0.0, estimate: 0.0 },
        }
    };
    let sides: Vec<Side> = published.iter().zip(estimates).map(side).collect();
    let Some(partners) = Partners::find(&sides, reach) else {
        return vec![None; n];
    };
    let rarity = rarity(published, &sides, partners.reach);
    // Per axis, the prior probability that some other record of this axis is the partner.
    let prior: [f64; D] = std::array::from_fn(|axis| {
        let n = sides.iter().filter(|side| side.axis == axis).count();
        1.0 / n.saturating_sub(1).max(1) as f64
    });
    let class = classes(estimates);
    let mut distances = Distances::new(partners.reach);
    // Per entry, the message that the record is free of other partners.
    let mut messages = vec![0.5; partners.of.len()];
    let mut weight = Vec::new();
    for _ in 0..ROUNDS {
        let likelier = |i: usize, j: usize| {
            let away = (sides[j].published - sides[i].estimate).abs();
            distances.table[class[i]][distances.step(away)] * rarity[i]
        };
        let odds = |i: usize, e: usize| {
            let j = partners.of[e] as usize;
            (likelier(i, j) * likelier(j, i) * prior[sides[i].axis]) as f32
        };
        weight = partners.column(|i, row| {
            row.iter_mut().zip(partners.entries(i)).for_each(|(to, e)| *to = odds(i, e));
        });
        let alone = distances.alone();
        let offer = |e: usize| weight[e] * messages[partners.back[e] as usize];
        messages = partners.column(|i, row| {
            let alone = alone[class[i]];
            let all: f32 = alone + partners.entries(i).map(offer).sum::<f32>();
            // Rounding must not take it below the weight without any pair.
            let message = |e: usize| 1.0 / (all - offer(e)).max(alone);
            row.iter_mut().zip(partners.entries(i)).for_each(|(to, e)| *to = message(e));
        });
        let tally = |part: usize| {
            let mut tally = vec![[0.0; STEPS]; CLASSES];
            for i in part * PART..n.min((part + 1) * PART) {
                for e in partners.entries(i) {
                    let away = (sides[partners.of[e] as usize].published - sides[i].estimate).abs();
                    let p = probability(&messages, &partners, &weight, e);
                    if p > LEAST_PROBABILITY {
                        tally[class[i]][distances.step(away)] += f64::from(p);
                    }
                }
            }
            tally
        };
        let tallies = parallel::map(n.div_ceil(PART), tally);
        let mut total = vec![[0.0; STEPS]; CLASSES];
        for tally in &tallies {
            let columns = total.as_flattened_mut().iter_mut().zip(tally.as_flattened());
            columns.for_each(|(to, more)| *to += more);
        }
        distances.learn(&total, &class);
    }
    // In an image, even a wrong partner is close.
    let least = if D == 2 { 0.05 } else { 0.2 };
    let published = |e: usize| sides[partners.of[e] as usize].published;
    // After rounding, or on a floor, many records publish one value: its probability is the sum of theirs.
    let best = |i: usize| {
        let of = |e: usize| (published(e), probability(&messages, &partners, &weight, e));
        let mut values: Vec<(f32, f32)> = partners.entries(i).map(of).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let sum = |equal: &[(f32, f32)]| (equal[0].0, equal.iter().map(|of| of.1).sum::<f32>());
        let values = values.chunk_by(|a, b| a.0 == b.0).map(sum).filter(|&(_, p)| p >= least);
        values.reduce(|best, next| if next.1 > best.1 { next } else { best }).map(|best| best.0)
    };
    let best = parallel::map(n, best);
    let mutual = |i: usize| {
        let value = best[i]?;
        let own = Some(sides[i].published);
        let is_mutual = |e: usize| published(e) == value && best[partners.of[e] as usize] == own;
        partners.entries(i).any(is_mutual).then_some(value)
    };
    (0..n).map(mutual).collect()
}

#[inline(always)]
fn probability(messages: &[f32], partners: &Partners, weight: &[f32], e: usize) -> f32 {
    // This order of the product gives the same bits in both directions.
    let odds = weight[e] * (messages[e] * messages[partners.back[e] as usize]);
    odds / (1.0 + odds)
}

/// Returns, per record, the inverse density of published values around its estimate: a rare value nearby is strong evidence.
fn rarity<const D: usize>(published: &[[f32; D]], sides: &[Side], reach: f32) -> Vec<f64> {
    let half = 0.5 * reach;
    let columns: [Vec<f32>; D] =
        std::array::from_fn(|axis| sorted(published.iter().map(|p| p[axis])));
    let of = |side: &Side| {
        let Some(values) = columns.get(side.axis) else { return 0.0 };
        let from = values.partition_point(|&v| v < side.estimate - half);
        let to = values.partition_point(|&v| v <= side.estimate + half);
        2.0 * f64::from(half) * values.len() as f64 / (to - from + 1) as f64
    };
    sides.iter().map(of).collect()
}

fn classes<const D: usize>(estimates: &[Estimate<D>]) -> Vec<usize> {
    let sorted = sorted(estimates.iter().map(|e| e.evidence));
    let bounds: Vec<f32> =
        (1..CLASSES).filter_map(|c| sorted.get(c * sorted.len() / CLASSES).copied()).collect();
    estimates.iter().map(|e| bounds.partition_point(|&bound| bound <= e.evidence)).collect()
}

/// The distribution of distances between estimates and hidden coordinates, per class: a mixture of normal distributions.
struct Distances {
    good: [f64; CLASSES],
    weight: [[f64; SCALES]; CLASSES],
    /// Density of each normal distribution in the middle of each bin.
    shapes: Vec<[f64; SCALES]>,
    reach: f32,
    /// Density times fraction of good estimates, per class and bin.
    table: Vec<[f64; STEPS]>,
}

impl Distances {
    /// Creates the first guess; partners are searched within `reach`.
    fn new(reach: f32) -> Self {
        let shape = |step: usize, scale: usize| {
            let away = (step as f64 + 0.5) / STEPS as f64;
            // In units of the reach. The constant is 1 / sqrt(2 pi).
            let inverse = f64::from(2u32 << scale);
            let z = away * inverse;
            0.398_942_280_4 * inverse / f64::from(reach) * libm::exp(-0.5 * z * z)
        };
        let shapes =
            (0..STEPS).map(|step| std::array::from_fn(|scale| shape(step, scale))).collect();
        let weight = [[1.0 / SCALES as f64; SCALES]; CLASSES];
        let mut distances = Self { good: [0.8; CLASSES], weight, shapes, reach, table: Vec::new() };
        distances.tabulate();
        distances
    }

    fn tabulate(&mut self) {
        let of_class = |class: usize| {
            let density = |step: usize| self.parts(class, step).iter().sum::<f64>();
            std::array::from_fn(|step| self.good[class] * density(step))
        };
        self.table = (0..CLASSES).map(of_class).collect();
    }

    /// Returns the weighted density of each normal distribution of `class` in the middle of a bin.
    fn parts(&self, class: usize, step: usize) -> [f64; SCALES] {
        std::array::from_fn(|s| self.shapes[step][s] * self.weight[class][s])
    }

    #[inline(always)]
    fn step(&self, away: f32) -> usize {
        ((away / self.reach * STEPS as f32) as usize).min(STEPS - 1)
    }

    /// Returns the weight of a record without a known partner, per class.
    fn alone(&self) -> [f32; CLASSES] {
        let others = self.mean_good();
        self.good.map(|good| (1.0 - good * others) as f32)
    }

    fn mean_good(&self) -> f64 {
        self.good.iter().sum::<f64>() / CLASSES as f64
    }

    /// Learns from `weights` of pairs per class and bin. `class` has the class of every record.
    fn learn(&mut self, weights: &[[f64; STEPS]], class: &[usize]) {
        let others = self.mean_good().max(0.1);
        for (own, weights) in weights.iter().enumerate() {
            let records = class.iter().filter(|&&class| class == own).count();
            if records == 0 {
                continue;
            }
            let mut scales = [0.0; SCALES];
            for (step, pairs) in weights.iter().enumerate().filter(|x| *x.1 > 0.0) {
                let parts = self.parts(own, step);
                let sum = parts.iter().sum::<f64>().max(f64::MIN_POSITIVE);
                for (to, part) in scales.iter_mut().zip(parts) {
                    *to += pairs * part / sum;
                }
            }
            let total: f64 = scales.iter().sum();
            self.good[own] = (total / records as f64 / others).clamp(FRACTION.0, FRACTION.1);
            // One prior pair, spread over all distributions.
            self.weight[own] = scales.map(|s| (s + 1.0 / SCALES as f64) / (total + 1.0));
        }
        self.tabulate();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    #[test]
    fn rounded_values_are_known_although_partners_are_not() {
        let mut draws = Draws::new(3, Stage::Synthetic, 0);
        let hidden: Vec<f32> = (0..2000).map(|_| draws.below(50) as f32 * 0.1).collect();
        let published: Vec<[f32; 3]> = (0..2000).map(|i| [hidden[i ^ 1], 0.0, 0.0]).collect();
        let estimate = |value: &f32| {
            let near = value + 0.01 * draws.normal() as f32;
            Estimate::at([near, 0.0, 0.0], 9, 0, 9.0)
        };
        let estimates: Vec<Estimate<3>> = hidden.iter().map(estimate).collect();
        let values = hidden_values(&published, &estimates, 0.2);
        let right = values.iter().zip(&hidden).filter(|(value, hidden)| **value == Some(**hidden));
        assert!(right.count() > 1900);
    }
}
