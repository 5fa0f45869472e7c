//! The automatic choice of delta: the length at which consensus agrees least probably by chance.
//!
//! Consensus solves a sample of slots for a geometric ladder of deltas. The score of a delta is the mean evidence minus that with mixed
//! lists, made of other slots' entries, which contains the effect of uneven density, too.

use std::collections::BTreeSet;

use crate::geometry::frame::Bounds;
use crate::neighbors::Neighborhoods;
use crate::recover::consensus;
use crate::recover::map::{CHUNK, Family, mixed, trimmed_box};
use crate::recover::result::Estimate;
use crate::released::{Obfuscation, Released};
use crate::seed::{Draws, Stage};

/// Least delta within known bounds, as a fraction of the spacing of points: coinciding keypoints agree exactly, whatever delta is.
const LEAST_DELTA: f64 = 0.25;
/// The bounds along an axis are ignored if they are this many times as long as the range of most points.
const TOO_LARGE: f64 = 1.5;
/// Delta for rays from centers with regions, as a fraction of the spacing of points. Their evidence does not depend on delta.
const ANCHOR_DELTA: f64 = 1.75;
/// Halvings of the extent in the coarse ladder: down to 1 / 16,384 of it.
const HALVINGS: u32 = 14;
/// Halvings in the coarse ladder below the first delta that is not too wide: a far center makes the extent of rays arbitrarily large.
const HALVINGS_NOT_TOO_WIDE: u32 = 5;
/// Steps per octave of the fine ladder. The maximum is flat, so finer steps do not help.
const FINE: i32 = 3;
/// Deltas form the plateau if their score reaches this fraction of the largest: for the wide choice, then for the narrow one.
const AS_GOOD: (f64, f64) = (0.94, 0.95);
/// Below the lower edge of the plateau, evidence grows by more than this factor per octave,
const GROWTH: f64 = 1.2;
/// or is less than this fraction of the best of the coarse ladder.
const FAR_BELOW: f64 = 0.8;
/// Largest number of steps below the best delta in which the edge is searched: five octaves.
const LOWEST: i32 = 15;
/// Largest narrow delta, as a multiple of the edge: wrong entries of the same region support wider ones.
const BEYOND_EDGE: f64 = 2.25;
/// Largest narrow delta for lists with scores, whose wrong entries have similar descriptors.
const BEYOND_EDGE_OF_SCORED: f64 = 2.0;
/// If the likely delta of candidates is this many times as wide, it is taken: partners agree exactly, so that evidence hardly falls.
const COLLAPSED: f64 = 4.0;

/// Chooses delta, in the unit of the map, from lists as `given` and as `used` (in both directions); with `sharp`, for joint recovery.
pub(super) fn learn<const D: usize, F: Family<D>>(
    released: &Released<D>,
    family: &F,
    (used, given): (&Neighborhoods, &Neighborhoods),
    sharp: bool,
    seed: u64,
) -> f64 {
    let spacing = spacing(released);
    if family.anchored().is_some() {
        return ANCHOR_DELTA * spacing;
    }
    let beyond_edge = given.scores().map_or(BEYOND_EDGE, |_| BEYOND_EDGE_OF_SCORED);
    let share = given.mean_length() / released.n_records().max(1) as f64;
    // The bounds of a map may be far wider than its points, so that the share limits delta.
    let least = if D == 2 { LEAST_DELTA * spacing } else { 0.0 };
    let beyond_edge = sharp.then_some(beyond_edge);
    let used = (used, released.slots_per_record());
    let chosen = choose(family, used, beyond_edge, (least, share), seed).unwrap_or(1.0);
    let likely = if D == 2 { 0.0 } else { family.likely_delta(share) };
    if COLLAPSED * chosen < likely { likely } else { chosen }
}

/// Returns the spacing of points spread evenly over the known bounds (or what axis candidates fill of them), or over all regions; else 0.
fn spacing<const D: usize>(released: &Released<D>) -> f64 {
    let of_regions = || {
        let regions = released.obfuscation().rays()?.regions()?;
        let corners = regions.iter().flat_map(|region| [region.low, region.high]);
        Bounds::quantiles(&corners.collect::<Vec<_>>(), 0.0)
    };
    let Some(bounds) = released.bounds().or_else(of_regions) else { return 0.0 };
    let mut sides: [f64; D] = std::array::from_fn(|c| bounds.high[c] - bounds.low[c]);
    if let Obfuscation::AxisCandidates(candidates) = released.obfuscation() {
        let (low, high) = trimmed_box(candidates.position());
        for (c, side) in sides.iter_mut().enumerate() {
            let filled = f64::from(high[c] - low[c]);
            if *side > TOO_LARGE * filled {
                *side = filled;
            }
        }
    }
    let volume: f64 = sides.iter().product();
    libm::pow(volume / released.n_slots().max(1) as f64, 1.0 / D as f64)
}

