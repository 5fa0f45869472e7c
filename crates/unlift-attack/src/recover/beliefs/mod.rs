//! Beliefs: a few places per slot, each with the probability that it is the right one.
//!
//! Records with similar descriptors list the same records, so that lists of a source often support several places. In an iteration it
//!
//! 1. learns, for each class `c` of edges, the likelihood ratio `L_c(u)` of an edge between points at distance `u` against one between
//!    points that are far apart (`tables`). The unit of `u` is a *width*, about the distance to the 50th nearest estimate
//!    (the 20th in images);
//! 2. learns the *temper*, an exponent below 1 for the evidence of edges that are wrong together (`temper`);
//! 3. proposes places on the record of each slot, and scores each place `x` by
//!    `temper * sum over edges j of ln(1 + sum over places y of j of w_y (L_c(|x - y|) - 1)) + 0.5 ln(0.05 + density(x)) + ln volume(x)`,
//!    in images without the density;
//! 4. refines the best place, and keeps the best ones with weights proportional to `exp(score)`.
//!
//! The volume element is `range^2` for rays; for paired lines, it is the mean squared distance to the places of the other point of the line,
//! because a line through a point is a ray from it; for axis candidates, it is the density of the values published on the exchanged axis.
//! The first iteration moves all slots, the others one of two random halves in turn.
//!
//! It is belief propagation with particles on the graph of lists (Ihler et al. 2005). Figures are in docs/decisions/tried.md.

mod tables;
mod temper;

use std::ops::Range;

use crate::geometry::knn::{Knn, LEAF};
use crate::geometry::vector::widen;
use crate::parallel;
use crate::recover::map::{
    Candidate, Family, Piece, Step, along_curve, distance2, evenly, known, ln, solve_slots, sorted,
    unit,
};
use crate::recover::problem::Problem;
use crate::recover::result::{Estimate, Status};
use crate::seed::{Draws, Stage};
use tables::{BIN_ENDS, Tables};

const ITERATIONS: usize = 5;
const PLACES: usize = 4;
/// A width is the distance to this neighbor, counted among all slots: in images, and in maps.
const WIDTH_NEIGHBOR: [usize; 2] = [20, 50];
/// Bounds of the width of a place, as a multiple of the typical width.
const WIDTHS: (f32, f32) = (0.3, 3.3);
/// Maps and images with fewer slots keep their estimates.
const LEAST_SLOTS: usize = 200;
/// Weight of an estimate of joint recovery: its least value, and what is added for the estimate with the most evidence.
const START_WEIGHT: (f32, f32) = (0.24, 0.36);
/// Weight of the density of places in the score, and the density of a place without neighbors.
const DENSITY_WEIGHT: f32 = 0.5;
const LEAST_DENSITY: f32 = 0.05;
/// Radius of the kernel of that density, in typical widths. The kernel `(1 - u^2)^4` is about a normal distribution of a third of a width.
const DENSITY_RADIUS: f32 = 0.91;
/// Largest number of candidates per slot, shared by the pieces of its feasible set, and the part of them that edges propose.
const CANDIDATES: usize = 40;
const OF_EDGES: f32 = 0.67;
/// An edge proposes a candidate if the squared distance of its place to the record is below this, in squared widths.
const NEAR2: f32 = 2.0;
/// Number of random places that are tried without an edge, and their largest squared distance to the record, in images and in maps.
const PROPOSALS: usize = 300;
const PROPOSAL_NEAR2: [f32; 2] = [0.3, 1.0];
/// Candidates are at least this far apart, in widths; kept places are farther apart than [`MERGED`] typical widths.
const APART: f32 = 0.25;
const MERGED: f32 = 0.3;
/// Distance to the other point of a line while that has no place, in typical widths.
const UNKNOWN_RANGE: f32 = 10.0;
/// Places of rays are at least this many typical widths away from their center, where all rays meet.
const LEAST_RANGE: f32 = 1.5;
/// The pattern search starts with this step, in typical widths, and ends below the second one, or after some changes of the step.
const STEPS: (f32, f32) = (0.35, 0.04);
const MAX_STEPS: usize = 15;
/// An estimate of joint recovery stays if this step moves it by less than this part of a typical width, plus the share of short edges.
const AGREED: f32 = 0.3;
/// Places with less weight are dropped.
const LEAST_WEIGHT: f32 = 1e-3;

