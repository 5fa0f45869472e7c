//! Comparison of descriptors block by block: memory grows with the number of rows, not of pairs.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::kept::{Rankings, are_equal};
use super::rows::Rows;
use crate::descriptors::Values;
use crate::parallel::{self, lock};
use crate::simd::BLOCK;
use crate::{Descriptors, Error};

/// Largest number of rows of which all pairs are compared; this takes minutes on two cores. Of more rows, similar blocks are compared.
pub const MOST_ROWS: usize = 1 << 17;

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

const PARTNERS: usize = 64;

/// A similarity of two descriptors. The score of a pair does not depend on its order.
pub trait Likeness: Sync {
    /// Name by which pair scores are kept.
    const NAME: &'static str;
    /// Scores are rounded to multiples of this, so that their sums are exact in any order.
    const STEP: f32;
    type Block: Send + Sync;

    /// Prepares the rows of `slots`, at most [`BLOCK`].
    fn block(&self, descriptors: &Descriptors, slots: &[u32]) -> Self::Block;

    /// Computes the scores of all rows of `a` with all of `b`, `(BLOCK, BLOCK)`. Scores of rows beyond the last are undefined.
    fn scores(&self, a: &Self::Block, b: &Self::Block, scores: &mut [f32]);
}

/// Returns the `n_best` best partners of every row among the rows of other records. The search is exact up to `exact` rows, and reads the
/// scores that `kept` has. Of more rows, similar blocks are compared. Mean and deviation of scores are computed if `counts`.
///
/// # Errors
/// When there are more rows than `exact`, and the means of all blocks are equal.
pub fn search<L: Likeness>(
    likeness: &L,
    rows: &mut Rows<'_>,
    n_best: usize,
    counts: bool,
    exact: usize,
    kept: &mut KeptPairs,
) -> Result<Vec<Found>, Error> {
    if rows.len() <= exact {
        let is_like = |all: &Compared| (all.name, all.counts) == (L::NAME, counts);
        let known = kept.compared.iter().find(|all| is_like(all));
        let mut found = known.and_then(|all| all.found(likeness, rows, n_best));
        // Scores of a map that lacks many points do not replace those of the whole map, which further maps need.
        let is_of_whole = known.is_some_and(|all| all.slots.len() >= rows.slots.len());
        if found.is_none() && !is_of_whole {
            let all = Compared::new(likeness, rows, 2 * n_best + SPARE, counts);
            found = all.found(likeness, rows, n_best);
            kept.compared.retain(|all| !is_like(all));
            kept.compared.push(all);
        }
        let anew = || compare(likeness, rows, n_best, &all_pairs(rows.len()), counts.then_some(1));
        return Ok(found.unwrap_or_else(|| finished::<L>(anew())));
    }
    let mut slots = rows.slots.clone();
    halve(&rows.descriptors, &mut slots);
    rows.reorder(slots);
    let means = means(&rows.descriptors, &rows.slots)?;
    let of_blocks = Rows::of_all(&means);
    let alike = compare(likeness, &of_blocks, PARTNERS, &all_pairs(means.len()), None);
    let every = counts.then(|| rows.len().div_ceil(USUAL));
    let pairs = chosen(&finished::<L>(alike));
    Ok(finished::<L>(compare(likeness, rows, n_best, &pairs, every)))
}

fn finished<L: Likeness>(rows: Vec<Row>) -> Vec<Found> {
    rows.into_iter().map(|row| row.found(L::STEP)).collect()
}

/// Scores of all pairs of the descriptors of a map, for further maps that lack a few of them or put them into other records.
#[derive(Clone, Debug, Default)]
pub struct KeptPairs {
    pub(super) compared: Vec<Compared>,
    /// The partners by a network, for further maps with the same descriptors.
    pub(super) rankings: Vec<Rankings>,
}

/// Partners that are kept beyond those that the map needs, in place of those that another map lacks.
const SPARE: usize = 8;
/// Another map may lack at most one of so many rows.
const LACKING: usize = 16;

/// Rows, each compared with all others as if every row were a record.
#[derive(Clone, Debug)]
pub(super) struct Compared {
    name: &'static str,
    counts: bool,
    n_best: usize,
    descriptors: Descriptors,
    pub(super) slots: Vec<u32>,
    rows: Vec<Row>,
}

