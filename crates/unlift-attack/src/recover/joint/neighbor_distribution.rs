//! The distribution of true neighbors' estimates around a point, learned from the map itself.
//!
//! Edges lead to true neighbors, whose estimates lie close, and to other records, whose estimates are as dense as estimates are
//! anywhere. The number of close edges beyond chance gives the fraction of true neighbors in each class of edges and the radius
//! that holds half of them. Their density is modeled as proportional to `(1 + r^2 / a^2)^-3`, which has a heavy tail.

use rayon::prelude::*;

use crate::recover::map::family::Family;
use crate::recover::map::graph::{CLASSES, Side, either, side};
use crate::recover::map::grid::Density;
use crate::recover::map::places::{distance2, nearest2};
use crate::recover::problem::{Problem, RANDOM, Sampled};
use crate::recover::result::Estimate;
use crate::simd::{Kernel, dispatch};

/// True neighbors are counted within this many radii, which hold nearly all of them.
const REACH: f32 = 4.0;
/// Number of bins of the distance, from 0 to the reach: 12 per radius.
const BINS: usize = 48;
/// First bin of distances too large for true neighbors: three radii.
const OUTSIDE: usize = BINS / 4 * 3;
/// Slots per parallel task. The number is fixed, so sums do not depend on the number of threads.
const PART: usize = 256;
/// Least number of close mutual edges from which the radius may be taken.
const ENOUGH: f64 = 250.0;
/// Mutual edges give the radius if theirs is below this fraction of the radius of all edges.
const TIGHTER: f64 = 0.65;
/// Fraction of true neighbors that is lost with their tail when the background is subtracted, measured on maps with uniform
/// noise in the lists.
const TAIL: f64 = 0.1;
/// Bounds of the fraction of true neighbors in a class, so that odds are neither 0 nor infinite.
const FRACTION: (f64, f64) = (5e-4, 0.95);

/// The learned distribution of true neighbors. Lengths are in units of the local width, [`Density::width`].
#[derive(Clone, Debug)]
pub(super) struct NeighborDistribution {
    /// Radius that holds half of the true neighbors' estimates.
    pub(super) radius: f32,
    /// Odds that an edge leads to a true neighbor, per class.
    pub(super) odds: [f32; CLASSES],
    /// Fraction of true neighbors among the estimates at the ends of edges.
    pub(super) fraction: f32,
    /// `1 / a^2`, and the density of true neighbors at `r = 0`.
    pub(super) inverse_a2: f32,
    pub(super) density_at_zero: f32,
    /// Odds times density of wrong entries that lie in the same region of the map; uniform within the reach.
    pub(super) background: f32,
    /// Bound on the imbalance of forward and reverse edges, in nats, see [`Near::balanced_log_likelihood`]; infinite where
    /// wrong entries form no clusters.
    ///
    /// [`Near::balanced_log_likelihood`]: super::votes::Near::balanced_log_likelihood
    pub(super) most_imbalance: f32,
}

impl NeighborDistribution {
    /// Learns the distribution from `estimates`. Neighbors are counted within [`REACH`] times `radius`; the learned radius is at
    /// least `least_radius`.
    pub(super) fn learn<const D: usize, F: Family<D>>(
        problem: &Problem<'_, D, F>,
        estimates: &[Estimate<D>],
        density: &Density<D>,
        radius: f32,
        least_radius: f32,
    ) -> Self {
        let learning = Learning { problem, estimates, density, reach: REACH * radius };
        let part = |rows: &[Sampled]| dispatch(Part { rows, learning: &learning });
        let parts: Vec<Tally> = problem.sample.par_chunks(PART).map(part).collect();
        let mut total = Tally::default();
        parts.iter().for_each(|part| total.merge(part));
        let limits = (least_radius, F::MOST_RADIUS * problem.delta);
        let distribution = total.distribution::<D, F>(problem.family, learning.reach, limits);
        Self { most_imbalance: learning.most_imbalance(), ..distribution }
    }

