//! How the estimates of true neighbors lie around a point: learned from the map itself.
//!
//! Listed records come from two populations: neighbors, whose estimates lie close, and others, which lie
//! as dense as estimates do anywhere. The excess of close ones over chance tells the fraction of neighbors
//! among the edges of each class and the radius within which half of them lie. Their density is taken
//! as `(1 + r^2 / a^2)^-3`: flat where estimates are too uncertain to tell, with a heavy tail.

use rayon::prelude::*;

use crate::recover::joint::input::{Input, RANDOM, Sampled};
use crate::recover::map::family::Settings;
use crate::recover::map::graph::{CLASSES, Side, either, side};
use crate::recover::map::grid::Density;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{Places, distance2};
use crate::simd::{Kernel, dispatch};

/// True neighbors are looked for within this many radii of their distribution: nearly all of its mass.
const REACH: f32 = 4.0;
/// Bins of the radius, up to the reach: a dozen within the radius.
const BINS: usize = 48;
/// Edges in this bin and beyond are too long for neighbors: three radii of the distribution.
const OUTSIDE: usize = BINS / 4 * 3;
/// Slots counted by one thread at a time: a fixed number, so that sums do not depend on threads.
const PART: usize = 256;
/// Mutual edges tell the radius if so many of them are close (a median of fewer is noise),
const ENOUGH: f64 = 250.0;
/// and within this fraction of the radius of all.
const TIGHTER: f64 = 0.65;
/// The fraction of the excess that is lost with the tail of true neighbors when the background is taken off: measured
/// on maps whose wrong entries are anywhere.
const TAIL: f64 = 0.1;
/// The least and the largest fraction of neighbors in a class: odds of zero or infinity would never change again.
const FRACTION: (f64, f64) = (5e-4, 0.95);

/// What is known about true neighbors.
#[derive(Clone, Debug)]
pub(super) struct NeighborDistribution {
    /// Half of the true neighbors' estimates lie within this radius (in units of local width).
    pub(super) radius: f32,
    /// Per class: the odds of a true neighbor.
    pub(super) odds: [f32; CLASSES],
    /// The fraction of true neighbors among the estimates at the other ends of edges.
    pub(super) fraction: f32,
    /// `(1 + r^2 / a^2)^-3`: 1 / a^2, and the density at the center.
    pub(super) inverse_a2: f32,
    pub(super) density_at_zero: f32,
    /// The odds of a wrong entry that is near all the same, times its density: the same all over the reach.
    pub(super) background: f32,
    /// How many nats the edges in one direction may be ahead of those in the other beyond what mutual edges say; infinite
    /// where nothing bounds them.
    pub(super) most_imbalance: f32,
}

impl NeighborDistribution {
    /// The distribution at the present `places`. Neighbors are looked for as if `radius` were that of the distribution; the
    /// one learned is not below `least_radius`.
    pub(super) fn learn<const D: usize, P: Pieces<D>>(
        input: &Input<'_, P>,
        places: &Places<D>,
        density: &Density<D>,
        radius: f32,
        least_radius: f32,
    ) -> Self {
        let learning = Learning { input, places, density, reach: REACH * radius };
        let part = |rows: &[Sampled]| dispatch(Part { rows, learning: &learning });
        let parts: Vec<Tally> = input.sample.par_chunks(PART).map(part).collect();
        let mut total = Tally::default();
        parts.iter().for_each(|part| total.merge(part));
        let limits = (least_radius, P::MOST_RADIUS * input.delta);
        let distribution = total.distribution::<D, P>(&input.pieces, learning.reach, limits);
        Self { most_imbalance: learning.most_imbalance(), ..distribution }
    }

    /// Per class: the odds that an edge leads to a true neighbor of this very slot, and 1 where it may as well be
    /// one of the other slot of its record, 0 elsewhere.
    pub(super) fn odds_of_slot(&self, slots_per_record: usize) -> [(f32, f32); CLASSES] {
        std::array::from_fn(|class| {
            let odds = self.odds[class];
            match class as u8 {
                // Either of two slots is twice as likely to lie anywhere.
                class if either(class, slots_per_record) => (0.5 * odds, 0.0),
                class if slots_per_record == 2 && side(class) == Side::Reverse => (odds, 1.0),
                _ => (odds, 0.0),
            }
        })
    }
}