impl Compared {
    fn new<L: Likeness>(likeness: &L, rows: &Rows<'_>, n_best: usize, counts: bool) -> Self {
        let (all, every) = (all_pairs(rows.len()), counts.then_some(1));
        let mut compared = compare(likeness, &rows.apart(), n_best, &all, every);
        parallel::for_each_mut(&mut compared, || (), |(), _, row| row.best.sort());
        Self {
            name: L::NAME,
            counts,
            n_best,
            descriptors: rows.descriptors.clone().into_owned(),
            slots: rows.slots.clone(),
            rows: compared,
        }
    }

    /// Returns what [`search`] returns for `rows`; `None` if their scores do not follow from those of a few pairs.
    ///
    /// Sums of scores are exact in any order, so what rows must not count can be subtracted.
    fn found<L: Likeness>(
        &self,
        likeness: &L,
        rows: &Rows<'_>,
        n_best: usize,
    ) -> Option<Vec<Found>> {
        // Both are ordered by content; of equal rows it does not matter which one is absent.
        let (mut own, mut absent) = (Vec::with_capacity(rows.len()), Vec::new());
        let mut row_of = vec![None; self.slots.len()];
        for (at, &slot) in self.slots.iter().enumerate() {
            let next = rows.slots.get(own.len());
            let equals = |next| are_equal((&self.descriptors, slot), (&rows.descriptors, next));
            if next.is_some_and(|&next| equals(next)) {
                row_of[at] = Some(own.len() as u32);
                own.push(at as u32);
            } else {
                absent.push(at as u32);
            }
        }
        if own.len() < rows.len() || LACKING * absent.len() > self.slots.len() {
            return None;
        }
        let record = |row: u32| rows.records[row as usize];
        let mut by_record: Vec<u32> = (0..rows.len() as u32).collect();
        by_record.sort_by_key(|&row| record(row));
        let mut mates: Vec<Vec<u32>> = vec![Vec::new(); rows.len()];
        for rows in by_record.chunk_by(|&a, &b| record(a) == record(b)) {
            for &a in rows {
                let others = rows.iter().filter(|&&b| b != a);
                mates[a as usize] = others.map(|&b| own[b as usize]).collect();
            }
        }
        let mut found: Vec<Row> = own.iter().map(|&at| self.rows[at as usize].clone()).collect();
        if self.counts {
            self.uncount(likeness, &own, (&absent, &mates), &mut found);
        }
        let finish = |at: usize| {
            let mut row = found[at].clone();
            let is_full = row.best.entries.len() == self.n_best;
            let record = rows.records[at];
            let other = |(score, other): (f32, u32)| Some((score, row_of[other as usize]?));
            let others = row.best.entries.into_iter().filter_map(other);
            let others = others.filter(|&(_, other)| rows.records[other as usize] != record);
            row.best = Best { entries: others.take(n_best).collect(), ..Best::new(n_best) };
            (!is_full || row.best.entries.len() == n_best).then(|| row.found(L::STEP))
        };
        parallel::map(found.len(), finish).into_iter().collect()
    }

    fn block<L: Likeness>(&self, likeness: &L, at: impl Iterator<Item = u32>) -> L::Block {
        let slots: Vec<u32> = at.map(|at| self.slots[at as usize]).collect();
        likeness.block(&self.descriptors, &slots)
    }

