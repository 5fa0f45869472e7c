//! The distribution of true neighbors' estimates around a point, learned from the map itself.
//!
//! Edges lead to true neighbors, whose estimates lie close, and to other records. The number of close edges beyond chance gives the
//! fraction of true neighbors in each class of edges, and their radius. Their density is modeled as proportional to `(1 + r^2 / a^2)^-3`.

use crate::parallel;
use crate::recover::map::{
    CLASSES, Density, Family, Graph, Side, distance2, evenly, nearest2, side,
};
use crate::recover::problem::{Problem, RANDOM, Sampled};
use crate::recover::result::Estimate;

/// True neighbors are counted within this many radii, which hold nearly all of them.
pub(super) const REACH: f32 = 4.0;
/// Number of bins of the distance, from 0 to the reach: 12 per radius.
const BINS: usize = 48;
/// First bin of distances too large for true neighbors: three radii.
const OUTSIDE: usize = BINS / 4 * 3;
/// Least number of close mutual edges from which the radius may be taken.
const ENOUGH: f64 = 250.0;
/// Mutual edges give the radius if theirs is below this fraction of the radius of all edges.
const TIGHTER: f64 = 0.65;
/// Bounds of the fraction of true neighbors in a class, so that odds are neither 0 nor infinite.
const FRACTION: (f64, f64) = (5e-4, 0.95);

/// The learned distribution of true neighbors. Lengths are divided by the local stretch, [`Density::stretch`].
pub(super) struct NeighborDistribution {
    /// Radius that holds half of the true neighbors' estimates.
    pub(super) radius: f32,
    pub(super) odds: [f32; CLASSES],
    /// Fraction of true neighbors among the estimates at the ends of edges.
    pub(super) fraction: f32,
    /// `1 / a^2`, and the density of true neighbors at `r = 0`.
    pub(super) inverse_a2: f32,
    pub(super) density_at_zero: f32,
    /// Bound on the imbalance of forward and reverse edges, in nats; infinite where wrong entries form no clusters.
    pub(super) most_imbalance: f32,
}

impl NeighborDistribution {
    /// Per class, the odds that one end of an edge is a true neighbor: half of the odds if it leads to two slots.
    pub(super) fn odds_per_end(&self, graph: &Graph) -> [f32; CLASSES] {
        let share = |class: usize| if graph.is_either(class as u8) { 0.5 } else { 1.0 };
        std::array::from_fn(|class| share(class) * self.odds[class])
    }
}

pub(super) struct Learning<'a, const D: usize, F: Family<D>> {
    pub(super) problem: &'a Problem<'a, D, F>,
    pub(super) estimates: &'a [Estimate<D>],
    pub(super) density: &'a Density<D>,
    /// True neighbors are counted within this length times the local stretch.
    pub(super) reach: f32,
}