/// Returns the delta with the best score, at least `least`; `None` for a map without extent. A list holds the fraction `share` of all
/// records. Of the plateau it takes the widest delta; with `beyond_edge`, a narrow one, at most that many times its lower edge.
fn choose<const D: usize, F: Family<D>>(
    family: &F,
    (lists, slots_per_record): (&Neighborhoods, usize),
    beyond_edge: Option<f64>,
    (least, share): (f64, f64),
    seed: u64,
) -> Option<f64> {
    let chance = |delta: f64| family.typical_chance(delta as f32);
    let [wide, narrow] = if D == 2 { [0.0; 2] } else { family.limits(share).map(|x| x as f32) };
    let too_wide = F::TOO_WIDE.max(wide);
    // Keep some steps of the ladder between the two limits.
    let too_narrow = narrow.min(too_wide / 8.0);
    // In a flat map two of the three lines of a record run within the plane.
    let if_flat = family.radius_if_flat(share).map_or(0.0, chance);
    // If points are sparse, keep at least one halving between the two limits.
    let too_wide = too_wide.max(if_flat).max(chance(2.0 * least));
    let extent = family.extent();
    if lists.n_slots() == 0 || !(extent.is_finite() && extent > 0.0) {
        return None;
    }
    let slots = sample(lists.n_slots(), F::DELTA_CHUNKS, seed);
    let mixed = mixed(lists, &slots, slots_per_record);
    let mean_evidence = |lists: &Neighborhoods, delta: f64| {
        Estimate::mean_evidence(&consensus::solve(family, lists, delta as f32, &slots))
    };
    let value = |delta: f64| mean_evidence(lists, delta) - mean_evidence(&mixed, delta);
    // From large to small: far below the maximum, smaller deltas only lose more neighbors.
    let (mut coarse, mut most) = (extent, f64::NEG_INFINITY);
    let halved = |step: u32| extent * libm::exp2(-f64::from(step));
    let is_too_wide = |step: u32| chance(halved(step)) > too_wide;
    // No more halvings, so that the result is positive in 32 bits.
    let first = (1..100).find(|&step| !is_too_wide(step));
    let steps = first.map(|first| first..=HALVINGS.max(first + HALVINGS_NOT_TOO_WIDE));
    for delta in steps.into_iter().flatten().map(halved) {
        if delta < least || chance(delta) < too_narrow {
            break;
        }
        let value = value(delta);
        if value > most {
            (coarse, most) = (delta, value);
        } else if most > 0.0 && value < 0.5 * most {
            break;
        }
    }
    // The fine ladder may exceed the limit of the coarse one, except in images.
    let most_chance = if F::KEEPS_TO_LIMIT { too_wide } else { f32::INFINITY };
    let fine: Vec<(f64, f64)> = (1 - FINE..2 * FINE)
        .map(|step| coarse * libm::exp2(f64::from(step) / f64::from(FINE)))
        .filter(|&delta| delta >= least && (too_narrow..=most_chance).contains(&chance(delta)))
        .map(|delta| (delta, value(delta)))
        .collect();
    let most = fine.iter().map(|&(_, value)| value).fold(f64::NEG_INFINITY, f64::max);
    let as_good = if beyond_edge.is_some() { AS_GOOD.1 } else { AS_GOOD.0 };
    let near = |&&(_, value): &&(f64, f64)| value >= as_good * most || value == most;
    let (low, high) = (fine.iter().find(near)?.0, fine.iter().rev().find(near)?.0);
    let Some(beyond_edge) = beyond_edge else { return Some(high) };
    let across = low * libm::pow(high / low, F::ACROSS);
    let near_edge = F::KEEPS_NEAR_EDGE.then(|| beyond_edge * edge(coarse, &value).max(least));
    Some(near_edge.map_or(across, |near_edge| across.min(near_edge)))
}

/// Returns the lower edge of the plateau: where evidence begins to fall as delta shrinks below `coarse`, the best of its ladder.
///
/// Wrong entries of the same region raise the upper part of the plateau, but not its lower edge.
fn edge(coarse: f64, value: &impl Fn(f64) -> f64) -> f64 {
    let at = |step: i32| coarse * libm::exp2(f64::from(-step) / f64::from(FINE));
    let mut values: Vec<f64> = (-FINE..=0).map(|step| value(at(step))).collect();
    let least = FAR_BELOW * values[FINE as usize];
    for step in 1..=LOWEST {
        let below = value(at(step));
        let octave_above = values[step as usize];
        if !(below > least && GROWTH * below >= octave_above) {
            return at(step);
        }
        values.push(below);
    }
    at(LOWEST)
}

fn sample(n_slots: usize, n_chunks: usize, seed: u64) -> Vec<usize> {
    let all = n_slots.div_ceil(CHUNK);
    let mut draws = Draws::new(seed, Stage::DeltaSlots, 0);
    let chunks: BTreeSet<usize> = match all <= n_chunks {
        true => (0..all).collect(),
        false => (0..n_chunks).map(|_| draws.below(all as u64) as usize).collect(),
    };
    let slots = |chunk: usize| chunk * CHUNK..n_slots.min((chunk + 1) * CHUNK);
    chunks.into_iter().flat_map(slots).collect()
}
