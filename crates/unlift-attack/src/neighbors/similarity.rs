//! The source `similarity`: near points have similar descriptors of any kind.

use super::Neighborhoods;
use super::compare::{KeptPairs, Likeness, note};
use super::protected::Shared;
use super::rows::Rows;
use super::sources::{Needs, Source};
use super::walk::{Walk, ranked_by};
use crate::descriptors::Values;
use crate::released::Released;
use crate::simd::{self, BLOCK, Kernel};
use crate::{Descriptors, Error};

/// Walk over learned descriptors. More steps find more of the 20 nearest, but fewer of the very nearest (docs/decisions/sources.md).
pub const WALK: Walk = Walk { steps: 2, decay: 0.2 };

/// Lists the records with the most similar descriptors. The score is the cosine similarity; of a record with two
/// descriptors, the larger one. SIFT without the root (L2 norm) is compared by its root, bit strings by their Hamming distance.
///
/// For learned descriptors, which see a large area around their point, it lists the records that a short walk over the most similar
/// ones reaches. The score is the logarithm of the discounted probability to be reached.
///
/// Subspaces are compared by the [guess](crate::ProtectedDescriptors::guess), sets of words by the likelihood that they contain one word.
///
/// The search is exact up to 131,072 slots (`MOST_ROWS`). In a larger map, similar blocks of descriptors are compared.
#[derive(Clone, Copy, Debug)]
pub struct Similarity;

/// Whether descriptors come from a network: floats that are no histograms of gradients.
fn are_learned(descriptors: &Descriptors) -> bool {
    matches!(descriptors.values(), Values::F32(_)) && super::overlap::check(descriptors).is_err()
}

impl<const D: usize> Source<D> for Similarity {
    fn name(&self) -> &str {
        "similarity"
    }

    fn needs(&self) -> Needs {
        Needs::DescriptorsAlone
    }

    fn k(&self, released: &Released<D>) -> usize {
        // Of an image's few keypoints or of learned descriptors, only the first of a ranking are near.
        match (D, released.descriptors().is_some_and(are_learned)) {
            (2, true) => 5,
            (2, false) => 10,
            (_, true) => 12,
            (_, false) => 30,
        }
    }

    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        self.lists_keeping(released, k, seed, &mut KeptPairs::default())
    }

    fn lists_keeping(
        &self,
        released: &Released<D>,
        k: usize,
        _: u64,
        kept: &mut KeptPairs,
    ) -> Result<Neighborhoods, Error> {
        let walk = released.descriptors().is_some_and(are_learned).then_some(WALK);
        let protected = released.protected();
        match protected.and_then(|protected| Some((protected, Shared::new(protected)?))) {
            Some((protected, shared)) => {
                // Protected descriptors differ between maps, and so does their likeness.
                let rows = Rows::of_map(protected.rows(), released, k)?;
                ranked_by(&shared, rows, walk, (released, k), &mut KeptPairs::default())
            }
            None => ranked_by(&Cosine, Rows::new(released, k)?, walk, (released, k), kept),
        }
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        note("similarity", n_slots)
    }
}

pub struct Cosine;

/// Adjacent columns, whose sums fit in registers.
const PANEL: usize = 16;

/// Descriptors of unit length, as rows and, transposed, as columns in panels of [`PANEL`]: a panel fits in the fastest cache.
pub struct Units {
    dim: usize,
    rows: Vec<f32>,
    columns: Vec<f32>,
}

impl Likeness for Cosine {
    const NAME: &'static str = "cosine";
    /// Finer than any relevant difference.
    const STEP: f32 = 1.0 / 32_768.0;
    type Block = Units;

    fn block(&self, descriptors: &Descriptors, slots: &[u32]) -> Units {
        let dim = descriptors.dim();
        let (mut rows, mut columns) = (vec![0.0; BLOCK * dim], vec![0.0; BLOCK * dim]);
        let mut row = vec![0.0; dim];
        for (at, &slot) in slots.iter().enumerate() {
            descriptors.read_row(slot as usize, &mut row);
            let square = |&x: &f32| f64::from(x) * f64::from(x);
            // A blank descriptor has similarity 0 to all others.
            let norm = row.iter().map(square).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            for (c, &x) in row.iter().enumerate() {
                let value = (f64::from(x) / norm) as f32;
                rows[at * dim + c] = value;
                columns[at / PANEL * PANEL * dim + c * PANEL + at % PANEL] = value;
            }
        }
        Units { dim, rows, columns }
    }

    fn scores(&self, a: &Units, b: &Units, scores: &mut [f32]) {
        let (rows, columns) = (&a.rows, &b.columns);
        simd::dispatch(Product { rows, columns, dim: a.dim, products: scores });
    }
}

/// Product of rows and columns, summed in a fixed order, so that it does not depend on which of two rows is first.
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
        const ROWS: usize = 4;
        let dim = self.dim;
        for (j, panel) in self.columns.chunks_exact(PANEL * dim).enumerate() {
            for i in (0..BLOCK).step_by(ROWS) {
                let [a, b, c, d]: [&[f32]; ROWS] =
                    std::array::from_fn(|r| &self.rows[(i + r) * dim..(i + r + 1) * dim]);
                // Written out without a check of bounds, else sums stay in memory and the loop is scalar.
                let mut sums = [[0.0f32; PANEL]; ROWS];
                let (columns, _) = panel.as_chunks::<PANEL>();
                for ((((column, &a), &b), &c), &d) in columns.iter().zip(a).zip(b).zip(c).zip(d) {
                    for l in 0..PANEL {
                        sums[0][l] += a * column[l];
                        sums[1][l] += b * column[l];
                        sums[2][l] += c * column[l];
                        sums[3][l] += d * column[l];
                    }
                }
                for (r, sums) in sums.iter().enumerate() {
                    let at = (i + r) * BLOCK + j * PANEL;
                    self.products[at..at + PANEL].copy_from_slice(sums);
                }
            }
        }
    }
}
