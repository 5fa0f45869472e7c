//! Properties of the oracle's noise models, for records with one and with two points.

use std::collections::BTreeSet;

use unlift::geometry::vector::squared_distance;
use unlift::obfuscate::{olc, ppl};

use crate::maps::*;

const K: usize = 10;
const N: usize = 1200;
const SCHEMES: [&Entry; 2] = [&olc::ENTRY, &ppl::ENTRY];

fn hidden(scheme: &Entry) -> Hidden<3> {
    hide(scheme, &room(17, N), 5)
}

/// Returns the rank of every other record by its distance to a slot's point, by brute force.
fn rank_from(of: &Hidden<3>, slot: usize) -> impl Fn(&RecordId) -> usize {
    let points = of.original.reveal().positions();
    let (per, hidden) = (of.released.slots_per_record(), of.secret.hidden());
    let here = points[hidden[slot].index()];
    let key =
        |other: usize| (squared_distance(&here, &points[hidden[other].index()]), hidden[other].0);
    let mut order: Vec<usize> =
        (0..hidden.len()).filter(|other| other / per != slot / per).collect();
    order.sort_by(|&a, &b| key(a).partial_cmp(&key(b)).unwrap());
    let mut seen = BTreeSet::new();
    let records = order.into_iter().map(|other| RecordId::from_index(other / per));
    let records: Vec<RecordId> = records.filter(|&r| seen.insert(r)).collect();
    move |record| records.iter().position(|other| other == record).unwrap()
}

#[test]
fn every_model_keeps_the_share_the_same_true_neighbors_and_outliers() {
    for hidden in SCHEMES.map(hidden) {
        let near = hidden.near(K);
        let full = near.lists(1.0, &Outliers::Uniform, 3).unwrap();
        let split = |lists: &Neighborhoods, slot: usize| -> [BTreeSet<RecordId>; 2] {
            lists.of(slot).iter().partition(|&r| full.of(slot).contains(r)).into()
        };
        for noise in Noise::ALL {
            let mut higher = None;
            for ratio in [0.6, 0.5, 0.3, 0.2, 0.0] {
                let lists = hidden.noisy_lists(K, (noise, ratio), 3).unwrap();
                let uniform = near.lists(ratio, &Outliers::Uniform, 3).unwrap();
                assert_eq!(near.measured_inlier_ratio(&lists), ratio, "{noise:?}");
                for slot in 0..lists.n_slots() {
                    assert_eq!(lists.of(slot).len(), K);
                    let [right, wrong] = split(&lists, slot);
                    assert_eq!(right, split(&uniform, slot)[0], "{noise:?}, slot {slot}");
                    // A lower ratio keeps fewer true neighbors, and the outliers of a higher one.
                    let Some(higher) = &higher else { continue };
                    let [more_right, fewer_wrong] = split(higher, slot);
                    assert!(right.is_subset(&more_right), "{noise:?}, slot {slot}");
                    assert!(fewer_wrong.is_subset(&wrong), "{noise:?}, slot {slot}");
                }
                higher = Some(lists);
            }
        }
    }
}

#[test]
fn near_outliers_lie_between_the_2k_th_and_the_10k_th_nearest() {
    for hidden in SCHEMES.map(hidden) {
        let lists = hidden.noisy_lists(K, (Noise::Near, 0.0), 1).unwrap();
        let mut ranks = BTreeSet::new();
        for slot in (0..lists.n_slots()).step_by(37) {
            let rank = rank_from(&hidden, slot);
            for rank in lists.of(slot).iter().map(rank) {
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
    for hidden in SCHEMES.map(hidden) {
        let nearest = hidden.lists(K, 1.0, 2);
        let per = hidden.released.slots_per_record();
        let lists = |noise: Noise| hidden.noisy_lists(K, (noise, 0.0), 2).unwrap();
        // Share of a slot's outliers that a slot on its nearest listed records lists, too.
        let shared = |noise: Noise| {
            let lists = lists(noise);
            let both = |slot: usize| {
                let others = nearest.of(slot).iter();
                let others = others.flat_map(|r| (0..per).map(move |side| r.index() * per + side));
                let both = others.map(|other| {
                    lists.of(slot).iter().filter(|r| lists.of(other).contains(r)).count()
                });
                both.max().unwrap()
            };
            let both: usize = (0..lists.n_slots()).map(both).sum();
            both as f64 / (K * lists.n_slots()) as f64
        };
        let (clustered, uniform) = (shared(Noise::Clustered), shared(Noise::Uniform));
        assert!(clustered > 0.5 && uniform < 0.25, "{clustered:.2} {uniform:.2}");
        // All outliers of a patch are the K records near either of two places.
        let lists = lists(Noise::Clustered);
        let slots: Vec<usize> = (0..lists.n_slots()).step_by(41).collect();
        let is_far = |&&slot: &&usize| {
            let rank = rank_from(&hidden, slot);
            lists.of(slot).iter().all(|r| rank(r) >= 2 * K)
        };
        let (far, slots) = (slots.iter().filter(is_far).count(), slots.len());
        // A record of a pair may be near because of its other point.
        assert!(10 * far >= 8 * slots, "{far} of {slots}");
    }
}

#[test]
fn a_map_without_a_ring_is_told() {
    let hidden = hide::<3>(&olc::ENTRY, &room(17, 2 * K + 4), 5);
    let lists = |ratio| hidden.noisy_lists(K, (Noise::Near, ratio), 0);
    assert!(lists(0.7).is_ok());
    let error = lists(0.5).unwrap_err().to_string();
    let end = "at least 5 records that are between the 2K-th and the 10K-th nearest, found 3";
    assert_eq!(error, format!("inlier ratio 0.5 at K = 10: expected {end}"));
}