/// Returns the estimates of all slots after beliefs from `start`; every edge leads to one slot. Without enough slots, they stay.
pub(super) fn recover<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    start: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    let mut estimates = start.clone();
    if start.iter().filter(|estimate| estimate.is_known()).count() < LEAST_SLOTS {
        return estimates;
    }
    let marginals = marginals(problem.family, start.len());
    let mut beliefs = first_beliefs(&start);
    let (mut typical, mut tables) = (None, None);
    for iteration in 0..ITERATIONS {
        let Some(places) = Places::new(&beliefs, &estimates, &mut typical) else {
            return estimates;
        };
        let learned = Tables::learn(problem, &places, tables.as_ref());
        let points: Vec<[f64; D]> = places.all.iter().map(|place| widen(&place.x)).collect();
        let Ok(tree) = Knn::new(&points) else { return estimates };
        let mut context = Context {
            problem,
            temper: 1.0,
            proposals: proposals(&places, problem.seed),
            places: &places,
            tables: &learned,
            crowd: Crowd::new(&places, &tree),
            marginals: &marginals,
        };
        context.temper = context.learn_temper();
        let mut slots = along_curve(&estimates);
        slots.retain(|&slot| {
            let mut draws = Draws::new(problem.seed, Stage::Beliefs, slot as u64);
            iteration == 0 || draws.below(2) as usize == iteration % 2
        });
        let updated = solve_slots(&context, &slots);
        for (slot, belief) in slots.into_iter().zip(updated) {
            if let Some(belief) = belief {
                let (estimate, best) = (&mut estimates[slot], belief[0]);
                (estimate.position, estimate.axis, estimate.status) =
                    (best.x, best.piece, Status::Ok);
                beliefs[slot] = belief;
            }
        }
        tables = Some(learned);
    }
    // Near its place, the least squares of joint recovery are more precise than this step, the farther the better the lists are.
    let typical = typical.unwrap_or(0.0);
    let agreed = ((AGREED + short_edges(problem, &estimates, typical)) * typical).powi(2);
    for (estimate, start) in estimates.iter_mut().zip(start) {
        if start.is_known() && distance2(&start.position, &estimate.position) < agreed {
            *estimate = start;
        }
    }
    estimates
}

/// Returns the share of edges whose ends are both known and less than `width` apart.
fn short_edges<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    estimates: &[Estimate<D>],
    width: f32,
) -> f32 {
    let (mut short, mut all) = (0, 0);
    for slot in evenly(estimates.len(), 1 << 12) {
        let place = &estimates[slot].position;
        for (end, _) in problem.graph.of(slot) {
            all += 1;
            short += u32::from(distance2(place, &estimates[end].position) < width * width);
        }
    }
    short as f32 / all.max(1) as f32
}

/// Returns the estimates of joint recovery as beliefs, weighted by the rank of their evidence.
fn first_beliefs<const D: usize>(estimates: &[Estimate<D>]) -> Vec<Vec<Place<D>>> {
    let mut order: Vec<usize> = (0..estimates.len()).collect();
    order.sort_by(|&a, &b| estimates[a].evidence.total_cmp(&estimates[b].evidence));
    let mut beliefs = vec![Vec::new(); estimates.len()];
    for (rank, slot) in order.into_iter().enumerate().filter(|&(_, s)| estimates[s].is_known()) {
        let Estimate { position: x, axis: piece, .. } = estimates[slot];
        let weight = START_WEIGHT.0 + START_WEIGHT.1 * rank as f32 / estimates.len() as f32;
        beliefs[slot].push(Place { x, piece, weight });
    }
    beliefs
}

/// A possible place of a slot, on a piece of its feasible set, and the probability that it is the right one.
#[derive(Clone, Copy, Debug)]
struct Place<const D: usize> {
    x: [f32; D],
    piece: u8,
    weight: f32,
}

