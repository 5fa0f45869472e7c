//! Ranking: positions under which the whole lists are likeliest, not only their entries.
//!
//! A list of the K nearest also says which records are *not* among them: if it has record `j` and not record `k`, then `j` is
//! nearer than `k`. Joint recovery uses the entries only, so inside a ball of K neighbors all places look alike to it. Ranking
//! starts from its estimates and uses both, in both directions. For a slot `i` at `x`, let `R_i` be the distance to the K-th
//! nearest estimate, and `d` the distance to the estimate of record `j`. Then
//!
//! `P(j is in the list of i) = In f(d / R_i) + q (1 - f(d / R_i))`, with `f(u) = 1 / (1 + exp((u - 1) / s))` and
//! `q = (1 - In) K / n`.
//!
//! The log-likelihood of slot `i` is the sum of `ln P` over its list and over the slots that list its record, and of `ln(1 - P)`
//! over the slots nearby that are not listed and over those that do not list its record. An iteration moves each slot along its
//! record to the likeliest of some places around its estimate. The inlier ratio `In` is estimated from lists and
//! estimates. Even and odd slots take turns, as in joint recovery.

use rayon::prelude::*;

use crate::RecordId;
use crate::geometry::knn::Knn;
use crate::neighbors::Neighborhoods;
use crate::recover::map::family::Family;
use crate::recover::map::graph::record_of;
use crate::recover::map::lists::CHUNK;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, Pieces, PlanePieces};
use crate::recover::map::places::distance2;
use crate::recover::result::{Estimate, Status};
use crate::seed::{Draws, Stage};
use crate::simd::{Kernel, dispatch};

/// Number of iterations.
const ITERATIONS: usize = 5;
/// Softness `s`.
const SOFTNESS: f32 = 0.06;
/// Nearest estimates that are compared with a list, as a multiple of its length.
const NEAR: f32 = 2.5;
/// Largest step along the record, in units of `R_i`, the factor from one step to the next, and the number of steps. Each is tried in
/// both directions.
const LARGEST_STEP: f32 = 0.5;
const STEP_FACTOR: f32 = 0.42;
const STEPS: i32 = 5;
/// Listed records near which the first iteration tries places, too, because the estimate may be elsewhere; only above the following
/// inlier ratio. Below it, such places win by chance too often.
const ELSEWHERE: usize = 8;
const LEAST_ELSEWHERE: f32 = 0.5;
/// Bounds of the number of estimates within the radius, as a fraction of K. Far from the center, only a part of them is counted.
const RATIO: (f32, f32) = (0.8, 1.25);
/// Listed records within this many `R_i` count as true neighbors when the inlier ratio is estimated.
const REACH: f32 = 1.3;
/// Bounds of the inlier ratio. No list is taken to be perfect, because estimates are not.
const INLIER_RATIO: (f32, f32) = (0.05, 0.98);
/// Number of slots from which the inlier ratio is estimated.
const SAMPLE: usize = 1 << 12;
/// Maps with fewer slots than this many lists keep the estimates of joint recovery.
const LEAST_LISTS: f32 = 4.0;
/// Below this inlier ratio, the estimates of joint recovery are kept: Castle at 0.1 would lose up to 4 points within 1.0.
const LEAST_RATIO: f32 = 0.15;

/// Returns the estimates of all slots after ranking from `start`, the estimates of joint recovery.
pub(crate) fn recover<const D: usize>(
    family: &Family<'_, D>,
    lists: &Neighborhoods,
    delta: f32,
    seed: u64,
    start: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    match family {
        Family::Lines { rows, slots_per_record, chance } => {
            iterate(&LinePieces::new(rows, *slots_per_record, chance, delta), lists, seed, start)
        }
        Family::Planes { planes, sorted } => {
            iterate(&PlanePieces::new(planes, sorted, delta), lists, seed, start)
        }
        Family::Candidates { rows, chance } => {
            iterate(&CandidatePieces::new(rows, chance, delta), lists, seed, start)
        }
    }
}

