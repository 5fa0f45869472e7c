//! How the estimates of true neighbors lie around a point: learned from the map itself.
//!
//! Listed records come from two populations: neighbors, whose estimates lie close, and others, which lie
//! as dense as estimates do anywhere. The excess of close ones over chance tells the share of neighbors
//! among the edges of each class and the radius within which half of them lie. Their density is taken
//! as `(1 + r^2 / a^2)^-3`: flat where estimates are too uncertain to tell, with a heavy tail.

use rayon::prelude::*;

use crate::recover::joint::input::{Learning, RANDOM, Sampled};
use crate::recover::map::family::Settings;
use crate::recover::map::graph::{CLASSES, Side, either, side};
use crate::recover::map::places::distance2;
use crate::simd::{Kernel, dispatch};

/// Bins of the radius, up to the reach: a dozen within the radius.
const BINS: usize = 48;
/// From this bin on an edge is too long for one of a neighbor: three radii of the distribution.
const OUTSIDE: usize = BINS / 4 * 3;
/// Slots looked at by one thread at a time: a fixed number, so that sums do not depend on threads.
const PART: usize = 256;
/// Mutual edges tell the radius if so many of them are close (a median of fewer is noise),
const ENOUGH: f64 = 250.0;
/// and within this share of the radius of all.
const TIGHTER: f64 = 0.65;
/// Of the excess over chance the tail of true neighbors takes so much with it when what is merely in the
/// region is taken off: measured on maps whose wrong entries are anywhere.
const TAIL: f64 = 0.1;
/// The share of neighbors in a class is at least and at most this: odds of nothing or without end would never change again.
const SHARE: (f64, f64) = (5e-4, 0.95);

/// What is known about true neighbors.
#[derive(Clone, Debug)]
pub(crate) struct NeighborDistribution {
    /// Half of the true neighbors' estimates lie within this radius (in units of local width).
    pub(crate) radius: f32,
    /// Per class: the odds of a true neighbor.
    pub(crate) odds: [f32; CLASSES],
    /// The share of true neighbors among the estimates at the other ends of edges.
    pub(crate) share: f32,
    /// `(1 + r^2 / a^2)^-3`: 1 / a^2, and the density at the center.
    pub(crate) inverse_a2: f32,
    pub(crate) center: f32,
    /// The odds of a wrong entry that is near all the same, times its density: the same all over the reach.
    pub(crate) region: f32,
    /// Nats by which those who list a slot, or those it lists, may be ahead of the others beyond what both
    /// say; infinite where nothing bounds them.
    pub(crate) surplus: f32,
}

impl NeighborDistribution {
    /// Per class: the odds that an edge leads to a true neighbor of this very slot, and 1 where it may as well be
    /// one of the other slot of its record, 0 elsewhere.
    pub(crate) fn odds_of_slot(&self, slots_per_record: usize) -> [(f32, f32); CLASSES] {
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

    /// The distribution at the present places.
    pub(crate) fn learn<const D: usize>(look: &Learning<'_, D>) -> Self {
        let rows = &look.sample.rows;
        let parts: Vec<Tally> =
            rows.par_chunks(PART).map(|rows| dispatch(Part { rows, look })).collect();
        let mut total = Tally::default();
        parts.iter().for_each(|part| total.merge(part));
        total.distribution(look)
    }
}

/// Some of the slots of a sample.
struct Part<'a, 'b, const D: usize> {
    rows: &'a [Sampled],
    look: &'a Learning<'b, D>,
}

impl<const D: usize> Kernel for Part<'_, '_, D> {
    type Output = Tally;