    /// Per class, the odds that an edge leads to a true neighbor of this slot, and a flag: 1 where the edge may belong to the
    /// other slot of the record, else 0.
    pub(super) fn odds_of_slot(&self, slots_per_record: usize) -> [(f32, f32); CLASSES] {
        std::array::from_fn(|class| {
            let odds = self.odds[class];
            match class as u8 {
                // The nearer of two slots is twice as likely to be close by chance.
                class if either(class, slots_per_record) => (0.5 * odds, 0.0),
                class if slots_per_record == 2 && side(class) == Side::Reverse => (odds, 1.0),
                _ => (odds, 0.0),
            }
        })
    }
}

struct Learning<'a, const D: usize, F: Family<D>> {
    problem: &'a Problem<'a, D, F>,
    estimates: &'a [Estimate<D>],
    density: &'a Density<D>,
    /// True neighbors are counted within this many local widths.
    reach: f32,
}

impl<const D: usize, F: Family<D>> Learning<'_, D, F> {
    #[inline(always)]
    fn reach_at(&self, x: &[f32; D]) -> f32 {
        self.density.width(self.density.at(x)) * self.reach
    }

    #[inline(always)]
    fn count(&self, Sampled { slot, random }: &Sampled, tally: &mut Tally) {
        let slots_per_record = self.problem.family.slots_per_record();
        let (ends, class) = self.problem.graph.of(*slot);
        let x = self.estimates[*slot].position;
        let reach = self.reach_at(&x);
        let (reach2, scale) = (reach * reach, BINS as f32 / reach);
        let close = |end: u32, class: u8| {
            let d2 = nearest2(self.estimates, end, either(class, slots_per_record), &x);
            (d2 < reach2).then(|| ((d2.sqrt() * scale) as usize).min(BINS - 1))
        };
        let mut n_mutual = 0;
        for (&end, &class) in ends.iter().zip(class) {
            let is_mutual = side(class) == Side::Mutual;
            n_mutual += usize::from(is_mutual);
            let of_class = &mut tally.classes[usize::from(class)];
            of_class[0] += 1;
            if let Some(bin) = close(end, class) {
                tally.bins[0][bin].0 += 1;
                tally.bins[1][bin].0 += u32::from(is_mutual);
                of_class[1] += 1;
            }
        }
        // The few random edges get the total weight of the slot's own edges.
        let per_random = ends.len() as f64 / RANDOM as f64;
        let per_random_mutual = n_mutual as f64 / RANDOM as f64;
        for &(end, class) in random {
            let of_kind = &mut tally.random[usize::from(either(class, slots_per_record))];
            of_kind[0] += 1;
            if let Some(bin) = close(end, class) {
                tally.bins[0][bin].1 += per_random;
                tally.bins[1][bin].1 += per_random_mutual;
                of_kind[1] += 1;
            }
        }
    }

    /// Returns the bound on the imbalance of forward and reverse edges, in nats; infinite where wrong entries form no clusters.
    ///
    /// Uniformly wrong entries stand alone. Records with similar descriptors are wrong together: a list with one of them holds
    /// others beside it, so that their place gathers as much evidence as the right one. But those records do not list back.
    fn most_imbalance(&self) -> f32 {
        let place = |slot: usize| self.estimates[slot].position;
        let (mut entries, mut beside) = (0.0, 0.0);
        let mut own = Vec::new();
        for Sampled { slot, random } in self.problem.sample.iter().step_by(EVERY) {
            if !self.estimates[*slot].is_known() {
                continue;
            }
            let (ends, class) = self.problem.graph.of(*slot);
            own.clear();
            let edges = ends.iter().zip(class);
            own.extend(
                edges.filter(|(_, class)| side(**class) == Side::Forward).map(|(end, _)| *end),
            );
            let x = place(*slot);
            for &entry in own.iter().step_by(own.len().div_ceil(ENTRIES).max(1)) {
                entries += 1.0;
                if !self.estimates[entry as usize].is_known() {
                    continue;
                }
                let y = place(entry as usize);
                let reach = self.reach_at(&y);
                if distance2(&x, &y) <= ELSEWHERE * ELSEWHERE * reach * reach {
                    continue;
                }
                let is_beside = |end: u32| distance2(&place(end as usize), &y) < reach * reach;
                let found = own.iter().filter(|&&end| end != entry && is_beside(end)).count();
                let by_chance = random.iter().filter(|(end, _)| is_beside(*end)).count();
                beside += found as f64 - (own.len() - 1) as f64 / RANDOM as f64 * by_chance as f64;
            }
        }
        if beside > LEAST_COMPANIONS * entries { MOST_IMBALANCE } else { f32::INFINITY }
    }
}

