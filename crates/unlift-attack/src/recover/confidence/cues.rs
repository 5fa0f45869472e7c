//! The cues of every slot: dimensionless features that separate right estimates from wrong ones.
//!
//! Around a right estimate, the estimates of listed records form a cluster, and more listed records pass than by chance. Means of
//! these measures over the whole map are cues, too: estimates that drifted together agree with each other, which only the whole
//! map shows.

use rayon::prelude::*;

use crate::recover::map::graph::{Graph, Side, either, record_of, side};
use crate::recover::map::grid::Density;
use crate::recover::map::lines::evidence;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{Places, along_curve, distance2};
use crate::recover::result::{Estimate, Status};

/// A cluster ends where the expected number of listed estimates by chance reaches this fraction.
const MOST_CHANCE: f32 = 0.3;
/// Smoothing width of the density of estimates, in deltas: wide, so that one cluster hardly changes it.
const SMOOTH: f32 = 4.0;
/// Smaller ratios are raised to this before a logarithm.
const LEAST_RATIO: f32 = 1e-3;
/// Number of clusters from which the typical radius is computed.
const RADII: usize = 1 << 14;

/// Number of cues.
pub(super) const N_CUES: usize = 20;

/// The cues of one slot, in the order in which the model was fitted.
pub(super) type Cues = [f32; N_CUES];

pub(crate) struct Solved<'a, const D: usize> {
    pub(crate) estimates: &'a [Estimate<D>],
    /// Estimates before exact constraints moved them.
    pub(crate) unsettled: &'a [Estimate<D>],
    pub(crate) delta: f32,
}

/// The cluster of listed estimates (members) around one estimate.
#[derive(Clone, Copy, Debug, Default)]
struct Cluster {
    /// Largest improbability by chance over all radii, in nats, and the radius where it is reached.
    evidence: f32,
    radius: f32,
    /// Number of members beyond chance.
    excess: f32,
    /// Distance of the mean of the members from the estimate, along and across the piece, in radii.
    off: [f32; 2],
    /// Evidence and excess of listed records that pass within delta.
    record_evidence: f32,
    record_excess: f32,
    /// Number of listed records that may vote.
    listed: f32,
    /// Fraction of the members whose records may vote.
    voting_fraction: f32,
    /// Distance by which exact constraints moved the estimate, if they did.
    settled: Option<f32>,
    /// Mean of `ln(1 + evidence)` over the members.
    of_members: f32,
    /// Logarithm of the number of members that the slot lists over the number that list it. Wrong members with similar descriptors
    /// rarely list the slot.
    one_sided: f32,
    /// Logarithm of the typical density of estimates over the density here.
    sparsity: f32,
}

/// Returns the cues of every slot and the typical radius of clusters.
pub(super) fn of_slots<const D: usize, P: Pieces<D>>(
    pieces: &P,
    graph: &Graph,
    solved: &Solved<'_, D>,
) -> (Vec<Cues>, f32) {
    let Solved { estimates, unsettled, delta } = *solved;
    let places = Places::new(estimates);
    let density = Density::new(&places, &graph.times_listed(), SMOOTH * delta);
    let order = along_curve(&places);
    let around = Surroundings { pieces, graph, places, density, delta2: delta * delta };
    let mut clusters = by_slot(&order, |near, slot| {
        let estimate = &estimates[slot];
        if estimate.status != Status::Ok {
            return Cluster::default();
        }
        let mut cluster = around.cluster(slot, estimate, near);
        if unsettled[slot].status == Status::Ok {
            let moved2 = distance2(&unsettled[slot].position, &estimate.position);
            cluster.settled = (moved2 > 0.0).then(|| moved2.sqrt());
        }
        cluster
    });
    let evidence: Vec<f32> =
        clusters.iter().map(|cluster| libm::log1pf(cluster.evidence)).collect();
    clusters = by_slot(&order, |_, slot| around.with_members(slot, clusters[slot], &evidence));
    of_map(&clusters, delta)
}

