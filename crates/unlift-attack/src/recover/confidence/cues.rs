//! What an attacker sees that tells right estimates from wrong ones: pure numbers, no lengths.
//!
//! Around a right estimate the estimates of listed records crowd, and listed records pass, more than
//! chance has it. How crowded, within which radius, and how well the crowd centers on the estimate are
//! the cues of a slot; the same over the whole map tell how well recovery went at all, which no slot can
//! know alone: estimates that drifted together agree with each other.

use rayon::prelude::*;

use crate::recover::confidence::crowd::{Crowd, Cues, Solved, Tally};
use crate::recover::map::graph::{Graph, Side, either, record_of, side};
use crate::recover::map::grid::Density;
use crate::recover::map::lines::evidence;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{Places, along_curve, distance2};
use crate::recover::result::{Estimate, Status};

/// Crowds are looked for where chance expects at most this share of the listed estimates: beyond, a crowd is no news.
const MOST_CHANCE: f32 = 0.3;
/// The density of estimates is smooth over this many deltas: it must not follow the crowds that it judges.
const SMOOTH: f32 = 4.0;
/// Slots whose cues are taken by one thread at a time.
const PART: usize = 1 << 10;

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

/// What slots are looked at with.
struct Look<'a, const D: usize, P> {
    pieces: &'a P,
    graph: &'a Graph,
    places: &'a Places<D>,
    density: &'a Density<D>,
    /// Slots in the order in which they are looked at.
    order: &'a [u32],
    delta2: f32,
}

/// The cues of every slot, and the length (typical radius of crowds) that scales predicted errors.
pub(super) fn of<const D: usize, P: Pieces<D>>(
    pieces: &P,
    graph: &Graph,
    solved: &Solved<'_, D>,
) -> (Vec<Cues>, f64) {
    let Solved { estimates, delta, .. } = *solved;
    let places = Places::new(estimates);
    let density = Density::new(&places, &graph.times_listed(), SMOOTH * delta);
    // Crowds in the order in which they are looked at, then by slot: neighbors are found in the cache.
    let order = along_curve(&places);
    let (places, density, order) = (&places, &density, &order[..]);
    let look = Look { pieces, graph, places, density, order, delta2: delta * delta };
    let mut along = look.crowds(solved);
    let mut evidence = vec![0.0; estimates.len()];
    for (crowd, &slot) in along.iter().zip(order) {
        evidence[slot as usize] = libm::log1pf(crowd.evidence);
    }
    look.ask_all(&mut along, &evidence);
    let crowds = look.by_slot(along);
    let mut tally = Tally::new(estimates.len());
    tally.add(&crowds);
    let map = tally.map(delta);
    (crowds.par_iter().map(|crowd| map.cues(crowd)).collect(), f64::from(map.radius))
}

impl<const D: usize, P: Pieces<D>> Look<'_, D, P> {
    /// The crowd of each slot, in the order in which they are looked at; who its members are is asked later.
    fn crowds(&self, solved: &Solved<'_, D>) -> Vec<Crowd> {
        let Solved { estimates, unsettled, .. } = *solved;
        let mut along = vec![Crowd::default(); self.order.len()];
        let by_part = self.order.par_chunks(PART);
        along.par_chunks_mut(PART).zip(by_part).for_each_init(Vec::new, |near, (crowds, slots)| {
            for (at, (crowd, &slot)) in crowds.iter_mut().zip(slots).enumerate() {
                let slot = slot as usize;
                if let Some(&next) = slots.get(at + 1) {
                    self.prefetch(next as usize);
                }
                if estimates[slot].status == Status::Ok {
                    *crowd = self.crowd(slot, &estimates[slot], near);
                    let before = &unsettled[slot];
                    if before.status == Status::Ok {
                        let moved2 = distance2(&before.position, &estimates[slot].position);
                        crowd.settled = (moved2 > 0.0).then(|| moved2.sqrt());
                    }
                }
            }
        });
        along
    }

    /// Asks the members of each crowd, whose `evidence` is known of all slots.
    fn ask_all(&self, along: &mut [Crowd], evidence: &[f32]) {
        along.par_chunks_mut(PART).zip(self.order.par_chunks(PART)).for_each(|(crowds, slots)| {
            for (crowd, &slot) in crowds.iter_mut().zip(slots) {
                self.ask_members(slot as usize, crowd, evidence);
            }
        });
    }

    /// The same crowds in order of slots.
    fn by_slot(&self, along: Vec<Crowd>) -> Vec<Crowd> {
        let mut crowds = vec![Crowd::default(); along.len()];
        for (crowd, &slot) in along.into_iter().zip(self.order) {
            crowds[slot as usize] = crowd;
        }
        crowds
    }

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