/// The places of all slots, the one with the best score of each slot first.
struct Places<const D: usize> {
    all: Vec<Place<D>>,
    offsets: Vec<u32>,
    slot: Vec<u32>,
    width: Vec<f32>,
    /// The median width of the start, the unit of lengths that hold for the whole map.
    typical: f32,
}

impl<const D: usize> Places<D> {
    /// Measures the width at every place; `estimates` are the best ones. The first call sets `typical`. `None` if most places coincide.
    fn new(
        beliefs: &[Vec<Place<D>>],
        estimates: &[Estimate<D>],
        typical: &mut Option<f32>,
    ) -> Option<Self> {
        let mut all: Vec<Place<D>> = Vec::new();
        let (mut slot, mut offsets) = (Vec::new(), vec![0]);
        for (at, belief) in beliefs.iter().enumerate() {
            all.extend(belief);
            slot.resize(all.len(), at as u32);
            offsets.push(all.len() as u32);
        }
        let (_, best) = known(estimates);
        let tree = Knn::new(&best).ok()?;
        let k = (WIDTH_NEIGHBOR[D - 2] * best.len() / beliefs.len()).max(8) + 1;
        let measure = |near: &mut Vec<(f64, u32)>, at: usize| {
            tree.nearest_to(widen(&all[at].x), k, near);
            near.last().map_or(0.0, |last| last.0.sqrt() as f32)
        };
        let mut width = parallel::map_with(all.len(), Vec::new, measure);
        let firsts = offsets.windows(2).filter(|range| range[0] < range[1]);
        let mut of_best: Vec<f32> = firsts.map(|range| width[range[0] as usize]).collect();
        let middle = of_best.len() / 2;
        let median = *of_best.select_nth_unstable_by(middle, f32::total_cmp).1;
        let typical = *typical.get_or_insert(median);
        if !(median > 0.0 && typical.is_finite()) {
            return None;
        }
        width.iter_mut().for_each(|w| *w = (*w / median).clamp(WIDTHS.0, WIDTHS.1) * typical);
        Some(Self { all, offsets, slot, width, typical })
    }

    fn n_slots(&self) -> usize {
        self.offsets.len() - 1
    }

    fn of(&self, slot: usize) -> Range<usize> {
        self.offsets[slot] as usize..self.offsets[slot + 1] as usize
    }

    /// Returns the distance between two places, in widths of the second one.
    #[inline(always)]
    fn distance(&self, from: &[f32; D], to: usize) -> f32 {
        distance2(from, &self.all[to].x).sqrt() / self.width[to]
    }
}

/// Returns places that are likely right, in random order: what slots are near that no edge names.
fn proposals<const D: usize>(places: &Places<D>, seed: u64) -> Vec<[f32; D]> {
    let best = |slot: usize| Some((slot, places.all[places.of(slot)].first()?));
    let mut best: Vec<(usize, &Place<D>)> = (0..places.n_slots()).filter_map(best).collect();
    let mut weights: Vec<f32> = best.iter().map(|(_, place)| place.weight).collect();
    let low = 3 * weights.len() / 10;
    let least = *weights.select_nth_unstable_by(low, f32::total_cmp).1;
    best.retain(|(_, place)| place.weight >= least);
    best.sort_by_cached_key(|&(slot, _)| {
        Draws::new(seed, Stage::BeliefProposals, slot as u64).bits()
    });
    best.into_iter().map(|(_, place)| place.x).collect()
}

/// The volume element of axis candidates: per piece and slot, the logarithm of the density of values on the axis. Else empty.
fn marginals<const D: usize, F: Family<D>>(family: &F, n: usize) -> Vec<Vec<f32>> {
    if F::PIECES == 1 {
        return Vec::new();
    }
    let of_axis = |axis: usize| {
        let values: Vec<f32> = (0..n).map(|slot| family.piece(slot, axis).through[axis]).collect();
        let sorted = sorted(values.iter().copied());
        let around = (n / 200).max(20);
        let density = |value: &f32| {
            let at = sorted.partition_point(|x| x < value);
            let (low, high) = (at.saturating_sub(around), (at + around).min(n - 1));
            let length = (sorted[high] - sorted[low]).max(f32::MIN_POSITIVE);
            ln((high - low) as f32 / length)
        };
        values.iter().map(density).collect()
    };
    (0..F::PIECES).map(of_axis).collect()
}

