//! Ranking: positions under which the whole lists are likeliest, not only their entries (docs/decisions/attack.md).
//!
//! A list of the K nearest also says which records are *not* among them. For a slot `i` at `x`, let `R_i` be the distance to the K-th
//! nearest estimate, corrected at each place by the number of estimates within it, and `d` the distance to the estimate of record `j`. Then
//!
//! `P(j is in the list of i) = In f(d / R_i) + q (1 - f(d / R_i))`, with `f(u) = 1 / (1 + exp((u^2 - 1) / (2 s)))` and
//! `q = (1 - In) K / n`.
//!
//! The log-likelihood of slot `i` is the sum of `ln P` over its list and over the slots that list its record, and of `ln(1 - P)` over the
//! others nearby. Each iteration moves even, then odd slots along their records to the likeliest of some places.
//!
//! Each likelihood is divided by that of a far estimate, so only those within a few `R_i` count. Eight places are scored at a time.

use crate::geometry::knn::Knn;
use crate::geometry::vector::squared_distance;
use crate::neighbors::Neighborhoods;
use crate::recover::map::{
    Candidate, Columns, Family, LANES, Lanes, Step, along_curve, distance2, evenly, known, ln,
    nearest2, record_of, solve_slots,
};
use crate::recover::problem::Problem;
use crate::recover::result::Estimate;
use crate::seed::{Draws, Stage};

const ITERATIONS: usize = 5;
const SOFTNESS: f32 = 0.06;
/// Radii rarely grow by more in an iteration; larger ones take longer to find.
const GROWTH: f64 = 1.1;
/// Number of iterations that search far; the others search near.
const FAR_ITERATIONS: usize = 2;
/// Estimates within this many radii are compared with a list.
const NEAR: f32 = 1.6;
/// Steps along the record, in radii.
const LINE_STEPS: [Lanes; 2] = [
    [0.0, 0.5, -0.5, 0.21, -0.21, 0.09, -0.09, 0.04],
    [0.12, -0.12, 0.05, -0.05, 0.022, -0.022, 0.01, -0.01],
];
const NEAR_LINE_STEPS: [Lanes; 1] = [[0.0, 0.2, -0.2, 0.08, -0.08, 0.03, -0.03, 0.012]];
const PLANE_STEPS: [Lanes; 4] = [
    [0.0, 0.5, -0.5, 0.25, -0.25, 0.12, -0.12, 0.05],
    [0.3, -0.3, 0.15, -0.15, 0.07, -0.07, 0.03, -0.03],
    [0.12, -0.12, 0.06, -0.06, 0.03, -0.03, 0.015, -0.015],
    [0.12, -0.12, 0.06, -0.06, 0.03, -0.03, 0.015, -0.015],
];
/// Listed records near which the first iteration tries places, above this inlier ratio: below it, such places win by chance too often.
const ELSEWHERE: usize = 8;
/// Steps from such a place, in radii.
const ELSEWHERE_STEPS: Lanes = [0.0, 0.1, -0.1, 0.2, -0.2, 0.4, -0.4, 0.6];
/// These places are tried for slots with several pieces, or with less than this fraction of the expected estimates nearby.
const LOST: f32 = 0.85;
const LEAST_ELSEWHERE: f32 = 0.5;
/// Bounds of the number of estimates within the radius, as a fraction of K. Far from the center, only a part of them is counted.
const RATIO: (f32, f32) = (0.8, 1.25);
/// Listed records within this many `R_i` count as true neighbors when the inlier ratio is estimated.
const REACH: f32 = 1.3;
/// If this many times as many listed records are within [`FARTHER`] radii as within [`REACH`], wrong entries are near, too, and what is not
/// listed says little. RedKitchen with `near` noise has 1.7 times as many at an inlier ratio of 0.3, where ranking gains, and 2.1 at 0.2,
/// where it loses; with `uniform` noise 1.2.
const MOST_FARTHER: f32 = 1.9;
const FARTHER: f32 = 2.0;
/// Bounds of the inlier ratio. No list is taken to be perfect, because estimates are not.
const INLIER_RATIO: (f32, f32) = (0.05, 0.98);
/// Maps with fewer slots than this many lists keep the estimates of joint recovery.
const LEAST_LISTS: f32 = 4.0;
/// Below this inlier ratio, the estimates of joint recovery are kept: Castle at 0.1 would lose up to 4 points within 1.0.
const LEAST_RATIO: f32 = 0.15;
/// The limit for lists with scores: sources leave out near points, too (docs/decisions/tried.md).
const LEAST_RATIO_OF_SOURCES: f32 = 0.75;

