//! Lists that are not in memory give what they give in memory, bit for bit.

use std::fs::File;
use std::io;
use std::sync::Arc;

use unlift::audit::{Observer, Plan, Recovery, Silent, run};
use unlift::neighbors::oracle::Noise;
use unlift::neighbors::{Neighborhoods, ShelvedLists};
use unlift::obfuscate::Entry;
use unlift::recover::{
    RecoverOptions, Recovered, Solver, prepare, prepare_shelved, recover_shelved,
};
use unlift::released::Obfuscation;
use unlift::truth::Original;
use unlift::{PointSet, Shelf, Unit};

use crate::maps::*;

/// Files of the system, with windows of so many bytes.
#[derive(Debug)]
pub struct Files(pub usize);

impl Shelf for Files {
    fn file(&self) -> io::Result<File> {
        tempfile::tempfile()
    }

    fn place(&self) -> String {
        "tests".to_owned()
    }

    fn window(&self) -> usize {
        self.0
    }
}

/// A disk that is full.
#[derive(Debug)]
struct Full;

impl Shelf for Full {
    fn file(&self) -> io::Result<File> {
        Err(io::Error::from(io::ErrorKind::StorageFull))
    }

    fn place(&self) -> String {
        "tests".to_owned()
    }

    fn window(&self) -> usize {
        1 << 20
    }
}

/// `lists` on a shelf, some thousand entries at a time.
pub fn put(lists: &Neighborhoods, map: (usize, usize), shelf: &dyn Shelf) -> ShelvedLists {
    let mut away = ShelvedLists::new(map, lists.scores().is_some(), shelf).unwrap();
    let slots: Vec<usize> = (0..lists.n_slots()).collect();
    for slots in slots.chunks(77) {
        let lengths = slots.iter().map(|&slot| lists.of(slot).len());
        let records = slots.iter().flat_map(|&slot| lists.of(slot)).copied().collect();
        let scores = lists.scores().map(|_| {
            slots.iter().flat_map(|&slot| lists.scores_of(slot).unwrap()).copied().collect()
        });
        away.push(lengths, records, scores).unwrap();
    }
    away.finish(lists.about()).unwrap()
}

fn shelved_is_in_memory<const D: usize>(name: &str, scheme: &Entry) {
    // Large enough that the oracle's lists have a confidence.
    let hidden = hide::<D>(scheme, &room(61, 1_600), 6);
    let released = &hidden.released;
    let map = (released.n_records(), released.slots_per_record());
    let plain = hidden.lists(15, 0.5, 6);
    let scores = (0..plain.records().len()).map(|at| (at * 7919 % 1000) as f32).collect();
    let (offsets, records) = (plain.offsets().to_vec(), plain.records().to_vec());
    let scored = Neighborhoods::try_new(offsets, records, Some(scores), map.0, map.1).unwrap();
    for (lists, window) in [(&plain, 10_000), (&scored, 30_000), (&plain, 1 << 30)] {
        for solver in [Solver::Consensus, Solver::Joint, Solver::JointStart] {
            let options = RecoverOptions { solver, seed: 9, ..RecoverOptions::default() };
            let shelf = Files(window);
            let away = put(lists, map, &shelf);
            let found = recover_shelved(released, &away, &options, &shelf);
            let of_anchors = matches!(released.obfuscation(), Obfuscation::Rays(rays) if rays.regions().is_some());
            if of_anchors {
                assert!(found.is_err(), "{name}");
                continue;
            }
            let (found, whole) = (found.unwrap(), solve(released, lists, options));
            let what = format!("{name}, {solver:?}, windows of {window} bytes");
            assert!(recovered_bytes(&found) == recovered_bytes(&whole), "{what}");
            assert_eq!(found.confidence(), whole.confidence(), "{what}");
            assert_eq!(found.about(), whole.about(), "{what}");
            let model = prepare_shelved(released, &away, &options, &shelf).unwrap();
            let whole = prepare(released, lists, &options).unwrap();
            assert!(model.to_bytes() == whole.to_bytes(), "{what}");
            let known = solver == Solver::Joint && D == 3 && lists.scores().is_none();
            assert!(!known || found.confidence().is_some(), "{what}: no confidence");
        }
    }
}

#[test]
fn lists_on_a_shelf_give_what_they_give_in_memory() {
    over_schemes!(shelved_is_in_memory);
}

/// Recoveries with lists on a shelf that an observer heard of.
#[derive(Default)]
struct Heard {
    asked: usize,
    kept: usize,
}