fn iterate<const D: usize, P: Pieces<D>>(
    pieces: &P,
    lists: &Neighborhoods,
    seed: u64,
    mut estimates: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    let n = estimates.len();
    let mean_length = lists.records().len() as f32 / n.max(1) as f32;
    if (n as f32) < LEAST_LISTS * mean_length {
        return estimates;
    }
    let listers = Listers::new(lists, n / pieces.slots_per_record());
    for iteration in 0..ITERATIONS {
        let Some(around) = Surroundings::new(&estimates, lists) else { return estimates };
        let inlier_ratio = inlier_ratio(pieces, lists, &estimates, &around);
        if inlier_ratio < LEAST_RATIO {
            return estimates;
        }
        let curve = Curve::new(inlier_ratio, mean_length / n as f32);
        for half in 0..2 {
            let context = Context {
                pieces,
                lists,
                listers: &listers,
                estimates: &estimates,
                around: &around,
                curve: &curve,
                tries_elsewhere: iteration == 0 && inlier_ratio > LEAST_ELSEWHERE,
                iteration,
                seed,
            };
            let mut moved: Vec<(usize, Estimate<D>)> = (half..n)
                .step_by(2)
                .filter(|&slot| around.radius[slot] > 0.0)
                .map(|slot| (slot, estimates[slot]))
                .collect();
            moved.par_chunks_mut(CHUNK).for_each_init(Terms::default, |terms, moved| {
                dispatch(Chunk { context: &context, moved, terms });
            });
            for (slot, estimate) in moved {
                estimates[slot] = estimate;
            }
        }
    }
    estimates
}

/// Slots that list each record.
struct Listers {
    offsets: Vec<usize>,
    slots: Vec<u32>,
}

impl Listers {
    fn new(lists: &Neighborhoods, n_records: usize) -> Self {
        let mut offsets = vec![0; n_records + 1];
        for record in lists.records() {
            offsets[record.index() + 1] += 1;
        }
        for record in 0..n_records {
            offsets[record + 1] += offsets[record];
        }
        let (mut next, mut slots) = (offsets.clone(), vec![0; lists.records().len()]);
        for slot in 0..lists.n_slots() {
            for record in lists.of(slot) {
                slots[next[record.index()]] = slot as u32;
                next[record.index()] += 1;
            }
        }
        Self { offsets, slots }
    }

    fn of(&self, record: usize) -> &[u32] {
        &self.slots[self.offsets[record]..self.offsets[record + 1]]
    }
}

/// The nearest estimates of every slot.
struct Surroundings {
    /// Distance to the K-th nearest estimate, where the list of the slot has K records; 0 for slots without estimate or list.
    radius: Vec<f32>,
    near: Vec<Vec<u32>>,
}

impl Surroundings {
    /// Returns `None` if no slot has an estimate.
    fn new<const D: usize>(estimates: &[Estimate<D>], lists: &Neighborhoods) -> Option<Self> {
        let is_known = |slot: &u32| estimates[*slot as usize].status == Status::Ok;
        let slots: Vec<u32> = (0..estimates.len() as u32).filter(is_known).collect();
        let place = |slot: &u32| estimates[*slot as usize].position.map(f64::from);
        let places: Vec<[f64; D]> = slots.iter().map(place).collect();
        let tree = Knn::new(&places).ok()?;
        let mean_length = lists.records().len() / estimates.len();
        let rows = tree.per_row((NEAR * mean_length as f32) as usize, |row, found| {
            let kth = lists.of(slots[row] as usize).len().checked_sub(1);
            let kth = kth.and_then(|kth| found.get(kth).or(found.last()));
            let radius = kth.map_or(0.0, |kth| kth.0.sqrt() as f32);
            (radius, found.iter().map(|near| slots[near.1 as usize]).collect())
        });
        let (mut radius, mut near) =
            (vec![0.0; estimates.len()], vec![Vec::new(); estimates.len()]);
        for (&slot, row) in slots.iter().zip(rows) {
            (radius[slot as usize], near[slot as usize]) = row;
        }
        Some(Self { radius, near })
    }
}

