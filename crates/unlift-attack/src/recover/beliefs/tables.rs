//! Likelihood ratios of edges by class and distance, learned from the current places by expectation maximization.

use super::Places;
use crate::parallel;
use crate::recover::map::{CHUNK, CLASSES, Family, evenly, ln};
use crate::recover::problem::Problem;
use crate::seed::{Draws, Stage};

/// Number of bins of the distance: up to the first bound, log-spaced up to the second one, and beyond.
const BINS: usize = 16;
pub(super) const BIN_ENDS: (f32, f32) = (0.1, 6.0);
/// Entries per unit of distance in a table, and their number.
const PER_WIDTH: f32 = 20.0;
const ENTRIES: usize = 121;
/// Number of random slots that each sampled slot is compared with.
const RANDOM: usize = 30;
/// Passes of expectation maximization: at first, and when tables are known.
const PASSES: (usize, usize) = (6, 3);
/// Number of random pairs that every class is given: a class with few edges says little.
const PRIOR: f64 = 10.0;

pub(super) struct Tables {
    /// Per class, the distribution of the distance over bins.
    bins: Vec<[f64; BINS]>,
    /// Per class, `L_c(u) - 1` at multiples of `1 / PER_WIDTH`, relative to the last bin.
    ratios: Vec<[f32; ENTRIES]>,
}

fn bin_of(u: f32) -> usize {
    let per_bin = ln(BIN_ENDS.1 / BIN_ENDS.0) / (BINS - 2) as f32;
    match u {
        _ if u < BIN_ENDS.0 => 0,
        _ if u >= BIN_ENDS.1 => BINS - 1,
        _ => (1 + (ln(u / BIN_ENDS.0) / per_bin) as usize).min(BINS - 2),
    }
}

impl Tables {
    /// Learns tables by expectation maximization: an edge says something about the distance if the places of both ends are right.
    pub(super) fn learn<const D: usize, F: Family<D>>(
        problem: &Problem<'_, D, F>,
        places: &Places<D>,
        before: Option<&Self>,
    ) -> Self {
        let sample: Vec<usize> = evenly(places.n_slots(), 1 << 12).collect();
        // Pairs of places of two slots: their bin and the weight of both.
        let pairs = |slot: usize, end: usize| {
            let pair = move |a: usize, b: usize| {
                let weight = places.all[a].weight * places.all[b].weight;
                (bin_of(places.distance(&places.all[a].x, b)) as u8, weight)
            };
            places.of(slot).flat_map(move |a| places.of(end).map(move |b| pair(a, b)))
        };
        let by_chance = |slots: &[usize]| {
            let mut bins = [0.0; BINS];
            for &slot in slots {
                let mut draws = Draws::new(problem.seed, Stage::BeliefTables, slot as u64);
                let random = (0..RANDOM).map(|_| draws.below(places.n_slots() as u64) as usize);
                let others = random.filter(|&end| end != slot);
                others.flat_map(|end| pairs(slot, end)).for_each(|(bin, weight)| {
                    bins[usize::from(bin)] += f64::from(weight);
                });
            }
            bins
        };
        let parts: Vec<&[usize]> = sample.chunks(CHUNK).collect();
        let by_chance = parallel::map(parts.len(), |at| by_chance(parts[at]));
        let mut chance = [1e-3; BINS];
        by_chance.iter().for_each(|part| add(&mut chance, part));
        let total: f64 = chance.iter().sum();
        let chance = chance.map(|x| (x / total).max(1e-7));
        let edges = |slots: &[usize]| -> Vec<Edge> {
            let edges = slots.iter().flat_map(|&slot| {
                let edge = move |(end, class)| Edge { class, pairs: pairs(slot, end).collect() };
                problem.graph.of(slot).map(edge)
            });
            edges.filter(|edge| !edge.pairs.is_empty()).collect()
        };
        let edges = parallel::map(parts.len(), |at| edges(parts[at]));
        let near = |bin: usize| chance[bin] * (8.0 - 7.0 * bin as f64 / (BINS - 1) as f64);
        let (mut bins, passes) = match before {
            None => (vec![normalized(std::array::from_fn(near)); CLASSES], PASSES.0),
            Some(tables) => (tables.bins.clone(), PASSES.1),
        };
        for _ in 0..passes {
            let ratios: Vec<[f64; BINS]> =
                bins.iter().map(|f| std::array::from_fn(|bin| f[bin] / chance[bin])).collect();
            let expected = |edges: &Vec<Edge>| {
                let mut sums = vec![[0.0; BINS]; CLASSES];
                for &Edge { class, ref pairs } in edges {
                    let class = usize::from(class);
                    let known: f64 = pairs.iter().map(|pair| f64::from(pair.1)).sum();
                    let unknown = (1.0 - known).max(0.0);
                    let likelihood = |&(bin, weight): &(u8, f32)| {
                        f64::from(weight) * ratios[class][usize::from(bin)]
                    };
                    let z = unknown + pairs.iter().map(likelihood).sum::<f64>();
                    for pair in pairs {
                        sums[class][usize::from(pair.0)] += likelihood(pair) / z;
                    }
                    for bin in 0..BINS {
                        sums[class][bin] += unknown * bins[class][bin] / z;
                    }
                }
                sums
            };
            let parts = parallel::map(edges.len(), |at| expected(&edges[at]));
            for (class, bins) in bins.iter_mut().enumerate() {
                let mut sum = chance.map(|share| PRIOR * share);
                parts.iter().for_each(|part| add(&mut sum, &part[class]));
                *bins = normalized(sum);
            }
        }
        let ratios = bins.iter().map(|f| interpolated(f, &chance)).collect();
        Self { bins, ratios }
    }

