//! What cues say about one slot, by the constants that were fitted.

use super::constants::{CENTER, MODELS, SPREAD};
use super::model::{Model, N_TERMS, centered, terms};
use super::seen::Cues;
use crate::recover::options::Solver;
use crate::recover::result::probability::Confidence;

/// What `cues` say about slots solved by `solver`; lengths are multiples of `radius`.
pub(super) fn confidence(solver: Solver, kind: usize, cues: &Cues, radius: f32) -> Confidence {
    let of_solver = match solver {
        // The attacks on records alone have no cues and never come here.
        Solver::Consensus | Solver::Density | Solver::Tomography => 0,
        Solver::Joint | Solver::JointStart => 1,
        Solver::Ransac => 2,
    };
    let model: &Model = &MODELS[of_solver][kind];
    let terms = centered(terms(cues), &CENTER, &SPREAD);
    let sum =
        |weights: &[f32; N_TERMS]| -> f32 { terms.iter().zip(weights).map(|(t, w)| t * w).sum() };
    let scale = libm::expf(sum(&model.scale).clamp(-12.0, 12.0)) * radius;
    Confidence { found: 1.0 / (1.0 + libm::expf(-sum(&model.found))), scale }
}