/// Estimates the fraction of listed records that are true neighbors.
fn inlier_ratio<const D: usize, P: Pieces<D>>(
    pieces: &P,
    lists: &Neighborhoods,
    estimates: &[Estimate<D>],
    around: &Surroundings,
) -> f32 {
    let (mut near, mut all) = (0, 0);
    let every = estimates.len().div_ceil(SAMPLE);
    for slot in (0..estimates.len()).step_by(every).filter(|&slot| around.radius[slot] > 0.0) {
        let reach = REACH * around.radius[slot];
        for record in lists.of(slot) {
            let x = &estimates[slot].position;
            let nearest = nearest_slot(pieces, estimates, record.index(), x);
            near += usize::from(nearest.is_some_and(|(d2, _)| d2 < reach * reach));
            all += 1;
        }
    }
    (near as f32 / all.max(1) as f32).clamp(INLIER_RATIO.0, INLIER_RATIO.1)
}

/// Returns the slot of `record` whose estimate is nearest to `x`, after its squared distance.
#[inline(always)]
fn nearest_slot<const D: usize, P: Pieces<D>>(
    pieces: &P,
    estimates: &[Estimate<D>],
    record: usize,
    x: &[f32; D],
) -> Option<(f32, usize)> {
    let first = record * pieces.slots_per_record();
    let mut nearest: Option<(f32, usize)> = None;
    for (at, estimate) in estimates[first..][..pieces.slots_per_record()].iter().enumerate() {
        let d2 = distance2(&estimate.position, x);
        if estimate.status == Status::Ok && nearest.is_none_or(|(least, _)| d2 < least) {
            nearest = Some((d2, first + at));
        }
    }
    nearest
}

const BINS: usize = 1024;
/// Bins per unit of `(d / R)^2`. The last bin stands for all larger values.
const BINS_PER_UNIT: f32 = 256.0;

/// `ln P` and `ln(1 - P)` in bins of `(d / R)^2`.
struct Curve {
    listed: Vec<f32>,
    not_listed: Vec<f32>,
}

impl Curve {
    /// Creates the curve for an inlier ratio. `by_chance` is the chance that a wrong entry is a given record.
    fn new(inlier_ratio: f32, by_chance: f32) -> Self {
        let q = (1.0 - inlier_ratio) * by_chance;
        let p = |bin: usize| {
            let u = ((bin as f64 + 0.5) / f64::from(BINS_PER_UNIT)).sqrt();
            let f = 1.0 / (1.0 + libm::exp((u - 1.0) / f64::from(SOFTNESS)));
            f64::from(inlier_ratio) * f + f64::from(q) * (1.0 - f)
        };
        let listed = (0..BINS).map(|bin| libm::log(p(bin)) as f32).collect();
        let not_listed = (0..BINS).map(|bin| libm::log1p(-p(bin)) as f32).collect();
        Self { listed, not_listed }
    }
}

/// The terms of the log-likelihood of one slot: the estimates of other slots, in columns.
struct Terms<const D: usize> {
    /// Length of the list of the center of these terms, and its squared radius.
    length: f32,
    radius2: f32,
    /// Estimates on the own list, and others nearby.
    listed: Columns<D>,
    not_listed: Columns<D>,
    /// Slots that list the own record, and others nearby.
    listers: Columns<D>,
    not_listers: Columns<D>,
}

impl<const D: usize> Default for Terms<D> {
    fn default() -> Self {
        Self {
            length: 0.0,
            radius2: 0.0,
            listed: Columns::default(),
            not_listed: Columns::default(),
            listers: Columns::default(),
            not_listers: Columns::default(),
        }
    }
}

struct Columns<const D: usize> {
    x: [Vec<f32>; D],
    inverse_radius2: Vec<f32>,
    /// Squared distance to the other slot of the own record, which explains the entry if it is nearer; else infinite.
    most: Vec<f32>,
}

impl<const D: usize> Default for Columns<D> {
    fn default() -> Self {
        let x = std::array::from_fn(|_| Vec::new());
        Self { x, inverse_radius2: Vec::new(), most: Vec::new() }
    }
}

impl<const D: usize> Columns<D> {
    fn clear(&mut self) {
        self.x.iter_mut().for_each(Vec::clear);
        self.inverse_radius2.clear();
        self.most.clear();
    }

