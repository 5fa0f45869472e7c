//! Who is listed for a slot, in one form for solvers with and without a graph.

use crate::neighbors::Neighborhoods;
use crate::recover::chance_field;
use crate::recover::joint::{Graph, either};

/// Edges of slots.
pub(crate) trait Edges: Sync {
    /// Calls `f(end, either)` for every edge: a slot, and whether it may be that one or the next.
    fn each(&self, slot: usize, f: impl FnMut(u32, bool));
    /// How often each record is at the other end of an edge.
    fn times_listed(&self, n_records: usize) -> Vec<u32>;
}

/// Lists alone.
pub(crate) struct Listed<'a> {
    pub(crate) lists: &'a Neighborhoods,
    pub(crate) slots_per_record: usize,
}

impl Edges for Listed<'_> {
    #[inline(always)]
    fn each(&self, slot: usize, mut f: impl FnMut(u32, bool)) {
        let either = self.slots_per_record == 2;
        for record in self.lists.of(slot) {
            f(record.0 * self.slots_per_record as u32, either);
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
    #[inline(always)]
    fn each(&self, slot: usize, mut f: impl FnMut(u32, bool)) {
        let (ends, class) = self.graph.of(slot);
        for (&end, &class) in ends.iter().zip(class) {
            f(end, either(class, self.slots_per_record));
        }
    }

    fn times_listed(&self, n_records: usize) -> Vec<u32> {
        self.graph.times_listed(n_records, self.slots_per_record)
    }
}
