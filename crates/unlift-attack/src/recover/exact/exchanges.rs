//! Exchanged coordinates: the hidden value of one record is published by another, and the reverse.
//!
//! A pair explains two estimates at once: mine lies near what the partner published, the partner's near
//! what I published. How near true partners lie is learned from all pairs together with their probabilities
//! (expectation and maximization), per class of evidence; every record is in one pair at most.

use rayon::prelude::*;

use crate::recover::exact::partners::{
    CLASSES, LOST, Law, Messages, PART, Partners, Side, Tally, by_part, side_by_side,
};
use crate::recover::map::family::Settings;
use crate::recover::result::{Estimate, Status};

/// Rounds of learning: a fixed number, so that time does not depend on the map.
const ROUNDS: usize = 6;
/// Pairs less probable than this teach nothing: there are many, and together they weigh little.
const NOTHING: f32 = 1e-3;

/// `estimates` with the exact coordinate wherever the partner is known.
pub(super) fn settle<const D: usize>(
    published: &[[f32; D]],
    mut estimates: Vec<Estimate<D>>,
    reach: f32,
) -> Vec<Estimate<D>> {
    for (i, partner) in pairs(published, &estimates, reach).into_iter().enumerate() {
        if let Some(partner) = partner {
            let axis = usize::from(estimates[i].axis);
            estimates[i].position = published[i];
            estimates[i].position[axis] = published[partner as usize][axis];
        }
    }
    estimates
}

/// The partner of every record, where it is known; always from both sides.
pub(super) fn pairs<const D: usize>(
    published: &[[f32; D]],
    estimates: &[Estimate<D>],
    reach: f32,
) -> Vec<Option<u32>> {
    let n = estimates.len();
    let side = |(record, estimate): (&[f32; D], &Estimate<D>)| {
        let axis = usize::from(estimate.axis);
        match estimate.status {
            Status::Ok => Side { axis, published: record[axis], estimate: estimate.position[axis] },
            _ => Side { axis: LOST, published: 0.0, estimate: 0.0 },
        }
    };
    let sides: Vec<Side> = published.iter().zip(estimates).map(side).collect();
    let order = side_by_side(&sides, reach);
    let sides: Vec<Side> = order.iter().map(|&record| sides[record as usize]).collect();
    let Some(partners) = Partners::find(&sides, D, reach) else {
        return vec![None; n];
    };
    let rarity = rarity(published, &sides, partners.reach);
    let prior = prior::<D>(&sides);
    let class = classes(estimates);
    let class: Vec<u8> = order.iter().map(|&record| class[record as usize]).collect();
    let mut law = Law::new(partners.reach);
    let mut messages = Messages::new(&partners);
    let mut weight = vec![0.0f32; partners.of.len()];
    for _ in 0..ROUNDS {
        let likelier = |i: usize, j: usize| {
            let away = (sides[j].published - sides[i].estimate).abs();
            law.density(usize::from(class[i]), away) * rarity[i]
        };
        by_part(&partners, &mut weight).into_par_iter().for_each(|(part, out)| {
            let records = part * PART..n.min((part + 1) * PART);
            let first = partners.offsets[records.start];
            for i in records {
                for e in partners.entries(i) {
                    let j = partners.of[e] as usize;
                    let odds = likelier(i, j) * likelier(j, i) * prior[sides[i].axis];
                    out[e - first] = odds as f32;
                }
            }
        });
        let others = law.mean_good();
        let alone: Vec<f32> =
            class.iter().map(|&c| law.alone(usize::from(c), others) as f32).collect();
        messages.send(&partners, &weight, &alone);
        let tallies: Vec<Tally> = (0..n.div_ceil(PART))
            .into_par_iter()
            .map(|part| {
                let mut tally = Tally::default();
                for i in part * PART..n.min((part + 1) * PART) {
                    let class = usize::from(class[i]);
                    tally.records[class] += 1.0;
                    for e in partners.entries(i) {
                        let away =
                            (sides[partners.of[e] as usize].published - sides[i].estimate).abs();
                        let p = messages.probability(&partners, &weight, e);
                        if p > NOTHING {
                            tally.add(&law, class, away, f64::from(p));
                        }
                    }
                }
                tally
            })
            .collect();
        let mut tally = Tally::default();
        tallies.iter().for_each(|part| tally.merge(part));
        law = law.learned(&tally);
    }
    let least = Settings::of_dimension::<D>().least_exchange;
    let best = |i: usize| {
        let mut best: Option<(f32, u32)> = None;
        for e in partners.entries(i) {
            let p = messages.probability(&partners, &weight, e);
            if p >= least && best.is_none_or(|(most, _)| p > most) {
                best = Some((p, partners.of[e]));
            }
        }
        best.map(|(_, partner)| partner)
    };
    let best: Vec<Option<u32>> = (0..n).into_par_iter().map(best).collect();
    let mutual = |i: usize| best[i].filter(|&j| best[j as usize] == Some(i as u32));
    let mut found = vec![None; n];
    for (i, &record) in order.iter().enumerate() {
        found[record as usize] = mutual(i).map(|j| order[j as usize]);
    }
    found
}

/// Per axis the probability that some other record on it is the partner, before anything is known.
fn prior<const D: usize>(sides: &[Side]) -> [f64; D] {
    std::array::from_fn(|axis| {
        let n = sides.iter().filter(|side| side.axis == axis).count();
        1.0 / n.saturating_sub(1).max(1) as f64
    })
}

/// Per record the inverse of the density of values around its estimate: how much it says that a value is
/// near.
fn rarity<const D: usize>(published: &[[f32; D]], sides: &[Side], reach: f32) -> Vec<f64> {
    let half = 0.5 * reach;
    let sorted: [Vec<f32>; D] = std::array::from_fn(|axis| {
        let mut values: Vec<f32> = published.iter().map(|p| p[axis]).collect();
        values.par_sort_unstable_by(f32::total_cmp);
        values
    });
    let of = |side: &Side| {
        let Some(values) = sorted.get(side.axis) else {
            return 0.0;
        };
        let from = values.partition_point(|&v| v < side.estimate - half);
        let to = values.partition_point(|&v| v <= side.estimate + half);
        2.0 * f64::from(half) * values.len() as f64 / (to - from + 1) as f64
    };
    sides.par_iter().map(of).collect()
}

/// Per record its class of evidence: equal shares of all records.
fn classes<const D: usize>(estimates: &[Estimate<D>]) -> Vec<u8> {
    let mut sorted: Vec<f32> = estimates.iter().map(|e| e.evidence).collect();
    sorted.par_sort_unstable_by(f32::total_cmp);
    let bounds: Vec<f32> =
        (1..CLASSES).filter_map(|c| sorted.get(c * sorted.len() / CLASSES).copied()).collect();
    estimates.iter().map(|e| bounds.partition_point(|&bound| bound <= e.evidence) as u8).collect()
}