/// Returns the estimates of all slots after ranking from `start`, or `None` if what lists do not name says too little.
pub(super) fn recover<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    start: &[Estimate<D>],
) -> Option<Vec<Estimate<D>>> {
    let (lists, n) = (problem.lists, start.len());
    let mean_length = lists.records().len() as f32 / n.max(1) as f32;
    if (n as f32) < LEAST_LISTS * mean_length {
        return None;
    }
    let mut estimates = start.to_vec();
    let least_ratio = lists.scores().map_or(LEAST_RATIO, |_| LEAST_RATIO_OF_SOURCES);
    let mut radius = Vec::new();
    for iteration in 0..ITERATIONS {
        for half in 0..2 {
            let (slots, points) = known(&estimates);
            let tree = Knn::new(&points).ok()?;
            if half == 0 {
                radius = radii(&tree, &slots, lists, &radius);
            }
            let [near, farther] = shares_within(problem, &estimates, &radius);
            let inlier_ratio = near.clamp(INLIER_RATIO.0, INLIER_RATIO.1);
            if half == 0 && (inlier_ratio < least_ratio || farther > MOST_FARTHER * near) {
                return (iteration > 0).then_some(estimates);
            }
            let entry = |&row: &u32| {
                let slot = slots[row as usize];
                let radius = radius[slot as usize];
                let inverse = if radius > 0.0 { STEEPNESS / (radius * radius) } else { 0.0 };
                TreeEntry { x: estimates[slot as usize].position, slot, inverse }
            };
            let entries: Vec<TreeEntry<D>> = tree.rows.iter().map(entry).collect();
            // The chance that a wrong entry is a given record.
            let q = (1.0 - inlier_ratio) * (mean_length / n as f32);
            let context = Context {
                problem,
                estimates: &estimates,
                tree: &tree,
                entries: &entries,
                radius: &radius,
                odds: [(1.0 - inlier_ratio) / (1.0 - q), (inlier_ratio / q).min(LARGEST)],
                inlier_ratio,
                iteration,
            };
            let mut moving = along_curve(&estimates);
            moving.retain(|&slot| slot % 2 == half && radius[slot] > 0.0);
            let moved = solve_slots(&context, &moving);
            for (slot, Candidate { x, piece, .. }) in moving.into_iter().zip(moved) {
                if x.iter().all(|x| x.is_finite()) {
                    let estimate = &mut estimates[slot];
                    (estimate.position, estimate.axis) = (x, piece as u8);
                }
            }
        }
    }
    Some(estimates)
}

/// Returns, per slot, the distance within which as many estimates (those of `slots`) lie as its list is long; else 0. Distances
/// `before` the last moves, if any, show where to search.
fn radii<const D: usize>(
    tree: &Knn<'_, D>,
    slots: &[u32],
    lists: &Neighborhoods,
    before: &[f32],
) -> Vec<f32> {
    let within = |row: usize| {
        let slot = slots[row] as usize;
        let reach = GROWTH * f64::from(before.get(slot).copied().unwrap_or(0.0));
        (lists.of(slot).len(), reach * reach)
    };
    let last = |_, found: &[(f64, u32)]| found.last().map_or(0.0, |last| last.0.sqrt() as f32);
    let found = tree.per_row_within(within, last);
    let mut radius = vec![0.0; lists.n_slots()];
    slots.iter().zip(found).for_each(|(&slot, found)| radius[slot as usize] = found);
    radius
}

/// Returns the fraction of listed records within [`REACH`] radii, which is about the inlier ratio, and within [`FARTHER`] radii.
fn shares_within<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    estimates: &[Estimate<D>],
    radius: &[f32],
) -> [f32; 2] {
    let (mut within, mut all) = ([0; 2], 0);
    for slot in evenly(estimates.len(), 1 << 12).filter(|&slot| radius[slot] > 0.0) {
        for target in problem.lists.targets(slot) {
            let ends = problem.graph.slots_of(target);
            let nearest = nearest2(estimates, ends, &estimates[slot].position);
            let is_within = |times: f32| usize::from(nearest < (times * radius[slot]).powi(2));
            within = [within[0] + is_within(REACH), within[1] + is_within(FARTHER)];
            all += 1;
        }
    }
    within.map(|count| count as f32 / all.max(1) as f32)
}

