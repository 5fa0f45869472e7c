//! Confidence: the probability that an estimate is right, predicted without ground truth.
//!
//! After joint recovery, `cues.rs` measures around every slot how much better than by chance estimates and records agree. A logistic
//! model turns these cues into the probability that the right place was found and into a scale of its error. Its constants
//! were fitted on synthetic rooms, never on a real map.

mod constants;
pub(super) mod cues;

use rayon::prelude::*;

use crate::ListsBy;
use crate::geometry::flatness::flatness;
use crate::geometry::vector::widen;
use crate::neighbors::Neighborhoods;
use crate::recover::confidence::constants::CONSTANTS;
use crate::recover::confidence::cues::{Cues, N_CUES, Solved};
use crate::recover::map::family::{Family, Settings};
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, PlanePieces};
use crate::recover::options::RecoverOptions;
use crate::recover::result::{Confidence, Estimate, Status, Unknown};
use crate::recover::solver::Builtin;
use crate::released::{Obfuscation, Released};

/// Returns why confidence is not computed, if options, solver or dimension say so.
pub(super) fn not_asked<const D: usize>(
    solver: Builtin,
    options: &RecoverOptions,
) -> Option<Unknown> {
    match solver {
        Builtin::Joint if !options.confidence => Some(Unknown::NotAsked),
        Builtin::Joint => (!Settings::of_dimension::<D>().confidence).then_some(Unknown::OfImages),
        _ => Some(Unknown::OtherSolver),
    }
}

/// Predicts the confidence of every slot.
pub(super) fn predict<const D: usize>(
    family: &Family<'_, D>,
    graph: &Graph,
    released: &Released<D>,
    solved: &Solved<'_, D>,
) -> Vec<Confidence> {
    let (cues, radius) = match family {
        Family::Lines { rows, slots_per_record, chance, has_regions } => {
            let pieces =
                LinePieces::new(rows, *slots_per_record, (chance, *has_regions), solved.delta);
            cues::of_slots(&pieces, graph, solved)
        }
        Family::Planes { planes, sorted } => {
            cues::of_slots(&PlanePieces::new(planes, sorted, solved.delta), graph, solved)
        }
        Family::Candidates { rows, chance } => {
            cues::of_slots(&CandidatePieces::new(rows, chance, solved.delta), graph, solved)
        }
    };
    let kind = match released.obfuscation() {
        Obfuscation::Lines(_) => released.slots_per_record() - 1,
        Obfuscation::Rays(_) => 2,
        Obfuscation::AxisPlanes(_) => 3,
        Obfuscation::AxisCandidates(_) => 4,
    };
    let of_slot = |(estimate, cues): (&Estimate<D>, &Cues)| match estimate.status {
        Status::Ok => predict_slot(&CONSTANTS, kind, cues, radius),
        _ => Confidence::LOST,
    };
    solved.estimates.par_iter().zip(&cues).map(of_slot).collect()
}

/// Predicts the confidence of one slot from its cues. Errors are in units of `radius`.
fn predict_slot(constants: &Constants, kind: usize, cues: &Cues, radius: f32) -> Confidence {
    let Constants { center, spread, models } = constants;
    let model = &models[kind];
    let terms = centered(terms(cues), center, spread);
    let sum =
        |weights: &[f32; N_TERMS]| -> f32 { terms.iter().zip(weights).map(|(t, w)| t * w).sum() };
    let scale = libm::expf(sum(&model.scale).clamp(-12.0, 12.0)) * radius;
    Confidence { found: 1.0 / (1.0 + libm::expf(-sum(&model.found))), scale }
}

/// Longest mean list, as a fraction of all hidden points, in the maps on which the model was fitted.
const MOST_LISTED: f64 = 0.01;

/// A map is flat if its smallest extent is at most this fraction of its largest one.
const FLAT: f64 = 0.01;

/// Points coincide if at least this fraction of all rays or planes equals another one. Different points hardly ever have equal ones.
const COINCIDENT: f64 = 0.5;

