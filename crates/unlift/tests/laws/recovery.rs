//! What recovery does with lists: exact limit, bounded influence, order, hidden input.

use proptest::prelude::*;
use unlift::neighbors::Neighborhoods;
use unlift::obfuscate::Scheme;
use unlift::recover::{Delta, RecoverOptions, Solver, Status, recover};
use unlift::released::{Obfuscation, Released};
use unlift::seed::{Draws, Stage};
use unlift::{PointSet, Unit};

use crate::maps::*;

/// The sine of the best angle under which a listed record crosses the slot's own: what rounding of
/// the records is divided by. 1 where coordinates are read off.
fn crossing<const D: usize>(hidden: &Hidden<D>, slot: usize, lists: &Neighborhoods) -> f64 {
    let record = slot / hidden.released.slots_per_record();
    let directions = match hidden.released.obfuscation() {
        Obfuscation::Lines(lines) => lines.direction(),
        Obfuscation::Rays(rays) => rays.direction(),
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => return 1.0,
    };
    let own = directions[record].map(f64::from);
    let sine = |other: &unlift::RecordId| {
        let cosine = dot(&own, &directions[other.index()].map(f64::from));
        (1.0 - cosine * cosine).max(0.0).sqrt()
    };
    lists.of(slot).iter().map(sine).fold(0.0, f64::max)
}

/// If all of a slot's neighbors hide at its original and their records fix a point, recovery
/// returns it within rounding.
fn exact_limit<const D: usize>(name: &str, scheme: &dyn Scheme<D>, seed: u64) {
    const COPIES: usize = 16;
    let hidden = hide(scheme, &piles(seed, 30, COPIES, 0.0), seed);
    let per = hidden.released.slots_per_record();
    let pile = |slot: usize| hidden.secret.hidden()[slot].index() / COPIES;
    let n = hidden.released.n_slots();
    let row = |slot: usize| {
        let mut row: Vec<u32> =
            (0..n).filter(|&s| pile(s) == pile(slot)).map(|s| (s / per) as u32).collect();
        row.retain(|&record| record as usize != slot / per);
        row.dedup();
        row
    };
    let lists = hidden.lists_of(&(0..n).map(row).collect::<Vec<_>>());
    for options in all_options() {
        let recovered = solve(&hidden.released, &lists, options);
        let mut lost = 0;
        for slot in 0..n {
            if recovered.status()[slot] != Status::Ok {
                lost += 1;
                continue;
            }
            let found = recovered.positions()[slot].map(f64::from);
            let local = hidden.local(slot);
            let off = norm(&std::array::from_fn::<f64, D, _>(|c| found[c] - local[c]));
            // A few units in the last place at 6 m, over the sine of the best crossing.
            let tolerance = 4e-6 / crossing(&hidden, slot, &lists).max(1e-3);
            assert!(off <= tolerance, "{name}, {options:?}: slot {slot} is {off} off");
        }
        // Records of one axis or one center do not fix a point; with 15 that is rare.
        assert!(lost * 50 <= n, "{name}, {options:?}: {lost} of {n} lost");
    }
}

/// Sending one of K agreeing neighbors arbitrarily far leaves the result where the other K - 1
/// alone put it (consensus, fixed delta).
fn bounded_influence<const D: usize>(name: &str, scheme: &dyn Scheme<D>, seed: u64) {
    const COPIES: usize = 21;
    const DELTA: f64 = 0.05;
    let mut points = piles(seed, 12, COPIES, 0.004);
    // The far ones, from 10 m to 10 km away.
    let mut draws = Draws::new(seed, Stage::Synthetic, 20);
    for i in 0..240 {
        let far = 10.0 * [1.0, 10.0, 100.0, 1000.0][i % 4];
        points.push(draws.direction().map(|x: f64| 3.0 + far * x));
    }
    let hidden = hide(scheme, &points, seed);
    let per = hidden.released.slots_per_record();
    let n = hidden.released.n_slots();
    let near_pile = |slot: usize| hidden.secret.hidden()[slot].index() / COPIES;
    let is_far = |slot: usize| hidden.secret.hidden()[slot].index() >= 12 * COPIES;
    let agreeing: Vec<Vec<u32>> = (0..n)
        .map(|slot| {
            let pile = near_pile(slot);
            let same = |&s: &usize| !is_far(slot) && !is_far(s) && near_pile(s) == pile;
            let mut row: Vec<u32> = (0..n).filter(same).map(|s| (s / per) as u32).collect();
            row.retain(|&record| record as usize != slot / per);
            row.dedup();
            row
        })
        .collect();
    let without: Vec<Vec<u32>> =
        agreeing.iter().map(|row| row.iter().skip(1).copied().collect()).collect();
    let options =
        RecoverOptions { solver: Solver::Consensus, delta: Delta::Fixed(DELTA), seed: 3 };
    let alone = solve(&hidden.released, &hidden.lists_of(&without), options);
    let mut with = without.clone();
    let mut replaced = vec![false; n];
    for slot in (0..n).filter(|&slot| !is_far(slot)) {
        if alone.status()[slot] != Status::Ok {
            continue;
        }
        let result = alone.positions()[slot].map(f64::from);
        // A record is far when it passes far from the result, wherever its point is.
        let stranger = (0..200).map(|_| draws.below(n as u64) as usize).find(|&s| {
            let record = s / per;
            is_far(s)
                && record != slot / per
                && !with[slot].contains(&(record as u32))
                && hidden.distance(record, &result) > 20.0 * DELTA
        });
        if let Some(stranger) = stranger {
            with[slot].push((stranger / per) as u32);
            replaced[slot] = true;
        }
    }
    assert!(replaced.iter().filter(|&&r| r).count() > 100, "{name}: too few far records");
    let pulled = solve(&hidden.released, &hidden.lists_of(&with), options);
    // Positions are about 1 km from the origin at most; sections lose digits with distance.
    for slot in (0..n).filter(|&slot| replaced[slot]) {
        assert_eq!(pulled.status()[slot], Status::Ok, "{name}: slot {slot}");
        let (a, b) = (alone.positions()[slot], pulled.positions()[slot]);
        let off = (0..D).map(|c| f64::from((a[c] - b[c]).abs())).fold(0.0, f64::max);
        assert!(off <= 1e-4 * DELTA, "{name}: slot {slot} was pulled by {off}");
    }
}

