//! What an attacker sees that tells right estimates from wrong ones: pure numbers, no lengths.
//!
//! Around a right estimate the estimates of listed records crowd, and listed records pass, more than
//! chance has it. How crowded, within which radius, and how well the crowd centers on the estimate are
//! the cues of a slot; the same over the whole map tell how well recovery went at all, which no slot can
//! know alone: estimates that drifted together agree with each other.

use rayon::prelude::*;

use super::seen::{Cues, Seen, Solved};
use crate::recover::map::along_curve::along_curve;
use crate::recover::map::crowding::Density;
use crate::recover::map::evidence::evidence;
use crate::recover::map::graph::{Graph, Side, either, record_of, side};
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{Places, distance2};
use crate::recover::result::estimate::{Estimate, Status};

/// Crowds are looked for where chance expects at most this share of the listed estimates: beyond, a crowd is no news.
const MOST_CHANCE: f32 = 0.3;
/// The density of estimates is smooth over this many deltas: it must not follow the crowds that it judges.
const SMOOTH: f32 = 4.0;
/// Ratios of lengths are told apart down to this: a logarithm needs a floor.
const LEAST_RATIO: f32 = 1e-3;
/// Slots whose cues are taken by one thread at a time.
const PART: usize = 1 << 10;

/// The listed estimates that crowd around one estimate.
#[derive(Clone, Copy, Debug, Default)]
struct Crowd {
    /// How improbable it is by chance, in nats.
    evidence: f32,
    /// The radius that makes it least probable.
    radius: f32,
    /// Members beyond those expected by chance.
    excess: f32,
    /// How far its middle is off the estimate, along and across the piece, per radius.
    off: [f32; 2],
    /// The same measures of listed records that pass within delta.
    record_evidence: f32,
    record_excess: f32,
    /// Records that could have voted.
    listed: f32,
    /// The share of members whose records may vote.
    voting_share: f32,
    /// How far exact constraints moved the estimate, if they did.
    settled: Option<f32>,
    /// The mean of the logarithm of the members' own evidence; of the second pass.
    of_members: f32,
    /// The logarithm of how many more members the slot lists than list it. Look-alikes agree on a wrong place, but
    /// those who are there do not name who is not. Of the second pass.
    one_sided: f32,
    sparsity: f32,
}

/// A listed estimate near another: the squared distance, then the slot, as a number that sorts by both, so that
/// the order is the same everywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Near(u64);

impl Near {
    fn new(distance2: f32, slot: usize) -> Self {
        Self(u64::from(distance2.to_bits()) << 32 | slot as u64)
    }

    fn distance2(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    fn slot(self) -> usize {
        self.0 as u32 as usize
    }
}

/// What all slots are looked at with.
struct Look<'a, const D: usize, P> {
    pieces: &'a P,
    graph: &'a Graph,
    places: &'a Places<D>,
    density: &'a Density<D>,
    delta2: f32,
}

/// The cues of every slot, and the length (typical radius of crowds) that scales predicted errors.
pub(super) fn of<const D: usize, P: Pieces<D>>(
    pieces: &P,
    graph: &Graph,
    solved: &Solved<'_, D>,
) -> Seen {
    let Solved { estimates, unsettled, delta } = *solved;
    let slots_per_record = pieces.slots_per_record();
    let places = Places::new(estimates);
    let listed = graph.times_listed(estimates.len() / slots_per_record, slots_per_record);
    let density = Density::new(&places, &listed, SMOOTH * delta);
    let look = Look { pieces, graph, places: &places, density: &density, delta2: delta * delta };
    // Crowds in the order in which they are looked at, then by slot: neighbors are found in the cache.
    let order = along_curve(&places);
    let mut along = vec![Crowd::default(); estimates.len()];
    let by_part = || order.par_chunks(PART);
    along.par_chunks_mut(PART).zip(by_part()).for_each_init(Vec::new, |near, (crowds, slots)| {
        for (at, (crowd, &slot)) in crowds.iter_mut().zip(slots).enumerate() {
            let slot = slot as usize;
            if let Some(&next) = slots.get(at + 1) {
                look.prefetch(next as usize);
            }
            if estimates[slot].status == Status::Ok {
                *crowd = look.crowd(slot, &estimates[slot], near);
                let before = &unsettled[slot];
                if before.status == Status::Ok {
                    let moved2 = distance2(&before.position, &estimates[slot].position);
                    crowd.settled = (moved2 > 0.0).then(|| moved2.sqrt());
                }
            }
        }
    });
    let mut evidence = vec![0.0; estimates.len()];
    for (crowd, &slot) in along.iter().zip(&order) {
        evidence[slot as usize] = libm::log1pf(crowd.evidence);
    }
    along.par_chunks_mut(PART).zip(by_part()).for_each(|(crowds, slots)| {
        for (crowd, &slot) in crowds.iter_mut().zip(slots) {
            look.ask_members(slot as usize, crowd, &evidence);
        }
    });
    let mut crowds = vec![Crowd::default(); estimates.len()];
    for (crowd, &slot) in along.into_iter().zip(&order) {
        crowds[slot as usize] = crowd;
    }
    let map = Map::new(&crowds, delta);
    let cues = crowds.par_iter().map(|crowd| map.cues(crowd)).collect();
    Seen { cues, radius: f64::from(map.radius), ..Seen::NOTHING }
}

