//! Neighborhoods from any descriptors: near points look alike more often than far ones.

use rayon::prelude::*;

use super::Neighborhoods;
use super::all_pairs::{self, Blocks};
use super::rows::Rows;
use crate::descriptors::Values;
use crate::released::Released;
use crate::simd::{self, BLOCK, Kernel};
use crate::{Descriptors, Error};

/// The `k` records with the most similar descriptors. Scores: cosine similarity; of a record with two
/// descriptors the larger.
///
/// Exact, and therefore quadratic in slots.
///
/// # Errors
/// When the map has no descriptors, fewer than `k` other records, or too many slots to compare all
/// pairs.
pub fn similarity<const D: usize>(
    released: &Released<D>,
    k: usize,
) -> Result<Neighborhoods, Error> {
    let rows = Rows::new(released, k)?;
    all_pairs::check(rows.len())?;
    let units = Units::new(rows.descriptors, &rows.slots);
    let found = all_pairs::compare(&units, &rows.records, rows.enough_for(k));
    let ranked: Vec<_> = found.into_iter().map(|found| found.best).collect();
    rows.lists(&ranked, k)
}

/// Descriptors of unit length, in blocks of rows and, transposed, of columns.
struct Units {
    dim: usize,
    n: usize,
    blocks: Vec<(Vec<f32>, Vec<f32>)>,
}

impl Units {
    fn new(descriptors: &Descriptors, order: &[u32]) -> Self {
        let dim = descriptors.dim();
        let block = |slots: &[u32]| {
            let (mut rows, mut columns) = (vec![0.0; BLOCK * dim], vec![0.0; BLOCK * dim]);
            for (at, &slot) in slots.iter().enumerate() {
                let range = slot as usize * dim..(slot as usize + 1) * dim;
                let row: Vec<f64> = match descriptors.values() {
                    Values::U8(v) => v[range].iter().map(|&x| f64::from(x)).collect(),
                    Values::F32(v) => v[range].iter().map(|&x| f64::from(x)).collect(),
                };
                // A blank descriptor is like none other: its similarities are 0.
                let norm = row.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
                for (c, x) in row.iter().enumerate() {
                    let value = (x / norm) as f32;
                    rows[at * dim + c] = value;
                    columns[c * BLOCK + at] = value;
                }
            }
            (rows, columns)
        };
        Self { dim, n: order.len(), blocks: order.par_chunks(BLOCK).map(block).collect() }
    }
}

impl Blocks for Units {
    const EXACT: bool = false;

    fn len(&self) -> usize {
        self.n
    }

    fn scores(&self, a: usize, b: usize, scores: &mut [f32]) {
        let (rows, columns) = (&self.blocks[a].0, &self.blocks[b].1);
        simd::dispatch(Product { rows, columns, dim: self.dim, products: scores });
    }
}

/// Rows times columns. Each product is summed in the order of its values, so that it is the same
/// whichever of its two rows comes first.
struct Product<'a> {
    rows: &'a [f32],
    columns: &'a [f32],
    dim: usize,
    products: &'a mut [f32],
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        // Sums of 4 rows by 16 columns stay in registers.
        const ROWS: usize = 4;
        const COLUMNS: usize = 16;
        let dim = self.dim;
        for i in (0..BLOCK).step_by(ROWS) {
            let rows: [&[f32]; ROWS] =
                std::array::from_fn(|r| &self.rows[(i + r) * dim..(i + r + 1) * dim]);
            for j in (0..BLOCK).step_by(COLUMNS) {
                let mut sums = [[0.0f32; COLUMNS]; ROWS];
                for (c, line) in self.columns.chunks_exact(BLOCK).enumerate() {
                    let column = &line[j..j + COLUMNS];
                    for (sums, row) in sums.iter_mut().zip(&rows) {
                        let value = row[c];
                        for (sum, &x) in sums.iter_mut().zip(column) {
                            *sum += value * x;
                        }
                    }
                }
                for (r, sums) in sums.iter().enumerate() {
                    let at = (i + r) * BLOCK + j;
                    self.products[at..at + COLUMNS].copy_from_slice(sums);
                }
            }
        }
    }
}
