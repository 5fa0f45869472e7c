//! Every pair of descriptors, block by block: memory grows with rows, never with pairs.

use std::sync::Mutex;

use rayon::prelude::*;

use super::best::Best;
use crate::Error;
use crate::simd::BLOCK;

/// Rows of which all pairs are compared at most: minutes on two cores.
pub const MOST_ROWS: usize = 1 << 17;

/// Rows that are compared in blocks of [`BLOCK`]; the score of a pair does not depend on its order.
pub trait Blocks: Sync {
    /// Whether scores are integers: then their sums are exact in any order, and are kept.
    const EXACT: bool;

    /// Number of rows.
    fn len(&self) -> usize;

    /// Scores of all rows of block `a` with all of block `b`, `(BLOCK, BLOCK)`; what stands for rows
    /// beyond the last has no meaning.
    fn scores(&self, a: usize, b: usize, scores: &mut [f32]);
}

/// What a row found.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The best rows of other records, best first; equal scores in row order.
    pub best: Vec<(f32, u32)>,
    /// Mean of the scores with all rows of other records; 0 unless scores are exact.
    pub mean: f64,
    /// Their standard deviation; 0 unless scores are exact.
    pub deviation: f64,
}

/// Whether all pairs of `n` rows are few enough to be compared.
///
/// # Errors
/// When `n` exceeds [`MOST_ROWS`].
pub fn check(n: usize) -> Result<(), Error> {
    if n <= MOST_ROWS {
        return Ok(());
    }
    let expected = format!("at most {MOST_ROWS}, as all pairs are compared");
    Err(Error::new("hidden points", expected, n.to_string()))
}

/// Compares all rows; each keeps its `most` best partners of other records. `record_of` tells the
/// record of a row.
///
/// Cost: quadratic in rows. The same bytes for any number of threads: what a row keeps depends on
/// the set of its scores alone.
pub fn compare<B: Blocks>(blocks: &B, record_of: &[u32], most: usize) -> Vec<Found> {
    let n = blocks.len();
    let n_blocks = n.div_ceil(BLOCK);
    let rows: Vec<Mutex<Vec<Row>>> = (0..n_blocks)
        .map(|block| {
            let rows = BLOCK.min(n - block * BLOCK);
            Mutex::new((0..rows).map(|_| Row::new(most)).collect())
        })
        .collect();
    // Diagonals of the triangle: neighbors in this order touch different rows.
    let mut pairs: Vec<(usize, usize)> = Vec::with_capacity(n_blocks * (n_blocks + 1) / 2);
    for gap in 0..n_blocks {
        pairs.extend((0..n_blocks - gap).map(|a| (a, a + gap)));
    }
    let scratch = || (vec![0.0f32; BLOCK * BLOCK], vec![0.0f32; BLOCK * BLOCK]);
    pairs.par_iter().with_max_len(8).for_each_init(scratch, |(scores, turned), &(a, b)| {
        blocks.scores(a, b, scores);
        take::<B>(&mut lock(&rows[a]), scores, a, b, n, record_of);
        if a != b {
            for i in 0..BLOCK {
                for j in 0..BLOCK {
                    turned[j * BLOCK + i] = scores[i * BLOCK + j];
                }
            }
            take::<B>(&mut lock(&rows[b]), turned, b, a, n, record_of);
        }
    });
    let rows = rows.into_iter().flat_map(|rows| match rows.into_inner() {
        Ok(rows) => rows,
        Err(poisoned) => poisoned.into_inner(),
    });
    rows.map(Row::found).collect()
}

/// A panic in another thread is passed on by rayon: the data behind a poisoned lock is not used.
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

    fn found(self) -> Found {
        let n = self.n.max(1) as f64;
        let mean = self.sum / n;
        let deviation = (self.squares / n - mean * mean).max(0.0).sqrt();
        Found { best: self.best.into_sorted(), mean, deviation }
    }
}

fn take<B: Blocks>(
    rows: &mut [Row],
    scores: &[f32],
    a: usize,
    b: usize,
    n: usize,
    record_of: &[u32],
) {
    let first = b * BLOCK;
    let columns = BLOCK.min(n - first);
    for (i, row) in rows.iter_mut().enumerate() {
        let scores = &scores[i * BLOCK..i * BLOCK + columns];
        let own = record_of[a * BLOCK + i];
        if B::EXACT {
            let (mut count, mut sum, mut squares) = (0u64, 0.0f64, 0.0f64);
            for (&score, &record) in scores.iter().zip(&record_of[first..]) {
                // Whole numbers far below 2^53 in total: exact.
                let score = if record == own { 0.0 } else { f64::from(score) };
                count += u64::from(record != own);
                sum += score;
                squares += score * score;
            }
            row.n += count;
            row.sum += sum;
            row.squares += squares;
        }
        for (j, &score) in scores.iter().enumerate() {
            if score >= row.best.floor() && record_of[first + j] != own {
                row.best.push(score, (first + j) as u32);
            }
        }
    }
}