impl<const D: usize, F: Family<D>> Learning<'_, D, F> {
    fn reach_at(&self, x: &[f32; D]) -> f32 {
        self.density.stretch(self.density.at(x)) * self.reach
    }

    fn count(&self, Sampled { slot, random }: &Sampled, tally: &mut Tally) {
        let graph = self.problem.graph;
        let x = self.estimates[*slot].position;
        let reach = self.reach_at(&x);
        let (reach2, scale) = (reach * reach, BINS as f32 / reach);
        let Tally { bins, classes, random: random_edges } = tally;
        let mut add =
            |edge: (usize, u8), edges: &mut [f64; 2], weights: [f64; 2], column: usize| {
                edges[0] += 1.0;
                let d2 = nearest2(self.estimates, graph.slots_at(edge), &x);
                if d2 < reach2 {
                    edges[1] += 1.0;
                    let bin = ((d2.sqrt() * scale) as usize).min(BINS - 1);
                    bins.iter_mut().zip(weights).for_each(|(bins, n)| bins[bin][column] += n);
                }
            };
        let (n_edges, mut n_mutual) = (graph.of(*slot).len() as f64, 0.0);
        for edge in graph.of(*slot) {
            let is_mutual = f64::from(u8::from(side(edge.1) == Side::Mutual));
            n_mutual += is_mutual;
            add(edge, &mut classes[usize::from(edge.1)], [1.0, is_mutual], 0);
        }
        // The random edges get the total weight of the slot's own edges.
        let per_random = [n_edges, n_mutual].map(|n| n / RANDOM as f64);
        for &edge in random {
            let leads_to_either = usize::from(graph.is_either(edge.1));
            add(edge, &mut random_edges[leads_to_either], per_random, 1);
        }
    }

    /// Returns the learned distribution; its radius is at least `least_radius`.
    pub(super) fn distribution(&self, least_radius: f32) -> NeighborDistribution {
        let Self { problem: Problem { graph, delta, sample, .. }, reach, .. } = *self;
        // The length is fixed, so sums do not depend on the number of threads.
        let parts: Vec<&[Sampled]> = sample.chunks(256).collect();
        let part = |at: usize| {
            let mut tally = Tally::ZERO;
            for row in parts[at].iter().filter(|row| self.estimates[row.slot].is_known()) {
                self.count(row, &mut tally);
            }
            tally
        };
        let parts = parallel::map(parts.len(), part);
        let mut tally = Tally::ZERO;
        parts.iter().for_each(|part| tally.merge(part));
        let [all, mutual] = [0, 1].map(|kind| tally.excess::<D>(kind));
        let mut radius = median_radius(&all);
        // Wrong entries in the same region are rarely mutual.
        if mutual.iter().sum::<f64>() >= ENOUGH && median_radius(&mutual) < TIGHTER * radius {
            radius = median_radius(&mutual);
        }
        let radius = (radius as f32 * reach).min(F::MOST_RADIUS * delta).max(least_radius);
        // The radius that holds half of the mass of `(1 + r^2)^-3`, and the mass.
        let (median, mass) = match D {
            2 => (0.643_594_25, std::f32::consts::PI / 2.0),
            _ => (1.0, std::f32::consts::PI * std::f32::consts::PI / 4.0),
        };
        let a = radius / median;
        let close_fraction = |[edges, close]: [f64; 2]| close / f64::max(edges, 1.0);
        let chance = tally.random.map(close_fraction);
        let mut odds = [0.0; CLASSES];
        let (mut ends, mut neighbors) = (0.0, 0.0);
        for (class, of_class) in tally.classes.iter().enumerate() {
            let is_either = graph.is_either(class as u8);
            let close = true_fraction(close_fraction(*of_class), chance[usize::from(is_either)]);
            odds[class] = (close / (1.0 - close)) as f32;
            let n = of_class[0];
            // Of the two slots of a record, only one can be a neighbor.
            ends += if is_either { 2.0 * n } else { n };
            neighbors += n * close;
        }
        NeighborDistribution {
            radius,
            fraction: (neighbors / f64::max(ends, 1.0)) as f32,
            odds,
            inverse_a2: 1.0 / (a * a),
            density_at_zero: 1.0 / (mass * a.powi(D as i32)),
            most_imbalance: self.most_imbalance(),
        }
    }

    /// Returns the bound on the imbalance of forward and reverse edges, in nats; infinite where wrong entries form no clusters.
    ///
    /// Records with similar descriptors are wrong together: a list with one of them holds others. But they do not list back.
    fn most_imbalance(&self) -> f32 {
        let place = |slot: usize| self.estimates[slot].position;
        let (mut entries, mut companions) = (0.0, 0.0);
        let mut own = Vec::new();
        for Sampled { slot, random } in self.problem.sample.iter().step_by(2) {
            if !self.estimates[*slot].is_known() {
                continue;
            }
            let forward = |&(_, class): &(usize, u8)| side(class) == Side::Forward;
            own.clear();
            own.extend(self.problem.graph.of(*slot).filter(forward).map(|(end, _)| end));
            let x = place(*slot);
            // Two entries per slot are enough.
            for entry in evenly(own.len(), 2).map(|at| own[at]) {
                entries += 1.0;
                if !self.estimates[entry].is_known() {
                    continue;
                }
                let y = place(entry);
                let reach = self.reach_at(&y);
                if distance2(&x, &y) <= ELSEWHERE * ELSEWHERE * reach * reach {
                    continue;
                }
                let is_near = |end: usize| distance2(&place(end), &y) < reach * reach;
                let n = own.iter().filter(|&&end| end != entry && is_near(end)).count();
                let by_chance = random.iter().filter(|(end, _)| is_near(*end)).count();
                companions += n as f64 - (own.len() - 1) as f64 / RANDOM as f64 * by_chance as f64;
            }
        }
        if companions > LEAST_COMPANIONS * entries { MOST_IMBALANCE } else { f32::INFINITY }
    }
}

