//! Who leads the rounds of a map whose edges are elsewhere.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use crate::recover::exact;
use crate::recover::joint::{Agree, Course, Kind, News, Outline, check_estimates};
use crate::recover::learned::Model;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::Places;
use crate::recover::map::with_pieces::WithPieces;
use crate::recover::result::estimate::Estimate;
use crate::recover::result::recovered::Recovered;
use crate::recover::result::unknown::Unknown;
use crate::recover::solve::Moved;
use crate::recover::task::in_columns;
use crate::released::Released;
use crate::{About, Error, Fingerprint};

/// Leads the rounds of a map whose edges others have, each those of some slots.
///
/// In memory are some 100 bytes a slot, 50 more for what is sent in a round, and the sample of an [`Outline`]. One process does all of it, in
/// this order:
///
/// 1. [`new`](Self::new) with what [`Model::start_part`] says of all slots.
/// 2. Until it [`is_done`](Self::is_done): [`standing`](Self::standing) to all parts; [`moved`](Self::moved) with what
///    [`Model::move_part`] says; the news that come of it to all parts; [`told`](Self::told) with what [`Model::tell_part`] says.
/// 3. [`finish`](Self::finish).
pub struct Lead<const D: usize> {
    pub(super) led: Led,
    pub(super) course: Course<D>,
    /// Where slots are after the round under way, once they have moved.
    pub(super) after: Option<Places<D>>,
    /// The last word, once there is one.
    pub(super) last: Option<Vec<Estimate<D>>>,
    /// How often rounds begin anew from where a rule of the scheme moved slots.
    pub(super) feeds: usize,
}

/// What is led: a map, and edges that others have.
pub(super) struct Led {
    pub(super) map: Fingerprint,
    /// Of model and outline.
    pub(super) learned: [u8; 32],
    pub(super) kind: Kind,
    /// Slots without edges stay where they are, and nobody asks for them.
    pub(super) has_edges: Vec<bool>,
}

impl Led {
    /// Refuses what does not belong together; `lengths` is how many edges each slot has in its part.
    pub(super) fn check<const D: usize>(
        model: &Model<D>,
        released: &Released<D>,
        outline: &Outline,
        lengths: &[u32],
    ) -> Result<Self, Error> {
        let family = model.family_of_rounds(released)?;
        let map = released.fingerprint();
        map.expect(Some(outline.map())).map_err(|error| error.within("outline"))?;
        if model.options().confidence {
            let expected = "a model without: who has no lists cannot say how sure it is";
            return Err(Error::new("confidence of rounds in parts", expected, "asked for"));
        }
        let n_slots = released.n_slots();
        for (what, n) in [("outline", outline.lengths.len()), ("lengths", lengths.len())] {
            if n != n_slots {
                return Err(Error::new(what, format!("{n_slots} rows"), n.to_string()));
            }
        }
        if outline.slots_per_record != released.slots_per_record() {
            let expected = format!("{} slots a record", released.slots_per_record());
            return Err(Error::new("outline", expected, outline.slots_per_record.to_string()));
        }
        let mut pairs = outline.lengths.iter().zip(lengths).enumerate();
        if let Some((slot, (expected, found))) = pairs.find(|(_, (a, b))| a != b) {
            let what = format!("edges of slot {slot}");
            return Err(Error::new(what, expected.to_string(), found.to_string()));
        }
        let hash = Sha256::new().chain_update(model.to_bytes()).chain_update(outline.to_bytes());
        let kind = family.with_pieces(model.delta as f32, OfKind(model.delta as f32));
        let has_edges = lengths.iter().map(|&n| n > 0).collect();
        Ok(Self { map, learned: hash.finalize().into(), kind, has_edges })
    }
}