/// Largest value of `exp`, and of an odds ratio: products of four are finite.
const LARGEST: f32 = (1 << 28) as f32;
/// `1 / (2 s)` in powers of two.
const STEEPNESS: f32 = std::f32::consts::LOG2_E / (2.0 * SOFTNESS);

/// Returns about `exp((v - 1) / (2 s))`, where `y` is `v` times [`STEEPNESS`], to 6 %: exact at powers of two, linear between.
#[inline(always)]
fn exponential(y: f32) -> f32 {
    // In [512, 1024), the last 23 bits of a number count units of 2^-14. Moved by 9, the lowest of its integer bits is that of an exponent.
    const ZERO: f32 = 512.0 + 127.0;
    f32::from_bits((y + (ZERO - STEEPNESS)).min(ZERO + 28.0).to_bits() << 9)
}

/// The estimates near a place, which are the terms of the log-likelihood of a slot there, with buffers.
#[derive(Default)]
struct Terms<const D: usize> {
    /// The targets that the slot lists, and the slots that list it, or its record.
    listed: Vec<bool>,
    lists: Vec<bool>,
    /// Radius at the center, and the number of estimates within it.
    radius: f32,
    length: f32,
    away: Columns<D>,
    terms: Vec<Term>,
    /// Per term, its squared distance to a place, and twice its component along a direction.
    aimed: Vec<[f32; 2]>,
}

/// What the likelihood reads of an estimate. In the tree's order, near estimates are near in memory.
struct TreeEntry<const D: usize> {
    x: [f32; D],
    slot: u32,
    /// `1 / R^2` in steps of steepness; 0 without a list.
    inverse: f32,
}

/// What the estimate of one other slot contributes.
#[derive(Clone, Copy)]
struct Term {
    /// `1 / R^2` in steps of steepness.
    inverse: f32,
    /// Odds of the estimate as a neighbor of the slot, and of the slot as a neighbor of it.
    own: f32,
    theirs: f32,
    /// Squared distance to the other slot of the own record, which explains the entry if it is nearer; else infinite.
    most: f32,
}

/// A term without effect, and its distance from the center.
const NOTHING: (Term, f32) =
    (Term { inverse: 0.0, own: 1.0, theirs: 1.0, most: f32::INFINITY }, 1e18);

impl<const D: usize> Terms<D> {
    /// Returns the log-likelihoods of the places `from + t * direction` at some `t`. `from` is relative to the center.
    #[inline(always)]
    fn scores(&mut self, from: &[f32; D], direction: &[f32; D], t: &Lanes) -> Lanes {
        let n = self.terms.len();
        self.aimed.resize(n, [0.0; 2]);
        let (away, aimed) = (self.away.first(n), &mut self.aimed[..n]);
        for i in 0..n {
            let (mut s, mut a) = (0.0, 0.0);
            for c in 0..D {
                let d = away[c][i] - from[c];
                s += d * d;
                a += d * direction[c];
            }
            aimed[i] = [s, 2.0 * a];
        }
        let length2 = distance2(direction, &[0.0; D]);
        let t2: Lanes = t.map(|t| t * t * length2);
        let radius2 = self.radius * self.radius;
        let mut counts = [0u32; LANES];
        for &[squared, along] in &self.aimed {
            for w in 0..LANES {
                let d2 = squared + (t2[w] - t[w] * along);
                counts[w] += u32::from(d2 < radius2);
            }
        }
        // Points are on surfaces, so their number grows with the square of the radius.
        let scale = counts.map(|count| {
            let ratio = (count as f32 / self.length).clamp(RATIO.0, RATIO.1);
            STEEPNESS / radius2 * ratio
        });
        let mut sums = [0.0; LANES];
        let aimed = self.aimed.as_chunks::<2>().0;
        let terms = self.terms.as_chunks::<2>().0;
        for (aimed, terms) in aimed.iter().zip(terms) {
            let (mut above, mut under) = ([1.0f32; LANES], [1.0f32; LANES]);
            for ([squared, along], Term { inverse, own, theirs, most }) in aimed.iter().zip(terms) {
                for w in 0..LANES {
                    let d2 = squared + (t2[w] - t[w] * along);
                    let mine = exponential(d2 * scale[w]);
                    let other = exponential(d2.min(*most) * inverse);
                    above[w] *= (own + mine) * (theirs + other);
                    under[w] *= (1.0 + mine) * (1.0 + other);
                }
            }
            for w in 0..LANES {
                sums[w] += ln(above[w] / under[w]);
            }
        }
        sums
    }
}

