//! From cues to a probability: one small model per solver and kind of record, fitted on synthetic rooms.

use super::cues::{Cues, N_CUES};
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
