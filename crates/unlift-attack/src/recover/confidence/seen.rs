//! What is seen around every slot, and what was recovered there.

use crate::recover::result::estimate::Estimate;

/// Number of cues.
pub const N_CUES: usize = 20;

/// The cues of one slot: pure numbers. Those of the map are the same for all its slots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cues {
    /// How improbable its crowd is by chance: `ln(1 + nats)`.
    pub evidence: f32,
    /// The logarithm of the members of the crowd beyond those expected by chance.
    pub ln_excess: f32,
    /// The logarithm of the radius of the crowd, per typical radius of the map.
    pub ln_radius: f32,
    /// How improbable it is by chance that so many records pass: `ln(1 + nats)`.
    pub record_evidence: f32,
    /// The logarithm of the records that pass beyond those expected by chance.
    pub ln_record_excess: f32,
    /// How far the middle of the crowd is off the estimate along its piece, per radius of the crowd.
    pub off_along: f32,
    /// The same across it.
    pub off_across: f32,
    /// The mean of `evidence` over the members of the crowd.
    pub of_members: f32,
    /// The logarithm of how much sparser estimates are than at a typical place.
    pub sparsity: f32,
    /// Of the map: the mean of `evidence`.
    pub map_evidence: f32,
    /// Of the map: the logarithm of the share of entries that are in crowds beyond chance.
    pub map_share: f32,
    /// Of the map: the logarithm of the share of entries whose records pass beyond chance.
    pub map_record_share: f32,
    /// Of the map: the logarithm of the typical radius of crowds per delta.
    pub map_ln_radius_per_delta: f32,
    /// The logarithm of the number of listed records that may vote.
    pub ln_listed: f32,
    /// The share of the crowd's members whose records may vote.
    pub voting_share: f32,
    /// Of the map: the mean of `voting_share`.
    pub map_voting_share: f32,
    /// 1 where an exact constraint moved the estimate, 0 elsewhere.
    pub is_settled: f32,
    /// How far it moved it, in typical radii: `ln(1 + radii)`.
    pub settled_by: f32,
    /// The logarithm of how many more members the slot lists than list it.
    pub one_sided: f32,
    /// Of the map: the mean of `one_sided` without its sign.
    pub map_one_sided: f32,
}

impl Cues {
    /// All cues, in the order in which the constants of the model were fitted.
    pub(super) fn in_order(&self) -> [f32; N_CUES] {
        [
            self.evidence,
            self.ln_excess,
            self.ln_radius,
            self.record_evidence,
            self.ln_record_excess,
            self.off_along,
            self.off_across,
            self.of_members,
            self.sparsity,
            self.map_evidence,
            self.map_share,
            self.map_record_share,
            self.map_ln_radius_per_delta,
            self.ln_listed,
            self.voting_share,
            self.map_voting_share,
            self.is_settled,
            self.settled_by,
            self.one_sided,
            self.map_one_sided,
        ]
    }
}

/// What the attacker sees around every slot.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Per slot.
    pub cues: Vec<Cues>,
    /// The typical radius of crowds, in the unit of the map: errors scale with it.
    pub radius: f64,
    /// The kind of the records, below [`N_KINDS`](super::model::N_KINDS): each has a model of its own.
    pub kind: usize,
}

impl Seen {
    /// Nobody looked.
    pub(crate) const NOTHING: Self = Self { cues: Vec::new(), radius: 1.0, kind: 0 };
}

/// What recovery found.
pub(crate) struct Solved<'a, const D: usize> {
    /// Per slot.
    pub(crate) estimates: &'a [Estimate<D>],
    /// The same before exact constraints moved them.
    pub(crate) unsettled: &'a [Estimate<D>],
    /// The distance that decided support.
    pub(crate) delta: f32,
}