/// All places in the order of the leaves of a search tree, in columns, padded by a leaf, so that loops run over vectors.
struct Crowd<'a, const D: usize> {
    tree: &'a Knn<'a, D>,
    x: [Vec<f32>; D],
    weight: Vec<f32>,
    slot: Vec<u32>,
}

impl<'a, const D: usize> Crowd<'a, D> {
    fn new(places: &Places<D>, tree: &'a Knn<'a, D>) -> Self {
        let order = || tree.rows.iter().map(|&at| at as usize);
        let padded = |of: &dyn Fn(usize) -> f32| -> Vec<f32> {
            order().map(of).chain([0.0; LEAF]).collect()
        };
        Self {
            tree,
            x: std::array::from_fn(|c| padded(&|at| places.all[at].x[c])),
            weight: padded(&|at| places.all[at].weight),
            slot: order().map(|at| places.slot[at]).chain([0; LEAF]).collect(),
        }
    }

    /// Returns the weighted number of places of other slots than `own` within the squared radius around `x`; `leaves` is a buffer.
    #[inline(always)]
    fn density(&self, own: u32, x: &[f32; D], radius2: f32, leaves: &mut Vec<Range<usize>>) -> f32 {
        leaves.clear();
        self.tree.leaves(&widen(x), f64::from(radius2), |places| leaves.push(places));
        let mut sum = 0.0;
        for places in leaves {
            for start in places.clone().step_by(LEAF) {
                let columns = self.x.each_ref().map(|column| leaf(column, start));
                let (weight, slot) = (leaf(&self.weight, start), leaf(&self.slot, start));
                // All terms before the sum, which cannot be vectorized.
                let mut terms = [0.0; LEAF];
                for at in 0..LEAF {
                    let mut d2 = 0.0;
                    for c in 0..D {
                        d2 += (columns[c][at] - x[c]) * (columns[c][at] - x[c]);
                    }
                    let closeness = (1.0 - d2 / radius2).max(0.0);
                    let square = closeness * closeness;
                    let weight = if slot[at] == own { 0.0 } else { weight[at] };
                    terms[at] = weight * (square * square);
                }
                for term in &terms[..LEAF.min(places.end - start)] {
                    sum += term;
                }
            }
        }
        sum
    }
}

#[inline(always)]
fn leaf<T>(column: &[T], start: usize) -> &[T; LEAF] {
    column[start..].first_chunk().expect("columns are padded")
}

struct Context<'a, const D: usize, F: Family<D>> {
    problem: &'a Problem<'a, D, F>,
    places: &'a Places<D>,
    tables: &'a Tables,
    temper: f32,
    proposals: Vec<[f32; D]>,
    crowd: Crowd<'a, D>,
    marginals: &'a [Vec<f32>],
}

/// The place of a neighbor that is near a piece of the own feasible set.
#[derive(Clone, Copy)]
struct Near<const D: usize> {
    x: [f32; D],
    weight: f32,
    inverse_width: f32,
    class: u8,
    /// Whether the next place belongs to the same edge.
    goes_on: bool,
}

/// Buffers of one thread: per piece, the places of neighbors that are near it, and the candidates.
#[derive(Default)]
struct Scratch<const D: usize> {
    near: Vec<Vec<Near<D>>>,
    candidates: Vec<Candidate<D>>,
    leaves: Vec<Range<usize>>,
}

