//! The update of one slot in one iteration: propose candidates, score them, refine the best one.

use crate::recover::joint::neighbor_distribution::NeighborDistribution;
use crate::recover::joint::votes::{Ends, Near, Odds};
use crate::recover::map::{
    CLASSES, Candidate, Columns, Density, Family, LANES, Lanes, Piece, Step, distance2, ln,
    nearest2, record_of,
};
use crate::recover::problem::Problem;
use crate::recover::result::Estimate;

/// Candidates per piece are chosen so that about this many are estimates of true neighbors.
const TRUE_CANDIDATES: f32 = 5.0;
/// Bounds of that number; up to half as many are taken, evenly spaced among all.
const CANDIDATES: (f32, f32) = (8.0, 16.0);
/// If the scores of the best candidate and the best one elsewhere differ by less than this many nats, the records near them decide.
const TIE_MARGIN: f32 = 8.0;
/// Assumed fraction of true neighbors whose record passes near the point but whose estimate is wrong.
const WRONG_ESTIMATES: f32 = 0.2;
/// Weight of the density prior. It is below 1 because candidates are estimates, which already lie where density is large.
const PRIOR: f32 = 0.5;

pub(super) struct Context<'a, const D: usize, F: Family<D>> {
    pub(super) problem: &'a Problem<'a, D, F>,
    pub(super) estimates: &'a [Estimate<D>],
    pub(super) density: &'a Density<D>,
    pub(super) neighbors: &'a NeighborDistribution,
    /// Per class, the odds that an edge leads to a true neighbor of a slot.
    pub(super) odds: [f32; CLASSES],
}

#[derive(Default)]
pub(super) struct Scratch<const D: usize> {
    all: Ends<D>,
    near: Vec<Near<D>>,
    directions: Columns<D>,
    candidates: Vec<Candidate<D>>,
}

impl<const D: usize, F: Family<D>> Step for Context<'_, D, F> {
    type Scratch = Scratch<D>;
    type Output = (Estimate<D>, f32);

    /// Returns the new estimate of `slot`, and its margin: the lead over the best candidate elsewhere in nats; 0 to update it again.
    #[inline(always)]
    fn solve(&self, slot: usize, scratch: &mut Scratch<D>) -> (Estimate<D>, f32) {
        let old = &self.estimates[slot];
        let Problem { family, graph, .. } = *self.problem;
        scratch.candidates.clear();
        scratch.near.resize_with(F::PIECES, Near::default);
        scratch.all.gather(graph, slot, self.estimates);
        let (odds, radius) = (self.odds(slot), self.neighbors.radius);
        for piece in 0..F::PIECES {
            let own = family.piece(slot, piece);
            scratch.all.near(&own, radius, &odds, &mut scratch.near[piece]);
            self.propose(&own, (slot, piece), scratch);
        }
        let Some((first, margin)) = self.winner(slot, &scratch.candidates) else {
            return (*old, 0.0);
        };
        let near = &scratch.near[first.piece];
        if near.len() == 0 {
            return (*old, 0.0);
        }
        let own = family.piece(slot, first.piece);
        let (x, support) = self.least_squares(&own, (near, &mut scratch.directions), first.x);
        if !x.iter().all(|c| c.is_finite()) {
            return (*old, 0.0);
        }
        let evidence = (first.score - self.prior(slot, &first.x)).max(0.0);
        (Estimate::at(x, support, first.piece, evidence), margin)
    }
}