struct Context<'a, const D: usize, F: Family<D>> {
    problem: &'a Problem<'a, D, F>,
    estimates: &'a [Estimate<D>],
    tree: &'a Knn<'a, D>,
    /// In the tree's order.
    entries: &'a [TreeEntry<D>],
    radius: &'a [f32],
    /// Likelihood ratios of records that are surely within the radius, against records far outside: of one that is no entry, and of an entry.
    odds: [f32; 2],
    inlier_ratio: f32,
    iteration: usize,
}

impl<const D: usize, F: Family<D>> Step for Context<'_, D, F> {
    type Scratch = Terms<D>;
    type Output = Candidate<D>;

    /// Returns the likeliest of some places on the record of `slot`.
    #[inline(always)]
    fn solve(&self, slot: usize, terms: &mut Terms<D>) -> Candidate<D> {
        let old = self.estimates[slot];
        let item = (slot * ITERATIONS + self.iteration) as u64;
        let mut draws = Draws::new(self.problem.seed, Stage::Ranking, item);
        let n_near = self.collect(slot, slot, terms);
        let expected = self.inlier_ratio * self.problem.lists.of(slot).len() as f32;
        let is_lost = (n_near as f32) < LOST * expected;
        let piece = usize::from(old.axis);
        let mut best = Candidate { score: f32::NEG_INFINITY, x: old.position, piece };
        let rounds: &[Lanes] = match F::IS_PLANE {
            true => &PLANE_STEPS,
            false if self.iteration < FAR_ITERATIONS => &LINE_STEPS,
            false => &NEAR_LINE_STEPS,
        };
        for steps in rounds {
            self.search(slot, (&old.position, best), steps, &mut draws, terms, &mut best);
        }
        let tries_elsewhere = self.iteration == 0 && self.inlier_ratio > LEAST_ELSEWHERE;
        if tries_elsewhere && (is_lost || F::PIECES > 1) {
            self.try_elsewhere(slot, &mut best, terms);
        }
        best
    }
}

