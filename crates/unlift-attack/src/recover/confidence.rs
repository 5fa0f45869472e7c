//! Confidence: the probability that an estimate is right, without ground truth.
//!
//! Around a right estimate, many records that the slot lists are near, and many that list it. A logistic model turns their numbers into a
//! probability and a scale of the error. It was fitted on synthetic maps only (docs/decisions/attack.md).

use crate::geometry::flatness::flatness;
use crate::geometry::knn::Knn;
use crate::geometry::vector::median;
use crate::neighbors::Neighborhoods;
use crate::parallel;
use crate::recover::map::{Graph, Side, distance2, known, side};
use crate::recover::result::{Confidence, Estimate, Unknown};
use crate::released::{Obfuscation, Released};

/// Estimates within this many radii are near. A radius is the distance to this nearest estimate, within these bounds of the median.
const NEAR: f32 = 1.3;
const NEIGHBOR: usize = 50;
const RADII: (f32, f32) = (0.3, 3.3);
/// If this many times as many records are within [`FARTHER`] radii, wrong entries are near, too. The model was not fitted on such lists.
const MOST_FARTHER: f64 = 1.5;
const FARTHER: f32 = 2.0;
/// Smaller shares are raised by this before a logarithm.
const LEAST: f32 = 0.02;
const LEAST_FOREIGN: f32 = 0.05;

/// For lines, paired lines, rays, planes and candidates: the constant term of the probability, and that of the scale.
const OF_KIND: [(f32, f32); 5] =
    [(-3.268, -2.741), (-6.75, -2.546), (-5.78, -2.245), (-6.443, -1.623), (-5.376, -2.314)];
/// Weights in the logit of the logarithms of: near listed records; near listers; their share around near slots; that of the map; other
/// centers.
const FOUND: [f32; 5] = [2.494, 0.308, -0.608, -1.07, 1.33];
/// Weights in the logarithm of the scale, of the logarithms of: all near records; the share of near entries of near slots.
const SCALE: [f32; 2] = [-0.133, -0.675];

/// Predicts the confidence of every slot that joint recovery placed. Fails where the model was never fitted or tested.
pub(super) fn predict<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    graph: &Graph,
    estimates: &[Estimate<D>],
) -> Result<Vec<Confidence>, Unknown> {
    unknown(released, lists, estimates).map_or(Ok(()), Err)?;
    let kind = match released.obfuscation() {
        Obfuscation::Lines(_) => released.slots_per_record() - 1,
        Obfuscation::Rays(_) => 2,
        Obfuscation::AxisPlanes(_) => 3,
        Obfuscation::AxisCandidates(_) => 4,
    };
    let Some(radius) = radii(estimates) else {
        return Ok(vec![Confidence::LOST; estimates.len()]);
    };
    // Slots at the end of an edge of a slot, within some radii of it.
    let near = |slot: usize, radii: f32, edge: (usize, u8)| {
        let reach2 = (radii * radius[slot]) * (radii * radius[slot]);
        let x = &estimates[slot].position;
        graph.slots_at(edge).filter(move |&end| distance2(&estimates[end].position, x) < reach2)
    };
    // Near records that a slot lists, near ones that list it, and the number of both if all were near.
    let count = |slot: usize, radii: f32| -> [f32; 3] {
        let mut counts = [0.0; 3];
        for edge in graph.of(slot).filter(|_| estimates[slot].is_known()) {
            // The two slots of a record count once.
            let is_near = near(slot, radii, edge).next().is_some();
            for (at, other_side) in [Side::Reverse, Side::Forward].into_iter().enumerate() {
                if side(edge.1) != other_side {
                    counts[at] += f32::from(u8::from(is_near));
                    counts[2] += 1.0;
                }
            }
        }
        counts
    };
    let n = estimates.len();
    let counts = |radii: f32| -> Vec<[f32; 3]> { parallel::map(n, |slot| count(slot, radii)) };
    // Sums of whole numbers, which are exact in any order.
    let total = |counts: &[[f32; 3]], at: usize| -> f64 {
        counts.iter().map(|count| f64::from(count[at])).sum()
    };
    let n_near = |counts: &[[f32; 3]]| total(counts, 0) + total(counts, 1);
    let farther = n_near(&counts(FARTHER));
    let counts = counts(NEAR);
    if farther > MOST_FARTHER * n_near(&counts) {
        return Err(Unknown::NearEntries);
    }
    let of_map = (n_near(&counts) / total(&counts, 2).max(1.0)) as f32;
    let share = |[lists, listed, all]: [f32; 3]| (lists + listed) / all.max(1.0);
    let rays = released.obfuscation().rays();
    let center = |slot: usize| rays.map(|rays| rays.center()[slot]);
    let of_slot = |slot: usize| {
        if !estimates[slot].is_known() {
            return Confidence::LOST;
        }
        let (mut shares, mut foreign, mut ends) = (0.0, 0.0f32, 0.0f32);
        for end in graph.of(slot).flat_map(|edge| near(slot, NEAR, edge)) {
            shares += share(counts[end]);
            foreign += f32::from(u8::from(center(end) != center(slot)));
            ends += 1.0;
        }
        let of_near = libm::logf(shares / ends.max(1.0) + LEAST);
        let foreign = if kind == 2 { foreign / ends.max(1.0) } else { 1.0 };
        let [lists, listed, _] = counts[slot];
        let cues = [
            libm::log1pf(lists),
            libm::log1pf(listed),
            of_near,
            libm::logf(of_map + LEAST),
            libm::logf(foreign + LEAST_FOREIGN),
        ];
        let sum = |weights: &[f32], cues: &[f32]| -> f32 {
            weights.iter().zip(cues).map(|(weight, cue)| weight * cue).sum()
        };
        let logit = OF_KIND[kind].0 + sum(&FOUND, &cues);
        let scale = OF_KIND[kind].1 + sum(&SCALE, &[libm::log1pf(lists + listed), of_near]);
        Confidence {
            found: 1.0 / (1.0 + libm::expf(-logit)),
            scale: radius[slot] * libm::expf(scale),
        }
    };
    Ok(parallel::map(n, of_slot))
}