/// Every this many sampled slots, entries are checked for clusters.
const EVERY: usize = 2;
/// Number of entries that are checked per slot.
const ENTRIES: usize = 2;
/// An entry is far if its distance from the slot's estimate exceeds this many times the reach.
const ELSEWHERE: f32 = 2.0;
/// Wrong entries form clusters if the mean number of other forward entries near a far forward entry exceeds this, beyond
/// chance. The mean is over all checked entries; entries that are not far count as 0.
const LEAST_COMPANIONS: f64 = 0.25;
/// The bound for lists whose wrong entries form clusters, in nats.
const MOST_IMBALANCE: f32 = 10.0;

struct Part<'a, const D: usize, F: Family<D>> {
    rows: &'a [Sampled],
    learning: &'a Learning<'a, D, F>,
}

impl<const D: usize, F: Family<D>> Kernel for Part<'_, D, F> {
    type Output = Tally;

    #[inline(always)]
    fn run(self) -> Tally {
        let mut tally = Tally::default();
        for row in self.rows.iter().filter(|row| self.learning.estimates[row.slot].is_known()) {
            self.learning.count(row, &mut tally);
        }
        tally
    }
}

struct Tally {
    /// Per bin, the number of close edges and of close random edges (weighted); for all edges, then for mutual ones.
    bins: [[(u32, f64); BINS]; 2],
    /// Per class, the number of edges and of close edges.
    classes: [[u32; 2]; CLASSES],
    /// The number of random edges and of close ones: those that lead to one slot, then those that lead to either of two.
    random: [[u32; 2]; 2],
}

impl Default for Tally {
    fn default() -> Self {
        let classes = [[0; 2]; CLASSES];
        Self { bins: [[(0, 0.0); BINS]; 2], classes, random: [[0; 2]; 2] }
    }
}

impl Tally {
    fn merge(&mut self, other: &Self) {
        let bins = self.bins.as_flattened_mut().iter_mut().zip(other.bins.as_flattened());
        bins.for_each(|(a, b)| *a = (a.0 + b.0, a.1 + b.1));
        let classes = self.classes.as_flattened_mut().iter_mut().zip(other.classes.as_flattened());
        classes.for_each(|(a, b)| *a += b);
        let random = self.random.as_flattened_mut().iter_mut().zip(other.random.as_flattened());
        random.for_each(|(a, b)| *a += b);
    }

    /// Returns close edges beyond chance and background per bin, and their fraction among close edges beyond chance. `kind` is 0
    /// for all edges, 1 for mutual ones.
    fn excess<const D: usize>(&self, kind: usize) -> ([f64; BINS], f64) {
        let bins = &self.bins[kind];
        let of_kind = |class: &usize| kind == 0 || side(*class as u8) == Side::Mutual;
        let edges: u32 = (0..CLASSES).filter(of_kind).map(|class| self.classes[class][0]).sum();
        let edges = f64::from(edges.max(1));
        let found: f64 = bins.iter().map(|b| f64::from(b.0)).sum();
        let by_chance: f64 = bins.iter().map(|b| b.1).sum();
        let fraction = true_fraction(found / edges, by_chance / edges);
        let excess = bins.map(|(found, by_chance)| f64::from(found) - (1.0 - fraction) * by_chance);
        // Wrong entries in the same region are uniform: their density is the one measured in the outer bins.
        let volume = |bin: usize| ((bin + 1) as f64).powi(D as i32) - (bin as f64).powi(D as i32);
        // In images, true neighbors reach those bins.
        let outside = match D {
            2 => 0.0,
            _ => excess[OUTSIDE..].iter().sum::<f64>().max(0.0),
        };
        let density = outside / (OUTSIDE..BINS).map(volume).sum::<f64>();
        let neighbors = std::array::from_fn(|bin| (excess[bin] - density * volume(bin)).max(0.0));
        let fraction = neighbors.iter().sum::<f64>() / excess.iter().sum::<f64>().max(1.0);
        (neighbors, (fraction / (1.0 - TAIL)).min(1.0))
    }

