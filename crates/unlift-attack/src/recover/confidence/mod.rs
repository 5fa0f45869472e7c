//! How sure the attacker can be of each recovered point, from attacker-side data alone.
//!
//! After joint recovery every slot is looked at once more: `cues.rs` measures how much better than by chance
//! estimates and records agree around it, and `model.rs` turns that into the probability that the right
//! place was found and a scale of its error. Its constants come from synthetic rooms
//! (`examples/fit_confidence.rs`), never from a real map. Cues are ratios: a scaled map has the same.

mod applies;
mod constants;
mod crowd;
mod cues;
pub(super) mod model;
pub(super) mod seen;

pub(super) use applies::unknown;
use rayon::prelude::*;

use crate::recover::map::family::Family;
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, PlanePieces};
use crate::recover::map::settings::Settings;
use crate::recover::options::{RecoverOptions, Solver};
use crate::recover::result::estimate::{Estimate, Status};
use crate::recover::result::probability::Confidence;
use crate::recover::result::unknown::Unknown;
use crate::released::Released;
use constants::{CENTER, MODELS, SPREAD};
use model::{Model, N_TERMS, centered, terms};
use seen::{Cues, Seen, Solved};

/// Why nobody looks how sure the attacker is, if `options` or the kind of map say so.
pub(super) fn not_asked<const D: usize>(options: &RecoverOptions) -> Option<Unknown> {
    match options.solver {
        Solver::Joint if !options.confidence => Some(Unknown::NotAsked),
        Solver::Joint if !Settings::of_dimension::<D>().confidence => Some(Unknown::OfImages),
        Solver::Joint => None,
        Solver::JointStart
        | Solver::Consensus
        | Solver::Ransac
        | Solver::Density
        | Solver::Tomography => Some(Unknown::OtherSolver),
    }
}

/// How sure the attacker is of every slot of joint recovery, and the cues that say so.
pub(super) fn look<const D: usize>(
    family: &Family<'_, D>,
    graph: &Graph,
    released: &Released<D>,
    solved: &Solved<'_, D>,
) -> (Vec<Confidence>, Seen) {
    let (cues, radius) = match family {
        Family::Lines { rows, slots_per_record, chance } => {
            let pieces = LinePieces::new(rows, *slots_per_record, chance, solved.delta);
            cues::of(&pieces, graph, solved)
        }
        Family::Planes { planes, sorted } => {
            cues::of(&PlanePieces::new(planes, sorted, solved.delta), graph, solved)
        }
        Family::Candidates { rows, chance } => {
            cues::of(&CandidatePieces::new(rows, chance, solved.delta), graph, solved)
        }
    };
    let kind = model::kind(released);
    let of_slot = |(estimate, cues): (&Estimate<D>, &Cues)| match estimate.status {
        Status::Ok => judged(&MODELS[kind], cues, radius as f32),
        _ => Confidence::LOST,
    };
    let sure = solved.estimates.par_iter().zip(&cues).map(of_slot).collect();
    (sure, Seen { cues, radius, kind })
}

/// What `cues` say about one slot; lengths are multiples of `radius`.
fn judged(model: &Model, cues: &Cues, radius: f32) -> Confidence {
    let terms = centered(terms(cues), &CENTER, &SPREAD);
    let sum =
        |weights: &[f32; N_TERMS]| -> f32 { terms.iter().zip(weights).map(|(t, w)| t * w).sum() };
    let scale = libm::expf(sum(&model.scale).clamp(-12.0, 12.0)) * radius;
    Confidence { found: 1.0 / (1.0 + libm::expf(-sum(&model.found))), scale }
}
