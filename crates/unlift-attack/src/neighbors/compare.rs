//! Comparison of descriptors block by block: memory grows with the number of rows, not of pairs.

use std::sync::Mutex;

use rayon::prelude::*;

use super::best::{Best, Found};
use super::rows::Rows;
use super::tiles::{Pairs, Tile};
use super::{alike, tiles};
use crate::simd::BLOCK;
use crate::{Descriptors, Error};

/// Largest number of rows of which all pairs are compared; this takes minutes on two cores. Of more rows, similar blocks are compared.
pub const MOST_ROWS: usize = 1 << 17;

/// Returns the note about inexact search for a source with this `name`, if there are too many slots.
pub fn note(name: &str, n_slots: usize) -> Option<String> {
    (n_slots > MOST_ROWS).then(|| {
        format!(
            "{name}: of more than {MOST_ROWS} points each is compared with those whose descriptors look alike on the \
             whole: some neighbors that all pairs would tell are missed"
        )
    })
}

/// Rows from which typical scores are computed, if not all pairs are compared.
const USUAL: usize = 16 * BLOCK;

/// Number of blocks that each block of a large map is compared with.
const PARTNERS: usize = 64;

/// A similarity of two descriptors. The score of a pair does not depend on its order.
pub trait Likeness: Sync {
    /// Scores are rounded to multiples of this, so that their sums are exact in any order.
    const STEP: f32;
    /// [`BLOCK`] rows, prepared for comparison.
    type Block: Send + Sync;

    /// Prepares the rows of `slots`, at most [`BLOCK`].
    fn block(&self, descriptors: &Descriptors, slots: &[u32]) -> Self::Block;

    /// Whether to compute mean and deviation of scores.
    fn counts(&self) -> bool {
        true
    }

    /// Computes the scores of all rows of `a` with all of `b`, `(BLOCK, BLOCK)`. Scores of rows beyond the last are undefined.
    fn scores(&self, a: &Self::Block, b: &Self::Block, scores: &mut [f32]);
}

/// Returns the `most` best partners of every row among the rows of other records. The search is exact up to `exact` rows. With more
/// rows, similar rows are first made adjacent, and each block is compared with the blocks that have the most similar means.
///
/// # Errors
/// When there are more rows than `exact`, and the means of all blocks are equal.
pub fn search<L: Likeness>(
    likeness: &L,
    rows: &mut Rows<'_>,
    most: usize,
    exact: usize,
) -> Result<Vec<Found>, Error> {
    let n_blocks = rows.len().div_ceil(BLOCK);
    if rows.len() <= exact {
        return Ok(compare(likeness, rows, most, (&Pairs::all(n_blocks), None)));
    }
    rows.reorder(alike::order(rows.descriptors, &rows.slots));
    let means = alike::means(rows.descriptors, &rows.slots)?;
    let of_blocks = Rows::of_all(&means);
    let all = Pairs::all(n_blocks.div_ceil(BLOCK));
    let alike = compare(likeness, &of_blocks, PARTNERS, (&all, None));
    let every = rows.len().div_ceil(USUAL);
    Ok(compare(likeness, rows, most, (&tiles::chosen(&alike), Some(every))))
}

/// Compares rows according to `pairs`; each row keeps its `most` best partners of other records. Mean and deviation come from all
/// pairs, or from those with every `every`-th row.
///
/// What a row keeps depends on the set of its scores alone, so the result does not depend on the number of threads.
fn compare<L: Likeness>(
    likeness: &L,
    rows: &Rows<'_>,
    most: usize,
    (pairs, every): (&Pairs, Option<usize>),
) -> Vec<Found> {
    let kept: Vec<Mutex<Vec<Row>>> = rows
        .slots
        .chunks(BLOCK)
        .map(|slots| Mutex::new(slots.iter().map(|_| Row::new(most)).collect()))
        .collect();
    let block = |at: usize| {
        let end = rows.len().min((at + 1) * BLOCK);
        likeness.block(rows.descriptors, &rows.slots[at * BLOCK..end])
    };
    let counts = likeness.counts() && every.is_none();
    let usual = every.filter(|_| likeness.counts()).map(|every| Usual::new(likeness, rows, every));
    let scratch = || (vec![0.0f32; BLOCK * BLOCK], vec![0.0f32; BLOCK * BLOCK]);
    for Tile { held, meetings } in pairs.tiles() {
        let first = held.start;
        let held: Vec<L::Block> = held.clone().into_par_iter().map(block).collect();
        if let Some(usual) = &usual {
            held.par_iter().enumerate().for_each_init(scratch, |(scores, _), (at, block)| {
                let a = first + at;
                usual.count(
                    likeness,
                    block,
                    scores,
                    &mut lock(&kept[a]),
                    &rows.records[a * BLOCK..],
                );
            });
        }
        meetings.par_iter().with_max_len(1).for_each_init(scratch, |(scores, turned), of_one| {
            let b = of_one.block as usize;
            let made = (b < first || b - first >= held.len()).then(|| block(b));
            let own = made.as_ref().unwrap_or_else(|| &held[b - first]);
            let of_b = Met::of(rows, b, counts, L::STEP);
            for &a in &of_one.with {
                let a = a as usize;
                likeness.scores(&held[a - first], own, scores);
                of_b.offer(&mut lock(&kept[a]), scores, &rows.records[a * BLOCK..]);
                if a == b {
                    continue;
                }
                for i in 0..BLOCK {
                    for j in 0..BLOCK {
                        turned[j * BLOCK + i] = scores[i * BLOCK + j];
                    }
                }
                let of_a = Met::of(rows, a, counts, L::STEP);
                of_a.offer(&mut lock(&kept[b]), turned, &rows.records[b * BLOCK..]);
            }
        });
    }
    let rows = kept.into_iter().flat_map(|rows| match rows.into_inner() {
        Ok(rows) => rows,
        Err(poisoned) => poisoned.into_inner(),
    });
    rows.map(|row| row.found(L::STEP)).collect()
}