/// What the distribution is learned with.
struct Learning<'a, const D: usize, P> {
    input: &'a Input<'a, P>,
    places: &'a Places<D>,
    density: &'a Density<D>,
    /// True neighbors are looked for within this many local widths.
    reach: f32,
}

impl<const D: usize, P: Pieces<D>> Learning<'_, D, P> {
    /// How far true neighbors are looked for about `x`.
    #[inline(always)]
    fn reach_at(&self, x: &[f32; D]) -> f32 {
        self.density.width(self.density.at(x)) * self.reach
    }

    #[inline(always)]
    fn count(&self, Sampled { slot, random }: &Sampled, tally: &mut Tally) {
        let slots_per_record = self.input.pieces.slots_per_record();
        let (ends, class) = self.input.graph.of(*slot);
        let x = self.places.of(*slot);
        let reach = self.reach_at(&x);
        let (reach2, scale) = (reach * reach, BINS as f32 / reach);
        let close = |end: u32, class: u8| {
            let (d2, _) = self.places.nearest(end, either(class, slots_per_record), &x);
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
        // Random edges stand for as many as the slot has.
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

    /// How many nats one direction may be ahead of the other beyond what mutual edges say; infinite where lists are
    /// not wrong together.
    ///
    /// Where lists are wrong at random, a wrong entry stands alone. Where they are wrong together, as look-alike
    /// descriptors are, whoever lists a wrong entry also lists others beside it, and that place gathers as much evidence as
    /// the right one. But those there do not list back.
    fn most_imbalance(&self) -> f32 {
        let places = self.places;
        let (mut entries, mut beside) = (0.0, 0.0);
        let mut own = Vec::new();
        for Sampled { slot, random } in self.input.sample.iter().step_by(EVERY) {
            if !places.is_known(*slot) {
                continue;
            }
            let (ends, class) = self.input.graph.of(*slot);
            own.clear();
            let edges = ends.iter().zip(class);
            own.extend(
                edges.filter(|(_, class)| side(**class) == Side::Forward).map(|(end, _)| *end),
            );
            let x = places.of(*slot);
            for &entry in own.iter().step_by(own.len().div_ceil(ENTRIES).max(1)) {
                entries += 1.0;
                if !places.is_known(entry as usize) {
                    continue;
                }
                let y = places.of(entry as usize);
                let reach = self.reach_at(&y);
                if distance2(&x, &y) <= ELSEWHERE * ELSEWHERE * reach * reach {
                    continue;
                }
                let is_beside = |end: u32| distance2(&places.of(end as usize), &y) < reach * reach;
                let found = own.iter().filter(|&&end| end != entry && is_beside(end)).count();
                let by_chance = random.iter().filter(|(end, _)| is_beside(*end)).count();
                beside += found as f64 - (own.len() - 1) as f64 / RANDOM as f64 * by_chance as f64;
            }
        }
        if beside > LEAST_COMPANIONS * entries { MOST_IMBALANCE } else { f32::INFINITY }
    }
}

/// Of the sample, every so many slots are looked at to see whether lists are wrong together,
const EVERY: usize = 2;
/// and so many entries of each.
const ENTRIES: usize = 2;
/// An entry is elsewhere when it is farther from the estimate than this many times its reach.
const ELSEWHERE: f32 = 2.0;
/// Lists are wrong together if an entry that does not list back has on average so many others of its list beside it elsewhere,
/// beyond chance; entries that are not elsewhere count with none.
const LEAST_COMPANIONS: f64 = 0.25;
/// The bound in nats then.
const MOST_IMBALANCE: f32 = 10.0;

/// Some of the slots of a sample.
struct Part<'a, const D: usize, P> {
    rows: &'a [Sampled],
    learning: &'a Learning<'a, D, P>,
}

impl<const D: usize, P: Pieces<D>> Kernel for Part<'_, D, P> {
    type Output = Tally;

    #[inline(always)]
    fn run(self) -> Tally {
        let mut tally = Tally::default();
        for row in self.rows.iter().filter(|row| self.learning.places.is_known(row.slot)) {
            self.learning.count(row, &mut tally);
        }
        tally
    }
}

