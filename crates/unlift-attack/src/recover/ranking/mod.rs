//! Ranking: positions under which the whole lists are likeliest, not only their entries.
//!
//! A list of the K nearest also says which records are *not* among them: if it has record `j` and not record `k`, then `j` is
//! nearer than `k`. Joint recovery uses the entries only, so inside a ball of K neighbors all places look alike to it. Ranking
//! starts from its estimates and uses both, in both directions. For a slot `i` at `x`, let `R_i` be the distance to the K-th
//! nearest estimate, and `d` the distance to the estimate of record `j`. Then
//!
//! `P(j is in the list of i) = In f(d / R_i) + q (1 - f(d / R_i))`, with `f(u) = 1 / (1 + exp((u^2 - 1) / (2 s)))` and
//! `q = (1 - In) K / n`.
//!
//! The log-likelihood of slot `i` is the sum of `ln P` over its list and over the slots that list its record, and of `ln(1 - P)`
//! over the slots nearby that are not listed and over those that do not list its record. An iteration moves each slot along its
//! record to the likeliest of some places around its estimate. The inlier ratio `In` is estimated from lists and
//! estimates. Even and odd slots take turns, as in joint recovery.
//!
//! Far estimates are as likely at all places, so only those within a few `R_i` count, and each likelihood is divided by that of a far
//! estimate. Slots near each other share the search for them (`Group`). Eight places are scored at a time.

mod surroundings;

use rayon::prelude::*;

use crate::neighbors::Neighborhoods;
use crate::recover::map::family::Family;
use crate::recover::map::graph::record_of;
use crate::recover::map::lines::{LANES, Lanes, ln};
use crate::recover::map::lists::CHUNK;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, Pieces, PlanePieces};
use crate::recover::map::places::distance2;
use crate::recover::result::{Estimate, Status};
use crate::seed::{Draws, Stage};
use crate::simd::{Kernel, dispatch};
use surroundings::{Group, NEAR, Surroundings};

/// Number of iterations.
const ITERATIONS: usize = 5;
/// Softness `s`.
const SOFTNESS: f32 = 0.06;
/// Number of iterations that search far; the others search near. Groups are made again in each of them.
const FAR_ITERATIONS: usize = 2;
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
/// Listed records near which the first iteration tries places, too, because the estimate may be elsewhere; only above the following
/// inlier ratio. Below it, such places win by chance too often.
const ELSEWHERE: usize = 8;
/// Steps from such a place, in radii.
const ELSEWHERE_STEPS: Lanes = [0.0, 0.1, -0.1, 0.2, -0.2, 0.4, -0.4, 0.6];
/// These places are tried for slots with fewer listed estimates nearby than this fraction of the expected number. Slots with several
/// pieces always try them, because the piece may be wrong.
const LOST: f32 = 0.85;
const LEAST_ELSEWHERE: f32 = 0.5;
/// Bounds of the number of estimates within the radius, as a fraction of K. Far from the center, only a part of them is counted.
const RATIO: (f32, f32) = (0.8, 1.25);
/// Listed records within this many `R_i` count as true neighbors when the inlier ratio is estimated.
const REACH: f32 = 1.3;
/// If this many times as many listed records are within [`FARTHER`] radii as within [`REACH`], wrong entries are near, too, and a record
/// that is not listed says little: then the estimates of joint recovery are kept. RedKitchen with `near` noise has 1.7 times as many at an
/// inlier ratio of 0.3, where ranking gains 2 to 9 points, 2.1 at 0.2, where it loses up to 5, and 2.9 at 0.1, where it loses up to 18.
/// With `uniform` noise it has 1.2 times as many at most.
const MOST_FARTHER: f32 = 1.9;
const FARTHER: f32 = 2.0;
/// Bounds of the inlier ratio. No list is taken to be perfect, because estimates are not.
const INLIER_RATIO: (f32, f32) = (0.05, 0.98);
/// Number of slots from which the inlier ratio is estimated.
const SAMPLE: usize = 1 << 12;
/// Maps with fewer slots than this many lists keep the estimates of joint recovery.
const LEAST_LISTS: f32 = 4.0;
/// Below this inlier ratio, the estimates of joint recovery are kept: Castle at 0.1 would lose up to 4 points within 1.0.
const LEAST_RATIO: f32 = 0.15;
/// The limit for lists with scores, which sources make. A choice by descriptors leaves out near points, too, so that a record that is
/// not listed says little: lists of SIFT maps (0.2) would lose up to 17 points, those of ALIKED maps (0.6) up to 4. Lists of ALIKED images
/// (0.9) gain up to 20 (docs/decisions/ranking.md).
const LEAST_RATIO_OF_SOURCES: f32 = 0.75;

