//! Work in fixed chunks of slots: any number of threads, the same result.

use std::ops::Range;

use rayon::prelude::*;

use crate::recover::result::estimate::{Estimate, Status};

/// Slots per chunk. Records are released in random order, so the slots of a chunk have nothing to
/// do with each other.
pub(crate) const CHUNK: usize = 64;

/// The slots a run covers.
#[derive(Clone, Debug)]
pub(crate) enum Slots<'a> {
    /// One after the other.
    Range(Range<usize>),
    /// Some chunks of [`CHUNK`] slots, for choosing parameters.
    Chunks(&'a [usize]),
}

/// Calls `solve(scratch, first slot, estimates)` for every chunk; estimates come back in slot order
/// (for [`Slots::Chunks`], the slots of those chunks end to end).
pub(crate) fn solve_chunks<const D: usize, S: Send>(
    n_slots: usize,
    slots: Slots<'_>,
    scratch: impl Fn() -> S + Sync + Send,
    solve: impl Fn(&mut S, usize, &mut [Estimate<D>]) + Sync + Send,
) -> Vec<Estimate<D>> {
    let lost = Estimate::lost(Status::NoSupport);
    match slots {
        Slots::Range(slots) => {
            let mut estimates = vec![lost; slots.len()];
            estimates
                .par_chunks_mut(CHUNK)
                .enumerate()
                .for_each_init(scratch, |scratch, (chunk, out)| {
                    solve(scratch, slots.start + chunk * CHUNK, out)
                });
            estimates
        }
        Slots::Chunks(chosen) => {
            let rows: Vec<Vec<Estimate<D>>> = chosen
                .par_iter()
                .map_init(scratch, |scratch, &chunk| {
                    let first = chunk * CHUNK;
                    let mut out = vec![lost; CHUNK.min(n_slots - first)];
                    solve(scratch, first, &mut out);
                    out
                })
                .collect();
            rows.concat()
        }
    }
}