/// Computes a cluster per slot, in the cache-friendly `order`; returns them in the order of slots.
fn by_slot(
    order: &[u32],
    of: impl Fn(&mut Vec<(u32, u32)>, usize) -> Cluster + Send + Sync,
) -> Vec<Cluster> {
    let in_order: Vec<Cluster> =
        order.par_iter().map_init(Vec::new, |near, &slot| of(near, slot as usize)).collect();
    let mut clusters = vec![Cluster::default(); order.len()];
    for (cluster, &slot) in in_order.into_iter().zip(order) {
        clusters[slot as usize] = cluster;
    }
    clusters
}

/// Returns the cues of `clusters`, one per slot, and the typical radius.
fn of_map(clusters: &[Cluster], delta: f32) -> (Vec<Cues>, f32) {
    let sum = |of: fn(&Cluster) -> f32| {
        clusters.iter().map(|cluster| f64::from(of(cluster))).sum::<f64>()
    };
    let mean = |of: fn(&Cluster) -> f32| (sum(of) / clusters.len().max(1) as f64) as f32;
    let listed = sum(|cluster| cluster.listed).max(1.0);
    let ln = |x: f32| libm::logf(x.max(LEAST_RATIO));
    let radius = typical_radius(clusters).unwrap_or(delta);
    let map_evidence = mean(|cluster| libm::log1pf(cluster.evidence));
    let map_fraction = ln((sum(|cluster| cluster.excess) / listed) as f32);
    let map_record_fraction = ln((sum(|cluster| cluster.record_excess) / listed) as f32);
    let map_ln_radius_per_delta = ln(radius / delta);
    let map_voting_fraction = mean(|cluster| cluster.voting_fraction);
    let map_one_sided = mean(|cluster| cluster.one_sided.abs());
    let cues = |cluster: &Cluster| {
        [
            libm::log1pf(cluster.evidence),
            ln(cluster.excess.max(0.1)),
            ln(cluster.radius / radius),
            libm::log1pf(cluster.record_evidence),
            ln(cluster.record_excess.max(0.1)),
            cluster.off[0],
            cluster.off[1],
            cluster.of_members,
            cluster.sparsity,
            map_evidence,
            map_fraction,
            map_record_fraction,
            map_ln_radius_per_delta,
            ln(cluster.listed.max(0.1)),
            cluster.voting_fraction,
            map_voting_fraction,
            if cluster.settled.is_some() { 1.0 } else { 0.0 },
            libm::log1pf(cluster.settled.unwrap_or(0.0) / radius),
            cluster.one_sided,
            map_one_sided,
        ]
    };
    (clusters.par_iter().map(cues).collect(), radius)
}

/// Returns the median radius of clusters, weighted by evidence.
fn typical_radius(clusters: &[Cluster]) -> Option<f32> {
    let sample = clusters.iter().step_by(clusters.len().div_ceil(RADII).max(1));
    let mut radii: Vec<(f32, f32)> = sample
        .filter(|cluster| cluster.evidence > 0.0 && cluster.radius > 0.0)
        .map(|cluster| (cluster.radius, cluster.evidence))
        .collect();
    radii.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let half = 0.5 * radii.iter().map(|one| f64::from(one.1)).sum::<f64>();
    let mut sum = 0.0;
    let is_half = |one: &&(f32, f32)| {
        sum += f64::from(one.1);
        sum >= half
    };
    radii.iter().find(is_half).map(|one| one.0)
}

struct Surroundings<'a, const D: usize, P> {
    pieces: &'a P,
    graph: &'a Graph,
    places: Places<D>,
    density: Density<D>,
    delta2: f32,
}