struct Tally {
    /// Close edges per bin, and close random ones; of all edges, and of mutual ones.
    bins: [[(u32, f64); BINS]; 2],
    /// Edges and close ones, per class.
    classes: [[u32; 2]; CLASSES],
    /// Random edges that lead to one slot or to either of two, and close ones.
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

    /// Close edges beyond those expected by chance or merely in the same region, per bin, and their fraction of
    /// those beyond chance; of all edges or of mutual ones.
    fn excess<const D: usize>(&self, kind: usize) -> ([f64; BINS], f64) {
        let bins = &self.bins[kind];
        let of_kind = |class: &usize| kind == 0 || side(*class as u8) == Side::Mutual;
        let edges: u32 = (0..CLASSES).filter(of_kind).map(|class| self.classes[class][0]).sum();
        let edges = f64::from(edges.max(1));
        let found: f64 = bins.iter().map(|b| f64::from(b.0)).sum();
        let by_chance: f64 = bins.iter().map(|b| b.1).sum();
        let fraction = true_fraction(found / edges, by_chance / edges);
        let excess = bins.map(|(found, by_chance)| f64::from(found) - (1.0 - fraction) * by_chance);
        // Wrong entries that are near all the same lie as dense everywhere as they do far out.
        let volume = |bin: usize| ((bin + 1) as f64).powi(D as i32) - (bin as f64).powi(D as i32);
        let outside = match Settings::of_dimension::<D>().measures_background {
            true => excess[OUTSIDE..].iter().sum::<f64>().max(0.0),
            false => 0.0,
        };
        let density = outside / (OUTSIDE..BINS).map(volume).sum::<f64>();
        let neighbors = std::array::from_fn(|bin| (excess[bin] - density * volume(bin)).max(0.0));
        let fraction = neighbors.iter().sum::<f64>() / excess.iter().sum::<f64>().max(1.0);
        (neighbors, (fraction / (1.0 - TAIL)).min(1.0))
    }

    /// The distribution, but for the most_imbalance.
    fn distribution<const D: usize, P: Pieces<D>>(
        &self,
        pieces: &P,
        reach: f32,
        (least_radius, most_radius): (f32, f32),
    ) -> NeighborDistribution {
        let [(all, fraction_of_all), (mutual, fraction_of_mutual)] =
            [0, 1].map(|kind| self.excess::<D>(kind));
        let mut radius = median_radius(&all);
        // Wrong entries that are near all the same are rarely mutual.
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
            let either = either(class as u8, pieces.slots_per_record());
            let close = true_fraction(close_fraction(*of_class), chance[usize::from(either)]);
            let of_close = match side(class as u8) {
                _ if !P::SUBTRACTS_BACKGROUND => 1.0,
                Side::Mutual => fraction_of_mutual,
                Side::Forward | Side::Reverse => fraction_of_all,
            };
            let p = (close * of_close).max(FRACTION.0);
            odds[class] = (p / (1.0 - p)) as f32;
            let n = f64::from(of_class[0]);
            edges += n;
            // Of two ends where it is not known which, one may be a neighbor.
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

/// Of so many edges, how many were close.
fn close_fraction([edges, found]: [u32; 2]) -> f64 {
    f64::from(found) / f64::from(edges.max(1))
}

/// Where half of `excess` lies, as a fraction of the bins.
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

/// The fraction of neighbors, where `found` of the edges are close and random ones with `chance`: all
/// neighbors are, and `chance` of the others.
fn true_fraction(found: f64, chance: f64) -> f64 {
    ((found - chance) / (1.0 - chance.min(0.99))).clamp(FRACTION.0, FRACTION.1)
}

/// The volume of a ball.
fn ball_volume(dimensions: usize, radius: f32) -> f64 {
    use std::f64::consts::PI;
    let unit = if dimensions == 2 { PI } else { 4.0 / 3.0 * PI };
    unit * f64::from(radius).powi(dimensions as i32)
}

/// Of `(1 + r^2)^-3` in so many dimensions: the radius that holds half of its mass, and the mass.
fn profile(dimensions: usize) -> (f32, f32) {
    use std::f32::consts::PI;
    match dimensions {
        2 => (0.643_594_25, PI / 2.0),
        _ => (1.0, PI * PI / 4.0),
    }
}