impl<const D: usize, F: Family<D>> Context<'_, D, F> {
    #[inline(always)]
    fn odds(&self, slot: usize) -> Odds<'_, D> {
        let is_paired = self.problem.graph.slots_per_target == 2;
        let partner = is_paired.then(|| self.estimates[slot ^ 1]).filter(Estimate::is_known);
        let partner = partner.map(|partner| {
            (partner.position, self.distribution(self.density.at(&partner.position)))
        });
        Odds { of_class: &self.odds, partner }
    }

    /// Returns the logarithm of the prior density at a place, up to a constant.
    #[inline(always)]
    fn prior(&self, slot: usize, x: &[f32; D]) -> f32 {
        PRIOR * ln(self.density.at(x)) + self.problem.family.ln_spread(slot, x)
    }

    /// Returns the distribution of neighbors at a place of this density: `gain = p_true(0) / p_random`, and `1 / a^2`.
    #[inline(always)]
    pub(super) fn distribution(&self, density: f32) -> (f32, f32) {
        let stretch = self.density.stretch(density);
        let volume: f32 = [stretch; D].iter().product();
        let gain = self.neighbors.density_at_zero / (volume * density);
        (gain, self.neighbors.inverse_a2 / (stretch * stretch))
    }

    /// Adds the candidates of one piece: projected estimates of neighbors, and the old estimate.
    #[inline(always)]
    fn propose(&self, own: &Piece<D>, (slot, piece): (usize, usize), scratch: &mut Scratch<D>) {
        let near = &scratch.near[piece];
        let n_true = (self.neighbors.fraction * scratch.all.len() as f32).max(1.0);
        let most = TRUE_CANDIDATES / n_true * near.len() as f32;
        let step = near.len().div_ceil(most.clamp(CANDIDATES.0, CANDIDATES.1) as usize).max(1);
        let estimates = (0..near.len()).step_by(step).map(|i| own.project(&near.at(i)));
        let old = Some(&self.estimates[slot]);
        let old = old.filter(|old| old.is_known() && usize::from(old.axis) == piece);
        let most_imbalance = self.neighbors.most_imbalance;
        for x in estimates.chain(old.map(|old| old.position)) {
            let distribution = self.distribution(self.density.at(&x));
            let likelihood = match most_imbalance < f32::INFINITY {
                true => near.balanced_log_likelihood(&x, distribution, most_imbalance),
                false => near.log_likelihood(&x, distribution),
            };
            let score = self.prior(slot, &x) + likelihood;
            scratch.candidates.push(Candidate { x, piece, score });
        }
    }

    /// Returns the best candidate and its margin. If the second best is close, the records decide between the two.
    #[inline(always)]
    fn winner(&self, slot: usize, candidates: &[Candidate<D>]) -> Option<(Candidate<D>, f32)> {
        // Of equal scores, the first one wins.
        let higher = |a: Candidate<D>, b: Candidate<D>| if b.score > a.score { b } else { a };
        let best = candidates.iter().copied().reduce(higher)?;
        let apart = 4.0 * self.neighbors.radius * self.neighbors.radius;
        let elsewhere = candidates.iter().filter(|c| distance2(&c.x, &best.x) > apart);
        let Some(second) = elsewhere.copied().reduce(higher) else {
            return Some((best, best.score - self.prior(slot, &best.x)));
        };
        let margin = best.score - second.score;
        if margin < TIE_MARGIN {
            let [of_best, of_second] = self.record_scores(slot, [best.x, second.x]);
            if second.score + of_second > best.score + of_best {
                return Some((second, 0.0));
            }
        }
        Some((best, margin))
    }

    /// Returns what records add to the scores of two places: records pass within delta, but their estimates may be elsewhere.
    #[inline(always)]
    fn record_scores(&self, slot: usize, x: [[f32; D]; 2]) -> [f32; 2] {
        let Problem { family, graph, delta, at_delta, .. } = self.problem;
        let at = x.map(|x| {
            (self.distribution(self.density.at(&x)), family.record_chance(slot, &x, at_delta))
        });
        let mut sums = [0.0; 2];
        for (end, class) in graph.of(slot) {
            let record = record_of(end, graph.slots_per_record);
            if !family.may_vote(slot, record) {
                continue;
            }
            for (i, x) in x.iter().enumerate() {
                if family.record_distance2(record, x) > delta * delta {
                    continue;
                }
                let ((gain, inverse_a2), chance) = at[i];
                let odds = self.neighbors.odds[usize::from(class)];
                let r2 = nearest2(self.estimates, graph.slots_at((end, class)), x);
                let q = 1.0 / (1.0 + r2 * inverse_a2);
                let by_estimate = 1.0 + odds * gain * q * q * q;
                sums[i] += ln(1.0 + WRONG_ESTIMATES * odds / chance / by_estimate);
            }
        }
        sums
    }
}

