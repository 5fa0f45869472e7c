//! How sure the attacker can be of each recovered point, from attacker-side data alone.
//!
//! After joint recovery `crowd.rs` measures around every slot how much better than by chance estimates and records agree. A
//! logistic model turns these cues into the probability that the right place was found, and a scale of its error. Its constants
//! come from synthetic rooms (`examples/fit_confidence.rs`), never from a real map.

mod constants;
pub(super) mod cues;

use rayon::prelude::*;

use crate::ListsBy;
use crate::geometry::flatness::flatness;
use crate::geometry::vector::widen;
use crate::neighbors::Neighborhoods;
use crate::recover::confidence::constants::{CENTER, MODELS, SPREAD};
use crate::recover::confidence::cues::{Cues, N_CUES, Seen, Solved};
use crate::recover::map::family::{Family, Settings};
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, PlanePieces};
use crate::recover::options::RecoverOptions;
use crate::recover::result::{Confidence, Estimate, Status, Unknown};
use crate::recover::solver::Builtin;
use crate::released::{Obfuscation, Rays, Released};

/// Why nobody looks how sure the attacker is, if `options` or the kind of map say so.
pub(super) fn not_asked<const D: usize>(
    solver: Builtin,
    options: &RecoverOptions,
) -> Option<Unknown> {
    match solver {
        Builtin::Joint if !options.confidence => Some(Unknown::NotAsked),
        Builtin::Joint if !Settings::of_dimension::<D>().confidence => Some(Unknown::OfImages),
        Builtin::Joint => None,
        _ => Some(Unknown::OtherSolver),
    }
}

/// How sure the attacker is of every slot of joint recovery, and the cues that say so.
pub(super) fn predict<const D: usize>(
    family: &Family<'_, D>,
    graph: &Graph,
    released: &Released<D>,
    solved: &Solved<'_, D>,
) -> (Vec<Confidence>, Seen) {
    let (cues, radius) = match family {
        Family::Lines { rows, slots_per_record, chance } => {
            let pieces = LinePieces::new(rows, *slots_per_record, chance, solved.delta);
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
        Status::Ok => predict_slot(&MODELS[kind], cues, radius),
        _ => Confidence::LOST,
    };
    let sure = solved.estimates.par_iter().zip(&cues).map(of_slot).collect();
    (sure, Seen { cues, radius: f64::from(radius), kind })
}

/// What `cues` say about one slot; lengths are multiples of `radius`.
fn predict_slot(model: &Model, cues: &Cues, radius: f32) -> Confidence {
    let terms = centered(terms(cues), &CENTER, &SPREAD);
    let sum =
        |weights: &[f32; N_TERMS]| -> f32 { terms.iter().zip(weights).map(|(t, w)| t * w).sum() };
    let scale = libm::expf(sum(&model.scale).clamp(-12.0, 12.0)) * radius;
    Confidence { found: 1.0 / (1.0 + libm::expf(-sum(&model.found))), scale }
}

/// A list has at most as many entries as this share of all hidden points in the maps that the model was fitted on.
const MOST_LISTED: f64 = 0.01;

/// A map is flat whose smallest extent is at most this share of its largest one.
const FLAT: f64 = 0.01;

/// Points fall together where at least this share of all rays has another one in its place. Of points that differ this
/// hardly ever happens by rounding.
const COINCIDENT: f64 = 0.5;

/// Why the model says nothing that comes true about maps recovered from `lists`, if so.
///
/// On smaller maps, on flat ones and on those of which most points fall together, and with lists that sources make, a tenth
/// to nine tenths of those called 90 % sure were right.
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
    } else if matches!(released.obfuscation(), Obfuscation::Rays(rays) if twins(rays) >= COINCIDENT)
    {
        // Records of other families are drawn anew for every point, or for a pair.
        Some(Unknown::Coincident)
    } else {
        (flatness(&places()) <= FLAT).then_some(Unknown::Flat)
    }
}

/// Share of the rays of which there is another one, bit for bit.
fn twins<const D: usize>(rays: &Rays<D>) -> f64 {
    let bits = |row: usize| (rays.center()[row], rays.direction()[row].map(f32::to_bits));
    let mut rows: Vec<_> = (0..rays.len()).into_par_iter().map(bits).collect();
    rows.par_sort_unstable();
    let same = rows.chunk_by(|a, b| a == b).map(<[_]>::len).filter(|&n| n > 1);
    same.sum::<usize>() as f64 / rays.len().max(1) as f64
}

/// Kinds of records that are calibrated apart: lines, paired lines, rays, axis planes, axis candidates.
pub const N_KINDS: usize = 5;

/// Number of products of two cues that count too.
const N_PRODUCTS: usize = 27;

/// Number of terms: the constant, the cues, and the products.
pub const N_TERMS: usize = 1 + N_CUES + N_PRODUCTS;

/// Terms farther than this many spreads from the center count as that far: nothing was seen there.
const FARTHEST: f32 = 4.0;

/// The weights of one kind of record.
pub(super) struct Model {
    /// Of the logit of the right place.
    pub(super) found: [f32; N_TERMS],
    /// Of the logarithm of the error scale per typical radius of crowds.
    pub(super) scale: [f32; N_TERMS],
}

/// The products of two cues that count too: what one says depends on the other, or bends.
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

/// A constant, the cues and their products, before they are centered.
pub fn terms(cues: &Cues) -> [f32; N_TERMS] {
    let mut terms = [1.0; N_TERMS];
    terms[1..=N_CUES].copy_from_slice(cues);
    terms[1 + N_CUES..].copy_from_slice(&products(cues));
    terms
}

/// Terms centered and scaled, none too far; the constant stays 1.
pub fn centered(terms: [f32; N_TERMS], center: &[f32], spread: &[f32]) -> [f32; N_TERMS] {
    let far = |at: usize| ((terms[at] - center[at]) / spread[at]).clamp(-FARTHEST, FARTHEST);
    std::array::from_fn(|at| if at == 0 { 1.0 } else { far(at) })
}

#[cfg(test)]
mod tests {
    use super::twins;
    use crate::released::Rays;

    #[test]
    fn rays_in_the_same_place_from_the_same_center_are_twins() {
        let centers = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        let up = [0.0, 0.0, 1.0];
        let rays = |center: Vec<u8>, directions: Vec<[f64; 3]>| {
            Rays::try_new(&centers, center, &directions).unwrap()
        };
        assert_eq!(twins(&rays(vec![0, 0, 0, 1], vec![up, up, [0.0, 1.0, 0.0], up])), 0.5);
        assert_eq!(twins(&rays(vec![0, 1], vec![up, up])), 0.0);
    }
}