/// An entry is far if its distance from the slot's estimate exceeds this many times the reach.
const ELSEWHERE: f32 = 2.0;
/// Wrong entries form clusters if a checked entry, if far, has a mean number of forward entries beside it beyond chance above this.
const LEAST_COMPANIONS: f64 = 0.25;
/// The bound for lists whose wrong entries form clusters, in nats.
const MOST_IMBALANCE: f32 = 10.0;

struct Tally {
    /// Per bin, the number of close edges and of close random edges (weighted); for all edges, then for mutual ones.
    bins: [[[f64; 2]; BINS]; 2],
    /// Per class, the number of edges and of close edges.
    classes: [[f64; 2]; CLASSES],
    /// The number of random edges and of close ones: those that lead to one slot, then those that lead to either of two.
    random: [[f64; 2]; 2],
}

impl Tally {
    const ZERO: Self =
        Self { bins: [[[0.0; 2]; BINS]; 2], classes: [[0.0; 2]; CLASSES], random: [[0.0; 2]; 2] };

    fn merge(&mut self, part: &Self) {
        let add = |a: &mut [[f64; 2]], b: &[[f64; 2]]| {
            let pairs = a.as_flattened_mut().iter_mut().zip(b.as_flattened());
            pairs.for_each(|(a, b)| *a += b);
        };
        add(self.bins.as_flattened_mut(), part.bins.as_flattened());
        add(&mut self.classes, &part.classes);
        add(&mut self.random, &part.random);
    }

    /// Returns close edges per bin beyond chance and beyond wrong entries of the same region, for all or mutual edges.
    fn excess<const D: usize>(&self, kind: usize) -> [f64; BINS] {
        let bins = &self.bins[kind];
        let of_kind = |class: &usize| kind == 0 || side(*class as u8) == Side::Mutual;
        let edges: f64 = (0..CLASSES).filter(of_kind).map(|class| self.classes[class][0]).sum();
        let [close, by_chance] =
            [0, 1].map(|of| bins.iter().map(|bin| bin[of]).sum::<f64>() / edges.max(1.0));
        let fraction = true_fraction(close, by_chance);
        let excess = bins.map(|[close, by_chance]| close - (1.0 - fraction) * by_chance);
        // Wrong entries in the same region are uniform: their density is the one measured in the outer bins.
        let volume = |bin: usize| ((bin + 1) as f64).powi(D as i32) - (bin as f64).powi(D as i32);
        // In images, true neighbors reach those bins.
        let outside = match D {
            2 => 0.0,
            _ => excess[OUTSIDE..].iter().sum::<f64>().max(0.0),
        };
        let density = outside / (OUTSIDE..BINS).map(volume).sum::<f64>();
        std::array::from_fn(|bin| (excess[bin] - density * volume(bin)).max(0.0))
    }
}

/// Returns the distance that splits `excess` in half, as a fraction of the reach.
fn median_radius(excess: &[f64; BINS]) -> f64 {
    let half = 0.5 * excess.iter().sum::<f64>();
    let mut sum = 0.0;
    for (bin, e) in excess.iter().enumerate() {
        if sum + e >= half && *e > 0.0 {
            return (bin as f64 + (half - sum) / e) / BINS as f64;
        }
        sum += e;
    }
    0.5
}

/// Returns the fraction of true neighbors among edges. All of them are close, and of other edges the fraction `chance`.
fn true_fraction(close: f64, chance: f64) -> f64 {
    ((close - chance) / (1.0 - chance.min(0.99))).clamp(FRACTION.0, FRACTION.1)
}