/// Returns the radius of every slot; the median for lost ones. `None` without estimates.
fn radii<const D: usize>(estimates: &[Estimate<D>]) -> Option<Vec<f32>> {
    let (slots, points) = known(estimates);
    let tree = Knn::new(&points).ok()?;
    let found = tree.kth_distances(NEIGHBOR);
    let median = median(&mut found.clone()) as f32;
    let mut radius = vec![median; estimates.len()];
    for (&slot, found) in slots.iter().zip(found) {
        radius[slot as usize] = (found as f32).clamp(RADII.0 * median, RADII.1 * median);
    }
    Some(radius)
}

/// Longest mean list, as a fraction of all hidden points, in the maps on which the model was fitted.
const MAX_LISTED: f64 = 0.01;
/// A map is flat if its smallest extent is at most this fraction of its largest one.
const FLAT: f64 = 0.01;

/// Returns why the model does not apply to maps recovered from `lists`, if so.
///
/// In these cases, one tenth to nine tenths of the estimates with a predicted probability of 90 % were right.
fn unknown<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    estimates: &[Estimate<D>],
) -> Option<Unknown> {
    let n_slots = lists.n_slots() as f64;
    let mean = lists.records().len() as f64 / n_slots.max(1.0);
    if D == 2 {
        Some(Unknown::OfImages)
    } else if lists.scores().is_some() {
        Some(Unknown::RankedLists)
    } else if !lists.about().by_oracle {
        Some(Unknown::GivenLists)
    } else if mean > MAX_LISTED * n_slots {
        Some(Unknown::SmallMap)
    } else if twins(released.obfuscation()) >= 0.5 {
        Some(Unknown::Coincident)
    } else {
        (flatness(&known(estimates).1) <= FLAT).then_some(Unknown::Flat)
    }
}

/// Returns the fraction of rays or planes that equal another one, as different points hardly do. Other records are drawn at random.
fn twins<const D: usize>(obfuscation: &Obfuscation<D>) -> f64 {
    let mut rows: Vec<(u8, [u32; D])> = match obfuscation {
        Obfuscation::Rays(rays) => {
            let directions = rays.direction().iter().map(|d| d.map(f32::to_bits));
            rays.center().iter().copied().zip(directions).collect()
        }
        Obfuscation::AxisPlanes(planes) => {
            let offsets = planes.offset().iter().map(|offset| [offset.to_bits(); D]);
            planes.axis().iter().copied().zip(offsets).collect()
        }
        Obfuscation::Lines(_) | Obfuscation::AxisCandidates(_) => return 0.0,
    };
    rows.sort_unstable();
    let same = rows.chunk_by(|a, b| a == b).map(<[_]>::len).filter(|&n| n > 1);
    same.sum::<usize>() as f64 / rows.len().max(1) as f64
}