impl Observer for Heard {
    fn recall(&mut self, recovery: &Recovery<'_>) -> Option<Recovered<3>> {
        self.asked += usize::from(recovery.lists.here().is_none());
        None
    }

    fn keep(&mut self, recovery: &Recovery<'_>, _recovered: &Recovered<3>) {
        self.kept += usize::from(recovery.lists.here().is_none());
    }
}

#[test]
fn an_audit_with_lists_on_a_shelf_has_the_same_rows() {
    let original = Original::new(PointSet::try_new(room(61, 900), Unit::Meter).unwrap());
    let mut plan = Plan::new(Unit::Meter);
    plan.schemes.retain(|scheme| ["olc", "ppl", "plane", "cp"].contains(&scheme.name()));
    (plan.inlier_ratios, plan.k, plan.records_alone) = (vec![0.5], 20, false);
    plan.oracle_noise = vec![Noise::Uniform, Noise::Near, Noise::Clustered];
    plan.solvers.push(Solver::Consensus);
    let audit = |plan: &Plan<3>| run(&original, None, plan, &mut Silent);
    let usual = audit(&plan).unwrap();
    plan.shelf = Some(Arc::new(Files(9_000)));
    assert_eq!(usual.rows.len(), 4 * 3 * 3);
    let mut heard = Heard::default();
    assert_eq!(usual.rows, run(&original, None, &plan, &mut heard).unwrap().rows);
    // A journal is asked and told of lists that are not in memory as well; where joint recovery started comes with it, unasked.
    assert_eq!((heard.asked, heard.kept), (4 * 3 * 2, 4 * 3 * 3));
    // A full disk is no scheme that was not audited: nothing goes on.
    plan.shelf = Some(Arc::new(Full));
    let error = audit(&plan).unwrap_err().to_string();
    assert!(error.contains("file in tests for what does not fit into memory"), "{error}");
    // A solver that takes lists in memory has them there, and so have the others: the shelf is not asked.
    plan.solvers.push(Solver::Ransac);
    plan.oracle_noise.truncate(1);
    let mixed = audit(&plan).unwrap();
    assert_eq!(mixed.rows.len(), 4 * 4);
    for row in usual.rows.iter().filter(|row| row.oracle_noise == Some("uniform")) {
        assert!(mixed.rows.contains(row), "{} by {}", row.scheme, row.solver);
    }
}

#[test]
fn what_cannot_be_shelved_is_one_line() {
    let hidden = hide::<3>(unlift::obfuscate::scheme("olc").unwrap(), &room(62, 200), 6);
    let (lists, map) = (hidden.lists(12, 0.5, 6), (200, 1));
    let away = put(&lists, map, &Files(1 << 20));
    let error = |solver, shelf: &dyn Shelf| {
        let options = RecoverOptions { solver, ..RecoverOptions::default() };
        recover_shelved(&hidden.released, &away, &options, shelf).unwrap_err().to_string()
    };
    assert_eq!(
        error(Solver::Ransac, &Full),
        "solver for lists that are not in memory: expected joint, joint-start, consensus, found ransac"
    );
    let full = error(Solver::Joint, &Full);
    assert!(full.starts_with(
        "file in tests for what does not fit into memory: expected one that can be made, found "
    ));
    assert!(ShelvedLists::new(map, false, &Full).is_err());

    let empty = || ShelvedLists::new(map, false, &Files(1 << 20)).unwrap();
    let refused = |row: &[u32], scores: Option<Vec<f32>>| {
        let records = row.iter().map(|&record| unlift::RecordId(record)).collect();
        empty().push([row.len()], records, scores).unwrap_err().to_string()
    };
    assert_eq!(
        refused(&[0], None),
        "neighborhood of slot 0: expected other records, found its own record 0"
    );
    assert_eq!(
        refused(&[1, 1], None),
        "neighborhood of slot 0: expected each record once, found record 1 twice"
    );
    assert_eq!(refused(&[1], Some(vec![1.0])), "neighborhood scores: expected none, found 1");
    let error = empty().finish(lists.about()).unwrap_err().to_string();
    assert_eq!(error, "neighborhoods: expected 200 slots, as the released map has, found 0");
    let other = put(
        &hide::<3>(unlift::obfuscate::scheme("olc").unwrap(), &room(62, 100), 6).lists(12, 0.5, 6),
        (100, 1),
        &Files(1 << 20),
    );
    let error =
        recover_shelved(&hidden.released, &other, &RecoverOptions::default(), &Full).unwrap_err();
    assert_eq!(error.to_string(), "neighborhoods: expected 200 rows, one per slot, found 100");
}
