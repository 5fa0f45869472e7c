//! Who leads the rounds of a map whose edges are elsewhere.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::recover::exact;
use crate::recover::joint::{Agree, Course, Digest, Judges, Kind, News, Sample};
use crate::recover::learned::Model;
use crate::recover::map::part_edges::Edges;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::Places;
use crate::recover::map::with_pieces::WithPieces;
use crate::recover::result::estimate::Estimate;
use crate::recover::result::recovered::Recovered;
use crate::recover::result::unknown::Unknown;
use crate::recover::solve::Moved;
use crate::recover::task::Task;
use crate::released::Released;

/// The other ends of the edges of a slot, and the class of each.
pub type EdgesOfSlot = (Vec<u32>, Vec<u8>);

/// Leads the rounds of a map whose edges others have, each those of some slots.
///
/// In memory are 90 bytes a slot or so, and a sample of the edges. One process does all of it, in this order:
///
/// 1. [`wanted`](Self::wanted): whose edges are the sample, [`new`](Self::new) with them.
/// 2. Until it [`is_done`](Self::is_done): [`standing`](Self::standing) to all parts; [`moved`](Self::moved) with what
///    [`Model::move_part`] says; the news that come of it to all parts; [`told`](Self::told) with what [`Model::tell_part`] says.
/// 3. [`finish`](Self::finish).
pub struct Lead<const D: usize> {
    course: Course<D>,
    /// Slots without edges stay where they are, and nobody asks for them.
    has_edges: Vec<bool>,
    /// Where slots are after the round under way, once they have moved.
    after: Option<Places<D>>,
    /// The last word, once there is one.
    last: Option<Vec<Estimate<D>>>,
    /// How often rounds begin anew from where a rule of the scheme moved slots.
    feeds: usize,
}

impl<const D: usize> Lead<D> {
    /// The slots whose edges the lead must know, ascending: some 50,000, however large the map is. `lengths` are the numbers of
    /// edges of all slots.
    ///
    /// # Errors
    /// None that a caller can cause.
    pub fn wanted(model: &Model<D>, lengths: &[u32]) -> Result<Vec<u32>, Error> {
        let starts = starts(lengths);
        let (n_slots, n_edges) = (lengths.len(), starts[lengths.len()] as usize);
        // Asked as if for the edges themselves.
        let slots = RefCell::new(BTreeSet::new());
        let want = |slot: usize| {
            slots.borrow_mut().insert(slot as u32);
        };
        let row = |slot: usize| {
            want(slot);
            Ok(EdgesOfSlot::default())
        };
        let edge = |at: u64| {
            want(slot_of(&starts, at));
            Ok((0, 0))
        };
        Judges::of(n_slots, |slot| row(slot).map(|row| row.0))?;
        Sample::of((n_slots, n_edges), model.options().seed, row, edge)?;
        Ok(slots.into_inner().into_iter().collect())
    }

    /// Before the first round, of a map with so many edges per slot (`lengths`). `listed` says how often each record is at the other
    /// end of an edge, `edges` are those of the [`wanted`](Self::wanted) slots, and `start` is what [`Model::start_part`] says of all slots.
    ///
    /// # Errors
    /// When the model is of another map or not for rounds, columns are not as long as the map, or edges are missing.
    pub fn new(
        model: &Model<D>,
        released: &Released<D>,
        (lengths, listed): (&[u32], Vec<u32>),
        edges: &BTreeMap<u32, EdgesOfSlot>,
        start: &[Estimate<D>],
    ) -> Result<Self, Error> {
        let family = model.family_of_rounds(released)?;
        if model.options().confidence {
            let expected = "a model without: who has no lists cannot say how sure it is";
            return Err(Error::new("confidence of rounds in parts", expected, "asked for"));
        }
        let n_slots = released.n_slots();
        for (what, expected, found) in [
            ("lengths", n_slots, lengths.len()),
            ("listed", released.n_records(), listed.len()),
            ("start", n_slots, start.len()),
        ] {
            if found != expected {
                return Err(Error::new(what, format!("{expected} rows"), found.to_string()));
            }
        }
        let starts = starts(lengths);
        let map = (released.n_records(), released.slots_per_record());
        let row = |slot: usize| -> Result<EdgesOfSlot, Error> {
            let (ends, class) = edges.get(&(slot as u32)).cloned().unwrap_or_default();
            let offsets = vec![0, u64::from(lengths[slot])];
            Edges::try_new(slot..slot + 1, offsets, ends.clone(), class.clone(), map)
                .map_err(|error| error.within("wanted"))?;
            Ok((ends, class))
        };
        let edge = |at: u64| {
            let slot = slot_of(&starts, at);
            let (ends, class) = row(slot)?;
            let at = (at - starts[slot]) as usize;
            Ok((ends[at], class[at]))
        };
        let n_edges = starts[n_slots] as usize;
        let judges = Judges::of(n_slots, |slot| row(slot).map(|row| row.0))?;
        let sample = Sample::of((n_slots, n_edges), model.options().seed, row, edge)?;
        let kind = family.with_pieces(model.delta as f32, OfKind(model.delta as f32));
        let has_edges = lengths.iter().map(|&n| n > 0).collect();
        let course = Course::new(kind, Digest { listed, sample, judges }, start);
        let feeds = if is_settled(model, released) { exact::feeds(released) } else { 0 };
        Ok(Self { course, has_edges, after: None, last: None, feeds })
    }