impl<const D: usize, P: Pieces<D>> Look<'_, D, P> {
    /// Brings near what [`crowd`](Self::crowd) looks at.
    fn prefetch(&self, slot: usize) {
        let slots_per_record = self.pieces.slots_per_record();
        for &end in self.graph.of(slot).0 {
            self.places.prefetch(end as usize);
            self.pieces.prefetch(record_of(end as usize, slots_per_record));
        }
    }

    fn crowd(&self, slot: usize, own: &Estimate<D>, near: &mut Vec<Near>) -> Crowd {
        let x = own.position;
        let density = self.density.at(&x);
        // Chance expects `rate * r^D` of the listed estimates within r, for one or either slot of a record.
        let rate = density * ball::<D>();
        let reach2 = libm::powf(MOST_CHANCE / rate, 2.0 / D as f32);
        near.clear();
        let (mut all, mut rates) = (0usize, 0.0f32);
        let (mut voting, mut votes) = (0usize, 0usize);
        let slots_per_record = self.pieces.slots_per_record();
        let (ends, class) = self.graph.of(slot);
        for (&end, &class) in ends.iter().zip(class) {
            let either = either(class, slots_per_record);
            let (d2, at) = self.places.nearest(end, either, &x);
            all += 1;
            rates += if either { 2.0 * rate } else { rate };
            if d2 < reach2 {
                near.push(Near::new(d2, at));
            }
            let record = record_of(end as usize, slots_per_record);
            if self.pieces.may_vote(slot, record) {
                voting += 1;
                votes += usize::from(self.pieces.record_distance2(record, &x) <= self.delta2);
            }
        }
        near.sort_unstable();
        let mean_rate = rates / all.max(1) as f32;
        let mut crowd = Crowd {
            listed: voting as f32,
            sparsity: self.density.sparsity(density),
            ..Crowd::default()
        };
        let mut members = 0;
        for (at, one) in near.iter().enumerate() {
            let d2 = one.distance2();
            let last = near.get(at + 1).is_none_or(|next| next.distance2() > d2);
            let p = (mean_rate * power::<D>(d2)).clamp(1e-9, MOST_CHANCE);
            if last && at > 0 {
                let nats = evidence((at + 1) as f32, all as f32, p);
                if nats > crowd.evidence {
                    members = at + 1;
                    crowd.evidence = nats;
                    crowd.radius = d2.sqrt();
                    crowd.excess = (members as f32 - p * all as f32).max(0.0);
                }
            }
        }
        let mut sum = [0.0f32; D];
        let mut voting_members = 0u32;
        for one in &near[..members] {
            let at = one.slot();
            let e = self.places.of(at);
            (0..D).for_each(|c| sum[c] += e[c] - x[c]);
            voting_members +=
                u32::from(self.pieces.may_vote(slot, record_of(at, slots_per_record)));
        }
        crowd.voting_share = voting_members as f32 / members.max(1) as f32;
        if members > 0 && crowd.radius > 0.0 {
            let piece = self.pieces.piece(slot, usize::from(own.axis));
            let scale = 1.0 / (members as f32 * crowd.radius);
            let mut along2 = 0.0;
            let mut all2 = 0.0;
            for r in 0..D {
                let along: f32 = (0..D).map(|c| piece.along[r][c] * sum[c]).sum();
                along2 += along * along;
                all2 += sum[r] * sum[r];
            }
            crowd.off = [along2.sqrt() * scale, (all2 - along2).max(0.0).sqrt() * scale];
        }
        let p = self.pieces.record_chance(slot, &x).clamp(1e-9, 0.5);
        crowd.record_evidence =
            if voting > 0 { evidence(votes as f32, voting as f32, p) } else { 0.0 };
        crowd.record_excess = votes as f32 - p * voting as f32;
        crowd
    }

    /// How well founded the members of a crowd are themselves.
    fn ask_members(&self, slot: usize, crowd: &mut Crowd, evidence: &[f32]) {
        if crowd.evidence <= 0.0 {
            return;
        }
        let x = self.places.of(slot);
        let reach2 = crowd.radius * crowd.radius * (1.0 + 1e-6);
        let (mut n, mut sum) = (0u32, 0.0);
        let (mut listed, mut listing) = (0u32, 0u32);
        let (ends, class) = self.graph.of(slot);
        for (&end, &class) in ends.iter().zip(class) {
            let either = either(class, self.pieces.slots_per_record());
            let (d2, at) = self.places.nearest(end, either, &x);
            if d2 <= reach2 {
                n += 1;
                sum += evidence[at];
                listed += u32::from(side(class) != Side::Reverse);
                listing += u32::from(side(class) != Side::Forward);
            }
        }
        crowd.of_members = sum / n.max(1) as f32;
        crowd.one_sided = libm::logf((listed + 1) as f32 / (listing + 1) as f32);
    }
}