    /// Takes back the scores of `rows`, whose places here are `own`, with those at `absent`, and those of each row with its `mates`.
    fn uncount<L: Likeness>(
        &self,
        likeness: &L,
        own: &[u32],
        (absent, mates): (&[u32], &[Vec<u32>]),
        rows: &mut [Row],
    ) {
        let blocks =
            absent.chunks(BLOCK).map(|at| (at.len(), self.block(likeness, at.iter().copied())));
        let blocks: Vec<(usize, L::Block)> = blocks.collect();
        let scratch = || vec![0.0f32; BLOCK * BLOCK];
        let of_block = |scores: &mut Vec<f32>, at: usize, rows: &mut &mut [Row]| {
            let all = at * BLOCK..at * BLOCK + rows.len();
            let a = self.block(likeness, own[all.clone()].iter().copied());
            for (n, absent) in &blocks {
                likeness.scores(&a, absent, scores);
                for (row, scores) in rows.iter_mut().zip(scores.chunks(BLOCK)) {
                    scores[..*n].iter().for_each(|&score| row.uncount(score, L::STEP));
                }
            }
            let pairs = mates[all]
                .iter()
                .zip(0..)
                .flat_map(|(mates, row)| mates.iter().map(move |&mate| (row, mate)));
            for pairs in pairs.collect::<Vec<(usize, u32)>>().chunks(BLOCK) {
                let b = self.block(likeness, pairs.iter().map(|&(_, mate)| mate));
                likeness.scores(&a, &b, scores);
                for (at, &(row, _)) in pairs.iter().enumerate() {
                    rows[row].uncount(scores[row * BLOCK + at], L::STEP);
                }
            }
        };
        let mut rows: Vec<&mut [Row]> = rows.chunks_mut(BLOCK).collect();
        parallel::for_each_mut(&mut rows, scratch, of_block);
    }
}

/// Compares rows according to `tiles`. Mean and deviation come from the pairs with every `every`-th row; for 1, from those of `tiles`.
///
/// What a row keeps depends on the set of its scores alone, so the result does not depend on the number of threads.
fn compare<L: Likeness>(
    likeness: &L,
    rows: &Rows<'_>,
    n_best: usize,
    tiles: &[Tile],
    every: Option<usize>,
) -> Vec<Row> {
    let kept: Vec<Mutex<Vec<Row>>> = rows
        .slots
        .chunks(BLOCK)
        .map(|slots| Mutex::new(slots.iter().map(|_| Row::new(n_best)).collect()))
        .collect();
    let range = |at: usize| at * BLOCK..rows.len().min((at + 1) * BLOCK);
    let block = |at: usize| likeness.block(&rows.descriptors, &rows.slots[range(at)]);
    let counts = every == Some(1);
    // Adds the rows of block `b` to those of block `a`, with these scores.
    let offer = |a: usize, b: usize, scores: &[f32]| {
        let records = &rows.records[range(b)];
        for (i, row) in lock(&kept[a]).iter_mut().enumerate() {
            let (scores, own) = (&scores[i * BLOCK..], rows.records[a * BLOCK + i]);
            if counts {
                row.count(scores, records, own, L::STEP);
            }
            for (j, (&score, &record)) in scores.iter().zip(records).enumerate() {
                if score >= row.best.floor && record != own {
                    row.best.push(score, (b * BLOCK + j) as u32);
                }
            }
        }
    };
    // Rows spread over the map, for mean and deviation.
    let every = every.filter(|&every| every > 1);
    let usual: Vec<(L::Block, Vec<u32>)> = every.map_or_else(Vec::new, |every| {
        let sample: Vec<usize> = (0..rows.len()).step_by(every).collect();
        let of_sample = |sample: &[usize]| {
            let slots: Vec<u32> = sample.iter().map(|&row| rows.slots[row]).collect();
            let records = sample.iter().map(|&row| rows.records[row]).collect();
            (likeness.block(&rows.descriptors, &slots), records)
        };
        sample.chunks(BLOCK).map(of_sample).collect()
    });
    let scratch = || (vec![0.0f32; BLOCK * BLOCK], vec![0.0f32; BLOCK * BLOCK]);
    for Tile { held, meetings } in tiles {
        let first = held.start;
        let held: Vec<L::Block> = parallel::map(held.len(), |at| block(first + at));
        if !usual.is_empty() {
            parallel::map_with(held.len(), scratch, |(scores, _), at| {
                let a = first + at;
                for (sample, records) in &usual {
                    likeness.scores(&held[at], sample, scores);
                    for (i, row) in lock(&kept[a]).iter_mut().enumerate() {
                        let own = rows.records[a * BLOCK + i];
                        row.count(&scores[i * BLOCK..], records, own, L::STEP);
                    }
                }
            });
        }
        parallel::map_with(meetings.len(), scratch, |(scores, turned), meeting| {
            let (b, with) = &meetings[meeting];
            let b = *b as usize;
            let made = (b < first || b - first >= held.len()).then(|| block(b));
            let own = made.as_ref().unwrap_or_else(|| &held[b - first]);
            for &a in with {
                let a = a as usize;
                likeness.scores(&held[a - first], own, scores);
                offer(a, b, scores);
                if a == b {
                    continue;
                }
                for i in 0..BLOCK {
                    for j in 0..BLOCK {
                        turned[j * BLOCK + i] = scores[i * BLOCK + j];
                    }
                }
                offer(b, a, turned);
            }
        });
    }
    let rows =
        kept.into_iter().map(|rows| rows.into_inner().unwrap_or_else(PoisonError::into_inner));
    rows.flatten().collect()
}

