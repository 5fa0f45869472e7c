//! From cues to a probability: one small model per solver and kind of record, fitted on synthetic rooms.

use super::constants::{CENTER, MODELS, SPREAD};
use super::cues::{Cues, N_CUES};
use crate::recover::Solver;
use crate::released::{Obfuscation, Released};

/// Kinds of records that are calibrated apart: lines, paired lines, rays, axis planes, axis candidates.
pub const N_KINDS: usize = 5;

/// Pairs of cues whose products count too.
const PRODUCTS: [(usize, usize); 27] = [
    (0, 0),
    (2, 2),
    (3, 3),
    (7, 7),
    (8, 8),
    (0, 7),
    (0, 9),
    (7, 9),
    (9, 9),
    (0, 2),
    (10, 10),
    (11, 11),
    (0, 10),
    (3, 11),
    (3, 9),
    (14, 14),
    (0, 14),
    (0, 15),
    (14, 15),
    (0, 16),
    (9, 16),
    (18, 18),
    (0, 18),
    (18, 19),
    (19, 19),
    (9, 19),
    (10, 19),
];

/// Number of terms: the constant, the cues, and the products.
pub const N_TERMS: usize = 1 + N_CUES + PRODUCTS.len();

/// Terms farther than this many spreads from the center count as that far: nothing was seen there.
const FARTHEST: f32 = 4.0;

/// The weights of one solver and kind of record.
pub(super) struct Model {
    /// Of the logit of the right place.
    pub(super) found: [f32; N_TERMS],
    /// Of the logarithm of the error scale per typical radius of crowds.
    pub(super) scale: [f32; N_TERMS],
}

/// How sure the attacker is of one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    /// The probability that the right place was found, up to an error.
    pub found: f32,
    /// The median of that error, in the unit of the map.
    pub scale: f32,
}

impl Confidence {
    /// What is said of a slot without a position.
    pub const LOST: Self = Self { found: 0.0, scale: f32::INFINITY };

    /// The probability that the true place is at most `threshold` away, in the unit of the map:
    /// `found / (1 + (scale / threshold)^2)`.
    pub fn probability_within(&self, threshold: f64) -> f64 {
        let ratio = f64::from(self.scale) / threshold;
        if ratio.is_finite() { f64::from(self.found) / (1.0 + ratio * ratio) } else { 0.0 }
    }
}

/// Which kind of records a map holds, below [`N_KINDS`].
pub(super) fn kind<const D: usize>(released: &Released<D>) -> usize {
    match released.obfuscation() {
        Obfuscation::Lines(_) => released.slots_per_record() - 1,
        Obfuscation::Rays(_) => 2,
        Obfuscation::AxisPlanes(_) => 3,
        Obfuscation::AxisCandidates(_) => 4,
    }
}

/// The cues, their products and a constant, before they are centered.
pub fn terms(cues: &Cues) -> [f32; N_TERMS] {
    let mut terms = [1.0; N_TERMS];
    terms[1..=N_CUES].copy_from_slice(cues);
    for (term, (a, b)) in terms[1 + N_CUES..].iter_mut().zip(PRODUCTS) {
        *term = cues[a] * cues[b];
    }
    terms
}

/// Terms centered and scaled, none too far; the constant stays 1.
pub fn centered(terms: [f32; N_TERMS], center: &[f32], spread: &[f32]) -> [f32; N_TERMS] {
    let far = |at: usize| ((terms[at] - center[at]) / spread[at]).clamp(-FARTHEST, FARTHEST);
    std::array::from_fn(|at| if at == 0 { 1.0 } else { far(at) })
}

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
