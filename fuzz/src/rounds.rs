//! What the parts of joint recovery send each other or keep, changed on the way: bytes are read or refused, and rounds end.

use std::sync::OnceLock;

use unlift::geometry::frame::Bounds;
use unlift::neighbors::{Neighborhoods, oracle};
use unlift::obfuscate::{self, SchemeOptions};
use unlift::recover::{
    Edges, Estimate, Lead, Model, Moved, NamedBy, Outline, Part, RecoverOptions, Status,
    prepare_rounds,
};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{Error, PointSet, Unit};

use super::bytes::Bytes;

/// Schemes of every family of records that rounds in parts know.
const SCHEMES: [&str; 6] = ["olc", "ppl", "plane", "cp", "lines2d", "cp2d"];

/// How many points are hidden.
const POINTS: usize = 60;

/// A scheme, what is changed, and how.
pub fn rounds(bytes: &[u8]) {
    static SPACE: [OnceLock<Rounds<3>>; SCHEMES.len()] = [const { OnceLock::new() }; SCHEMES.len()];
    static PLANE: [OnceLock<Rounds<2>>; SCHEMES.len()] = [const { OnceLock::new() }; SCHEMES.len()];
    let mut bytes = Bytes(bytes);
    let scheme = usize::from(bytes.byte()) % SCHEMES.len();
    let name = SCHEMES[scheme];
    let made = "rounds of a map of ours";
    if name.ends_with("2d") {
        PLANE[scheme].get_or_init(|| Rounds::of(name).expect(made)).with(&mut bytes);
    } else {
        SPACE[scheme].get_or_init(|| Rounds::of(name).expect(made)).with(&mut bytes);
    }
}

/// A map in one part, and what is sent in its second round.
struct Rounds<const D: usize> {
    released: Released<D>,
    model: Model<D>,
    edges: Edges,
    start: Vec<Estimate<D>>,
    lengths: Vec<u32>,
    /// Bytes of model, outline, standing, news and lead, as they are sent or kept.
    sent: [Vec<u8>; 5],
}

impl<const D: usize> Rounds<D> {
    fn of(name: &str) -> Result<Self, Error> {
        let (unit, side) = if D == 2 { (Unit::Pixel, 64.0) } else { (Unit::Meter, 4.0) };
        let at = |i: usize, c: usize| side * ((i * [7, 13, 29][c] + c) % 61) as f64 / 61.0;
        let points = (0..POINTS).map(|i| std::array::from_fn(|c| at(i, c))).collect();
        let points = PointSet::try_new(points, unit)?;
        let original = match D {
            2 => Original::within(points, Bounds { low: [0.0; D], high: [side; D] })?,
            _ => Original::new(points),
        };
        let scheme = obfuscate::scheme(name)?.of_dimension(&SchemeOptions { voxel: side / 8.0 });
        let scheme = scheme.expect("defined there");
        let key = Key::from_seed(1);
        let (released, secret) = obfuscate::obfuscate(&*scheme, &original, None, &key)?;
        let per_record = released.slots_per_record();
        let search = oracle::search(&original)?;
        let near = oracle::TrueNeighbors::new(&search, &secret, per_record, 6)?;
        let lists = near.at_inlier_ratio(0.5, 1)?;
        let options = RecoverOptions { confidence: false, ..RecoverOptions::default() };
        let (model, outline) = prepare_rounds(&released, &lists, &options)?;
        let edges = edges(&model, &released, &lists)?;
        let Part { estimates: start, .. } = model.start_part(&released, &edges)?;
        let lengths = edges.offsets().windows(2).map(|row| (row[1] - row[0]) as u32).collect();
        let sent = [model.to_bytes(), outline.to_bytes(), Vec::new(), Vec::new(), Vec::new()];
        let mut rounds = Self { released, model, edges, start, lengths, sent };
        let mut lead = rounds.lead(outline)?;
        while rounds.sent[3].is_empty() && !lead.is_done() {
            rounds.sent[2] = lead.standing();
            let moved = rounds.moved(&rounds.model, &rounds.sent[2])?;
            rounds.sent[3] = lead.moved(&moved)?.unwrap_or_default();
            lead.told(&rounds.model, &rounds.released, &[])?;
            rounds.sent[4] = lead.to_bytes()?;
        }
        Ok(rounds)
    }

    fn lead(&self, outline: Outline) -> Result<Lead<D>, Error> {
        Lead::new(&self.model, &self.released, outline, (&self.start, &self.lengths))
    }

    fn moved(&self, model: &Model<D>, standing: &[u8]) -> Result<Vec<Moved<D>>, Error> {
        model.move_part(&self.released, &self.edges, standing)
    }

