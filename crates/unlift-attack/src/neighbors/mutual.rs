//! Mutual nearest neighbors between two sets of descriptors.

use rayon::prelude::*;

use super::compare::Likeness;
use super::similarity::{Cosine, Units};
use crate::Descriptors;
use crate::simd::{self, BLOCK, Kernel};

/// Columns that are compared at once.
const LANES: usize = 16;
/// Blocks of rows that one thread compares at once.
const ROW_BLOCKS: usize = 8;

/// The nearest descriptor and its cosine, and the cosine of the second nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nearest {
    pub at: u32,
    pub first: f32,
    pub second: f32,
}

impl Nearest {
    const NONE: Self = Self { at: u32::MAX, first: f32::NEG_INFINITY, second: f32::NEG_INFINITY };

    /// Returns the squared distance to the nearest descriptor as a share of that to the second nearest.
    pub fn ratio(&self) -> f32 {
        // The squared distance of unit vectors is 2 - 2 cos.
        let [first, second] = [self.first, self.second].map(|cos| 1.0 - cos.clamp(-1.0, 1.0));
        if second > 0.0 { first / second } else { 1.0 }
    }

    /// Adds the nearest among other descriptors; of equal ones, the first counts.
    fn merge(&mut self, other: &Self) {
        let is_nearer =
            other.first > self.first || (other.first == self.first && other.at < self.at);
        let (near, far) = if is_nearer { (other, &*self) } else { (&*self, other) };
        *self = Self { second: near.second.max(far.first), ..*near };
    }
}

/// Descriptors in blocks, ready to be compared.
pub(crate) struct Blocks {
    blocks: Vec<Units>,
    len: usize,
}

impl Blocks {
    pub fn new(descriptors: &Descriptors) -> Self {
        let slots: Vec<u32> = (0..descriptors.len() as u32).collect();
        let blocks = slots.chunks(BLOCK).map(|slots| Cosine.block(descriptors, slots));
        Self { blocks: blocks.collect(), len: descriptors.len() }
    }
}

/// Returns pairs (row of `a`, row of `b`) of mutual nearest neighbors with the ratio of each side's distances, sorted.
pub(crate) fn mutual(a: &Blocks, b: &Blocks) -> Vec<(u32, u32, f32)> {
    let parts = a.blocks.par_chunks(ROW_BLOCKS).enumerate();
    let found: Vec<_> = parts.map(|(at, part)| compare(a.len, at * ROW_BLOCKS, part, b)).collect();
    let mut columns = vec![Nearest::NONE; b.len];
    for (_, part) in &found {
        columns.iter_mut().zip(part).for_each(|(column, part)| column.merge(part));
    }
    let rows = found.iter().flat_map(|(rows, _)| rows);
    let pair = |(row, nearest): (usize, &Nearest)| {
        let column = columns.get(nearest.at as usize)?;
        let is_mutual = column.at as usize == row;
        is_mutual.then(|| (row as u32, nearest.at, nearest.ratio().max(column.ratio())))
    };
    rows.enumerate().filter_map(pair).collect()
}

/// Finds the nearest column of every row of a few blocks, and the nearest of these rows of every column.
fn compare(
    n_rows: usize,
    first: usize,
    part: &[Units],
    b: &Blocks,
) -> (Vec<Nearest>, Vec<Nearest>) {
    let mut scores = vec![0.0f32; BLOCK * BLOCK];
    let mut columns = Lanes::new(b.blocks.len() * BLOCK);
    let mut rows = Vec::with_capacity(part.len() * BLOCK);
    for (i, own) in part.iter().enumerate() {
        let at = (first + i) * BLOCK;
        let n_own = (n_rows - at).min(BLOCK);
        let mut lanes = Lanes::new(BLOCK * LANES);
        for (j, other) in b.blocks.iter().enumerate() {
            Cosine.scores(own, other, &mut scores);
            // The last block has places without descriptors.
            let n_other = (b.len - j * BLOCK).min(BLOCK);
            if n_other < BLOCK {
                let ends = scores.chunks_exact_mut(BLOCK);
                ends.for_each(|row| row[n_other..].fill(f32::NEG_INFINITY));
            }
            let (rows, columns) = (&mut lanes, &mut columns);
            simd::dispatch(Keep { scores: &scores, n_own, at, j, rows, columns });
        }
        rows.extend((0..n_own).map(|row| lanes.best_of(row * LANES..(row + 1) * LANES)));
    }
    let columns = (0..b.len).map(|column| columns.best_of(column..column + 1)).collect();
    (rows, columns)
}

