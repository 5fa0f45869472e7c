//! Who is listed for a slot, in one form for solvers with and without a graph.

use crate::neighbors::Neighborhoods;
use crate::recover::map::chance_field;
use crate::recover::map::graph::{Graph, Side, either, side};

/// One edge of a slot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// The slot at the other end.
    pub(crate) end: u32,
    /// Whether it may be the next slot instead.
    pub(crate) either: bool,
    /// Whether the slot lists the other end, and the other way round.
    pub(crate) lists: bool,
    pub(crate) is_listed: bool,
}

/// Edges of slots.
pub(crate) trait Edges: Sync {
    /// Whether it is known who lists a slot.
    const BOTH_WAYS: bool;

    /// Calls `f` for every edge.
    fn each(&self, slot: usize, f: impl FnMut(Edge));
    /// How often each record is at the other end of an edge.
    fn times_listed(&self, n_records: usize) -> Vec<u32>;
}

/// Lists alone.
pub(crate) struct Listed<'a> {
    pub(crate) lists: &'a Neighborhoods,
    pub(crate) slots_per_record: usize,
}

impl Edges for Listed<'_> {
    const BOTH_WAYS: bool = false;

    #[inline(always)]
    fn each(&self, slot: usize, mut f: impl FnMut(Edge)) {
        let either = self.slots_per_record == 2;
        for record in self.lists.of(slot) {
            let end = record.0 * self.slots_per_record as u32;
            f(Edge { end, either, lists: true, is_listed: false });
        }
    }

    fn times_listed(&self, n_records: usize) -> Vec<u32> {
        chance_field::times_listed(self.lists, n_records)
    }
}

/// Lists in both directions.
pub(crate) struct BothWays<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) slots_per_record: usize,
}

impl Edges for BothWays<'_> {
    const BOTH_WAYS: bool = true;

    #[inline(always)]
    fn each(&self, slot: usize, mut f: impl FnMut(Edge)) {
        let (ends, class) = self.graph.of(slot);
        for (&end, &class) in ends.iter().zip(class) {
            let side = side(class);
            let (lists, is_listed) = (side != Side::Reverse, side != Side::Forward);
            f(Edge { end, either: either(class, self.slots_per_record), lists, is_listed });
        }
    }

    fn times_listed(&self, n_records: usize) -> Vec<u32> {
        self.graph.times_listed(n_records, self.slots_per_record)
    }
}