// The last step of an update: weighted least squares over the estimates of nearby neighbors.

/// Estimates within this many radii count, with less weight the farther they are.
const RADIUS: f32 = 3.75;
/// Number of least-squares steps. The second one recomputes the weights.
const STEPS: usize = 2;

/// Weighted sums over nearby neighbors, one per vector lane.
#[derive(Clone, Copy)]
struct Sums<const D: usize> {
    n: [u32; LANES],
    weight: Lanes,
    /// Differences to the place, and their components along the directions.
    pull: [Lanes; D],
    free_pull: [Lanes; D],
    /// Outer products of the directions; only the upper triangle is filled.
    free: [[Lanes; D]; D],
}

impl<const D: usize> Sums<D> {
    /// Sums over the neighbors of `near` within `1 / sqrt(inverse_reach2)` of `x`.
    #[inline(always)]
    fn new(
        near: &Near<D>,
        directions: &Columns<D>,
        x: &[f32; D],
        (inverse_reach2, (gain, inverse_a2), half_weight_ratio): (f32, (f32, f32), f32),
    ) -> Self {
        let (weight, pull) = ([0.0; LANES], [[0.0; LANES]; D]);
        let mut sums = Self { n: [0; LANES], weight, pull, free_pull: pull, free: [pull; D] };
        let odds = near.odds.as_chunks::<LANES>().0;
        let places: [&[Lanes]; D] =
            std::array::from_fn(|c| &near.x.0[c].as_chunks().0[..odds.len()]);
        let directions: [&[Lanes]; D] =
            std::array::from_fn(|c| &directions.0[c].as_chunks().0[..odds.len()]);
        for i in 0..odds.len() {
            for lane in 0..LANES {
                let away: [f32; D] = std::array::from_fn(|c| places[c][i][lane] - x[c]);
                let toward: [f32; D] = std::array::from_fn(|c| directions[c][i][lane]);
                let (mut r2, mut along) = (0.0, 0.0);
                for c in 0..D {
                    r2 += away[c] * away[c];
                    along += toward[c] * away[c];
                }
                let closeness = (1.0 - r2 * inverse_reach2).max(0.0);
                let q = 1.0 / (1.0 + r2 * inverse_a2);
                let likelier = odds[i][lane] * gain * (q * q * q);
                sums.n[lane] += u32::from(closeness > 0.0);
                // Estimates that are close by chance get less weight: on a small map half of all are close.
                let closeness = closeness * likelier / (half_weight_ratio + likelier);
                sums.weight[lane] += closeness;
                for r in 0..D {
                    let held = closeness * toward[r];
                    sums.pull[r][lane] += closeness * away[r];
                    sums.free_pull[r][lane] += held * along;
                    for (c, toward) in toward.iter().enumerate().skip(r) {
                        sums.free[r][c][lane] += held * toward;
                    }
                }
            }
        }
        sums
    }
}