/// Rows spread over the map, for mean and deviation of scores.
struct Usual<B> {
    blocks: Vec<(B, Vec<u32>)>,
}

impl<B> Usual<B> {
    /// Every `every`-th row.
    fn new<L: Likeness<Block = B>>(likeness: &L, rows: &Rows<'_>, every: usize) -> Self {
        let slots: Vec<u32> = rows.slots.iter().step_by(every).copied().collect();
        let records: Vec<u32> = rows.records.iter().step_by(every).copied().collect();
        let block = |(slots, records): (&[u32], &[u32])| {
            (likeness.block(rows.descriptors, slots), records.to_vec())
        };
        Self { blocks: slots.chunks(BLOCK).zip(records.chunks(BLOCK)).map(block).collect() }
    }

    /// Counts the scores of the rows of `block`.
    fn count<L: Likeness<Block = B>>(
        &self,
        likeness: &L,
        block: &B,
        scores: &mut [f32],
        rows: &mut [Row],
        record_of: &[u32],
    ) {
        for (usual, records) in &self.blocks {
            likeness.scores(block, usual, scores);
            for (i, row) in rows.iter_mut().enumerate() {
                row.count(&scores[i * BLOCK..], records, record_of[i], L::STEP);
            }
        }
    }
}

/// Locks a mutex. rayon propagates a panic of another thread, so data behind a poisoned lock is never used.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    match mutex.lock() {
        Ok(guard) => guard,
        Err(poisoned) => poisoned.into_inner(),
    }
}

struct Row {
    best: Best,
    n: u64,
    sum: f64,
    squares: f64,
}

impl Row {
    fn new(most: usize) -> Self {
        Self { best: Best::new(most), n: 0, sum: 0.0, squares: 0.0 }
    }

    /// Counts the scores with rows of other records than `own`, in steps.
    fn count(&mut self, scores: &[f32], records: &[u32], own: u32, step: f32) {
        // Rounds to an integer without a call: beyond 2^23 floats are integers.
        const WHOLE: f32 = 1.5 * 8_388_608.0;
        let per_step = 1.0 / step;
        let (mut n, mut sum, mut squares) = (0u64, 0.0f64, 0.0f64);
        for (&score, &record) in scores.iter().zip(records) {
            // Integers whose sum is far below 2^53, so sums are exact.
            let score = (score * per_step + WHOLE) - WHOLE;
            let score = if record == own { 0.0 } else { f64::from(score) };
            n += u64::from(record != own);
            sum += score;
            squares += score * score;
        }
        self.n += n;
        self.sum += sum;
        self.squares += squares;
    }

    fn found(self, step: f32) -> Found {
        let (n, step) = (self.n.max(1) as f64, f64::from(step));
        let mean = self.sum / n;
        let deviation = (self.squares / n - mean * mean).max(0.0).sqrt();
        let (mean, deviation) = (mean * step, deviation * step);
        Found { best: self.best.into_sorted(), mean, deviation }
    }
}

/// A block whose rows are candidates for other rows.
struct Met<'a> {
    first: usize,
    records: &'a [u32],
    counts: bool,
    step: f32,
}

impl<'a> Met<'a> {
    fn of(rows: &'a Rows<'_>, block: usize, counts: bool, step: f32) -> Self {
        let first = block * BLOCK;
        let records = &rows.records[first..rows.len().min(first + BLOCK)];
        Self { first, records, counts, step }
    }

    /// Adds its rows to `rows` with these scores; `record_of` has the record of each of `rows`.
    fn offer(&self, rows: &mut [Row], scores: &[f32], record_of: &[u32]) {
        for (i, row) in rows.iter_mut().enumerate() {
            let scores = &scores[i * BLOCK..];
            let own = record_of[i];
            if self.counts {
                row.count(scores, self.records, own, self.step);
            }
            for (j, (&score, &record)) in scores.iter().zip(self.records).enumerate() {
                if score >= row.best.floor() && record != own {
                    row.best.push(score, (self.first + j) as u32);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
