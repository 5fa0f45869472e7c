//! The temper, learned from each slot's own record.
//!
//! The lists of a slot say where its point is, and its record says so independently. So the temper is the exponent under which the lists,
//! without the record, predict best where the record passes. Entries that are wrong together make it small.

use super::Context;
use crate::parallel;
use crate::recover::map::{Family, distance2, evenly, ln};
use crate::seed::{Draws, Stage};

const TEMPERS: [f32; 7] = [0.14, 0.2, 0.28, 0.4, 0.56, 0.8, 1.0];
/// The largest temper counts whose mean log-likelihood is within this many nats of the best.
const TOLERANCE: f64 = 0.1;
/// Number of random records that measure how often a record passes by chance.
const BY_CHANCE: usize = 150;
const MAX_PLACES: usize = 100;
/// Probability that a list names the place at all.
const NAMED: f64 = 0.9;
/// Compared places are at least this many widths apart.
const SEPARATE: f32 = 2.0;

/// A place that a list names: the evidence of the other edges, and how often the own record passes it, against other records.
struct Named<const D: usize> {
    x: [f32; D],
    evidence: f32,
    ratio: f64,
}

impl<const D: usize, F: Family<D>> Context<'_, D, F> {
    pub(super) fn learn_temper(&self) -> f32 {
        let sample: Vec<usize> = evenly(self.places.n_slots(), 2000).collect();
        let mut named = parallel::map(sample.len(), |at| self.named(sample[at]));
        named.retain(|named| named.len() > 1);
        let fit = |temper: f32| -> f64 {
            let of_slot = |named: &Vec<Named<D>>| {
                let most = named.iter().map(|n| n.evidence).fold(f32::NEG_INFINITY, f32::max);
                let (mut all, mut passed) = (0.0, 0.0);
                for n in named {
                    let p = libm::exp(f64::from(temper * (n.evidence - most)));
                    all += p;
                    passed += p * (1.0 - NAMED + NAMED * n.ratio);
                }
                libm::log(passed / all)
            };
            named.iter().map(of_slot).sum::<f64>() / named.len().max(1) as f64
        };
        let fits = TEMPERS.map(fit);
        let best = fits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let chosen = fits.iter().rposition(|&fit| fit > best - TOLERANCE);
        TEMPERS[chosen.unwrap_or(0)]
    }

    /// Returns the places that the edges of `slot` lead to, far from each other, those with the most evidence first.
    fn named(&self, slot: usize) -> Vec<Named<D>> {
        let Self { problem, places, tables, .. } = *self;
        let edges = || problem.graph.of(slot).enumerate();
        let best_at = |(edge, (end, _)): (usize, (usize, u8))| {
            let best =
                places.all[places.of(end)].iter().max_by(|a, b| a.weight.total_cmp(&b.weight));
            Some((edge, best?.x))
        };
        let width = places.typical;
        let passes = |slot: usize, x: &[f32; D]| problem.family.is_near(slot, x, width * width);
        let mut draws = Draws::new(problem.seed, Stage::BeliefTables, !(slot as u64));
        let others: Vec<usize> =
            (0..BY_CHANCE).map(|_| draws.below(places.n_slots() as u64) as usize).collect();
        let named = |(edge, x): (usize, [f32; D])| {
            let mut evidence = 0.0;
            for (_, (end, class)) in edges().filter(|&(at, _)| at != edge) {
                let mut ratio = 1.0;
                for at in places.of(end) {
                    ratio += places.all[at].weight * tables.at(class, places.distance(&x, at));
                }
                evidence += ln(ratio.max(1e-6));
            }
            let by_chance = others.iter().filter(|&&other| passes(other, &x)).count();
            let chance = (by_chance as f64 + 0.5) / (BY_CHANCE + 1) as f64;
            let ratio = if passes(slot, &x) { 1.0 / chance } else { 0.0 };
            Named { x, evidence, ratio }
        };
        let all = edges().filter_map(best_at).take(MAX_PLACES).map(named);
        let mut all: Vec<Named<D>> = all.collect();
        all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        let mut kept: Vec<Named<D>> = Vec::new();
        let apart = SEPARATE * width;
        for named in all {
            if kept.iter().all(|other| distance2(&other.x, &named.x) >= apart * apart) {
                kept.push(named);
            }
        }
        kept
    }
}