    #[inline(always)]
    fn push(&mut self, x: &[f32; D], radius: f32, most: f32) {
        self.x.iter_mut().zip(x).for_each(|(column, x)| column.push(*x));
        self.inverse_radius2.push(1.0 / (radius * radius));
        self.most.push(most);
    }

    /// Counts the rows whose squared distance to `x` is below `most`.
    #[inline(always)]
    fn count(&self, x: &[f32; D], most: f32) -> u32 {
        let n = self.most.len();
        let columns: [&[f32]; D] = std::array::from_fn(|c| &self.x[c][..n]);
        let near = |i: usize| distance2(&std::array::from_fn(|c| columns[c][i]), x) < most;
        (0..n).map(|i| u32::from(near(i))).sum()
    }

    /// Sums `table` over all rows for a slot at `x`, with squared radii divided by `scale`.
    #[inline(always)]
    fn sum(&self, table: &[f32], x: &[f32; D], scale: f32) -> f32 {
        let n = self.most.len();
        let columns: [&[f32]; D] = std::array::from_fn(|c| &self.x[c][..n]);
        let (inverse, most, table) = (&self.inverse_radius2[..n], &self.most[..n], &table[..BINS]);
        let mut sum = 0.0;
        for i in 0..n {
            let d2 = distance2(&std::array::from_fn(|c| columns[c][i]), x).min(most[i]);
            let bin = (d2 * inverse[i] * (scale * BINS_PER_UNIT)).min((BINS - 1) as f32);
            sum += table[(bin as usize).min(BINS - 1)];
        }
        sum
    }
}

/// What an iteration reads.
struct Context<'a, const D: usize, P> {
    pieces: &'a P,
    lists: &'a Neighborhoods,
    listers: &'a Listers,
    estimates: &'a [Estimate<D>],
    around: &'a Surroundings,
    curve: &'a Curve,
    tries_elsewhere: bool,
    iteration: usize,
    seed: u64,
}

/// Slots with their estimates, which are replaced by new ones.
struct Chunk<'a, 'b, const D: usize, P> {
    context: &'a Context<'b, D, P>,
    moved: &'a mut [(usize, Estimate<D>)],
    terms: &'a mut Terms<D>,
}

impl<const D: usize, P: Pieces<D>> Kernel for Chunk<'_, '_, D, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (slot, estimate) in self.moved {
            *estimate = self.context.likeliest(*slot, self.terms);
        }
    }
}