    /// Whether all rounds are done.
    pub fn is_done(&self) -> bool {
        self.last.is_some()
    }

    /// Where the round stands, as bytes for [`Model::move_part`].
    pub fn standing(&self) -> Vec<u8> {
        self.course.standing().to_bytes()
    }

    /// All slots have moved whose turn it was, in any order: the news as bytes for [`Model::tell_part`], `None` where there are
    /// none.
    ///
    /// # Errors
    /// When a slot with edges is missing, a slot is there twice or out of turn, or the round is one that has moved.
    pub fn moved(&mut self, moved: &[Moved<D>]) -> Result<Option<Vec<u8>>, Error> {
        if self.after.is_some() || self.is_done() {
            return Err(Error::new("round", "one after the other", "slots that move twice"));
        }
        let standing = self.course.standing();
        let turn = |slot: usize| standing.is_turn_of(slot);
        let mut open: Vec<bool> = (0..self.has_edges.len()).map(turn).collect();
        for Moved { slot, .. } in moved {
            match open.get_mut(*slot as usize) {
                Some(open) if *open => *open = false,
                _ => return Err(Error::new("round", "each slot in its turn", slot.to_string())),
            }
        }
        let missing = open.iter().zip(&self.has_edges).position(|(&open, &has)| open && has);
        if let Some(slot) = missing {
            return Err(Error::new("round", format!("slot {slot}"), "none"));
        }
        self.course.take(moved);
        let (jumpers, after) = self.course.moved();
        let news = News::new(self.course.standing(), jumpers, &after);
        self.after = Some(after);
        Ok((!news.is_empty()).then(|| news.to_bytes()))
    }

    /// Ends the round: how many jumps concern which slot, as all parts say, in any order; nothing where there were no news.
    ///
    /// # Errors
    /// When slots have not moved, one is not there, or the model is of another map.
    pub fn told(
        &mut self,
        model: &Model<D>,
        released: &Released<D>,
        concerning: &[(u32, u32)],
    ) -> Result<(), Error> {
        let n_slots = self.has_edges.len();
        if let Some((slot, _)) = concerning.iter().find(|(slot, _)| *slot as usize >= n_slots) {
            return Err(Error::new("told", format!("slots below {n_slots}"), slot.to_string()));
        }
        let family = model.family_of_rounds(released)?;
        let Some(after) = self.after.take() else {
            return Err(Error::new("round", "slots that have moved", "others"));
        };
        let delta = model.delta as f32;
        self.course.tell(concerning);
        self.course.go_on(after, |judges, next| {
            family.with_pieces(delta, Agree { judges, estimates: next, delta })
        });
        if self.course.is_done() {
            self.settle(model, released);
        }
        Ok(())
    }

    /// The rule of the scheme moves slots, and rounds begin anew from there, or this is the last word.
    fn settle(&mut self, model: &Model<D>, released: &Released<D>) {
        let mut estimates = self.course.estimates().to_vec();
        if is_settled(model, released) {
            estimates = exact::settle(released, estimates, model.delta);
        }
        match self.feeds.checked_sub(1) {
            Some(feeds) => {
                self.feeds = feeds;
                self.course.begin_anew(&estimates);
            }
            None => self.last = Some(estimates),
        }
    }

    /// What came back: that of [`recover`](crate::recover::recover) without confidence, bit for bit. `descriptor_row` is what
    /// [`Model::start_part`] says of all slots.
    ///
    /// # Errors
    /// When rounds are left, or columns are not those of this map.
    pub fn finish(
        self,
        model: &Model<D>,
        released: &Released<D>,
        descriptor_row: Option<Vec<u32>>,
    ) -> Result<Recovered<D>, Error> {
        let Some(last) = self.last else {
            return Err(Error::new("rounds", "all of them", "some that are left"));
        };
        let map = (released.n_records(), released.slots_per_record());
        let lists = Neighborhoods::of_slots(0, &[0], Vec::new(), None, map)?;
        let lists = lists.with_about(model.about);
        let task = Task::new(model, released, &lists)?;
        Ok(task.in_columns(&last, descriptor_row)?.without_confidence(Unknown::NotAsked))
    }
}

impl<const D: usize> std::fmt::Debug for Lead<D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lead").field("is_done", &self.is_done()).finish_non_exhaustive()
    }
}

/// Whether a rule of the scheme moves slots.
fn is_settled<const D: usize>(model: &Model<D>, released: &Released<D>) -> bool {
    model.options().exact_constraints && exact::can_settle(released)
}

/// Where the edges of each slot start among all; one more entry than there are slots.
fn starts(lengths: &[u32]) -> Vec<u64> {
    let mut starts = Vec::with_capacity(lengths.len() + 1);
    starts.push(0);
    let mut start = 0;
    starts.extend(lengths.iter().map(|&n| {
        start += u64::from(n);
        start
    }));
    starts
}

/// The slot that the edge `at` of all is of.
fn slot_of(starts: &[u64], at: u64) -> usize {
    starts.partition_point(|&start| start <= at) - 1
}

struct OfKind(f32);

impl<const D: usize> WithPieces<D> for OfKind {
    type Output = Kind;

    fn run<P: Pieces<D>>(self, pieces: &P) -> Kind {
        Kind::of(pieces, self.0)
    }
}
