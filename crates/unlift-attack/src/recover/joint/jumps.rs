//! Whom a jump concerns: the slots that must be looked at again.
//!
//! A slot that jumps tells those at the other ends of its edges, if it jumped to or from where they may lie. Few
//! slots jump after the first sweep, so telling is cheaper than asking. A slot whom many list knows only some of
//! them: the others are not told, and stay until something else jumps.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use crate::recover::map::edges::either;
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{Places, distance2};

/// Per slot that is ahead, how many jumps concern it since it was last its turn. Sums of integers: the same however threads
/// share the work.
pub(super) struct Jumps {
    concerning: Vec<AtomicU32>,
}

impl Jumps {
    /// No jumps yet.
    pub(super) fn new(n_slots: usize) -> Self {
        Self { concerning: (0..n_slots).map(|_| AtomicU32::new(0)).collect() }
    }

    /// How many jumps concern `slot` since it was its turn last, whether it was then looked at or passed over.
    #[inline(always)]
    pub(super) fn of(&self, slot: usize) -> u32 {
        self.concerning[slot].load(Ordering::Relaxed)
    }

    /// It was the turn of `slot`.
    pub(super) fn forget(&mut self, slot: usize) {
        *self.concerning[slot].get_mut() = 0;
    }

    /// Tells all whom `jumpers` concern, which moved `from` their places `to` others: whoever may lie within `reach` of either.
    /// Where nothing `is_ahead` a slot is looked at in any case and need not know.
    pub(super) fn tell<const D: usize, P: Pieces<D>>(
        &self,
        (pieces, graph): (&P, &Graph),
        jumpers: &[u32],
        (from, to): (&Places<D>, &Places<D>),
        reach: f32,
        is_ahead: impl Fn(usize) -> bool + Sync,
    ) {
        let slots_per_record = pieces.slots_per_record();
        let concerns = |slot: usize, x: &[f32; D]| {
            let near = |piece| distance2(&pieces.piece(slot, piece).project(x), x) < reach * reach;
            (0..P::PER_SLOT).any(near)
        };
        jumpers.par_chunks(CHUNK).for_each(|jumpers| {
            for &slot in jumpers {
                let (from, to) = (from.of(slot as usize), to.of(slot as usize));
                let (ends, class) = graph.of(slot as usize);
                for (&end, &class) in ends.iter().zip(class) {
                    let last = end as usize + usize::from(either(class, slots_per_record));
                    let ends = end as usize..=last;
                    if !ends.clone().any(&is_ahead) {
                        continue;
                    }
                    // Both slots of a record lie on one piece.
                    if concerns(end as usize, &from) || concerns(end as usize, &to) {
                        for end in ends {
                            self.concerning[end].fetch_add(1, Ordering::Relaxed);
                        }
                    }
                }
            }
        });
    }
}

/// Slots whose jumps one thread tells at a time: enough that sharing them out costs nothing.
const CHUNK: usize = 64;