impl<const D: usize, P: Pieces<D>> Context<'_, D, P> {
    /// Returns the likeliest of some places on the record of `slot`.
    #[inline(always)]
    fn likeliest(&self, slot: usize, terms: &mut Terms<D>) -> Estimate<D> {
        let old = self.estimates[slot];
        let radius = self.around.radius[slot];
        let mut draws =
            Draws::new(self.seed, Stage::Ranking, (slot * ITERATIONS + self.iteration) as u64);
        self.collect(slot, slot, terms);
        let mut best = (self.log_likelihood(terms, &old.position), old.position, old.axis);
        let axis = usize::from(old.axis);
        let piece = self.pieces.piece(slot, axis);
        let mut size = LARGEST_STEP * radius;
        for _ in 0..STEPS {
            let direction: [f32; D] = match P::NORMAL {
                true => std::array::from_fn(|_| draws.between(-1.0, 1.0) as f32),
                false => self.pieces.direction(slot, axis),
            };
            let step = size * draws.between(0.75, 1.25) as f32;
            size *= STEP_FACTOR;
            let from = best.1;
            for step in [-step, step] {
                let x = piece.project(&std::array::from_fn(|c| from[c] + step * direction[c]));
                let score = self.log_likelihood(terms, &x);
                if score > best.0 {
                    best = (score, x, old.axis);
                }
            }
        }
        if self.tries_elsewhere {
            let own = self.lists.of(slot);
            for record in own.iter().step_by(own.len().div_ceil(ELSEWHERE).max(1)) {
                self.try_near(slot, record.index(), terms, &mut best);
            }
        }
        let (_, position, axis) = best;
        if !position.iter().all(|x| x.is_finite()) {
            return old;
        }
        Estimate { position, axis, ..old }
    }

    /// Tries the places of `slot` that are nearest to the estimates of a listed record.
    #[inline(always)]
    fn try_near(
        &self,
        slot: usize,
        record: usize,
        terms: &mut Terms<D>,
        best: &mut (f32, [f32; D], u8),
    ) {
        let first = record * self.pieces.slots_per_record();
        for center in first..first + self.pieces.slots_per_record() {
            let (x, radius) = (self.estimates[center].position, self.around.radius[center]);
            if radius == 0.0 {
                continue;
            }
            let near = |piece: usize| self.pieces.piece(slot, piece).project(&x);
            let is_near = |piece: &usize| distance2(&near(*piece), &x) < radius * radius;
            if !(0..P::PER_SLOT).any(|piece| is_near(&piece)) {
                continue;
            }
            self.collect(slot, center, terms);
            for piece in (0..P::PER_SLOT).filter(is_near) {
                let x = near(piece);
                let score = self.log_likelihood(terms, &x);
                if score > best.0 {
                    *best = (score, x, piece as u8);
                }
            }
        }
    }

    /// Returns the log-likelihood of a slot at `x`. The radius there follows from the number of estimates within the radius of the
    /// center, as if they were spread evenly.
    #[inline(always)]
    fn log_likelihood(&self, terms: &Terms<D>, x: &[f32; D]) -> f32 {
        let Terms { length, radius2, listed, not_listed, listers, not_listers } = terms;
        let n = listed.count(x, *radius2) + not_listed.count(x, *radius2);
        let ratio = (n as f32 / *length).clamp(RATIO.0, RATIO.1);
        let scale = if D == 2 { ratio } else { libm::cbrtf(ratio * ratio) };
        let Curve { listed: p, not_listed: p_not } = self.curve;
        listed.sum(p, x, scale)
            + not_listed.sum(p_not, x, scale)
            + listers.sum(p, x, 1.0)
            + not_listers.sum(p_not, x, 1.0)
    }

    /// Collects the terms of `slot` for places around the estimate of `center`.
    #[inline(always)]
    fn collect(&self, slot: usize, center: usize, terms: &mut Terms<D>) {
        let Self { pieces, lists, estimates, around, .. } = self;
        let Terms { length, radius2, listed, not_listed, listers, not_listers } = terms;
        [&mut *listed, not_listed, listers, not_listers].into_iter().for_each(Columns::clear);
        let slots_per_record = pieces.slots_per_record();
        let record = record_of(slot, slots_per_record);
        let (own, radius) = (lists.of(slot), around.radius[center]);
        (*length, *radius2) = (lists.of(center).len() as f32, radius * radius);
        let at = &estimates[center].position;
        for record in own {
            if let Some((_, nearest)) = nearest_slot(*pieces, estimates, record.index(), at) {
                listed.push(&estimates[nearest].position, radius, f32::INFINITY);
            }
        }
        let partner = slot ^ 1;
        let has_partner = slots_per_record == 2 && estimates[partner].status == Status::Ok;
        for &lister in self.listers.of(record) {
            let lister = lister as usize;
            if around.radius[lister] > 0.0 {
                let x = &estimates[lister].position;
                let most = match has_partner {
                    true => distance2(&estimates[partner].position, x),
                    false => f32::INFINITY,
                };
                listers.push(x, around.radius[lister], most);
            }
        }
        let id = RecordId::from_index(record);
        let center = (center != slot).then_some(center as u32);
        for &other in around.near[center.map_or(slot, |c| c as usize)].iter().chain(&center) {
            let other = other as usize;
            let theirs = record_of(other, slots_per_record);
            if theirs == record {
                continue;
            }
            let x = &estimates[other].position;
            if own.binary_search(&RecordId::from_index(theirs)).is_err() {
                not_listed.push(x, radius, f32::INFINITY);
            }
            if around.radius[other] > 0.0 && lists.of(other).binary_search(&id).is_err() {
                not_listers.push(x, around.radius[other], f32::INFINITY);
            }
        }
    }
}
