//! Joint recovery whose edges are spread gives what it gives at once, bit for bit.

use std::collections::BTreeMap;
use std::ops::Range;

use unlift::Error;
use unlift::neighbors::Neighborhoods;
use unlift::obfuscate::Entry;
use unlift::recover::{
    Edges, EdgesOfSlot, Lead, Model, NamedBy, Part, RecoverOptions, Recovered, prepare,
};
use unlift::released::{Obfuscation, Released};

use crate::maps::*;

fn options() -> RecoverOptions {
    RecoverOptions { seed: 9, confidence: false, ..RecoverOptions::default() }
}

/// Parts of all sizes, one of them empty, of whole records.
fn cuts(n_records: usize, per: usize) -> Vec<Range<usize>> {
    let at = [0, n_records / 7, n_records / 7, n_records / 3 + 1, n_records - 1, n_records];
    at.windows(2).map(|pair| per * pair[0]..per * pair[1]).collect()
}

/// The lists of some slots, and who names their records, in an order of its own.
fn of_part(lists: &Neighborhoods, slots: &Range<usize>, per: usize) -> (Neighborhoods, Entries) {
    let [from, to] = [slots.start, slots.end].map(|slot| lists.offsets()[slot]);
    let own = from as usize..to as usize;
    let offsets: Vec<u64> =
        lists.offsets()[slots.start..=slots.end].iter().map(|at| at - from).collect();
    let records = lists.records()[own.clone()].to_vec();
    let scores = lists.scores().map(|scores| scores[own].to_vec());
    let map = (lists.n_slots() / per, per);
    let lists_of = Neighborhoods::of_slots(slots.start, &offsets, records, scores, map).unwrap();
    let mut entries = Entries::default();
    for slot in (0..lists.n_slots()).rev() {
        for (at, record) in lists.of(slot).iter().enumerate() {
            if slots.contains(&(record.index() * per)) {
                entries.records.push(record.0);
                entries.slots.push(slot as u32);
                entries.scores.extend(lists.scores_of(slot).map(|scores| scores[at]));
            }
        }
    }
    (lists_of, entries)
}

#[derive(Default)]
struct Entries {
    records: Vec<u32>,
    slots: Vec<u32>,
    scores: Vec<f32>,
}

impl Entries {
    fn named_by(&self, has_scores: bool) -> NamedBy<'_> {
        let scores = has_scores.then_some(&self.scores[..]);
        NamedBy { records: &self.records, slots: &self.slots, scores }
    }
}

/// Edges as whoever keeps them in columns gives them back.
fn kept(edges: &Edges, map: (usize, usize)) -> Edges {
    let (offsets, ends) = (edges.offsets().to_vec(), edges.ends().to_vec());
    let kept = Edges::try_new(edges.slots(), offsets, ends, edges.class().to_vec(), map).unwrap();
    assert_eq!(&kept, edges);
    kept
}

fn spread<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    model: &Model<D>,
) -> Result<Recovered<D>, Error> {
    let per = released.slots_per_record();
    let map = (released.n_records(), per);
    let mut parts = Vec::new();
    for slots in cuts(released.n_records(), per) {
        let (own, entries) = of_part(lists, &slots, per);
        let named_by = entries.named_by(lists.scores().is_some());
        parts.push(kept(&model.edges(released, &own, slots, named_by)?, map));
    }
    let (mut lengths, mut listed, mut all) =
        (Vec::new(), vec![0; released.n_records()], BTreeMap::new());
    let (mut start, mut rows) = (Vec::new(), Vec::new());
    for edges in &parts {
        for (at, slot) in edges.slots().enumerate() {
            let row = edges.offsets()[at] as usize..edges.offsets()[at + 1] as usize;
            lengths.push(row.len() as u32);
            let row: EdgesOfSlot =
                (edges.ends()[row.clone()].to_vec(), edges.class()[row].to_vec());
            all.insert(slot as u32, row);
        }
        edges.ends().iter().for_each(|&end| listed[end as usize / per] += 1);
        let Part { estimates, descriptor_row } = model.start_part(released, edges)?;
        start.extend(estimates);
        rows.extend(descriptor_row.into_iter().flatten());
    }
    let wanted = Lead::wanted(model, &lengths)?;
    let sample = wanted.iter().map(|slot| (*slot, all[slot].clone())).collect();
    let mut lead = Lead::new(model, released, (&lengths, listed), &sample, &start)?;
    while !lead.is_done() {
        let standing = lead.standing();
        let mut moved = Vec::new();
        for edges in parts.iter().rev() {
            moved.extend(model.move_part(released, edges, &standing)?);
        }
        let mut told = Vec::new();
        if let Some(news) = lead.moved(&moved)? {
            for edges in &parts {
                told.extend(model.tell_part(released, edges, &news)?);
            }
        }
        lead.told(model, released, &told)?;
    }
    let has_rows = per == 2 && released.descriptors().is_some();
    lead.finish(model, released, has_rows.then_some(rows))
}

