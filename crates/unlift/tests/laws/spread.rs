//! Joint recovery whose edges are spread gives what it gives at once, bit for bit.

use std::ops::Range;

use unlift::Error;
use unlift::neighbors::Neighborhoods;
use unlift::obfuscate::Entry;
use unlift::recover::{
    Edges, Estimate, Lead, Model, Moved, NamedBy, Outline, Part, RecoverOptions, Recovered, Solver,
    prepare, prepare_rounds,
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
    (model, outline): (&Model<D>, Outline),
) -> Result<Recovered<D>, Error> {
    let per = released.slots_per_record();
    let map = (released.n_records(), per);
    let mut parts = Vec::new();
    for slots in cuts(released.n_records(), per) {
        let (own, entries) = of_part(lists, &slots, per);
        let named_by = entries.named_by(lists.scores().is_some());
        parts.push(kept(&model.edges(released, &own, slots, named_by)?, map));
    }
    let (mut start, mut lengths, mut rows) = (Vec::new(), Vec::new(), Vec::new());
    for edges in &parts {
        lengths.extend(edges.offsets().windows(2).map(|row| (row[1] - row[0]) as u32));
        let Part { estimates, descriptor_row } = model.start_part(released, edges)?;
        start.extend(estimates);
        rows.extend(descriptor_row.into_iter().flatten());
    }
    let known = outline.to_bytes();
    let mut lead = Lead::new(model, released, outline, (&start, &lengths))?;
    while !lead.is_done() {
        // Whoever leads may be another in every round.
        let kept = lead.to_bytes()?;
        lead = Lead::resume(model, released, Outline::from_bytes(&known)?, (&lengths, &kept))?;
        assert!(lead.to_bytes()? == kept);
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
    let done = lead.to_bytes()?;
    let lead = Lead::resume(model, released, Outline::from_bytes(&known)?, (&lengths, &done))?;
    assert!(lead.is_done());
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
        let (model, outline) = prepare_rounds(released, lists, &options()).unwrap();
        assert!(model.to_bytes() == prepare(released, lists, &options()).unwrap().to_bytes());
        let [learned, known] = [model.to_bytes(), outline.to_bytes()];
        let model = Model::<D>::from_bytes(&learned).unwrap();
        let outline = Outline::from_bytes(&known).unwrap();
        assert_eq!([model.to_bytes(), outline.to_bytes()], [learned, known], "{name}");
        let found = spread(released, lists, (&model, outline));
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

/// A map of lines, its lists, and all of it in one part.
struct OnePart {
    hidden: Hidden<3>,
    lists: Neighborhoods,
    model: Model<3>,
    outline: Vec<u8>,
    edges: Edges,
    start: Vec<Estimate<3>>,
    lengths: Vec<u32>,
}

impl OnePart {
    fn new() -> Self {
        let olc = unlift::obfuscate::scheme("olc").unwrap();
        let hidden = hide::<3>(olc, &room(62, 200), 6);
        let lists = hidden.lists(12, 0.25, 6);
        let (model, outline) = prepare_rounds(&hidden.released, &lists, &options()).unwrap();
        let (own, entries) = of_part(&lists, &(0..200), 1);
        let named_by = entries.named_by(false);
        let edges = model.edges(&hidden.released, &own, 0..200, named_by).unwrap();
        let start = model.start_part(&hidden.released, &edges).unwrap().estimates;
        let lengths = edges.offsets().windows(2).map(|row| (row[1] - row[0]) as u32).collect();
        Self { outline: outline.to_bytes(), hidden, lists, model, edges, start, lengths }
    }

    fn lead(&self, start: &[Estimate<3>], lengths: &[u32]) -> Result<Lead<3>, Error> {
        let outline = Outline::from_bytes(&self.outline)?;
        Lead::new(&self.model, &self.hidden.released, outline, (start, lengths))
    }

    fn moved(&self, standing: &[u8]) -> Result<Vec<Moved<3>>, Error> {
        self.model.move_part(&self.hidden.released, &self.edges, standing)
    }
}

fn line<T>(found: Result<T, Error>) -> String {
    found.err().expect("an error").to_string()
}

#[test]
fn edges_are_those_of_their_map() {
    let one = OnePart::new();
    let released = &one.hidden.released;
    let (own, entries) = of_part(&one.lists, &(0..200), 1);
    let far = entries.records.iter().find(|&&record| record > 99).unwrap();
    assert_eq!(
        line(one.model.edges(released, &own, 0..100, entries.named_by(false))),
        format!("named by: expected records 0..100, found {far}")
    );
    let mut twice = Entries { records: entries.records.clone(), ..Entries::default() };
    twice.slots = entries.slots.clone();
    twice.records.push(entries.records[0]);
    twice.slots.push(entries.slots[0]);
    let found = line(one.model.edges(released, &own, 0..200, twice.named_by(false)));
    assert!(found.contains("expected each slot once"), "{found}");
    let small = hide::<3>(unlift::obfuscate::scheme("olc").unwrap(), &room(62, 100), 6);
    let few = small.lists(12, 0.5, 6);
    let found = line(one.model.edges(released, &few, 0..200, entries.named_by(false)));
    assert!(found.starts_with("neighborhoods: expected 200 rows"), "{found}");

    let columns = |slots: Range<usize>, end: u32, class: u8| {
        Edges::try_new(slots, vec![0, 2], vec![4, end], vec![0, class], (100, 2))
    };
    let half = columns(5..6, 6, 0).unwrap();
    assert_eq!(line(columns(5..6, 200, 0)), "edges: edge: expected a slot below 200, found 200");
    assert_eq!(line(columns(5..6, 6, 24)), "edges: edge: expected a class below 24, found 24");
    assert!(line(columns(5..6, 7, 0)).starts_with("edges: edge: expected the first slot of"));
    assert!(line(columns(5..6, 2, 0)).starts_with("edges: ends: expected ascending slots"));
    assert!(line(columns(200..201, 6, 0)).starts_with("edges: slots: expected 2 offsets within"));
    let found = line(one.model.start_part(released, &half));
    assert!(found.starts_with("edges: records, and slots of each: expected (200, 1)"), "{found}");
}

#[test]
fn a_lead_is_told_what_all_parts_say() {
    let one = OnePart::new();
    let released = &one.hidden.released;
    let mut lengths = one.lengths.clone();
    lengths[7] -= 1;
    let lost = format!("edges of slot 7: expected {}, found {}", one.lengths[7], lengths[7]);
    assert_eq!(line(one.lead(&one.start, &lengths)), lost);
    assert_eq!(
        line(one.lead(&one.start[1..], &one.lengths)),
        "start: expected 200 rows, found 199"
    );
    let mut start = one.start.clone();
    start[3].axis = 3;
    assert!(line(one.lead(&start, &one.lengths)).starts_with("estimate: expected a place"));

    let mut lead = one.lead(&one.start, &one.lengths).unwrap();
    let standing = lead.standing();
    let mut moved = one.moved(&standing).unwrap();
    let left = moved.pop().unwrap();
    let missing = format!("round: expected slot {}, found none", left.slot);
    assert_eq!(line(lead.moved(&moved)), missing);
    assert!(lead.told(&one.model, released, &[]).is_err());
    assert!(lead.to_bytes().is_ok());
    moved.push(moved[0]);
    assert!(line(lead.moved(&moved)).contains("each slot in its turn"));
    moved.pop();
    moved.push(left);
    lead.moved(&moved).unwrap();
    assert!(lead.moved(&moved).is_err());
    assert_eq!(
        line(lead.to_bytes()),
        "lead: expected one between two rounds, found one within a round"
    );
    assert!(lead.told(&one.model, released, &[(200, 1)]).is_err());
    assert!(lead.finish(&one.model, released, None).is_err());

    let options = RecoverOptions { confidence: true, ..options() };
    let (sure, outline) = prepare_rounds(released, &one.lists, &options).unwrap();
    let found = line(Lead::new(&sure, released, outline, (&one.start, &one.lengths)));
    assert!(found.starts_with("confidence of rounds in parts"), "{found}");
    let consensus = RecoverOptions { solver: Solver::Consensus, ..options };
    let found = line(prepare_rounds(released, &one.lists, &consensus));
    assert_eq!(found, "solver of rounds: expected joint, found consensus");
}

#[test]
fn other_bytes_are_no_round() {
    let one = OnePart::new();
    let released = &one.hidden.released;
    let mut lead = one.lead(&one.start, &one.lengths).unwrap();
    let first = lead.standing();
    lead.moved(&one.moved(&first).unwrap()).unwrap();
    lead.told(&one.model, released, &[]).unwrap();
    let standing = lead.standing();
    let news = lead.moved(&one.moved(&standing).unwrap()).unwrap().expect("jumps");
    let tell = |news: &[u8]| one.model.tell_part(released, &one.edges, news);
    assert!(one.moved(&standing).is_ok() && tell(&news).is_ok());
    let refuses = |bytes: &[u8], read: &dyn Fn(&[u8]) -> bool| {
        assert!(!read(&[bytes, &[0]].concat()), "one byte more");
        for cut in (0..200.min(bytes.len())).chain([bytes.len() / 2, bytes.len() - 1]) {
            assert!(!read(&bytes[..cut]), "{cut} bytes");
        }
        // Whatever is in them, they are read or refused.
        for at in (0..bytes.len()).step_by(bytes.len().div_ceil(400)) {
            for value in [0, 1, 0x7f, 0xff] {
                let mut changed = bytes.to_vec();
                changed[at] = value;
                read(&changed);
            }
        }
    };
    refuses(&standing, &|bytes| one.moved(bytes).is_ok());
    refuses(&news, &|bytes| tell(bytes).is_ok());
    lead.told(&one.model, released, &tell(&news).unwrap()).unwrap();
    let kept = lead.to_bytes().unwrap();
    let resume = |kept: &[u8], lengths: &[u32]| {
        let outline = Outline::from_bytes(&one.outline)?;
        Lead::resume(&one.model, released, outline, (lengths, kept))
    };
    assert!(resume(&kept, &one.lengths).is_ok());
    refuses(&kept, &|bytes| resume(bytes, &one.lengths).is_ok());
    let mut lengths = one.lengths.clone();
    lengths[0] += 1;
    assert!(line(resume(&kept, &lengths)).starts_with("edges of slot 0: expected"));
    let seeded = RecoverOptions { seed: 10, ..options() };
    let (other, outline) = prepare_rounds(released, &one.lists, &seeded).unwrap();
    let found = line(Lead::resume(&other, released, outline, (&one.lengths, &kept)));
    assert_eq!(found, "lead: expected one with this model and outline, found one with others");
    refuses(&one.outline, &|bytes| Outline::from_bytes(bytes).is_ok());
    // Slots that do not ascend would be looked for in the wrong part.
    let last = news.len() - 28;
    assert!(last > 57 + 28, "one jump alone is in order");
    let mut swapped = news.clone();
    swapped[last..last + 4].copy_from_slice(&0u32.to_le_bytes());
    let found = line(tell(&swapped));
    assert!(found.starts_with("news: expected ascending slots"), "{found}");
}
