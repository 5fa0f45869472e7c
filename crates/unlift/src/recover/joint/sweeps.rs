//! The rounds of a map whose edges are all at hand.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use super::agreement;
use super::course::{Course, Digest, Kind};
use super::wire::check_estimates;
use crate::Error;
use crate::recover::map::along_curve::along_curve_in;
use crate::recover::map::bytes::{Reader, Writer};
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::Places;
use crate::recover::result::estimate::Estimate;
use crate::recover::solve::{Begin, InRounds, Moved};

/// Sweeps over the slots of a map, each in rounds.
pub(super) struct Sweeps<'a, const D: usize, P> {
    pieces: P,
    graph: &'a Graph,
    delta2: f32,
    /// Slots as neighbors follow each other.
    order: Vec<u32>,
    /// Slots whose edges are read together, and how many of `order` are before the end of each.
    windows: Vec<Range<usize>>,
    ends: Vec<usize>,
    course: Course<D>,
}

impl<'a, const D: usize, P: Pieces<D>> Sweeps<'a, D, P> {
    /// Between two rounds or before the first one, where `begin` says.
    pub(super) fn new(
        pieces: P,
        graph: &'a Graph,
        begin: Begin<'_, D>,
        (delta, seed): (f32, u64),
    ) -> Result<Self, Error> {
        let (kind, digest) = (Kind::of(&pieces, delta), Arc::new(Digest::new(graph, seed)?));
        let course = match begin {
            Begin::At(start) => Course::new(kind, digest, start),
            Begin::Written(bytes) => {
                let mut from = Reader::new("kept rounds", bytes);
                if from.array()? != digest.hash() {
                    return Err(from.wrong("those of these lists", "of others"));
                }
                let course = Course::read(&mut from, (kind, digest), graph.n_slots())?;
                from.end()?;
                check_estimates(course.all_estimates())?;
                course
            }
        };
        let windows = graph.windows();
        let order = along_curve_in(&windows, &course.standing().places);
        let mut end = 0;
        let ends = windows.iter().map(|window| {
            end += window.len();
            end
        });
        let (ends, delta2) = (ends.collect(), delta * delta);
        Ok(Self { pieces, graph, delta2, order, ends, windows, course })
    }

    /// Tells whom it concerns where `jumpers` are `after` this round.
    fn tell(&self, jumpers: &mut [u32], after: &Places<D>) -> Result<(), Error> {
        let window_of = |slot: u32| self.windows.partition_point(|w| w.end <= slot as usize);
        // Whoever solved parts of the round may have handed them back in any order.
        if !jumpers.is_sorted_by_key(|&slot| window_of(slot)) {
            jumpers.sort_by_key(|&slot| window_of(slot));
        }
        let standing = self.course.standing();
        let jump = |&slot: &u32| (slot, standing.places.of(slot as usize), after.of(slot as usize));
        let is_ahead = |slot: usize| standing.ahead[slot] > 0.0;
        for jumpers in jumpers.chunk_by(|&a, &b| window_of(a) == window_of(b)) {
            let edges = self.graph.rows(&self.windows[window_of(jumpers[0])])?;
            let (to, reach) = ((&self.pieces, &edges), standing.reach());
            standing.jumps.tell(to, jumpers, jump, reach, is_ahead);
        }
        Ok(())
    }
}

impl<const D: usize, P: Pieces<D>> InRounds<D> for Sweeps<'_, D, P> {
    fn parts(&self) -> Vec<Range<usize>> {
        self.windows.clone()
    }

    fn solve(&self, slots: Range<usize>) -> Result<Vec<Moved<D>>, Error> {
        let standing = self.course.standing();
        let mut all = Vec::new();
        let mut start = 0;
        for (window, &end) in self.windows.iter().zip(&self.ends) {
            let order = &self.order[start..end];
            start = end;
            if window.end <= slots.start || slots.end <= window.start {
                continue;
            }
            let is_asked = |slot: usize| standing.is_turn_of(slot) && slots.contains(&slot);
            let mut moved: Vec<Moved<D>> = order
                .iter()
                .filter(|&&slot| is_asked(slot as usize))
                .map(|&slot| standing.unmoved(slot))
                .collect();
            if moved.is_empty() {
                continue;
            }
            standing.solve((&self.pieces, &self.graph.rows(window)?), self.delta2, &mut moved);
            if all.is_empty() { all = moved } else { all.append(&mut moved) }
        }
        Ok(all)
    }

    fn is_done(&self) -> bool {
        self.course.is_done()
    }

    fn is_turn_of(&self, slot: usize) -> bool {
        self.course.standing().is_turn_of(slot)
    }

    fn take(&mut self, moved: &[Moved<D>]) {
        self.course.take(moved);
    }

    fn end_round(&mut self) -> Result<(), Error> {
        let (mut jumpers, after) = self.course.moved();
        self.tell(&mut jumpers, &after)?;
        let (pieces, delta2) = (&self.pieces, self.delta2);
        let agree = |judges: &_, next: &[Estimate<D>]| agreement::of(pieces, judges, next, delta2);
        self.course.go_on(after, agree);
        Ok(())
    }

    fn write(&self, to: &mut dyn io::Write) -> io::Result<()> {
        let mut to = Writer::new(to);
        to.bytes(&self.course.digest().hash());
        self.course.write(&mut to);
        to.finish().map(drop)
    }

    fn estimates(&self) -> &[Estimate<D>] {
        self.course.estimates()
    }

    fn into_estimates(self: Box<Self>) -> Vec<Estimate<D>> {
        self.course.into_estimates()
    }
}