    #[inline(always)]
    pub(super) fn at(&self, class: u8, u: f32) -> f32 {
        let at = (u * PER_WIDTH).min((ENTRIES - 1) as f32);
        let low = (at as usize).min(ENTRIES - 2);
        let share = at - low as f32;
        let table = &self.ratios[usize::from(class)];
        table[low] * (1.0 - share) + table[low + 1] * share
    }
}

/// An edge of the sample: its class, and the bin and the weight of each pair of places of its ends.
struct Edge {
    class: u8,
    pairs: Vec<(u8, f32)>,
}

fn add(sums: &mut [f64; BINS], more: &[f64; BINS]) {
    sums.iter_mut().zip(more).for_each(|(sum, x)| *sum += x);
}

fn normalized(bins: [f64; BINS]) -> [f64; BINS] {
    let total: f64 = bins.iter().sum();
    bins.map(|x| x / total)
}

/// Returns a table of likelihood ratios, less 1, from distributions over bins: linear in logarithms between the middles of bins.
fn interpolated(bins: &[f64; BINS], chance: &[f64; BINS]) -> [f32; ENTRIES] {
    let log_ratio: [f32; BINS] =
        std::array::from_fn(|bin| libm::log(bins[bin].max(1e-12) / chance[bin]) as f32);
    let step = libm::logf(BIN_ENDS.1 / BIN_ENDS.0) / (BINS - 2) as f32;
    let start = libm::logf(BIN_ENDS.0);
    const LAST: usize = BINS - 1;
    let middle = |bin: usize| match bin {
        0 => start - 0.36,
        LAST => libm::logf(BIN_ENDS.1),
        _ => start + (bin as f32 - 0.5) * step,
    };
    let logs: [f32; ENTRIES] = std::array::from_fn(|entry| {
        let u = libm::logf((entry as f32).max(1.0) / PER_WIDTH);
        let bin = (0..BINS).position(|bin| middle(bin) >= u).unwrap_or(BINS - 1);
        if bin == 0 {
            return log_ratio[0];
        }
        let share = ((u - middle(bin - 1)) / (middle(bin) - middle(bin - 1))).min(1.0);
        log_ratio[bin - 1] * (1.0 - share) + log_ratio[bin] * share
    });
    logs.map(|x| libm::expf(x - logs[ENTRIES - 1]) - 1.0)
}