#[derive(Clone, Debug)]
struct Row {
    best: Best,
    n: u64,
    sum: f64,
    squares: f64,
}

impl Row {
    fn new(n_best: usize) -> Self {
        Self { best: Best::new(n_best), n: 0, sum: 0.0, squares: 0.0 }
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

    fn uncount(&mut self, score: f32, step: f32) {
        let mut one = Self::new(0);
        one.count(&[score], &[0], 1, step);
        self.n -= one.n;
        self.sum -= one.sum;
        self.squares -= one.squares;
    }

    fn found(self, step: f32) -> Found {
        let (n, step) = (self.n.max(1) as f64, f64::from(step));
        let mean = self.sum / n;
        let deviation = (self.squares / n - mean * mean).max(0.0).sqrt();
        let (mean, deviation) = (mean * step, deviation * step);
        Found { best: self.best.into_sorted(), mean, deviation }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The best rows of other records, best first; equal scores in row order.
    pub best: Vec<(f32, u32)>,
    /// Mean of the scores with rows of other records; 0 unless they were counted.
    pub mean: f64,
    /// Standard deviation of these scores; 0 unless they were counted.
    pub deviation: f64,
}

/// Keeps the entries with the highest scores, and among equal scores those with the lowest ids, in whatever order they come.
#[derive(Clone, Debug)]
pub struct Best {
    n_best: usize,
    /// Entries with a lower score can no longer be kept.
    floor: f32,
    entries: Vec<(f32, u32)>,
}

impl Best {
    pub fn new(n_best: usize) -> Self {
        Self { n_best, floor: f32::NEG_INFINITY, entries: Vec::new() }
    }

    /// Adds an entry; each id at most once.
    #[inline]
    pub fn push(&mut self, score: f32, id: u32) {
        self.entries.push((score, id));
        if self.entries.len() >= 2 * self.n_best.max(8) {
            self.shrink();
        }
    }

    fn shrink(&mut self) {
        if self.entries.len() > self.n_best {
            self.entries.select_nth_unstable_by(self.n_best - 1, higher_first);
            self.entries.truncate(self.n_best);
            self.floor = self.entries[self.n_best - 1].0;
        }
    }

    fn sort(&mut self) {
        self.shrink();
        self.entries.sort_unstable_by(higher_first);
    }

    /// Returns the kept entries, highest score first, equal scores by id.
    pub fn into_sorted(mut self) -> Vec<(f32, u32)> {
        self.sort();
        self.entries
    }
}

/// Order of results: by score, high to low, then by id.
pub fn higher_first<T: Ord>(a: &(f32, T), b: &(f32, T)) -> std::cmp::Ordering {
    b.0.total_cmp(&a.0).then(a.1.cmp(&b.1))
}

/// Blocks in memory at a time if only some pairs are compared.
const HELD: u32 = 256;

/// Pairs of blocks with a range of blocks, which stay in memory meanwhile.
struct Tile {
    held: Range<usize>,
    /// Each block that is compared with some of them, and these.
    meetings: Vec<(u32, Vec<u32>)>,
}

/// Returns all pairs of the blocks of `n_rows` rows.
fn all_pairs(n_rows: usize) -> Vec<Tile> {
    let n = n_rows.div_ceil(BLOCK);
    // Each list starts with the block itself and descends, so that parallel threads work on different blocks.
    let with = |block: u32| (block, (0..=block).rev().collect());
    vec![Tile { held: 0..n, meetings: (0..n as u32).rev().map(with).collect() }]
}

/// Returns the pairs of every block with itself and with the most similar blocks.
fn chosen(alike: &[Found]) -> Vec<Tile> {
    let n = alike.len() as u32;
    // Each pair has its lower index first.
    let mut pairs: BTreeSet<(u32, u32)> = (0..n).map(|block| (block, block)).collect();
    for (block, found) in (0..n).zip(alike) {
        pairs.extend(found.best.iter().map(|&(_, other)| (block.min(other), block.max(other))));
    }
    let tile = |first: u32| {
        let end = (first + HELD).min(n);
        let mut meetings: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for &(a, b) in pairs.range((first, 0)..(end, 0)) {
            meetings.entry(b).or_default().push(a);
        }
        Tile { held: first as usize..end as usize, meetings: meetings.into_iter().collect() }
    };
    (0..n).step_by(HELD as usize).map(tile).collect()
}

// Similar blocks of a large map.

const SAMPLE: usize = 256;
/// Number of power iterations. An approximate direction suffices.
const ITERATIONS: usize = 8;

/// Reorders `slots` so that similar descriptors are adjacent: splits at the median along the direction of largest variance, recursively.
fn halve(descriptors: &Descriptors, slots: &mut [u32]) {
    if slots.len() <= BLOCK {
        return;
    }
    let direction = widest(descriptors, slots);
    let scratch = || vec![0.0; descriptors.dim()];
    let product = |row: &mut Vec<f32>, at: usize| -> (f32, u32) {
        descriptors.read_row(slots[at] as usize, row);
        (row.iter().zip(&direction).map(|(x, d)| x * d).sum(), slots[at])
    };
    let mut along = parallel::map_with(slots.len(), scratch, product);
    // Whole blocks on the left. Equal rows stay in the order of slots.
    let left = (slots.len() / 2).next_multiple_of(BLOCK);
    let by_place = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    along.sort_unstable_by(by_place);
    slots.iter_mut().zip(&along).for_each(|(slot, &(_, moved))| *slot = moved);
    drop(along);
    let (low, high) = slots.split_at_mut(left);
    rayon::join(|| halve(descriptors, low), || halve(descriptors, high));
}

/// Returns the direction of largest variance of a sample of the rows.
fn widest(descriptors: &Descriptors, slots: &[u32]) -> Vec<f32> {
    let every = slots.len().div_ceil(SAMPLE).max(1);
    let mut rows: Vec<Vec<f32>> =
        slots.iter().step_by(every).map(|&slot| descriptors.row(slot as usize)).collect();
    let n = rows.len() as f32;
    let mean: Vec<f32> =
        (0..descriptors.dim()).map(|c| rows.iter().map(|row| row[c]).sum::<f32>() / n).collect();
    for row in &mut rows {
        row.iter_mut().zip(&mean).for_each(|(x, mean)| *x -= mean);
    }
    // Start with the row farthest from the mean.
    let length2 = |row: &Vec<f32>| row.iter().map(|x| x * x).sum::<f32>();
    let farthest = rows.iter().max_by(|a, b| length2(a).total_cmp(&length2(b)));
    let mut direction = farthest.cloned().unwrap_or_default();
    for _ in 0..ITERATIONS {
        let mut next = vec![0.0f32; direction.len()];
        for row in &rows {
            let along: f32 = row.iter().zip(&direction).map(|(x, d)| x * d).sum();
            next.iter_mut().zip(row).for_each(|(next, x)| *next += along * x);
        }
        let length = length2(&next).sqrt();
        if length == 0.0 {
            break;
        }
        direction = next.into_iter().map(|x| x / length).collect();
    }
    direction
}

/// Returns the mean row of each block of `slots`; fails if all of them are equal.
fn means(descriptors: &Descriptors, slots: &[u32]) -> Result<Descriptors, Error> {
    let mean = |slots: &[u32]| {
        let mut sum = vec![0.0f32; descriptors.dim()];
        for &slot in slots {
            sum.iter_mut().zip(descriptors.row(slot as usize)).for_each(|(sum, x)| *sum += x);
        }
        sum.into_iter().map(move |x| x / slots.len() as f32).collect::<Vec<f32>>()
    };
    let values: Vec<f32> = slots.chunks(BLOCK).flat_map(mean).collect();
    Descriptors::try_new(Values::F32(values), descriptors.dim())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbors::overlap::Hypotheses;
    use crate::neighbors::similarity::Cosine;
    use crate::seed::{Draws, Stage};

    /// `n` rows around random middles, about six to each.
    fn crowds(n: usize, dim: usize) -> Descriptors {
        let mut draws = Draws::new(4, Stage::Synthetic, 0);
        let mut middle = || (0..dim).map(|_| draws.between(20.0, 120.0)).collect::<Vec<f64>>();
        let middles: Vec<Vec<f64>> = (0..n.div_ceil(6)).map(|_| middle()).collect();
        let mut draws = Draws::new(5, Stage::Synthetic, 0);
        let rows = (0..n).flat_map(|row| &middles[row % middles.len()]);
        let values = rows.map(|x| (x + 6.0 * draws.normal()).clamp(0.0, 255.0) as u8).collect();
        Descriptors::try_new(Values::U8(values), dim).unwrap()
    }

    /// What every slot found: slots instead of rows.
    fn found<L: Likeness>(
        likeness: &L,
        descriptors: &Descriptors,
        n_best: usize,
        exact: usize,
    ) -> Vec<Vec<(f32, u32)>> {
        let mut rows = Rows::of_all(descriptors);
        let kept = &mut KeptPairs::default();
        let found = search(likeness, &mut rows, n_best, false, exact, kept).unwrap();
        let mut by_slot = vec![Vec::new(); rows.len()];
        for (found, &slot) in found.into_iter().zip(&rows.slots) {
            let best = found.best.into_iter();
            by_slot[slot as usize] =
                best.map(|(score, row)| (score, rows.slots[row as usize])).collect();
        }
        by_slot
    }

    #[test]
    fn few_blocks_all_meet() {
        let of = crowds(1_500, 128);
        const { assert!(1_500 < BLOCK * PARTNERS) };
        let scores = |found: Vec<Vec<(f32, u32)>>| -> Vec<f32> {
            found.concat().into_iter().map(|(score, _)| score).collect()
        };
        let hypotheses = Hypotheses::of(&of).unwrap();
        let [some, all] = [0, MOST_ROWS].map(|exact| found(&Cosine, &of, 10, exact));
        assert_eq!(scores(some), scores(all));
        let [some, all] = [0, MOST_ROWS].map(|exact| found(&hypotheses, &of, 10, exact));
        assert_eq!(scores(some), scores(all));
    }

    #[test]
    fn of_many_blocks_those_meet_that_look_alike() {
        let descriptors = crowds(30_000, 16);
        let n_blocks = 30_000usize.div_ceil(BLOCK);
        assert!(n_blocks > 3 * PARTNERS, "a third of the blocks");
        let right = found(&Cosine, &descriptors, 5, MOST_ROWS);
        let some = found(&Cosine, &descriptors, 5, 0);
        let is_found = |at: usize, slot: u32| some[at].iter().any(|found| found.1 == slot);
        let n_both = |at: usize| right[at].iter().filter(|right| is_found(at, right.1)).count();
        let n_all = right.concat().len();
        let recall = (0..right.len()).map(n_both).sum::<usize>() as f64 / n_all as f64;
        assert!(recall >= 0.9, "{recall}");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        assert_eq!(pool.install(|| found(&Cosine, &descriptors, 5, 0)), some);
    }

    #[test]
    fn usual_scores_are_those_of_all_rows() {
        let descriptors = crowds(6_000, 128);
        let hypotheses = Hypotheses::of(&descriptors).unwrap();
        let rows = Rows::of_all(&descriptors);
        let all = all_pairs(rows.len());
        let exact = compare(&hypotheses, &rows, 1, &all, Some(1));
        let sampled = compare(&hypotheses, &rows, 1, &all, Some(3));
        let [exact, sampled] = [exact, sampled].map(finished::<Hypotheses>);
        for (exact, sampled) in exact.iter().zip(&sampled) {
            let off = (exact.mean - sampled.mean).abs() / exact.deviation;
            assert!(off < 0.2, "{off}");
            let ratio = sampled.deviation / exact.deviation;
            assert!((0.9..1.1).contains(&ratio), "{ratio}");
        }
    }
}
