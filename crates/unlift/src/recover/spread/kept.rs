//! A lead between two rounds as bytes, from which another goes on.

use std::sync::Arc;

use super::lead::{Lead, Led, most_feeds};
use crate::Error;
use crate::recover::joint::{Course, Outline, check_estimates, read_estimates, write_estimates};
use crate::recover::learned::Model;
use crate::recover::map::bytes::{Reader, Writer};
use crate::released::Released;

/// How they begin.
const MAGIC: [u8; 8] = *b"unliftL1";

impl<const D: usize> Lead<D> {
    /// Where the lead stands between two rounds, some 60 bytes a slot, the same on every machine: what [`resume`](Self::resume) goes on
    /// from, to the same bits, after whoever led is gone.
    ///
    /// # Errors
    /// When slots have moved, but nobody was told.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        if self.after.is_some() {
            return Err(Error::new("lead", "one between two rounds", "one within a round"));
        }
        let mut to = Writer::default();
        to.bytes(&MAGIC);
        to.bytes(&self.led.learned);
        to.u64(self.feeds as u64);
        to.bytes(&[u8::from(self.last.is_some())]);
        write_estimates(self.last.as_deref().unwrap_or_default(), &mut to);
        self.course.write(&mut to);
        Ok(to.into_bytes())
    }

    /// The lead whose bytes [`to_bytes`](Self::to_bytes) gave. `lengths` is how many edges each slot has in its part, as for
    /// [`new`](Self::new).
    ///
    /// # Errors
    /// Those of [`new`](Self::new), and when `bytes` are anything else, or those of rounds by another model or outline.
    pub fn resume(
        model: &Model<D>,
        released: &Released<D>,
        outline: Outline,
        (lengths, bytes): (&[u32], &[u8]),
    ) -> Result<Self, Error> {
        let led = Led::check(model, released, &outline, lengths)?;
        let n_slots = lengths.len();
        let mut from = Reader::new("lead", bytes);
        if from.array()? != MAGIC {
            return Err(from.wrong("one of this version", "other bytes"));
        }
        if from.array()? != led.learned {
            return Err(from.wrong("one with this model and outline", "one with others"));
        }
        let feeds = from.count(most_feeds(model, released))?;
        let [is_done] = from.array()?;
        let last = (is_done != 0).then(|| read_estimates(&mut from, n_slots)).transpose()?;
        let course = Course::read(&mut from, (led.kind, Arc::new(outline.digest)), n_slots)?;
        from.end()?;
        check_estimates(course.all_estimates().chain(last.iter().flatten()))?;
        if course.is_done() != last.is_some() {
            return Err(from.wrong("a last word if and only if rounds are done", "another"));
        }
        Ok(Self { led, course, after: None, last, feeds })
    }
}
