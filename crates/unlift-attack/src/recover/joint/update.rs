//! One slot in one iteration: candidates from the estimates of neighbors, the likeliest of them, refined.

use crate::recover::joint::neighbor_distribution::NeighborDistribution;
use crate::recover::joint::refine::{Directions, refined};
use crate::recover::joint::votes::{Columns, Ends, Odds};
use crate::recover::map::graph::{CLASSES, Graph, either, record_of};
use crate::recover::map::grid::Density;
use crate::recover::map::lines::ln;
use crate::recover::map::pieces::{Piece, Pieces};
use crate::recover::map::places::{Places, distance2};
use crate::recover::result::{Estimate, Status, stored_support};

/// Everything that an update of a slot reads.
pub(crate) struct Context<'a, const D: usize, P> {
    pub(crate) pieces: &'a P,
    pub(crate) graph: &'a Graph,
    pub(crate) places: &'a Places<D>,
    pub(crate) density: &'a Density<D>,
    pub(crate) neighbors: &'a NeighborDistribution,
    /// Per class, as in [`Odds`].
    pub(crate) odds: &'a [(f32, f32); CLASSES],
    /// Within this many local widths estimates enter the refined position.
    pub(crate) kernel: f32,
    pub(crate) delta2: f32,
}

/// Estimates farther from a piece than this many radii of the distribution say nothing about it.
pub(super) const TUBE: f32 = 6.0;
/// Estimates within this many radii of the distribution of the center of a ray are near all of its rays. They would
/// draw others there, as nothing tells them apart.
const BLIND: f32 = 3.0;
/// Candidates looked at per piece: about as many as hold so many true neighbors' estimates,
const TRUE_CANDIDATES: f32 = 5.0;
/// but so many at least and at most.
const CANDIDATES: (f32, f32) = (8.0, 16.0);
/// Records decide between the best candidates that lie within this many nats of each other.
const DOUBT: f32 = 8.0;
/// The share of neighbors whose estimate is taken to be wrong though their record is near: what a record may still add.
const ASTRAY: f32 = 0.2;
/// The weight of the density prior: candidates are estimates, which lie where density is large as it is.
const PRIOR: f32 = 0.5;

/// So many places (8 MB) stay in the cache: no memory is asked for ahead.
const CACHED: usize = 1 << 19;

/// A position that could win.
#[derive(Clone, Copy, Debug)]
struct Candidate<const D: usize> {
    x: [f32; D],
    piece: usize,
    score: f32,
    prior: f32,
}

/// Places that could win, with the distribution there, in columns.
#[derive(Debug)]
struct Tried<const D: usize> {
    x: [Vec<f32>; D],
    cell: Vec<u32>,
    density: Vec<f32>,
    gain: Vec<f32>,
    inverse_a2: Vec<f32>,
    prior: Vec<f32>,
}

impl<const D: usize> Default for Tried<D> {
    fn default() -> Self {
        let new = Vec::new;
        let x = std::array::from_fn(|_| new());
        Self { x, cell: Vec::new(), density: new(), gain: new(), inverse_a2: new(), prior: new() }
    }
}

impl<const D: usize> Tried<D> {
    #[inline(always)]
    fn clear(&mut self) {
        self.x.iter_mut().for_each(Vec::clear);
    }

    #[inline(always)]
    fn push(&mut self, x: &[f32; D]) {
        for (column, x) in self.x.iter_mut().zip(x) {
            column.push(*x);
        }
    }

    /// Looks up density and law.
    #[inline(always)]
    fn weigh<P: Pieces<D>>(&mut self, context: &Context<'_, D, P>) {
        let n = self.x[0].len();
        self.cell.resize(n, 0);
        let Self { x, cell, density, gain, inverse_a2, prior } = self;
        for column in [&mut *density, &mut *gain, &mut *inverse_a2, &mut *prior] {
            column.resize(n, 0.0);
        }
        context.density.at_each(&x.each_ref().map(|column| &column[..]), cell, density);
        let (density, gain, inverse_a2, prior) =
            (&density[..n], &mut gain[..n], &mut inverse_a2[..n], &mut prior[..n]);
        for i in 0..n {
            (gain[i], inverse_a2[i]) = context.distribution_where(density[i]);
            prior[i] = PRIOR * ln(density[i]);
        }
    }
}