impl<const D: usize, F: Family<D>> Context<'_, D, F> {
    /// Searches in `steps` from a place; `terms` are around `center`.
    #[inline(always)]
    fn search(
        &self,
        slot: usize,
        (center, from): (&[f32; D], Candidate<D>),
        steps: &Lanes,
        draws: &mut Draws,
        terms: &mut Terms<D>,
        best: &mut Candidate<D>,
    ) {
        let Candidate { x: from, piece: number, .. } = from;
        let piece = self.problem.family.piece(slot, number);
        let radius = terms.radius;
        let direction: [f32; D] = match F::IS_PLANE {
            true => {
                let random: [f32; D] =
                    std::array::from_fn(|c| from[c] + draws.between(-1.0, 1.0) as f32 * radius);
                let to = piece.project(&random);
                let away: [f32; D] = std::array::from_fn(|c| to[c] - from[c]);
                let length = distance2(&away, &[0.0; D]).sqrt().max(f32::MIN_POSITIVE);
                away.map(|x| x / length)
            }
            false => piece.direction,
        };
        let size = radius * draws.between(0.75, 1.25) as f32;
        let length2 = distance2(&direction, &[0.0; D]);
        let places: [[f32; D]; LANES] = std::array::from_fn(|w| {
            piece.project(&std::array::from_fn(|c| from[c] + size * steps[w] * direction[c]))
        });
        let t: Lanes = std::array::from_fn(|w| {
            (0..D).map(|c| (places[w][c] - from[c]) * direction[c]).sum::<f32>() / length2
        });
        let relative = std::array::from_fn(|c| from[c] - center[c]);
        let scores = terms.scores(&relative, &direction, &t);
        for w in 0..LANES {
            if scores[w] > best.score {
                let x = if steps[w] == 0.0 { from } else { places[w] };
                *best = Candidate { score: scores[w], x, piece: number };
            }
        }
    }

    #[inline(never)]
    fn try_elsewhere(&self, slot: usize, best: &mut Candidate<D>, terms: &mut Terms<D>) {
        let Problem { family, lists, graph, seed, .. } = self.problem;
        let n_listed = lists.of(slot).len();
        let mut draws = Draws::new(*seed, Stage::Ranking, u64::MAX - slot as u64);
        for at in evenly(n_listed, ELSEWHERE) {
            for center in graph.slots_of(lists.target(slot, at)) {
                let (x, radius) = (self.estimates[center].position, self.radius[center]);
                if !family.is_near(slot, &x, radius * radius) {
                    continue;
                }
                self.collect(slot, center, terms);
                for piece in 0..F::PIECES {
                    let near = family.piece(slot, piece).project(&x);
                    if distance2(&near, &x) < radius * radius {
                        let from = Candidate { score: 0.0, x: near, piece };
                        self.search(slot, (&x, from), &ELSEWHERE_STEPS, &mut draws, terms, best);
                    }
                }
            }
        }
    }

    /// Collects the terms of `slot` for places around the estimate of `center`; returns how many listed records are near.
    #[inline(always)]
    fn collect(&self, slot: usize, center: usize, terms: &mut Terms<D>) -> usize {
        let Self { problem: Problem { lists, graph, .. }, estimates, radius, odds, .. } = *self;
        let is_either = graph.slots_per_target == 2;
        let record = record_of(slot, graph.slots_per_record);
        let place = |slot: usize| &estimates[slot].position;
        let at = place(center);
        let mark = |terms: &mut Terms<D>, to: bool| {
            lists.targets(slot).for_each(|target| terms.listed[target] = to);
            let listers = graph.listers.of(record_of(slot, graph.slots_per_target));
            listers.iter().for_each(|&slot| terms.lists[slot as usize] = to);
        };
        terms.listed.resize(estimates.len(), false);
        terms.lists.resize(estimates.len(), false);
        mark(terms, true);
        terms.radius = radius[center];
        terms.length = lists.of(center).len() as f32;
        terms.terms.clear();
        terms.away.resize(0, 0.0);
        let partner = (is_either && estimates[slot ^ 1].is_known()).then(|| place(slot ^ 1));
        let reach = f64::from(NEAR * terms.radius);
        let (center, reach2) = (at.map(f64::from), reach * reach);
        let mut n_near = 0;
        self.tree.leaves(&center, reach2, |places| {
            for &TreeEntry { x, slot: other, inverse } in &self.entries[places] {
                let other = other as usize;
                let of = record_of(other, graph.slots_per_record);
                if of == record || squared_distance(&center, &x.map(f64::from)) > reach2 {
                    continue;
                }
                let is_listed = terms.listed[record_of(other, graph.slots_per_target)];
                // Of the two slots of a listed record, the nearer one is meant.
                let is_farther = is_listed && is_either && {
                    let (own, other_slot) = (distance2(&x, at), distance2(place(other ^ 1), at));
                    other_slot < own || (other_slot == own && other % 2 == 1)
                };
                n_near += usize::from(is_listed && !is_farther);
                let lists_slot = terms.lists[other];
                let most = partner.filter(|_| lists_slot).map(|partner| distance2(partner, &x));
                terms.terms.push(Term {
                    inverse,
                    own: if is_farther { 1.0 } else { odds[usize::from(is_listed)] },
                    theirs: if inverse > 0.0 { odds[usize::from(lists_slot)] } else { 1.0 },
                    most: most.unwrap_or(f32::INFINITY),
                });
                (0..D).for_each(|c| terms.away.0[c].push(x[c] - at[c]));
            }
        });
        // Terms count in pairs.
        if terms.terms.len() % 2 == 1 {
            terms.terms.push(NOTHING.0);
            terms.away.resize(terms.terms.len(), NOTHING.1);
        }
        mark(terms, false);
        n_near
    }
}