    fn with(&self, bytes: &mut Bytes<'_>) {
        let which = usize::from(bytes.byte() % 5);
        let sent = changed(&self.sent[which], bytes);
        // An error is one line; what it says is tested elsewhere.
        let _ = match which {
            0 => self.with_model(&sent),
            1 => self.with_outline(&sent),
            2 => self.with_standing(&sent),
            3 => self.with_news(&sent),
            _ => self.with_lead(&sent),
        };
    }

    fn with_model(&self, sent: &[u8]) -> Result<(), Error> {
        let model = Model::<D>::from_bytes(sent)?;
        let again = model.to_bytes();
        let read = Model::<D>::from_bytes(&again).expect("what a model writes");
        assert_eq!(read.to_bytes(), again);
        let Part { estimates, .. } = model.start_part(&self.released, &self.edges)?;
        assert_eq!(estimates.len(), self.released.n_slots());
        self.moved(&model, &self.sent[2])?;
        model.tell_part(&self.released, &self.edges, &self.sent[3]).map(drop)
    }

    fn with_outline(&self, sent: &[u8]) -> Result<(), Error> {
        let outline = Outline::from_bytes(sent)?;
        let again = outline.to_bytes();
        assert_eq!(Outline::from_bytes(&again).expect("what an outline writes").to_bytes(), again);
        self.to_the_end(self.lead(outline)?)
    }

    fn with_lead(&self, sent: &[u8]) -> Result<(), Error> {
        let lead = self.resume(sent)?;
        let again = lead.to_bytes()?;
        assert!(self.resume(&again).expect("what a lead writes").to_bytes()? == again);
        self.to_the_end(lead)
    }

    fn resume(&self, sent: &[u8]) -> Result<Lead<D>, Error> {
        let outline = Outline::from_bytes(&self.sent[1])?;
        Lead::resume(&self.model, &self.released, outline, (&self.lengths, sent))
    }

    fn to_the_end(&self, mut lead: Lead<D>) -> Result<(), Error> {
        while !lead.is_done() {
            let moved = self.moved(&self.model, &lead.standing())?;
            let news = lead.moved(&moved)?;
            let told = news.map(|news| self.model.tell_part(&self.released, &self.edges, &news));
            lead.told(&self.model, &self.released, &told.transpose()?.unwrap_or_default())?;
        }
        let recovered = lead.finish(&self.model, &self.released, None)?;
        for (slot, status) in recovered.status().iter().enumerate() {
            let place = recovered.position(slot);
            assert_eq!(place.is_some(), *status == Status::Ok, "slot {slot}");
            assert!(place.iter().flatten().all(|x| x.is_finite()), "slot {slot}");
        }
        Ok(())
    }

    fn with_standing(&self, sent: &[u8]) -> Result<(), Error> {
        let moved = self.moved(&self.model, sent)?;
        assert!(moved.iter().all(|one| (one.slot as usize) < self.released.n_slots()));
        Ok(())
    }

    fn with_news(&self, sent: &[u8]) -> Result<(), Error> {
        let told = self.model.tell_part(&self.released, &self.edges, sent)?;
        assert!(told.iter().all(|(slot, _)| (*slot as usize) < self.released.n_slots()));
        Ok(())
    }
}

/// Who lists whom, in one part.
fn edges<const D: usize>(
    model: &Model<D>,
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Result<Edges, Error> {
    let pairs = |slot: usize| lists.of(slot).iter().map(move |record| (record.0, slot as u32));
    let (records, slots): (Vec<u32>, Vec<u32>) = (0..lists.n_slots()).flat_map(pairs).unzip();
    let named_by = NamedBy { records: &records, slots: &slots, scores: None };
    model.edges(released, lists, 0..lists.n_slots(), named_by)
}

/// `sent` with some changes: bits turned, numbers set, bytes put in, taken out or cut off; or other bytes instead.
fn changed(sent: &[u8], bytes: &mut Bytes<'_>) -> Vec<u8> {
    let mut sent = sent.to_vec();
    while !bytes.0.is_empty() {
        let kind = bytes.byte();
        // Most of what can be wrong is at the front or at the end.
        let at = usize::from(bytes.short());
        let at = if kind & 0x80 == 0 { at } else { sent.len().saturating_sub(at) };
        let at = at.min(sent.len());
        let end = |n: usize| sent.len().min(at + n);
        match kind % 8 {
            0 => sent.truncate(at),
            1 => {
                let n = bytes.byte().into();
                sent.splice(at..at, bytes.take(n).iter().copied());
            }
            2 => drop(sent.drain(at..end(bytes.byte().into()))),
            3 => drop(sent.splice(at..end(8), u64::from(bytes.short()).to_le_bytes())),
            4 => drop(sent.splice(at..end(4), u32::from(bytes.short()).to_le_bytes())),
            5 => drop(sent.splice(at..end(4), (bytes.number() as f32).to_le_bytes())),
            6 => drop(sent.splice(at..end(8), bytes.number().to_le_bytes())),
            _ => {
                let mask = bytes.byte();
                sent.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= mask);
            }
        }
    }
    sent
}