/// Buffers of one thread.
#[derive(Debug)]
pub(crate) struct Scratch<const D: usize> {
    all: Ends<D>,
    near: [Columns<D>; D],
    directions: Directions<D>,
    tried: Tried<D>,
    best: Vec<Candidate<D>>,
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        let near = std::array::from_fn(|_| Columns::default());
        Self {
            all: Ends::default(),
            near,
            directions: std::array::from_fn(|_| Vec::new()),
            tried: Tried::default(),
            best: Vec::new(),
        }
    }
}

impl<const D: usize, P: Pieces<D>> Context<'_, D, P> {
    /// Brings the places near that [`solve`](Self::solve) looks at.
    #[inline(always)]
    pub(crate) fn prefetch(&self, slot: usize) {
        if self.places.len() <= CACHED {
            return;
        }
        // The other slot of a record lies beside the one that is named.
        self.graph.of(slot).0.iter().for_each(|&end| self.places.prefetch(end as usize));
    }

    /// The new estimate of `slot`, and how many nats its place is ahead of the best one elsewhere; the
    /// old estimate when no neighbor says anything.
    #[inline(always)]
    pub(crate) fn solve(
        &self,
        slot: usize,
        old: &Estimate<D>,
        scratch: &mut Scratch<D>,
    ) -> (Estimate<D>, f32) {
        scratch.best.clear();
        scratch.all.gather(self.graph.of(slot), self.places, self.pieces.slots_per_record());
        let (reach, blind) = (TUBE * self.neighbors.radius, BLIND * self.neighbors.radius);
        let odds = self.odds(slot);
        for piece in 0..P::PER_SLOT {
            let own = self.pieces.piece(slot, piece);
            scratch.all.near(&own, reach, blind, &odds, &mut scratch.near[piece]);
            self.consider(&own, (slot, piece), old, scratch);
        }
        let Some((first, ahead)) = self.winner(slot, &scratch.best) else {
            return (*old, 0.0);
        };
        let own = self.pieces.piece(slot, first.piece);
        let near = &mut scratch.near[first.piece];
        if near.len() == 0 {
            return (*old, 0.0);
        }
        let at = |x: &[f32; D]| {
            let density = self.density.at(x);
            let kernel = self.kernel * self.density.width(density);
            let doubt = P::DOUBT * (1.0 + self.neighbors.region / self.volume(density) / density);
            (1.0 / (kernel * kernel), self.distribution_where(density), doubt)
        };
        let near = (near, &mut scratch.directions);
        let (x, support) = refined(self.pieces, self.places, &own, near, first.x, at);
        if !x.iter().all(|c| c.is_finite()) {
            return (*old, 0.0);
        }
        let estimate = Estimate {
            position: x,
            status: Status::Ok,
            support: stored_support(support),
            axis: first.piece as u8,
            evidence: (first.score - first.prior).max(0.0),
        };
        (estimate, ahead)
    }

    /// The odds of the edges of `slot`.
    #[inline(always)]
    fn odds(&self, slot: usize) -> Odds<'_, D> {
        let other = slot ^ 1;
        let has_partner = self.pieces.slots_per_record() == 2 && self.places.is_known(other);
        let partner = if has_partner { self.places.of(other) } else { [0.0; D] };
        let (gain, inverse_a2) =
            if has_partner { self.distribution_at(&partner) } else { (0.0, 0.0) };
        Odds { of_class: self.odds, partner, gain, inverse_a2 }
    }

    /// The law at `x`: the gain of an estimate on the spot, and `1 / a^2`.
    #[inline(always)]
    fn distribution_at(&self, x: &[f32; D]) -> (f32, f32) {
        self.distribution_where(self.density.at(x))
    }

    #[inline(always)]
    fn distribution_where(&self, density: f32) -> (f32, f32) {
        let width = self.density.width(density);
        let gain = self.neighbors.center / (self.volume(density) * density);
        (gain, self.neighbors.inverse_a2 / (width * width))
    }

    /// The volume of a cube of the local width.
    #[inline(always)]
    fn volume(&self, density: f32) -> f32 {
        let width = self.density.width(density);
        let mut volume = 1.0;
        for _ in 0..D {
            volume *= width;
        }
        volume
    }

    /// Adds the candidates of one piece to the best: neighbors' estimates, and the old one.
    #[inline(always)]
    fn consider(
        &self,
        own: &Piece<D>,
        (slot, piece): (usize, usize),
        old: &Estimate<D>,
        scratch: &mut Scratch<D>,
    ) {
        let Scratch { all, near, tried, best, .. } = scratch;
        let near = &near[piece];
        tried.clear();
        let n_true = (self.neighbors.share * all.len() as f32).max(1.0);
        let most = TRUE_CANDIDATES / n_true * near.len() as f32;
        let step = near.len().div_ceil(most.clamp(CANDIDATES.0, CANDIDATES.1) as usize).max(1);
        for i in (0..near.len()).step_by(step) {
            tried.push(&own.project(&near.at(i)));
        }
        if old.status == Status::Ok && usize::from(old.axis) == piece {
            tried.push(&old.position);
        }
        tried.weigh(self);
        for i in 0..tried.density.len() {
            let x = std::array::from_fn(|c| tried.x[c][i]);
            let prior = tried.prior[i] + self.pieces.ln_spread(slot, &x);
            let (law, surplus) = ((tried.gain[i], tried.inverse_a2[i]), self.neighbors.surplus);
            let likelihood = match surplus < f32::INFINITY {
                true => near.two_sided(&x, law, surplus),
                false => near.log_likelihood(&x, law),
            };
            let score = prior + likelihood;
            best.push(Candidate { x, piece, score, prior });
        }
    }

    /// The likeliest candidate, and how far it is ahead of the best one elsewhere. Where others come
    /// close, records decide whose estimates are astray.
    #[inline(always)]
    fn winner(&self, slot: usize, candidates: &[Candidate<D>]) -> Option<(Candidate<D>, f32)> {
        let mut best = *candidates.first()?;
        for candidate in &candidates[1..] {
            if candidate.score > best.score {
                best = *candidate;
            }
        }
        let apart = 4.0 * self.neighbors.radius * self.neighbors.radius;
        let elsewhere = |c: &&Candidate<D>| distance2(&c.x, &best.x) > apart;
        let mut second: Option<Candidate<D>> = None;
        for candidate in candidates.iter().filter(elsewhere) {
            if second.is_none_or(|s| candidate.score > s.score) {
                second = Some(*candidate);
            }
        }
        let Some(second) = second else {
            return Some((best, best.score - best.prior));
        };
        let ahead = best.score - second.score;
        if ahead < DOUBT {
            let [of_best, of_second] = self.by_records(slot, [best.x, second.x]);
            if second.score + of_second > best.score + of_best {
                return Some((second, 0.0));
            }
        }
        Some((best, ahead))
    }

    /// What records near two places add where their estimates are elsewhere.
    #[inline(always)]
    fn by_records(&self, slot: usize, x: [[f32; D]; 2]) -> [f32; 2] {
        let slots_per_record = self.pieces.slots_per_record();
        let at = x.map(|x| (self.distribution_at(&x), self.pieces.record_chance(slot, &x)));
        let (ends, class) = self.graph.of(slot);
        let mut sums = [0.0; 2];
        for (&end, &class) in ends.iter().zip(class) {
            let record = record_of(end as usize, slots_per_record);
            if !self.pieces.may_vote(slot, record) {
                continue;
            }
            for (i, x) in x.iter().enumerate() {
                if self.pieces.record_distance2(record, x) > self.delta2 {
                    continue;
                }
                let ((gain, inverse_a2), chance) = at[i];
                let odds = self.neighbors.odds[usize::from(class)];
                let either = either(class, slots_per_record);
                let q = 1.0 / (1.0 + self.places.nearest(end, either, x).0 * inverse_a2);
                let by_estimate = 1.0 + odds * gain * q * q * q;
                sums[i] += ln(1.0 + ASTRAY * odds / chance / by_estimate);
            }
        }
        sums
    }
}
