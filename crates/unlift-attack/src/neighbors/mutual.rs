//! Mutual nearest neighbors between two sets of descriptors.

use std::ops::Range;

use super::compare::Likeness;
use super::similarity::{Cosine, Units};
use crate::Descriptors;
use crate::parallel;
use crate::simd::{self, BLOCK, Kernel};

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
    let parts: Vec<_> = a.blocks.chunks(ROW_BLOCKS).collect();
    let compare = |at: usize| compare(a.len, at * ROW_BLOCKS, parts[at], b);
    let found = parallel::map(parts.len(), compare);
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
    let mut rows = vec![Nearest::NONE; (n_rows - first * BLOCK).min(part.len() * BLOCK)];
    let least = vec![f32::NEG_INFINITY; b.blocks.len() * BLOCK];
    let at = vec![u32::MAX; least.len()];
    let mut columns = Columns { at, first: least.clone(), second: least };
    for (i, (own, rows)) in part.iter().zip(rows.chunks_mut(BLOCK)).enumerate() {
        for (j, other) in b.blocks.iter().enumerate() {
            Cosine.scores(own, other, &mut scores);
            let (at, others) = ((first + i) * BLOCK, j * BLOCK..b.len.min((j + 1) * BLOCK));
            let (scores, rows, columns) = (&scores, &mut *rows, &mut columns);
            simd::dispatch(Keep { scores, at, others, rows, columns });
        }
    }
    let nearest = |column: usize| {
        let [first, second] = [columns.first[column], columns.second[column]];
        Nearest { at: columns.at[column], first, second }
    };
    (rows, (0..b.len).map(nearest).collect())
}

/// The nearest row of each column, in columns.
struct Columns {
    at: Vec<u32>,
    first: Vec<f32>,
    second: Vec<f32>,
}

/// Adds the scores of a block to its rows and columns.
struct Keep<'a> {
    scores: &'a [f32],
    at: usize,
    /// The columns of the block. The last block has places without descriptors.
    others: Range<usize>,
    rows: &'a mut [Nearest],
    columns: &'a mut Columns,
}

impl Kernel for Keep<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { scores, at, others, rows, columns } = self;
        for (r, (scores, best)) in scores.chunks_exact(BLOCK).zip(rows).enumerate() {
            let mut top = [f32::NEG_INFINITY; LANES];
            for (c, scores) in scores.as_chunks::<LANES>().0.iter().enumerate() {
                let to = others.start + c * LANES..others.start + (c + 1) * LANES;
                let (nearest, first) =
                    (&mut columns.at[to.clone()], &mut columns.first[to.clone()]);
                let second = &mut columns.second[to];
                // Free of branches, so that it is vectorized.
                for l in 0..LANES {
                    let (score, old) = (scores[l], first[l]);
                    let low = if score > old { old } else { score };
                    nearest[l] = if score > old { (at + r) as u32 } else { nearest[l] };
                    first[l] = if score > old { score } else { old };
                    second[l] = if low > second[l] { low } else { second[l] };
                    top[l] = if score > top[l] { score } else { top[l] };
                }
            }
            // Few blocks have one of the two nearest of a row.
            if top.iter().any(|&top| top > best.second) {
                for (other, &first) in others.clone().zip(scores) {
                    let second = f32::NEG_INFINITY;
                    best.merge(&Nearest { at: other as u32, first, second });
                }
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