    /// Computes the distribution, without the bound on imbalance.
    fn distribution<const D: usize, F: Family<D>>(
        &self,
        family: &F,
        reach: f32,
        (least_radius, most_radius): (f32, f32),
    ) -> NeighborDistribution {
        let [(all, fraction_of_all), (mutual, fraction_of_mutual)] =
            [0, 1].map(|kind| self.excess::<D>(kind));
        let mut radius = median_radius(&all);
        // Wrong entries in the same region are rarely mutual.
        if mutual.iter().sum::<f64>() >= ENOUGH && median_radius(&mutual) < TIGHTER * radius {
            radius = median_radius(&mutual);
        }
        let radius = (radius as f32 * reach).min(most_radius).max(least_radius);
        let (median, mass) = profile(D);
        let a = radius / median;
        let chance = self.random.map(close_fraction);
        let mut odds = [0.0; CLASSES];
        let (mut edges, mut ends, mut neighbors, mut n_background) = (0.0, 0.0, 0.0, 0.0);
        for (class, of_class) in self.classes.iter().enumerate() {
            let either = either(class as u8, family.slots_per_record());
            let close = true_fraction(close_fraction(*of_class), chance[usize::from(either)]);
            let of_close = match side(class as u8) {
                _ if !F::SUBTRACTS_BACKGROUND => 1.0,
                Side::Mutual => fraction_of_mutual,
                Side::Forward | Side::Reverse => fraction_of_all,
            };
            let p = (close * of_close).max(FRACTION.0);
            odds[class] = (p / (1.0 - p)) as f32;
            let n = f64::from(of_class[0]);
            edges += n;
            // Of the two slots of a record, only one can be a neighbor.
            ends += if either { 2.0 * n } else { n };
            neighbors += n * close;
            n_background += n * close * (1.0 - of_close);
        }
        let background = (n_background / f64::max(edges, 1.0)).min(FRACTION.1);
        NeighborDistribution {
            radius,
            fraction: (neighbors / f64::max(ends, 1.0)) as f32,
            odds,
            inverse_a2: 1.0 / (a * a),
            density_at_zero: 1.0 / (mass * a.powi(D as i32)),
            background: (background / (1.0 - background) / ball_volume(D, reach)) as f32,
            most_imbalance: f32::INFINITY,
        }
    }
}

fn close_fraction([edges, found]: [u32; 2]) -> f64 {
    f64::from(found) / f64::from(edges.max(1))
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

/// Returns the fraction of true neighbors among edges. All true neighbors are close, and of other edges the fraction `chance`;
/// `found` is the fraction of all edges that are close.
fn true_fraction(found: f64, chance: f64) -> f64 {
    ((found - chance) / (1.0 - chance.min(0.99))).clamp(FRACTION.0, FRACTION.1)
}

fn ball_volume(dimensions: usize, radius: f32) -> f64 {
    use std::f64::consts::PI;
    let unit = if dimensions == 2 { PI } else { 4.0 / 3.0 * PI };
    unit * f64::from(radius).powi(dimensions as i32)
}

/// Returns the radius that holds half of the mass of `(1 + r^2)^-3`, and the mass.
fn profile(dimensions: usize) -> (f32, f32) {
    use std::f32::consts::PI;
    match dimensions {
        2 => (0.643_594_25, PI / 2.0),
        _ => (1.0, PI * PI / 4.0),
    }
}
