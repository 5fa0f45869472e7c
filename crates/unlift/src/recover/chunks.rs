//! Work in fixed chunks of slots: any number of threads, the same result.

use rayon::prelude::*;

use super::{Estimate, Status};

/// Slots per chunk. Records are released in random order, so the slots of a chunk have nothing to
/// do with each other and can share a null sample.
pub(crate) const CHUNK: usize = 64;

/// The chunks a run covers.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Chunks<'a> {
    /// Every slot.
    All,
    /// Some chunks, for choosing parameters.
    Some(&'a [usize]),
}

/// Calls `solve(scratch, first slot, estimates)` for every chunk; estimates come back in slot order
/// (for [`Chunks::Some`], the slots of those chunks end to end).
pub(crate) fn solve_chunks<const D: usize, S: Send>(
    n_slots: usize,
    chunks: Chunks<'_>,
    scratch: impl Fn() -> S + Sync + Send,
    solve: impl Fn(&mut S, usize, &mut [Estimate<D>]) + Sync + Send,
) -> Vec<Estimate<D>> {
    let lost = Estimate::lost(Status::NoSupport);
    match chunks {
        Chunks::All => {
            let mut estimates = vec![lost; n_slots];
            estimates
                .par_chunks_mut(CHUNK)
                .enumerate()
                .for_each_init(scratch, |scratch, (chunk, out)| solve(scratch, chunk * CHUNK, out));
            estimates
        }
        Chunks::Some(chosen) => {
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