impl<const D: usize, P: Pieces<D>> Surroundings<'_, D, P> {
    /// Returns the cluster of a slot; [`with_members`](Self::with_members) adds the cues of its members.
    fn cluster(&self, slot: usize, own: &Estimate<D>, near: &mut Vec<(u32, u32)>) -> Cluster {
        let x = own.position;
        let density = self.density.at(&x);
        // By chance, the fraction `rate * r^D` of the listed estimates lies within r, per slot of a record.
        let rate = density * ball::<D>();
        let reach2 = libm::powf(MOST_CHANCE / rate, 2.0 / D as f32);
        near.clear();
        let (mut rates, mut voting, mut votes) = (0.0f32, 0usize, 0usize);
        let slots_per_record = self.pieces.slots_per_record();
        let (ends, class) = self.graph.of(slot);
        for (&end, &class) in ends.iter().zip(class) {
            let either = either(class, slots_per_record);
            let (d2, at) = self.places.nearest(end, either, &x);
            rates += if either { 2.0 * rate } else { rate };
            if d2 < reach2 {
                // The bits of a distance sort as the distance does; ties sort by slot.
                near.push((d2.to_bits(), at as u32));
            }
            let record = record_of(end as usize, slots_per_record);
            if self.pieces.may_vote(slot, record) {
                voting += 1;
                votes += usize::from(self.pieces.record_distance2(record, &x) <= self.delta2);
            }
        }
        near.sort_unstable();
        let all = ends.len() as f32;
        let mean_rate = rates / all.max(1.0);
        let sparsity = self.density.sparsity(density);
        let mut cluster = Cluster { listed: voting as f32, sparsity, ..Cluster::default() };
        let mut members = 0;
        for at in 1..near.len() {
            let d2 = f32::from_bits(near[at].0);
            let is_last = near.get(at + 1).is_none_or(|next| f32::from_bits(next.0) > d2);
            let p = (mean_rate * power::<D>(d2)).clamp(1e-9, MOST_CHANCE);
            let nats = if is_last { evidence((at + 1) as f32, all, p) } else { 0.0 };
            if nats > cluster.evidence {
                members = at + 1;
                cluster.evidence = nats;
                cluster.radius = d2.sqrt();
                cluster.excess = (members as f32 - p * all).max(0.0);
            }
        }
        let mut sum = [0.0f32; D];
        let mut voting_members = 0u32;
        for &(_, at) in &near[..members] {
            let place = self.places.of(at as usize);
            (0..D).for_each(|c| sum[c] += place[c] - x[c]);
            let record = record_of(at as usize, slots_per_record);
            voting_members += u32::from(self.pieces.may_vote(slot, record));
        }
        cluster.voting_fraction = voting_members as f32 / members.max(1) as f32;
        if members > 0 && cluster.radius > 0.0 {
            let piece = self.pieces.piece(slot, usize::from(own.axis));
            let scale = 1.0 / (members as f32 * cluster.radius);
            let (mut along2, mut all2) = (0.0, 0.0);
            for r in 0..D {
                let along: f32 = (0..D).map(|c| piece.along[r][c] * sum[c]).sum();
                along2 += along * along;
                all2 += sum[r] * sum[r];
            }
            cluster.off = [along2.sqrt() * scale, (all2 - along2).max(0.0).sqrt() * scale];
        }
        let p = self.pieces.record_chance(slot, &x).clamp(1e-9, 0.5);
        if voting > 0 {
            cluster.record_evidence = evidence(votes as f32, voting as f32, p);
        }
        cluster.record_excess = votes as f32 - p * voting as f32;
        cluster
    }

    /// Adds the cues of the members to `cluster`; `evidence` has one value per slot.
    fn with_members(&self, slot: usize, mut cluster: Cluster, evidence: &[f32]) -> Cluster {
        if cluster.evidence <= 0.0 {
            return cluster;
        }
        let x = self.places.of(slot);
        let reach2 = cluster.radius * cluster.radius * (1.0 + 1e-6);
        let (mut n, mut sum, mut listed, mut listing) = (0u32, 0.0, 0u32, 0u32);
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
        cluster.of_members = sum / n.max(1) as f32;
        cluster.one_sided = libm::logf((listed + 1) as f32 / (listing + 1) as f32);
        cluster
    }
}

fn ball<const D: usize>() -> f32 {
    use std::f32::consts::PI;
    if D == 2 { PI } else { 4.0 / 3.0 * PI }
}

#[inline(always)]
fn power<const D: usize>(d2: f32) -> f32 {
    if D == 2 { d2 } else { d2 * d2.sqrt() }
}