/// The nearest of each lane, in columns.
struct Lanes {
    at: Vec<u32>,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Lanes {
    fn new(n: usize) -> Self {
        let least = || vec![f32::NEG_INFINITY; n];
        Self { at: vec![u32::MAX; n], first: least(), second: least() }
    }

    fn best_of(&self, lanes: std::ops::Range<usize>) -> Nearest {
        let mut best = Nearest::NONE;
        for lane in lanes {
            let [first, second] = [self.first[lane], self.second[lane]];
            best.merge(&Nearest { at: self.at[lane], first, second });
        }
        best
    }

    /// Adds a score to each of [`LANES`] lanes from `lane` on; `at` has their indices. Free of branches, so that it is vectorized.
    #[inline(always)]
    fn keep(&mut self, lane: usize, scores: &[f32], at: &[u32; LANES]) {
        let to = lane..lane + LANES;
        let (best, first) = (&mut self.at[to.clone()], &mut self.first[to.clone()]);
        let second = &mut self.second[to];
        for l in 0..LANES {
            let (score, old) = (scores[l], first[l]);
            let low = if score > old { old } else { score };
            best[l] = if score > old { at[l] } else { best[l] };
            first[l] = if score > old { score } else { old };
            second[l] = if low > second[l] { low } else { second[l] };
        }
    }
}

/// Adds the scores of a block to the lanes of its rows and columns.
struct Keep<'a> {
    scores: &'a [f32],
    n_own: usize,
    /// First row of the block.
    at: usize,
    /// Index of the block of columns.
    j: usize,
    rows: &'a mut Lanes,
    columns: &'a mut Lanes,
}

impl Kernel for Keep<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { scores, n_own, at, j, rows, columns } = self;
        for (r, scores) in scores.chunks_exact(BLOCK).take(n_own).enumerate() {
            let own = [(at + r) as u32; LANES];
            for (c, scores) in scores.chunks_exact(LANES).enumerate() {
                let column = j * BLOCK + c * LANES;
                let others = std::array::from_fn(|l| (column + l) as u32);
                rows.keep(r * LANES, scores, &others);
                columns.keep(column, scores, &own);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptors::Values;
    use crate::seed::{Draws, Stage};

    fn random(n: usize, seed: u64) -> Descriptors {
        let mut draws = Draws::new(seed, Stage::Synthetic, 0);
        // Few values, so that some descriptors are equal.
        let values = (0..n * 4).map(|_| draws.below(5) as u8).collect();
        Descriptors::try_new(Values::U8(values), 4).unwrap()
    }

    #[test]
    fn lanes_find_what_plain_comparison_finds() {
        let (a, b) = (random(1300, 1), random(301, 2));
        let (blocks_a, blocks_b) = (Blocks::new(&a), Blocks::new(&b));
        let mut scores =
            vec![vec![0.0; blocks_b.blocks.len() * BLOCK]; blocks_a.blocks.len() * BLOCK];
        let mut block = vec![0.0; BLOCK * BLOCK];
        for (i, own) in blocks_a.blocks.iter().enumerate() {
            for (j, other) in blocks_b.blocks.iter().enumerate() {
                Cosine.scores(own, other, &mut block);
                for (at, &score) in block.iter().enumerate() {
                    scores[i * BLOCK + at / BLOCK][j * BLOCK + at % BLOCK] = score;
                }
            }
        }
        let nearest = |of: &dyn Fn(usize) -> f32, n: usize| {
            let mut all: Vec<usize> = (0..n).collect();
            all.sort_by(|&a, &b| of(b).total_cmp(&of(a)).then(a.cmp(&b)));
            Nearest { at: all[0] as u32, first: of(all[0]), second: of(all[1]) }
        };
        let columns: Vec<Nearest> =
            (0..b.len()).map(|column| nearest(&|row| scores[row][column], a.len())).collect();
        let pair = |row: usize| {
            let own = nearest(&|column| scores[row][column], b.len());
            let other = &columns[own.at as usize];
            let ratio = own.ratio().max(other.ratio());
            (other.at as usize == row).then_some((row as u32, own.at, ratio))
        };
        let plain: Vec<(u32, u32, f32)> = (0..a.len()).filter_map(pair).collect();
        assert_eq!(mutual(&blocks_a, &blocks_b), plain);
        assert!(plain.len() > 20, "{}", plain.len());
    }
}
