//! Properties of the oracle's noise models, for records with one and with two points.

use std::collections::BTreeSet;

use unlift::RecordId;
use unlift::neighbors::Neighborhoods;
use unlift::neighbors::oracle::{self, Noise, Outliers, TrueNeighbors};
use unlift::obfuscate::{Entry, olc, ppl};
use unlift::recover::{Builtin, RecoverOptions, recover};

use crate::maps::*;

const K: usize = 10;
const N: usize = 1200;
const SCHEMES: [&Entry; 2] = [&olc::ENTRY, &ppl::ENTRY];

struct Oracle {
    hidden: Hidden<3>,
    near: TrueNeighbors,
}

impl Oracle {
    fn new(scheme: &Entry) -> Self {
        let hidden = hide(scheme, &room(17, N), 5);
        let near = hidden.near(K);
        Self { hidden, near }
    }

    fn outliers(&self, noise: Noise, seed: u64) -> Outliers {
        let search = oracle::search(&self.hidden.original).unwrap();
        Outliers::new(noise, &self.near, &search, &self.hidden.secret, seed).unwrap()
    }

    fn lists(&self, noise: Noise, ratio: f64, seed: u64) -> Neighborhoods {
        self.near.lists(ratio, &self.outliers(noise, seed), seed).unwrap()
    }

    /// Returns all other records of a slot, nearest first, by brute force.
    fn by_nearness(&self, slot: usize) -> Vec<RecordId> {
        let points = self.hidden.original.reveal().positions();
        let per = self.hidden.released.slots_per_record();
        let hidden = self.hidden.secret.hidden();
        let here = points[hidden[slot].index()];
        let squared = |p: &[f64; 3]| (0..3).fold(0.0, |sum, c| sum + (here[c] - p[c]).powi(2));
        let mut all: Vec<(f64, u32, RecordId)> = (0..hidden.len())
            .filter(|&other| other / per != slot / per)
            .map(|other| {
                let id = hidden[other];
                (squared(&points[id.index()]), id.0, RecordId::from_index(other / per))
            })
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut seen = BTreeSet::new();
        all.into_iter().map(|(.., record)| record).filter(|&r| seen.insert(r)).collect()
    }
}

#[test]
fn every_model_keeps_the_share_and_the_same_true_neighbors() {
    for scheme in SCHEMES {
        let oracle = Oracle::new(scheme);
        let full = oracle.near.at_inlier_ratio(1.0, 3).unwrap();
        for ratio in [0.0, 0.3, 0.5] {
            let kept = |lists: &Neighborhoods, slot: usize| -> Vec<RecordId> {
                lists.of(slot).iter().copied().filter(|r| full.of(slot).contains(r)).collect()
            };
            let uniform = oracle.near.at_inlier_ratio(ratio, 3).unwrap();
            for noise in Noise::ALL {
                let lists = oracle.lists(noise, ratio, 3);
                assert_eq!(oracle.near.measured_inlier_ratio(&lists), ratio, "{noise:?}");
                for slot in 0..lists.n_slots() {
                    assert_eq!(lists.of(slot).len(), K);
                    assert_eq!(kept(&lists, slot), kept(&uniform, slot), "{noise:?}, slot {slot}");
                }
            }
        }
    }
}

#[test]
fn a_lower_ratio_keeps_fewer_true_neighbors_and_more_of_the_same_outliers() {
    for scheme in SCHEMES {
        let oracle = Oracle::new(scheme);
        let full = oracle.near.at_inlier_ratio(1.0, 4).unwrap();
        for noise in Noise::ALL {
            let (high, low) = (oracle.lists(noise, 0.6, 4), oracle.lists(noise, 0.2, 4));
            for slot in 0..high.n_slots() {
                let right = |r: &RecordId| full.of(slot).contains(r);
                for record in high.of(slot).iter().filter(|r| !right(r)) {
                    assert!(low.of(slot).contains(record), "{noise:?}, slot {slot}");
                }
                for record in low.of(slot).iter().filter(|r| right(r)) {
                    assert!(high.of(slot).contains(record), "{noise:?}, slot {slot}");
                }
            }
        }
    }
}