impl<const D: usize> Lead<D> {
    /// Before the first round: `start` is what [`Model::start_part`] says of all slots, and `lengths` how many edges each has in
    /// its part.
    ///
    /// # Errors
    /// When model or outline are of another map or not for rounds, columns are not as long as the map, edges are lost or are others than
    /// those of the outline, or an estimate cannot be.
    pub fn new(
        model: &Model<D>,
        released: &Released<D>,
        outline: Outline,
        (start, lengths): (&[Estimate<D>], &[u32]),
    ) -> Result<Self, Error> {
        let led = Led::check(model, released, &outline, lengths)?;
        if start.len() != released.n_slots() {
            let expected = format!("{} rows", released.n_slots());
            return Err(Error::new("start", expected, start.len().to_string()));
        }
        check_estimates(start.iter())?;
        let course = Course::new(led.kind, Arc::new(outline.digest), start);
        let feeds = most_feeds(model, released);
        Ok(Self { led, course, after: None, last: None, feeds })
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
    /// When a slot with edges is missing, a slot is there twice or out of turn, an estimate cannot be, or the round is one that has
    /// moved.
    pub fn moved(&mut self, moved: &[Moved<D>]) -> Result<Option<Vec<u8>>, Error> {
        if self.after.is_some() || self.is_done() {
            return Err(Error::new("round", "one after the other", "slots that move twice"));
        }
        check_estimates(moved.iter().map(|one| &one.estimate))?;
        let standing = self.course.standing();
        let turn = |slot: usize| standing.is_turn_of(slot);
        let mut open: Vec<bool> = (0..self.led.has_edges.len()).map(turn).collect();
        for Moved { slot, .. } in moved {
            match open.get_mut(*slot as usize) {
                Some(open) if *open => *open = false,
                _ => return Err(Error::new("round", "each slot in its turn", slot.to_string())),
            }
        }
        let missing = open.iter().zip(&self.led.has_edges).position(|(&open, &has)| open && has);
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
        let n_slots = self.led.has_edges.len();
        if let Some((slot, _)) = concerning.iter().find(|(slot, _)| *slot as usize >= n_slots) {
            return Err(Error::new("told", format!("slots below {n_slots}"), slot.to_string()));
        }
        self.led.map.expect(Some(released.fingerprint()))?;
        // Records are asked at the end of a sweep alone.
        let ends_sweep = self.course.ends_sweep();
        let family = ends_sweep.then(|| model.family_of_rounds(released)).transpose()?;
        let Some(after) = self.after.take() else {
            return Err(Error::new("round", "slots that have moved", "others"));
        };
        let delta = model.delta as f32;
        self.course.tell(concerning);
        self.course.go_on(after, |judges, estimates| {
            let agree = Agree { judges, estimates, delta };
            family.map_or(0.0, |family| family.with_pieces(delta, agree))
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
                self.course = self.course.anew(&estimates);
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
        &self,
        model: &Model<D>,
        released: &Released<D>,
        descriptor_row: Option<Vec<u32>>,
    ) -> Result<Recovered<D>, Error> {
        self.led.map.expect(Some(released.fingerprint()))?;
        let Some(last) = &self.last else {
            return Err(Error::new("rounds", "all of them", "some that are left"));
        };
        let about = About { map: Some(self.led.map), ..model.about };
        let recovered = in_columns(released, (last, descriptor_row), model.delta, about)?;
        Ok(recovered.without_confidence(Unknown::NotAsked))
    }
}

impl<const D: usize> std::fmt::Debug for Lead<D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lead").field("is_done", &self.is_done()).finish_non_exhaustive()
    }
}

/// How often rounds of `released` begin anew.
pub(super) fn most_feeds<const D: usize>(model: &Model<D>, released: &Released<D>) -> usize {
    if is_settled(model, released) { exact::feeds(released) } else { 0 }
}

/// Whether a rule of the scheme moves slots.
fn is_settled<const D: usize>(model: &Model<D>, released: &Released<D>) -> bool {
    model.options().exact_constraints && exact::can_settle(released)
}

struct OfKind(f32);

impl<const D: usize> WithPieces<D> for OfKind {
    type Output = Kind;

    fn run<P: Pieces<D>>(self, pieces: &P) -> Kind {
        Kind::of(pieces, self.0)
    }
}