fn spread_is_the_whole<const D: usize>(name: &str, scheme: &Entry) {
    let hidden = hide::<D>(scheme, &room(61, 500), 6);
    let released = &hidden.released;
    let plain = hidden.lists(15, 0.5, 6);
    // A tenth of the slots list nobody; scores are as good as any.
    let (mut offsets, mut records, mut scores) = (vec![0], Vec::new(), Vec::new());
    for slot in 0..plain.n_slots() {
        if slot % 10 != 3 {
            records.extend_from_slice(plain.of(slot));
            scores.extend(plain.of(slot).iter().map(|r| ((r.0 * 7919 + slot as u32) % 97) as f32));
        }
        offsets.push(records.len() as u64);
    }
    let (n_records, per) = (released.n_records(), released.slots_per_record());
    let scored = Neighborhoods::try_new(offsets, records, Some(scores), n_records, per).unwrap();
    let of_anchors =
        matches!(released.obfuscation(), Obfuscation::Rays(rays) if rays.regions().is_some());
    for lists in [&plain, &scored] {
        let whole = solve(released, lists, options());
        let bytes = prepare(released, lists, &options()).unwrap().to_bytes();
        let model = Model::<D>::from_bytes(&bytes).unwrap();
        assert_eq!(model.to_bytes(), bytes, "{name}");
        let found = spread(released, lists, &model);
        if of_anchors {
            assert!(found.is_err(), "{name}");
            continue;
        }
        let found = found.unwrap();
        assert!(recovered_bytes(&found) == recovered_bytes(&whole), "{name}");
        assert_eq!(found.confidence_unknown(), whole.confidence_unknown(), "{name}");
        let columns =
            |back: &Recovered<D>| (back.about(), back.descriptor_row().map(<[u32]>::to_vec));
        assert_eq!(columns(&found), columns(&whole), "{name}");
    }
}

#[test]
fn rounds_with_spread_edges_are_rounds_at_once() {
    over_schemes!(spread_is_the_whole);
}

#[test]
fn what_is_missing_or_not_of_the_map_is_told() {
    let olc = unlift::obfuscate::scheme("olc").unwrap();
    let hidden = hide::<3>(olc, &room(62, 200), 6);
    let (released, lists) = (&hidden.released, hidden.lists(12, 0.5, 6));
    let model = prepare(released, &lists, &options()).unwrap();
    let (own, entries) = of_part(&lists, &(0..200), 1);
    let edges = model.edges(released, &own, 0..200, entries.named_by(false)).unwrap();
    let error = |found: Result<Edges, Error>| found.unwrap_err().to_string();
    assert_eq!(
        error(model.edges(released, &own, 0..100, entries.named_by(false))),
        format!(
            "named by: expected records 0..100, found {}",
            entries.records.iter().find(|&&r| r > 99).unwrap()
        )
    );
    let columns = |end: u32, class: u8| {
        Edges::try_new(5..6, vec![0, 2], vec![4, end], vec![0, class], (100, 2))
    };
    assert!(columns(6, 0).is_ok());
    assert_eq!(error(columns(200, 0)), "edges: end: expected a slot below 200, found 200");
    assert_eq!(error(columns(6, 24)), "edges: class: expected a number below 24, found 24");
    assert!(error(columns(7, 0)).starts_with("edges: end: expected the first slot of a record"));
    assert!(error(columns(2, 0)).starts_with("edges: ends: expected ascending slots"));

    let lengths: Vec<u32> =
        edges.offsets().windows(2).map(|row| (row[1] - row[0]) as u32).collect();
    let mut listed = vec![0; 200];
    edges.ends().iter().for_each(|&end| listed[end as usize] += 1);
    let row = |slot: usize| {
        let row = edges.offsets()[slot] as usize..edges.offsets()[slot + 1] as usize;
        (edges.ends()[row.clone()].to_vec(), edges.class()[row].to_vec())
    };
    let mut all: BTreeMap<u32, EdgesOfSlot> =
        (0..200).map(|slot| (slot as u32, row(slot))).collect();
    let start = model.start_part(released, &edges).unwrap().estimates;
    let lead = |all: &_| Lead::new(&model, released, (&lengths, listed.clone()), all, &start);
    let mut rounds = lead(&all).unwrap();
    let standing = rounds.standing();
    let mut moved = model.move_part(released, &edges, &standing).unwrap();
    let left = moved.pop().unwrap();
    let missing = format!("round: expected slot {}, found none", left.slot);
    assert_eq!(rounds.moved(&moved).unwrap_err().to_string(), missing);
    assert!(rounds.told(&model, released, &[]).is_err());
    moved.push(moved[0]);
    assert!(rounds.moved(&moved).unwrap_err().to_string().contains("each slot in its turn"));
    moved.pop();
    moved.push(left);
    rounds.moved(&moved).unwrap();
    assert!(rounds.moved(&moved).is_err());
    assert!(rounds.told(&model, released, &[(200, 1)]).is_err());
    assert!(rounds.finish(&model, released, None).is_err());
    all.remove(&0);
    assert!(lead(&all).unwrap_err().to_string().starts_with("wanted: edges: offsets"));

    let sure =
        prepare(released, &lists, &RecoverOptions { confidence: true, ..options() }).unwrap();
    let all = (0..200).map(|slot| (slot as u32, row(slot))).collect();
    let error = Lead::new(&sure, released, (&lengths, listed.clone()), &all, &start).unwrap_err();
    assert!(error.to_string().starts_with("confidence of rounds in parts"), "{error}");
    for cut in (0..200).chain([standing.len() / 2, standing.len() - 1]) {
        assert!(model.move_part(released, &edges, &standing[..cut]).is_err(), "{cut} bytes");
    }
    assert!(model.move_part(released, &edges, &[&standing[..], &[0]].concat()).is_err());
}