impl<const D: usize, F: Family<D>> Context<'_, D, F> {
    /// Moves `x` along `own` by weighted least squares; returns the place and the number of records within reach.
    ///
    /// The residual of a neighbor is the difference to its estimate, with less weight along its own record. `directions` is a buffer.
    #[inline(always)]
    pub(super) fn least_squares(
        &self,
        own: &Piece<D>,
        (near, directions): (&Near<D>, &mut Columns<D>),
        mut x: [f32; D],
    ) -> ([f32; D], u32) {
        let Self { problem, estimates, density: field, neighbors, .. } = self;
        directions.fill(&near.slot, |&slot| {
            let piece = usize::from(estimates[slot as usize].axis);
            problem.family.piece(slot as usize, piece).direction
        });
        directions.resize(near.odds.len(), 0.0);
        let mut records = 0;
        for step_at in 1..=STEPS {
            let density = field.at(&x);
            let reach = RADIUS * neighbors.radius * field.stretch(density);
            let inverse_reach2 = 1.0 / (reach * reach);
            let weights = (inverse_reach2, self.distribution(density), F::HALF_WEIGHT_RATIO);
            let sums = Sums::new(near, directions, &x, weights);
            let n: u32 = sums.n.iter().sum();
            if step_at == STEPS {
                records = match problem.graph.slots_per_target {
                    1 => n,
                    _ => near.n_pairs(&x, inverse_reach2),
                };
            }
            x = own.project(&Self::step(own, &x, &sums, n));
        }
        (x, records)
    }

    /// Returns `x` plus the least-squares step along `own`, from the sums over `n` neighbors.
    #[inline(always)]
    fn step(own: &Piece<D>, x: &[f32; D], sums: &Sums<D>, n: u32) -> [f32; D] {
        let total = |lanes: &Lanes| lanes.iter().sum::<f32>();
        let weight = total(&sums.weight);
        let mut pull = sums.pull.map(|lanes| total(&lanes));
        // The component along a record: the direction of a line, or all but the normal of a plane.
        let (whole, sign) = if F::IS_PLANE { (1.0, -1.0) } else { (0.0, 1.0) };
        let free_fraction = 1.0 - F::MOST_ALONG.min(F::ALONG / n.max(1) as f32);
        let mut hold = [[0.0f32; D]; D];
        for (r, row) in hold.iter_mut().enumerate() {
            for (c, value) in row.iter_mut().enumerate() {
                let free = sign * total(&sums.free[r.min(c)][r.max(c)]);
                *value = -free_fraction * if r == c { free + whole * weight } else { free };
            }
            row[r] += weight;
            pull[r] -= free_fraction * (whole * pull[r] + sign * total(&sums.free_pull[r]));
        }
        // The step solves `hold step = pull` within the piece: P hold P + weight (1 - P). The component across is decoupled
        // and stays 0.
        let p = &own.along;
        let (mut half, mut full, mut right) = ([[0.0f32; D]; D], [[0.0f32; D]; D], [0.0f32; D]);
        for r in 0..D {
            for c in 0..D {
                for k in 0..D {
                    half[r][c] += p[r][k] * hold[k][c];
                }
                right[r] += p[r][c] * pull[c];
            }
        }
        for r in 0..D {
            for c in 0..D {
                for k in 0..D {
                    full[r][c] += half[r][k] * p[k][c];
                }
                full[r][c] -= weight * p[r][c];
            }
            full[r][r] += weight;
        }
        if !solve_symmetric(&mut full, &mut right) {
            return *x;
        }
        std::array::from_fn(|c| x[c] + right[c])
    }
}

/// Solves `a x = b` for a symmetric positive definite `a`; `b` becomes `x`. Returns `false` if `a` is singular.
#[inline(always)]
fn solve_symmetric<const D: usize>(a: &mut [[f32; D]; D], b: &mut [f32; D]) -> bool {
    for i in 0..D {
        if a[i][i] <= 0.0 || a[i][i].is_nan() {
            return false;
        }
        for r in i + 1..D {
            let f = a[r][i] / a[i][i];
            let pivot = a[i];
            for (value, p) in a[r].iter_mut().zip(&pivot).skip(i) {
                *value -= f * p;
            }
            b[r] -= f * b[i];
        }
    }
    for i in (0..D).rev() {
        for c in i + 1..D {
            b[i] -= a[i][c] * b[c];
        }
        b[i] /= a[i][i];
    }
    true
}