    #[inline(always)]
    fn run(self) -> Tally {
        let mut tally = Tally::default();
        for row in self.rows {
            if self.look.places.is_known(row.slot as usize) {
                tally.add(row, self.look);
            }
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
    #[inline(always)]
    fn add<const D: usize>(&mut self, row: &Sampled, look: &Learning<'_, D>) {
        let Sampled { slot, random } = row;
        let (ends, class) = look.graph.of(*slot as usize);
        let x = look.places.of(*slot as usize);
        let width = look.density.width(look.density.at(&x));
        let reach = width * look.reach;
        let (reach2, scale) = (reach * reach, BINS as f32 / reach);
        let close = |end: u32, class: u8| {
            let (d2, _) = look.places.nearest(end, either(class, look.slots_per_record), &x);
            (d2 < reach2).then(|| ((d2.sqrt() * scale) as usize).min(BINS - 1))
        };
        let mut n_mutual = 0;
        for (&end, &class) in ends.iter().zip(class) {
            n_mutual += usize::from(side(class) == Side::Mutual);
            let of_class = &mut self.classes[usize::from(class)];
            of_class[0] += 1;
            if let Some(bin) = close(end, class) {
                self.bins[0][bin].0 += 1;
                self.bins[1][bin].0 += u32::from(side(class) == Side::Mutual);
                of_class[1] += 1;
            }
        }
        // Random edges stand for as many as the slot has.
        let share = ends.len() as f64 / RANDOM as f64;
        let share_mutual = n_mutual as f64 / RANDOM as f64;
        for &(end, class) in random {
            let of_kind = &mut self.random[usize::from(either(class, look.slots_per_record))];
            of_kind[0] += 1;
            if let Some(bin) = close(end, class) {
                self.bins[0][bin].1 += share;
                self.bins[1][bin].1 += share_mutual;
                of_kind[1] += 1;
            }
        }
    }

    fn merge(&mut self, other: &Self) {
        for kind in 0..2 {
            for (a, b) in self.bins[kind].iter_mut().zip(&other.bins[kind]) {
                *a = (a.0 + b.0, a.1 + b.1);
            }
        }
        for (a, b) in self.classes.iter_mut().zip(&other.classes) {
            (0..2).for_each(|i| a[i] += b[i]);
        }
        for (a, b) in self.random.iter_mut().zip(&other.random) {
            (0..2).for_each(|i| a[i] += b[i]);
        }
    }

    /// The share of true neighbors among the estimates at the other ends of edges: of two where it is not known which, one
    /// may be.
    fn share(&self, slots_per_record: usize) -> f64 {
        let chance = self.random.map(share_found);
        let (mut all, mut neighbors) = (0.0, 0.0);
        for (class, of_class) in self.classes.iter().enumerate() {
            let either = either(class as u8, slots_per_record);
            let edges = f64::from(of_class[0]);
            all += if either { 2.0 * edges } else { edges };
            neighbors += edges * share_of(share_found(*of_class), chance[usize::from(either)]);
        }
        neighbors / all.max(1.0)
    }

    /// Close edges beyond those expected by chance or merely in the same region, per bin, and their share of
    /// those beyond chance; of all edges or of mutual ones.
    fn excess<const D: usize>(&self, kind: usize) -> ([f64; BINS], f64) {
        let bins = &self.bins[kind];
        let of_kind = |class: &u8| kind == 0 || side(*class) == Side::Mutual;
        let classes = (0..CLASSES as u8).filter(of_kind);
        let edges: u32 = classes.map(|class| self.classes[usize::from(class)][0]).sum();
        let edges = f64::from(edges.max(1));
        let found: f64 = bins.iter().map(|b| f64::from(b.0)).sum();
        let by_chance: f64 = bins.iter().map(|b| b.1).sum();
        let share = share_of(found / edges, by_chance / edges);
        let excess = bins.map(|(found, by_chance)| f64::from(found) - (1.0 - share) * by_chance);
        // Wrong entries that are near all the same lie as dense everywhere as they do far out.
        let volume = |bin: usize| ((bin + 1) as f64).powi(D as i32) - (bin as f64).powi(D as i32);
        let outside = if Settings::of_dimension::<D>().tells_background {
            excess[OUTSIDE..].iter().sum::<f64>().max(0.0)
        } else {
            0.0
        };
        let density = outside / (OUTSIDE..BINS).map(volume).sum::<f64>();
        let neighbors = std::array::from_fn(|bin| (excess[bin] - density * volume(bin)).max(0.0));
        let share = neighbors.iter().sum::<f64>() / excess.iter().sum::<f64>().max(1.0);
        (neighbors, (share / (1.0 - TAIL)).min(1.0))
    }

    /// The odds that an edge leads into the region, but not to a neighbor.
    fn odds_of_region(&self, close: &[f64; CLASSES], neighbors: impl Fn(usize) -> f64) -> f64 {
        let (mut all, mut in_region) = (0.0, 0.0);
        for (class, [edges, _]) in self.classes.iter().enumerate() {
            all += f64::from(*edges);
            in_region += f64::from(*edges) * close[class] * (1.0 - neighbors(class));
        }
        let p = (in_region / all.max(1.0)).min(SHARE.1);
        p / (1.0 - p)
    }

    fn distribution<const D: usize>(&self, look: &Learning<'_, D>) -> NeighborDistribution {
        let chance = self.random.map(share_found);
        let [(all, share_of_all), (mutual, share_of_mutual)] =
            [0, 1].map(|kind| self.excess::<D>(kind));
        let mut radius = middle(&all);
        // Wrong entries that are near all the same are rarely mutual.
        if mutual.iter().sum::<f64>() >= ENOUGH && middle(&mutual) < TIGHTER * radius {
            radius = middle(&mutual);
        }
        let radius = (radius as f32 * look.reach).min(look.most_radius).max(look.least_radius);
        let (median, mass) = profile(D);
        let a = radius / median;
        let neighbors = |class: usize| match side(class as u8) {
            _ if !look.tells_region => 1.0,
            Side::Mutual => share_of_mutual,
            Side::Forward | Side::Reverse => share_of_all,
        };
        let close = std::array::from_fn(|class| {
            let chance = chance[usize::from(either(class as u8, look.slots_per_record))];
            share_of(share_found(self.classes[class]), chance)
        });
        NeighborDistribution {
            radius,
            share: self.share(look.slots_per_record) as f32,
            odds: std::array::from_fn(|class| {
                let p = (close[class] * neighbors(class)).max(SHARE.0);
                (p / (1.0 - p)) as f32
            }),
            inverse_a2: 1.0 / (a * a),
            center: 1.0 / (mass * a.powi(D as i32)),
            region: (self.odds_of_region(&close, neighbors) / ball(D, look.reach)) as f32,
            surplus: surplus(look),
        }
    }
}

/// Of so many edges, how many were close.
fn share_found([edges, found]: [u32; 2]) -> f64 {
    f64::from(found) / f64::from(edges.max(1))
}

/// Where half of `excess` lies, as a share of the bins.
fn middle(excess: &[f64; BINS]) -> f64 {
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

/// The share of neighbors `p`, where `found` of the edges are close and random ones with `chance`: all
/// neighbors are, and `chance` of the others.
fn share_of(found: f64, chance: f64) -> f64 {
    ((found - chance) / (1.0 - chance.min(0.99))).clamp(SHARE.0, SHARE.1)
}

/// The volume of a ball.
fn ball(dimensions: usize, radius: f32) -> f64 {
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

// Whether wrong entries of a list share places, as look-alike descriptors do.
//
// Where lists are wrong at random, a wrong entry stands alone. Where they are wrong together, whoever lists it
// also lists others beside it, and a place that is merely named by look-alikes gathers as much
// evidence as the right one. But those there do not list back, while at the right place as many list as are
// listed. So where crowds are found, one side may be ahead of the other only so far.

/// Every so many slots of the sample are looked at, as one mean of all is asked for,
const EVERY: usize = 2;
/// and so many entries of each.
const ENTRIES: usize = 2;
/// An entry is elsewhere when it is farther from the estimate than this many times as far as true neighbors are looked for
/// about the entry.
const ELSEWHERE: f32 = 2.0;
/// Lists are wrong together if an entry that does not list back has so many others of its list beside it elsewhere, beyond
/// chance, in the mean; entries that are not elsewhere count with none. Of a pair one slot is looked at, so
/// pairs need more.
const CROWD: f64 = 0.25;
/// Evidence of one side counts at most so many nats beyond that of the other and of both.
const SURPLUS: f32 = 10.0;

/// How many nats one side may be ahead of the other beyond what both say; without bound where lists are not wrong together.
pub(super) fn surplus<const D: usize>(look: &Learning<'_, D>) -> f32 {
    let mut entries = 0.0;
    let mut beside = 0.0;
    let mut own = Vec::new();
    for Sampled { slot, random } in look.sample.rows.iter().step_by(EVERY) {
        let slot = *slot as usize;
        let (ends, class) = look.graph.of(slot);
        if !look.places.is_known(slot) {
            continue;
        }
        own.clear();
        let edges = ends.iter().zip(class);
        own.extend(edges.filter(|(_, class)| side(**class) == Side::Forward).map(|(end, _)| *end));
        let x = look.places.of(slot);
        for &entry in own.iter().step_by(own.len().div_ceil(ENTRIES).max(1)) {
            entries += 1.0;
            if !look.places.is_known(entry as usize) {
                continue;
            }
            let y = look.places.of(entry as usize);
            let reach = look.reach * look.density.width(look.density.at(&y));
            if distance2(&x, &y) <= ELSEWHERE * ELSEWHERE * reach * reach {
                continue;
            }
            let is_beside = |end: u32| distance2(&look.places.of(end as usize), &y) < reach * reach;
            let found = own.iter().filter(|&&end| end != entry && is_beside(end)).count();
            let by_chance = random.iter().filter(|(end, _)| is_beside(*end)).count();
            beside += found as f64 - (own.len() - 1) as f64 / RANDOM as f64 * by_chance as f64;
        }
    }
    if beside > CROWD * entries { SURPLUS } else { f32::INFINITY }
}