impl<const D: usize, F: Family<D>> Step for Context<'_, D, F> {
    type Scratch = Scratch<D>;
    type Output = Option<Vec<Place<D>>>;

    /// Returns the new places of `slot`, the best one first; `None` if there is no candidate.
    #[inline(always)]
    fn solve(&self, slot: usize, scratch: &mut Scratch<D>) -> Option<Vec<Place<D>>> {
        scratch.near.resize_with(F::PIECES, Vec::new);
        scratch.candidates.clear();
        for piece in 0..F::PIECES {
            self.propose(slot, piece, scratch);
        }
        for place in &self.places.all[self.places.of(slot)] {
            let piece = usize::from(place.piece);
            scratch.candidates.push(Candidate { x: place.x, piece, score: 0.0 });
        }
        let mut best = 0;
        for at in 0..scratch.candidates.len() {
            let Candidate { x, piece, .. } = scratch.candidates[at];
            let score = self.score(slot, piece, &x, scratch);
            scratch.candidates[at].score = score;
            if score > scratch.candidates[best].score {
                best = at;
            }
        }
        let refined = self.refine(slot, *scratch.candidates.get(best)?, scratch);
        scratch.candidates.push(refined);
        Some(self.kept(&mut scratch.candidates, refined.score))
    }
}