/// The order in which a list is given changes no result.
fn order_tells_nothing<const D: usize>(name: &str, scheme: &dyn Scheme<D>, seed: u64) {
    let hidden = hide(scheme, &room(seed, 300), seed);
    let lists = hidden.lists(15, 0.6, seed);
    let shuffled: Vec<Vec<u32>> = (0..lists.n_slots())
        .map(|slot| {
            let mut row: Vec<u32> = lists.of(slot).iter().map(|r| r.0).collect();
            Draws::new(seed, Stage::Synthetic, slot as u64).shuffle(&mut row);
            row
        })
        .collect();
    let shuffled = hidden.lists_of(&shuffled);
    for options in all_options() {
        let one = recovered_bytes(&solve(&hidden.released, &lists, options));
        let other = recovered_bytes(&solve(&hidden.released, &shuffled, options));
        assert!(one == other, "{name}, {options:?}");
    }
}

/// Recovery reads nothing but the released map and the lists: columns copied out of them, after
/// everything else is gone, give the same bytes.
fn no_hidden_input<const D: usize>(name: &str, scheme: &dyn Scheme<D>, seed: u64) {
    let hidden = hide(scheme, &room(seed, 300), seed);
    let lists = hidden.lists(15, 0.6, seed);
    for options in all_options() {
        let first = recovered_bytes(&solve(&hidden.released, &lists, options));
        let released = Released::try_new(
            hidden.released.obfuscation().clone(),
            hidden.released.slots_per_record(),
            hidden.released.origin(),
            hidden.released.unit(),
            None,
        )
        .unwrap();
        let copied = Neighborhoods::try_new(
            lists.offsets().to_vec(),
            lists.records().to_vec(),
            None,
            released.n_records(),
            released.slots_per_record(),
        )
        .unwrap();
        assert!(first == recovered_bytes(&solve(&released, &copied, options)), "{name}");
    }
    let Hidden { original, released, secret } = hidden;
    let before = recovered_bytes(&solve(&released, &lists, RecoverOptions::default()));
    drop((original, secret));
    let after = recovered_bytes(&solve(&released, &lists, RecoverOptions::default()));
    assert!(before == after, "{name}");
}

/// Lists for another map are refused, not misread.
fn foreign_lists_are_refused<const D: usize>(name: &str, scheme: &dyn Scheme<D>) {
    let one = hide(scheme, &room(1, 100), 1);
    let other = hide(scheme, &room(1, 160), 1);
    let error = recover(&one.released, &other.lists(5, 1.0, 1), &RecoverOptions::default());
    assert!(error.unwrap_err().to_string().contains("one per slot"), "{name}");
}

proptest! {
    #![proptest_config(cases(3))]

    #[test]
    fn neighbors_at_the_original_give_it_back(seed: u64) {
        over_schemes!(exact_limit, seed);
    }

    #[test]
    fn one_far_neighbor_moves_nothing(seed: u64) {
        over_schemes!(bounded_influence, seed);
    }

    #[test]
    fn lists_are_sets(seed: u64) {
        over_schemes!(order_tells_nothing, seed);
    }

    #[test]
    fn records_and_lists_are_all_there_is(seed: u64) {
        over_schemes!(no_hidden_input, seed);
    }
}

#[test]
fn lists_belong_to_a_map() {
    over_schemes!(foreign_lists_are_refused);
    assert!(PointSet::try_new(vec![[0.0, f64::NAN]], Unit::Meter).is_err());
}