/// Returns why the model does not apply to maps recovered from `lists`, if so.
///
/// In these cases, one tenth to nine tenths of the estimates with a predicted probability of 90 % were right.
pub(crate) fn unknown<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    estimates: &[Estimate<D>],
) -> Option<Unknown> {
    let n_slots = lists.n_slots() as f64;
    let mean = lists.records().len() as f64 / n_slots.max(1.0);
    let found = || estimates.iter().filter(|one| one.status == Status::Ok);
    let places = || -> Vec<[f64; D]> { found().map(|one| widen(&one.position)).collect() };
    if lists.scores().is_some() {
        Some(Unknown::RankedLists)
    } else if lists.about().lists_by != ListsBy::Oracle {
        Some(Unknown::GivenLists)
    } else if mean > MOST_LISTED * n_slots {
        Some(Unknown::SmallMap)
    } else if twins(released.obfuscation()) >= COINCIDENT {
        // Other records are drawn at random, so that coinciding points do not have equal lines or candidates.
        Some(Unknown::Coincident)
    } else {
        (flatness(&places()) <= FLAT).then_some(Unknown::Flat)
    }
}

/// Returns the fraction of rays or planes that equal another one bit for bit.
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
    rows.par_sort_unstable();
    let same = rows.chunk_by(|a, b| a == b).map(<[_]>::len).filter(|&n| n > 1);
    same.sum::<usize>() as f64 / rows.len().max(1) as f64
}

/// Kinds of records with separate models: lines, paired lines, rays, axis planes, axis candidates.
const N_KINDS: usize = 5;

const N_PRODUCTS: usize = 27;

/// Number of terms: the constant, the cues and the products.
const N_TERMS: usize = 1 + N_CUES + N_PRODUCTS;

/// Terms are clipped at this many standard deviations, because the fit saw no others.
const FARTHEST: f32 = 4.0;

/// What the fit found.
pub(super) struct Constants {
    /// Means of the terms.
    pub(super) center: [f32; N_TERMS],
    /// Standard deviations of the terms.
    pub(super) spread: [f32; N_TERMS],
    /// Per kind of records.
    pub(super) models: [Model; N_KINDS],
}

/// Weights of the terms for one kind of records.
pub(super) struct Model {
    /// For the logit of the probability that the estimate is right.
    pub(super) found: [f32; N_TERMS],
    /// For the logarithm of the error scale in units of the typical radius.
    pub(super) scale: [f32; N_TERMS],
}

fn products(cues: &Cues) -> [f32; N_PRODUCTS] {
    let [evidence, _, ln_radius, record_evidence, _, _, _, of_members, sparsity, map_evidence, ..] =
        *cues;
    let [
        ..,
        map_fraction,
        map_record_fraction,
        _,
        _,
        voting_fraction,
        map_voting_fraction,
        settled,
        _,
        _,
        _,
    ] = *cues;
    let [.., one_sided, map_one_sided] = *cues;
    [
        evidence * evidence,
        ln_radius * ln_radius,
        record_evidence * record_evidence,
        of_members * of_members,
        sparsity * sparsity,
        evidence * of_members,
        evidence * map_evidence,
        of_members * map_evidence,
        map_evidence * map_evidence,
        evidence * ln_radius,
        map_fraction * map_fraction,
        map_record_fraction * map_record_fraction,
        evidence * map_fraction,
        record_evidence * map_record_fraction,
        record_evidence * map_evidence,
        voting_fraction * voting_fraction,
        evidence * voting_fraction,
        evidence * map_voting_fraction,
        voting_fraction * map_voting_fraction,
        evidence * settled,
        map_evidence * settled,
        one_sided * one_sided,
        evidence * one_sided,
        one_sided * map_one_sided,
        map_one_sided * map_one_sided,
        map_evidence * map_one_sided,
        map_fraction * map_one_sided,
    ]
}

/// Returns the constant, the cues and their products, not yet centered.
fn terms(cues: &Cues) -> [f32; N_TERMS] {
    let mut terms = [1.0; N_TERMS];
    terms[1..=N_CUES].copy_from_slice(cues);
    terms[1 + N_CUES..].copy_from_slice(&products(cues));
    terms
}

/// Centers, scales and clips terms; the constant stays 1.
fn centered(terms: [f32; N_TERMS], center: &[f32], spread: &[f32]) -> [f32; N_TERMS] {
    let far = |at: usize| ((terms[at] - center[at]) / spread[at]).clamp(-FARTHEST, FARTHEST);
    std::array::from_fn(|at| if at == 0 { 1.0 } else { far(at) })
}