/// What is the same for all slots.
struct Map {
    /// The typical radius of crowds.
    radius: f32,
    evidence: f32,
    voting_share: f32,
    one_sided: f32,
    share: f32,
    record_share: f32,
    ln_radius_per_delta: f32,
}

impl Map {
    fn new(crowds: &[Crowd], delta: f32) -> Self {
        let n = crowds.len().max(1) as f64;
        let mean = |of: &dyn Fn(&Crowd) -> f32| {
            (crowds.iter().map(|c| f64::from(of(c))).sum::<f64>() / n) as f32
        };
        let share = |excess: &dyn Fn(&Crowd) -> f32| {
            let listed: f64 = crowds.iter().map(|c| f64::from(c.listed)).sum();
            let found: f64 = crowds.iter().map(|c| f64::from(excess(c))).sum();
            (found / listed.max(1.0)) as f32
        };
        let radius = weighted_median(crowds).unwrap_or(delta);
        Self {
            radius,
            evidence: mean(&|c| libm::log1pf(c.evidence)),
            voting_share: mean(&|c| c.voting_share),
            one_sided: mean(&|c| c.one_sided.abs()),
            share: libm::logf(share(&|c| c.excess).max(LEAST_RATIO)),
            record_share: libm::logf(share(&|c| c.record_excess).max(LEAST_RATIO)),
            ln_radius_per_delta: libm::logf((radius / delta).max(LEAST_RATIO)),
        }
    }

    fn cues(&self, crowd: &Crowd) -> Cues {
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

/// The median radius of crowds, each counted as its evidence.
fn weighted_median(crowds: &[Crowd]) -> Option<f32> {
    let every = crowds.len().div_ceil(1 << 14).max(1);
    let mut sample: Vec<(f32, f32)> = crowds
        .iter()
        .step_by(every)
        .filter(|c| c.evidence > 0.0 && c.radius > 0.0)
        .map(|c| (c.radius, c.evidence))
        .collect();
    sample.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let half = 0.5 * sample.iter().map(|s| f64::from(s.1)).sum::<f64>();
    let mut sum = 0.0;
    for (radius, weight) in sample {
        sum += f64::from(weight);
        if sum >= half {
            return Some(radius);
        }
    }
    None
}

/// The volume of the unit ball.
fn ball<const D: usize>() -> f32 {
    use std::f32::consts::PI;
    if D == 2 { PI } else { 4.0 / 3.0 * PI }
}

/// `r^D` from a squared radius.
#[inline(always)]
fn power<const D: usize>(d2: f32) -> f32 {
    if D == 2 { d2 } else { d2 * d2.sqrt() }
}
