//! From cues to a probability: one small model per kind of record, fitted on synthetic rooms.

use super::seen::{Cues, N_CUES};
use crate::released::{Obfuscation, Released};

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

/// Which kind of records a map holds, below [`N_KINDS`].
pub(super) fn kind<const D: usize>(released: &Released<D>) -> usize {
    match released.obfuscation() {
        Obfuscation::Lines(_) => released.slots_per_record() - 1,
        Obfuscation::Rays(_) => 2,
        Obfuscation::AxisPlanes(_) => 3,
        Obfuscation::AxisCandidates(_) => 4,
    }
}

/// The products of two cues that count too: what one says depends on the other, or bends.
fn products(c: &Cues) -> [f32; N_PRODUCTS] {
    [
        c.evidence * c.evidence,
        c.ln_radius * c.ln_radius,
        c.record_evidence * c.record_evidence,
        c.of_members * c.of_members,
        c.sparsity * c.sparsity,
        c.evidence * c.of_members,
        c.evidence * c.map_evidence,
        c.of_members * c.map_evidence,
        c.map_evidence * c.map_evidence,
        c.evidence * c.ln_radius,
        c.map_share * c.map_share,
        c.map_record_share * c.map_record_share,
        c.evidence * c.map_share,
        c.record_evidence * c.map_record_share,
        c.record_evidence * c.map_evidence,
        c.voting_share * c.voting_share,
        c.evidence * c.voting_share,
        c.evidence * c.map_voting_share,
        c.voting_share * c.map_voting_share,
        c.evidence * c.is_settled,
        c.map_evidence * c.is_settled,
        c.one_sided * c.one_sided,
        c.evidence * c.one_sided,
        c.one_sided * c.map_one_sided,
        c.map_one_sided * c.map_one_sided,
        c.map_evidence * c.map_one_sided,
        c.map_share * c.map_one_sided,
    ]
}

/// A constant, the cues and their products, before they are centered.
pub fn terms(cues: &Cues) -> [f32; N_TERMS] {
    let mut terms = [1.0; N_TERMS];
    terms[1..=N_CUES].copy_from_slice(&cues.in_order());
    terms[1 + N_CUES..].copy_from_slice(&products(cues));
    terms
}

/// Terms centered and scaled, none too far; the constant stays 1.
pub fn centered(terms: [f32; N_TERMS], center: &[f32], spread: &[f32]) -> [f32; N_TERMS] {
    let far = |at: usize| ((terms[at] - center[at]) / spread[at]).clamp(-FARTHEST, FARTHEST);
    std::array::from_fn(|at| if at == 0 { 1.0 } else { far(at) })
}