#[test]
fn near_outliers_lie_between_the_2k_th_and_the_10k_th_nearest() {
    for scheme in SCHEMES {
        let oracle = Oracle::new(scheme);
        let lists = oracle.lists(Noise::Near, 0.0, 1);
        let mut ranks = BTreeSet::new();
        for slot in (0..lists.n_slots()).step_by(37) {
            let order = oracle.by_nearness(slot);
            for record in lists.of(slot) {
                let rank = order.iter().position(|r| r == record).unwrap();
                assert!((2 * K..10 * K).contains(&rank), "slot {slot}: rank {rank}");
                ranks.insert(rank);
            }
        }
        // Outliers come from the whole range of ranks.
        assert!(ranks.len() > 7 * K, "{} of {} ranks", ranks.len(), 8 * K);
    }
}

#[test]
fn clustered_outliers_are_shared_by_neighbors_and_lie_in_two_far_places() {
    for scheme in SCHEMES {
        let oracle = Oracle::new(scheme);
        let nearest = oracle.near.at_inlier_ratio(1.0, 2).unwrap();
        let per = oracle.hidden.released.slots_per_record();
        // Share of a slot's outliers that a slot on its nearest listed records lists, too.
        let shared = |noise: Noise| {
            let lists = oracle.lists(noise, 0.0, 2);
            let (mut both, mut all) = (0, 0);
            for slot in 0..lists.n_slots() {
                let best = nearest
                    .of(slot)
                    .iter()
                    .flat_map(|r| (0..per).map(move |side| r.index() * per + side))
                    .map(|other| {
                        lists.of(slot).iter().filter(|r| lists.of(other).contains(r)).count()
                    });
                both += best.max().unwrap();
                all += K;
            }
            both as f64 / all as f64
        };
        let (clustered, uniform) = (shared(Noise::Clustered), shared(Noise::Uniform));
        assert!(clustered > 0.5 && uniform < 0.25, "{clustered:.2} {uniform:.2}");
        // All outliers of a patch are the K records near either of two places.
        let lists = oracle.lists(Noise::Clustered, 0.0, 2);
        let mut far = 0;
        for slot in (0..lists.n_slots()).step_by(41) {
            let order = oracle.by_nearness(slot);
            let rank = |r: &RecordId| order.iter().position(|other| other == r).unwrap();
            far += usize::from(lists.of(slot).iter().filter(|r| rank(r) >= 2 * K).count() == K);
        }
        let slots = lists.n_slots().div_ceil(41);
        // A record of a pair may be near because of its other point.
        assert!(10 * far >= 8 * slots, "{far} of {slots}");
    }
}

#[test]
fn a_map_without_a_ring_is_told() {
    let hidden = hide::<3>(&olc::ENTRY, &room(17, 2 * K + 4), 5);
    let oracle = Oracle { near: hidden.near(K), hidden };
    let outliers = oracle.outliers(Noise::Near, 0);
    assert!(oracle.near.lists(0.7, &outliers, 0).is_ok());
    assert_eq!(
        oracle.near.lists(0.5, &outliers, 0).unwrap_err().to_string(),
        "inlier ratio 0.5 at K = 10: expected at least 5 records that are between the 2K-th and \
         the 10K-th nearest, found 3"
    );
}

/// Ranking trusts that records which are not listed are far. Where wrong entries are near, too, it would lose.
#[test]
fn ranking_keeps_joint_estimates_where_wrong_entries_are_near() {
    let oracle = Oracle::new(&olc::ENTRY);
    let positions = |noise, ratio| {
        [Builtin::Joint, Builtin::Ranking].map(|solver| {
            let (released, lists) = (&oracle.hidden.released, oracle.lists(noise, ratio, 1));
            let recovered = recover(released, &lists, &solver, &RecoverOptions::default()).unwrap();
            recovered.positions().to_vec()
        })
    };
    let [joint, ranking] = positions(Noise::Near, 0.2);
    assert_eq!(joint, ranking);
    let [joint, ranking] = positions(Noise::Uniform, 0.2);
    assert_ne!(joint, ranking);
}
