//! The crowd around one estimate, and what crowds of a whole map have in common.

use crate::recover::result::Estimate;

/// Ratios of lengths are told apart down to this: a logarithm needs a floor.
const LEAST_RATIO: f32 = 1e-3;

/// The listed estimates that crowd around one estimate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Crowd {
    /// How improbable it is by chance, in nats.
    pub(super) evidence: f32,
    /// The radius that makes it least probable.
    pub(super) radius: f32,
    /// Members beyond those expected by chance.
    pub(super) excess: f32,
    /// How far its middle is off the estimate, along and across the piece, per radius.
    pub(super) off: [f32; 2],
    /// The same measures of listed records that pass within delta.
    pub(super) record_evidence: f32,
    pub(super) record_excess: f32,
    /// Records that could have voted.
    pub(super) listed: f32,
    /// The share of members whose records may vote.
    pub(super) voting_share: f32,
    /// How far exact constraints moved the estimate, if they did.
    pub(super) settled: Option<f32>,
    /// The mean of the logarithm of the members' own evidence; of the second pass.
    pub(super) of_members: f32,
    /// The logarithm of how many more members the slot lists than list it. Look-alikes agree on a wrong place, but
    /// those who are there do not name who is not. Of the second pass.
    pub(super) one_sided: f32,
    pub(super) sparsity: f32,
}

/// What is the same for all slots.
pub(super) struct Map {
    /// The typical radius of crowds.
    pub(super) radius: f32,
    evidence: f32,
    voting_share: f32,
    one_sided: f32,
    share: f32,
    record_share: f32,
    ln_radius_per_delta: f32,
}

/// What is asked of all crowds, which come in order of slots.
#[derive(Default)]
pub(super) struct Tally {
    /// Number of slots, and those that were added.
    n: usize,
    added: usize,
    evidence: f64,
    voting_share: f64,
    one_sided: f64,
    listed: f64,
    excess: f64,
    record_excess: f64,
    /// Radius and evidence of some crowds.
    radii: Vec<(f32, f32)>,
}

/// Crowds that tell the typical radius, at most.
const RADII: usize = 1 << 14;

impl Tally {
    /// Of no crowd yet, out of `n`.
    pub(super) fn new(n: usize) -> Self {
        Self { n, ..Self::default() }
    }

    /// Counts those of the next slots.
    pub(super) fn add(&mut self, crowds: &[Crowd]) {
        let every = self.n.div_ceil(RADII).max(1);
        for crowd in crowds {
            self.evidence += f64::from(libm::log1pf(crowd.evidence));
            self.voting_share += f64::from(crowd.voting_share);
            self.one_sided += f64::from(crowd.one_sided.abs());
            self.listed += f64::from(crowd.listed);
            self.excess += f64::from(crowd.excess);
            self.record_excess += f64::from(crowd.record_excess);
            if self.added.is_multiple_of(every) && crowd.evidence > 0.0 && crowd.radius > 0.0 {
                self.radii.push((crowd.radius, crowd.evidence));
            }
            self.added += 1;
        }
    }

    /// The median radius of crowds, each counted as its evidence.
    fn radius(&mut self) -> Option<f32> {
        self.radii.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let half = 0.5 * self.radii.iter().map(|s| f64::from(s.1)).sum::<f64>();
        let mut sum = 0.0;
        for (radius, weight) in &self.radii {
            sum += f64::from(*weight);
            if sum >= half {
                return Some(*radius);
            }
        }
        None
    }

    /// What is the same for all slots, where delta decided support.
    pub(super) fn map(mut self, delta: f32) -> Map {
        let n = self.n.max(1) as f64;
        let share =
            |found: f64| libm::logf(((found / self.listed.max(1.0)) as f32).max(LEAST_RATIO));
        let (share, record_share) = (share(self.excess), share(self.record_excess));
        let radius = self.radius().unwrap_or(delta);
        Map {
            radius,
            evidence: (self.evidence / n) as f32,
            voting_share: (self.voting_share / n) as f32,
            one_sided: (self.one_sided / n) as f32,
            share,
            record_share,
            ln_radius_per_delta: libm::logf((radius / delta).max(LEAST_RATIO)),
        }
    }
}

impl Map {
    /// The cues of a slot.
    pub(super) fn cues(&self, crowd: &Crowd) -> Cues {
        let ln = |x: f32| libm::logf(x.max(LEAST_RATIO));
        let evidence = libm::log1pf(crowd.evidence);
        let record_evidence = libm::log1pf(crowd.record_evidence);
        let ln_radius = ln(crowd.radius / self.radius);
        Cues {
            evidence,
            ln_excess: ln(crowd.excess.max(0.1)),
            ln_radius,
            record_evidence,
            ln_record_excess: ln(crowd.record_excess.max(0.1)),
            off_along: crowd.off[0],
            off_across: crowd.off[1],
            of_members: crowd.of_members,
            sparsity: crowd.sparsity,
            map_evidence: self.evidence,
            map_share: self.share,
            map_record_share: self.record_share,
            map_ln_radius_per_delta: self.ln_radius_per_delta,
            ln_listed: ln(crowd.listed.max(0.1)),
            voting_share: crowd.voting_share,
            map_voting_share: self.voting_share,
            is_settled: if crowd.settled.is_some() { 1.0 } else { 0.0 },
            settled_by: libm::log1pf(crowd.settled.unwrap_or(0.0) / self.radius),
            one_sided: crowd.one_sided,
            map_one_sided: self.one_sided,
        }
    }
}

// What is seen around every slot, and what was recovered there.

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
    /// How far the middle of the crowd is off the estimate across its piece, per radius of the crowd.
    pub off_across: f32,
    /// The mean of `evidence` over the members of the crowd.
    pub of_members: f32,
    /// The logarithm of how much sparser estimates are than at a typical place.
    pub sparsity: f32,
    /// The mean of `evidence` over all slots of the map.
    pub map_evidence: f32,
    /// The logarithm of the share of all entries of the map that are in crowds beyond chance.
    pub map_share: f32,
    /// The logarithm of the share of all entries of the map whose records pass beyond chance.
    pub map_record_share: f32,
    /// The logarithm of the typical radius of crowds in the map, per delta.
    pub map_ln_radius_per_delta: f32,
    /// The logarithm of the number of listed records that may vote.
    pub ln_listed: f32,
    /// The share of the crowd's members whose records may vote.
    pub voting_share: f32,
    /// The mean of `voting_share` over all slots of the map.
    pub map_voting_share: f32,
    /// 1 where an exact constraint moved the estimate, 0 elsewhere.
    pub is_settled: f32,
    /// How far it moved it, in typical radii: `ln(1 + radii)`.
    pub settled_by: f32,
    /// The logarithm of how many more members the slot lists than list it.
    pub one_sided: f32,
    /// The mean of `one_sided`, without its sign, over all slots of the map.
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
    /// The kind of the records, below [`N_KINDS`](super::N_KINDS): each has a model of its own.
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
    /// The estimates per slot before exact constraints moved them.
    pub(crate) unsettled: &'a [Estimate<D>],
    /// The distance that decided support.
    pub(crate) delta: f32,
}