impl<const D: usize, F: Family<D>> Context<'_, D, F> {
    /// Collects the places of neighbors that are near a piece, and adds candidates on it.
    #[inline(always)]
    fn propose(&self, slot: usize, piece: usize, scratch: &mut Scratch<D>) {
        let Self { problem: Problem { family, graph, seed, .. }, places, .. } = self;
        let (near, candidates) = (&mut scratch.near[piece], &mut scratch.candidates);
        let own = family.piece(slot, piece);
        let first = candidates.len();
        let room = CANDIDATES / F::PIECES;
        let of_edges = (room as f32 * OF_EDGES) as usize;
        near.clear();
        for (end, class) in graph.of(slot) {
            let from = near.len();
            for at in places.of(end) {
                let (Place { x: y, weight, .. }, width) = (places.all[at], places.width[at]);
                let x = own.project(&y);
                let d2 = distance2(&x, &y);
                if d2 >= BIN_ENDS.1 * BIN_ENDS.1 * width * width || self.is_at_center(&own, &y) {
                    continue;
                }
                near.push(Near { x: y, weight, inverse_width: 1.0 / width, class, goes_on: true });
                if candidates.len() - first < of_edges && d2 < NEAR2 * width * width {
                    let new = Candidate { x, piece, score: 0.0 };
                    Self::add(candidates, first, new, APART * width);
                }
            }
            if let Some(last) = near[from..].last_mut() {
                last.goes_on = false;
            }
        }
        let item = (slot * F::PIECES + piece) as u64;
        let mut draws = Draws::new(*seed, Stage::BeliefProposals, !item);
        let start = draws.below(self.proposals.len() as u64) as usize;
        let (before, after) = self.proposals.split_at(start);
        let typical = places.typical;
        for y in after.iter().chain(before).take(PROPOSALS) {
            if candidates.len() - first >= room {
                break;
            }
            let x = own.project(y);
            if distance2(&x, y) < PROPOSAL_NEAR2[D - 2] * typical * typical
                && !self.is_at_center(&own, &x)
            {
                let new = Candidate { x, piece, score: 0.0 };
                Self::add(candidates, first, new, APART * typical);
            }
        }
    }

    /// Adds a candidate unless one of the same piece, from index `first` on, is close.
    #[inline(always)]
    fn add(candidates: &mut Vec<Candidate<D>>, first: usize, new: Candidate<D>, apart: f32) {
        let is_close = |old: &Candidate<D>| (0..D).all(|c| (old.x[c] - new.x[c]).abs() < apart);
        if !candidates[first..].iter().any(is_close) {
            candidates.push(new);
        }
    }

    /// Whether `x` is so close to the center of a ray that it is near all its rays.
    #[inline(always)]
    fn is_at_center(&self, own: &Piece<D>, x: &[f32; D]) -> bool {
        let least = LEAST_RANGE * self.places.typical;
        own.from_center && distance2(&own.through, x) < least * least
    }

    /// Returns the log-posterior of a place, up to a constant.
    #[inline(always)]
    fn score(&self, slot: usize, piece: usize, x: &[f32; D], scratch: &mut Scratch<D>) -> f32 {
        let (mut sum, mut product, mut ratio) = (0.0, 1.0f32, 1.0f32);
        for y in &scratch.near[piece] {
            let u = distance2(x, &y.x).sqrt() * y.inverse_width;
            ratio += y.weight * self.tables.at(y.class, u);
            if !y.goes_on {
                product *= ratio.clamp(1e-6, 1e12);
                ratio = 1.0;
                if !(1e-12..1e12).contains(&product) {
                    sum += ln(product);
                    product = 1.0;
                }
            }
        }
        let evidence = self.temper * (sum + ln(product));
        let own = self.problem.family.piece(slot, piece);
        let range2 = match own.from_center {
            true => distance2(&own.through, x) / self.places.typical.powi(2),
            false if self.problem.graph.slots_per_record == 2 => self.partner_range2(slot, x),
            false => 1.0,
        };
        // Keypoints lie all over an image: their density says nothing.
        let density = if D == 2 {
            0.0
        } else {
            let radius = DENSITY_RADIUS * self.places.typical;
            let leaves = &mut scratch.leaves;
            let density = self.crowd.density(slot as u32, x, radius * radius, leaves);
            DENSITY_WEIGHT * ln(LEAST_DENSITY + density)
        };
        evidence
            + density
            + 0.5 * (D - 1) as f32 * ln(range2.max(1e-6))
            + self.marginals.get(piece).map_or(0.0, |column| column[slot])
    }

    /// Returns the mean squared distance of a place to those of the other point of the line, in typical widths.
    #[inline(always)]
    fn partner_range2(&self, slot: usize, x: &[f32; D]) -> f32 {
        let (mut sum, mut known) = (0.0, 0.0);
        for place in &self.places.all[self.places.of(slot ^ 1)] {
            sum += place.weight * distance2(&place.x, x);
            known += place.weight;
        }
        let unknown = (1.0 - known).max(0.0) * UNKNOWN_RANGE * UNKNOWN_RANGE;
        sum / self.places.typical.powi(2) + unknown
    }

    /// Moves a candidate along its piece while that improves its score, in steps that become shorter.
    #[inline(always)]
    fn refine(&self, slot: usize, start: Candidate<D>, scratch: &mut Scratch<D>) -> Candidate<D> {
        let (mut best, piece) = (start, start.piece);
        let own = self.problem.family.piece(slot, piece);
        // Directions of a plane are the axes other than its normal.
        let free: Vec<[f32; D]> = match F::IS_PLANE {
            true => (0..D).filter(|&axis| own.direction[axis] == 0.0).map(unit).collect(),
            false => vec![own.direction],
        };
        let mut step = STEPS.0 * self.places.typical;
        // Loops, not iterators, whose closures would not be compiled for the vector instructions.
        'steps: for _ in 0..MAX_STEPS {
            if step < STEPS.1 * self.places.typical {
                break;
            }
            for direction in &free {
                for step in [step, -step] {
                    let moved = std::array::from_fn(|c| best.x[c] + step * direction[c]);
                    let x = own.project(&moved);
                    let score = self.score(slot, piece, &x, scratch);
                    if score > best.score {
                        best = Candidate { x, piece, score };
                        continue 'steps;
                    }
                }
            }
            step *= 0.5;
        }
        best
    }

    /// Returns the best candidates as places, and adds the weights of candidates next to them.
    fn kept(&self, candidates: &mut [Candidate<D>], best: f32) -> Vec<Place<D>> {
        let share = |candidate: &Candidate<D>| libm::expf(candidate.score - best);
        let total: f32 = candidates.iter().map(share).sum();
        candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
        let merged = MERGED * self.places.typical;
        let mut kept: Vec<Place<D>> = Vec::with_capacity(PLACES);
        for candidate in candidates.iter() {
            let weight = share(candidate) / total;
            if weight < LEAST_WEIGHT && !kept.is_empty() {
                break;
            }
            let is_near =
                |place: &&mut Place<D>| distance2(&place.x, &candidate.x) < merged * merged;
            if let Some(near) = kept.iter_mut().find(is_near) {
                near.weight += weight;
            } else if kept.len() < PLACES {
                kept.push(Place { x: candidate.x, piece: candidate.piece as u8, weight });
            }
        }
        kept
    }
}
