//! Consensus in parts, each with its own lists alone: what the machines of a cluster solve.

use std::ops::Range;

use super::checks::check_anchors;
use super::model::Model;
use super::pairs_of_descriptors::descriptor_rows;
use super::problem::Problem;
use super::result::estimate::Estimate;
use super::result::recovered::Recovered;
use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::released::Released;

/// What came of some slots of a map, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Part<const D: usize> {
    /// An estimate per slot.
    pub estimates: Vec<Estimate<D>>,
    /// Per slot the descriptor row said to belong to it, if records hide two points and have descriptors.
    pub descriptor_row: Option<Vec<u32>>,
}

impl<const D: usize> Model<D> {
    /// Solves `slots` of `released` by consensus with the lists of these slots alone, made by
    /// [`Neighborhoods::of_slots`]: whatever other lists say changes nothing. Reads all records once: parts should be large.
    ///
    /// # Errors
    /// When the model is of another map, records are rays from anchors in regions (which are compared with each other), or `slots` are
    /// not there or end within a record.
    pub fn solve_part(
        &self,
        released: &Released<D>,
        lists: &Neighborhoods,
        slots: Range<usize>,
    ) -> Result<Part<D>, Error> {
        check_anchors(released)?;
        let per_record = released.slots_per_record();
        let is_there = slots.start <= slots.end && slots.end <= released.n_slots();
        if !is_there || slots.start % per_record + slots.end % per_record > 0 {
            let expected = format!("a range of whole records, {per_record} slots each");
            return Err(Error::new("slots", expected, format!("{slots:?}")));
        }
        let estimates = Problem::with_model(released, lists, self)?.solve(slots.clone());
        let records = slots.start / per_record..slots.end / per_record;
        let descriptor_row = descriptor_rows(released, lists, records);
        Ok(Part { estimates, descriptor_row })
    }

    /// What came back of the whole map: `parts` in the order of their slots. The same as
    /// [`recover`](crate::recover::recover), bit for bit.
    ///
    /// # Errors
    /// As there, and when the parts are not those of all slots.
    pub fn join(
        &self,
        released: &Released<D>,
        parts: impl IntoIterator<Item = Part<D>>,
    ) -> Result<Recovered<D>, Error> {
        check_anchors(released)?;
        let (mut estimates, mut rows) = (Vec::new(), Vec::new());
        for part in parts {
            estimates.extend(part.estimates);
            rows.extend(part.descriptor_row.into_iter().flatten());
        }
        let lists = Neighborhoods::of_slots(
            0,
            &[0],
            Vec::new(),
            None,
            (released.n_records(), released.slots_per_record()),
        )?;
        let lists = lists.with_about(self.about);
        let has_rows = released.slots_per_record() == 2 && released.descriptors().is_some();
        let problem = Problem::with_model(released, &lists, self)?;
        problem
            .finish_with(estimates, has_rows.then_some(rows), false)
            .map(|(recovered, _)| recovered)
    }
}