/// Returns the estimates of all slots after ranking from `start`, the estimates of joint recovery; `start` as an error if what lists do not
/// name says too little.
pub(crate) fn recover<const D: usize>(
    family: &Family<'_, D>,
    lists: &Neighborhoods,
    delta: f32,
    seed: u64,
    start: Vec<Estimate<D>>,
) -> Result<Vec<Estimate<D>>, Vec<Estimate<D>>> {
    match family {
        Family::Lines { rows, slots_per_record, chance, has_regions } => iterate(
            &LinePieces::new(rows, *slots_per_record, (chance, *has_regions), delta),
            lists,
            seed,
            start,
        ),
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
) -> Result<Vec<Estimate<D>>, Vec<Estimate<D>>> {
    let n = estimates.len();
    let mean_length = lists.records().len() as f32 / n.max(1) as f32;
    if (n as f32) < LEAST_LISTS * mean_length {
        return Err(estimates);
    }
    let least_ratio = match lists.scores() {
        None => LEAST_RATIO,
        Some(_) => LEAST_RATIO_OF_SOURCES,
    };
    let listers = Listers::new(lists, n / pieces.slots_per_record());
    let mut around = Surroundings::default();
    for iteration in 0..ITERATIONS {
        if iteration < FAR_ITERATIONS {
            let Some(new) = Surroundings::new(&estimates, lists) else { return Err(estimates) };
            around = new;
        } else {
            around.update(&estimates, lists);
        }
        let [near, farther] = shares_within(pieces, lists, &estimates, &around);
        let inlier_ratio = near.clamp(INLIER_RATIO.0, INLIER_RATIO.1);
        if inlier_ratio < least_ratio || farther > MOST_FARTHER * near {
            return if iteration == 0 { Err(estimates) } else { Ok(estimates) };
        }
        let place = |(e, &radius): (&Estimate<D>, &f32)| {
            let inverse = if radius > 0.0 { 1.0 / (radius * radius) } else { 0.0 };
            Place { x: e.position, inverse }
        };
        let mut places: Vec<Place<D>> = estimates.iter().zip(&around.radius).map(place).collect();
        for half in 0..2 {
            let context = Context {
                pieces,
                lists,
                listers: &listers,
                estimates: &estimates,
                places: &places,
                around: &around,
                odds: Odds::new(inlier_ratio, mean_length / n as f32),
                inlier_ratio,
                tries_elsewhere: iteration == 0 && inlier_ratio > LEAST_ELSEWHERE,
                iteration,
                seed,
            };
            let moved: Vec<Vec<(u32, Best<D>)>> = around
                .groups
                .par_chunks(CHUNK)
                .map_init(
                    || Terms::new(n),
                    |terms, groups| {
                        let mut moved = Vec::new();
                        for group in groups {
                            dispatch(Half {
                                context: &context,
                                group,
                                half,
                                terms: &mut *terms,
                                moved: &mut moved,
                            });
                        }
                        moved
                    },
                )
                .collect();
            for (slot, Best { x, axis, .. }) in moved.into_iter().flatten() {
                if x.iter().all(|x| x.is_finite()) {
                    let slot = slot as usize;
                    (estimates[slot].position, estimates[slot].axis) = (x, axis as u8);
                    places[slot].x = x;
                }
            }
        }
    }
    Ok(estimates)
}

/// Slots that list each record.
pub(super) struct Listers {
    offsets: Vec<usize>,
    slots: Vec<u32>,
}

impl Listers {
    pub(super) fn new(lists: &Neighborhoods, n_records: usize) -> Self {
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

    pub(super) fn of(&self, record: usize) -> &[u32] {
        &self.slots[self.offsets[record]..self.offsets[record + 1]]
    }
}

/// Returns the fraction of listed records within [`REACH`] radii, which is about the inlier ratio, and within [`FARTHER`] radii.
fn shares_within<const D: usize, P: Pieces<D>>(
    pieces: &P,
    lists: &Neighborhoods,
    estimates: &[Estimate<D>],
    around: &Surroundings,
) -> [f32; 2] {
    let (mut within, mut all) = ([0; 2], 0);
    let every = estimates.len().div_ceil(SAMPLE);
    for slot in (0..estimates.len()).step_by(every).filter(|&slot| around.radius[slot] > 0.0) {
        let bounds = [REACH, FARTHER].map(|times| (times * around.radius[slot]).powi(2));
        for record in lists.of(slot) {
            let x = &estimates[slot].position;
            let nearest = nearest_slot(pieces, estimates, record.index(), x);
            for (count, bound) in within.iter_mut().zip(bounds) {
                *count += usize::from(nearest.is_some_and(|(d2, _)| d2 < bound));
            }
            all += 1;
        }
    }
    within.map(|count| count as f32 / all.max(1) as f32)
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

/// Likelihood ratios of entries that are surely within the radius, against entries far outside.
#[derive(Clone, Copy)]
struct Odds {
    listed: f32,
    not_listed: f32,
}

impl Odds {
    /// `by_chance` is the chance that a wrong entry is a given record.
    fn new(inlier_ratio: f32, by_chance: f32) -> Self {
        let q = (1.0 - inlier_ratio) * by_chance;
        let listed = (inlier_ratio / q).min(LARGEST);
        Self { listed, not_listed: (1.0 - inlier_ratio) / (1.0 - q) }
    }
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

/// The place of a slot, and `1 / R^2`; 0 if it has no list.
#[derive(Clone, Copy)]
struct Place<const D: usize> {
    x: [f32; D],
    inverse: f32,
}

/// The estimates near a group, and those near one slot, which are the terms of its log-likelihood.
struct Terms<const D: usize> {
    /// Per slot, its row in the following columns; 0 if it is not near. Row 0 is far from all.
    row: Vec<u32>,
    places: Vec<Place<D>>,
    x: [Vec<f32>; D],
    /// Odds of each estimate as a neighbor of the slot, and of the slot as a neighbor of it.
    own: Vec<f32>,
    theirs: Vec<f32>,
    /// Squared distance to the other slot of the own record, which explains the entry if it is nearer; else infinite.
    most: Vec<f32>,
    squared: Vec<f32>,
    kept: Vec<u32>,
    /// The radius of the slot at the center.
    length: f32,
    radius: f32,
    away: [Vec<f32>; D],
    terms: Vec<Term>,
    aimed: Vec<[f32; 2]>,
}

/// What the estimate of one other slot contributes.
#[derive(Clone, Copy, Default)]
struct Term {
    inverse: f32,
    own: f32,
    theirs: f32,
    most: f32,
}

/// Coordinate that is far from all estimates, and finite when squared.
const FAR: f32 = 1e18;

impl<const D: usize> Terms<D> {
    fn new(n: usize) -> Self {
        Self {
            row: vec![0; n],
            places: Vec::new(),
            x: std::array::from_fn(|_| Vec::new()),
            own: Vec::new(),
            theirs: Vec::new(),
            most: Vec::new(),
            squared: Vec::new(),
            kept: Vec::new(),
            length: 0.0,
            radius: 0.0,
            away: std::array::from_fn(|_| Vec::new()),
            terms: Vec::new(),
            aimed: Vec::new(),
        }
    }

    /// Reads the estimates near a group.
    #[inline(always)]
    fn enter(&mut self, places: &[Place<D>], near: &[u32]) {
        self.places.clear();
        self.places.push(Place { x: [FAR; D], inverse: 0.0 });
        self.places.extend(near.iter().map(|&slot| places[slot as usize]));
        for (row, &slot) in near.iter().enumerate() {
            self.row[slot as usize] = row as u32 + 1;
        }
        for c in 0..D {
            self.x[c].clear();
            self.x[c].extend(self.places.iter().map(|place| place.x[c]));
        }
    }

    fn leave(&mut self, near: &[u32]) {
        near.iter().for_each(|&slot| self.row[slot as usize] = 0);
    }

    /// Prepares for places `from + t * direction`, where `from` is relative to the center.
    #[inline(always)]
    fn aim(&mut self, from: &[f32; D], direction: &[f32; D]) {
        let n = self.terms.len();
        self.aimed.resize(n, [0.0; 2]);
        let away: [&[f32]; D] = std::array::from_fn(|c| &self.away[c][..n]);
        let aimed = &mut self.aimed[..n];
        for i in 0..n {
            let (mut s, mut a) = (0.0, 0.0);
            for c in 0..D {
                let d = away[c][i] - from[c];
                s += d * d;
                a += d * direction[c];
            }
            aimed[i] = [s, 2.0 * a];
        }
    }

    /// Returns the log-likelihoods at some `t`.
    #[inline(always)]
    fn scores(&self, t: &Lanes, length2: f32) -> Lanes {
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

/// What an iteration reads.
struct Context<'a, const D: usize, P> {
    pieces: &'a P,
    lists: &'a Neighborhoods,
    listers: &'a Listers,
    estimates: &'a [Estimate<D>],
    places: &'a [Place<D>],
    around: &'a Surroundings,
    odds: Odds,
    inlier_ratio: f32,
    tries_elsewhere: bool,
    iteration: usize,
    seed: u64,
}

/// The even or the odd slots of a group.
struct Half<'a, 'b, const D: usize, P> {
    context: &'a Context<'b, D, P>,
    group: &'a Group,
    half: u32,
    terms: &'a mut Terms<D>,
    moved: &'a mut Vec<(u32, Best<D>)>,
}

impl<const D: usize, P: Pieces<D>> Kernel for Half<'_, '_, D, P> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { context, group, half, terms, moved } = self;
        let mut lost = Vec::new();
        terms.enter(context.places, &group.near);
        for &slot in &group.members {
            if slot % 2 == half && context.around.radius[slot as usize] > 0.0 {
                let (best, is_lost) = context.likeliest(slot as usize, terms);
                if context.tries_elsewhere && (is_lost || P::PER_SLOT > 1) {
                    lost.push(moved.len());
                }
                moved.push((slot, best));
            }
        }
        terms.leave(&group.near);
        for at in lost {
            let (slot, best) = &mut moved[at];
            context.try_elsewhere(*slot as usize, best, terms);
        }
    }
}

/// A place with its score and its piece.
#[derive(Clone, Copy)]
struct Best<const D: usize> {
    score: f32,
    x: [f32; D],
    axis: usize,
}

impl<const D: usize, P: Pieces<D>> Context<'_, D, P> {
    /// Returns the likeliest of some places on the record of `slot`, and whether few listed estimates are near it.
    #[inline(always)]
    fn likeliest(&self, slot: usize, terms: &mut Terms<D>) -> (Best<D>, bool) {
        let old = self.estimates[slot];
        let item = (slot * ITERATIONS + self.iteration) as u64;
        let mut draws = Draws::new(self.seed, Stage::Ranking, item);
        let n_near = self.collect(slot, slot, terms);
        let is_lost = (n_near as f32) < LOST * self.inlier_ratio * self.lists.of(slot).len() as f32;
        let axis = usize::from(old.axis);
        let mut best = Best { score: f32::NEG_INFINITY, x: old.position, axis };
        let rounds: &[Lanes] = match P::NORMAL {
            true => &PLANE_STEPS,
            false if self.iteration < FAR_ITERATIONS => &LINE_STEPS,
            false => &NEAR_LINE_STEPS,
        };
        for steps in rounds {
            let from = Best { axis, ..best };
            self.search(slot, (&old.position, from), steps, &mut draws, terms, &mut best);
        }
        (best, is_lost)
    }

    /// Searches in `steps` from a place; `terms` are around `center`.
    #[inline(always)]
    fn search(
        &self,
        slot: usize,
        (center, from): (&[f32; D], Best<D>),
        steps: &Lanes,
        draws: &mut Draws,
        terms: &mut Terms<D>,
        best: &mut Best<D>,
    ) {
        let Best { x: from, axis, .. } = from;
        let piece = self.pieces.piece(slot, axis);
        let radius = terms.radius;
        let direction: [f32; D] = match P::NORMAL {
            true => {
                let random: [f32; D] =
                    std::array::from_fn(|c| from[c] + draws.between(-1.0, 1.0) as f32 * radius);
                let to = piece.project(&random);
                let away: [f32; D] = std::array::from_fn(|c| to[c] - from[c]);
                let length = distance2(&away, &[0.0; D]).sqrt().max(f32::MIN_POSITIVE);
                away.map(|x| x / length)
            }
            false => self.pieces.direction(slot, axis),
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
        terms.aim(&relative, &direction);
        let scores = terms.scores(&t, length2);
        for w in 0..LANES {
            if scores[w] > best.score {
                let x = if steps[w] == 0.0 { from } else { places[w] };
                *best = Best { score: scores[w], x, axis };
            }
        }
    }

    /// Tries the places of `slot` that are near the estimates of listed records.
    #[inline(never)]
    fn try_elsewhere(&self, slot: usize, best: &mut Best<D>, terms: &mut Terms<D>) {
        let own = self.lists.of(slot);
        let mut draws = Draws::new(self.seed, Stage::Ranking, u64::MAX - slot as u64);
        for record in own.iter().step_by(own.len().div_ceil(ELSEWHERE).max(1)) {
            let first = record.index() * self.pieces.slots_per_record();
            for center in first..first + self.pieces.slots_per_record() {
                let (x, radius) = (self.estimates[center].position, self.around.radius[center]);
                let near = |axis: usize| self.pieces.piece(slot, axis).project(&x);
                let is_near = |&axis: &usize| distance2(&near(axis), &x) < radius * radius;
                if !(0..P::PER_SLOT).any(|axis| is_near(&axis)) {
                    continue;
                }
                let group = &self.around.groups[self.around.group_of[center] as usize];
                terms.enter(self.places, &group.near);
                self.collect(slot, center, terms);
                for axis in (0..P::PER_SLOT).filter(is_near) {
                    let from = Best { score: 0.0, x: near(axis), axis };
                    self.search(slot, (&x, from), &ELSEWHERE_STEPS, &mut draws, terms, best);
                }
                terms.leave(&group.near);
            }
        }
    }

    /// Collects the terms of `slot` for places around the estimate of `center`; returns how many listed records are near.
    #[inline(always)]
    fn collect(&self, slot: usize, center: usize, terms: &mut Terms<D>) -> usize {
        let Self { pieces, lists, estimates, around, odds, .. } = self;
        let Terms { row, places, x, own, theirs, most, squared, kept, .. } = terms;
        let slots_per_record = pieces.slots_per_record();
        let record = record_of(slot, slots_per_record);
        terms.radius = around.radius[center];
        terms.length = lists.of(center).len() as f32;
        let reach2 = NEAR * NEAR * terms.radius * terms.radius;
        let at = self.places[center].x;
        let n = places.len();
        for column in [&mut *own, theirs] {
            column.clear();
            column.resize(n, odds.not_listed);
        }
        if slots_per_record == 2 || most.len() < n {
            most.clear();
            most.resize(n, f32::INFINITY);
        }
        squared.resize(n, 0.0);
        kept.resize(n + 1, 0);
        let (own, theirs, most) = (&mut own[..n], &mut theirs[..n], &mut most[..n]);
        let (places, squared) = (&places[..n], &mut squared[..n]);
        let x: [&[f32]; D] = std::array::from_fn(|c| &x[c][..n]);
        for i in 0..n {
            squared[i] = distance2(&std::array::from_fn(|c| x[c][i]), &at);
        }
        let mut n_near = 0;
        for record in lists.of(slot) {
            let first = record.index() * slots_per_record;
            let mut i = row[first] as usize;
            if slots_per_record == 2 {
                let other = row[first + 1] as usize;
                let is_other = squared[other] < squared[i];
                let (nearer, farther) = if is_other { (other, i) } else { (i, other) };
                own[farther] = 1.0;
                i = nearer;
            }
            own[i] = odds.listed;
            n_near += usize::from(squared[i] < reach2);
        }
        let partner = slot ^ 1;
        let has_partner = slots_per_record == 2 && estimates[partner].status == Status::Ok;
        for &lister in self.listers.of(record) {
            let i = row[lister as usize] as usize;
            theirs[i] = odds.listed;
            if has_partner {
                most[i] = distance2(&self.places[partner].x, &places[i].x);
            }
        }
        for slot in 0..slots_per_record {
            squared[row[record * slots_per_record + slot] as usize] = f32::INFINITY;
        }
        let mut n_kept = 0;
        for (i, &squared) in squared.iter().enumerate().skip(1) {
            kept[n_kept] = i as u32;
            n_kept += usize::from(squared < reach2);
        }
        // Row 0 completes the last pair, without effect.
        kept[n_kept] = 0;
        n_kept = n_kept.next_multiple_of(2);
        (own[0], theirs[0]) = (1.0, 1.0);
        let kept = &kept[..n_kept];
        terms.terms.resize(n_kept, Term::default());
        terms.away.iter_mut().for_each(|away| away.resize(n_kept, 0.0));
        let mut away = terms.away.each_mut().map(|away| &mut away[..n_kept]);
        let terms = &mut terms.terms[..n_kept];
        for (k, &i) in kept.iter().enumerate() {
            let i = i as usize;
            let Place { x, inverse } = places[i];
            let theirs = if inverse > 0.0 { theirs[i] } else { 1.0 };
            let inverse = STEEPNESS * inverse;
            terms[k] = Term { inverse, own: own[i], theirs, most: most[i] };
            (0..D).for_each(|c| away[c][k] = x[c] - at[c]);
        }
        n_near
    }
}
