//! The source `overlap`: the patches of near SIFT keypoints overlap. It needs no training.
//!
//! Two patches are compared on the cells that they share under the best hypothesis, a turn and a shift. A short walk reaches others.

use super::Neighborhoods;
use super::compare::{KeptPairs, Likeness, note};
use super::rows::Rows;
use super::sources::{Needs, Source};
use super::walk::{Walk, ranked_by};
use crate::descriptors::Values;
use crate::released::Released;
use crate::simd::{BLOCK, QUAD, packed};
use crate::{Descriptors, Error, ErrorKind, simd};

/// Number of classes of shifts: 0 cells, 1 cell, more.
pub const REACHES: usize = 3;

/// The walk over matches: patches of near points need not overlap, so neighbors are several steps apart.
pub const WALK: Walk = Walk { steps: 5, decay: 0.7 };

/// Lists the records whose patches overlap each slot's patch most, or that a short walk over such records reaches. The score is
/// the logarithm of the discounted probability to be reached.
///
/// The search is exact up to 131,072 slots (`MOST_ROWS`). In a larger map, similar blocks of descriptors are compared.
#[derive(Clone, Copy, Debug)]
pub struct Overlap;

impl<const D: usize> Source<D> for Overlap {
    fn name(&self) -> &str {
        "overlap"
    }

    fn needs(&self) -> Needs {
        Needs::DescriptorsAlone
    }

    fn k(&self, _: &Released<D>) -> usize {
        // An image has fewer keypoints, so that only the first of a ranking are near.
        if D == 2 { 10 } else { 35 }
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
        let rows = Rows::new(released, k)?;
        let hypotheses = Hypotheses::of(&rows.descriptors)?;
        ranked_by(&hypotheses, rows, Some(WALK), (released, k), kept)
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        check(descriptors)
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        note("overlap", n_slots)
    }
}

/// Length of a version as a vector of bytes. With rounding, a product of two is at most 133 x 133.
const LENGTH: f32 = 127.0;

/// Least norm of shared cells. With a smaller one, blank parts (at the border of an image) would match each other.
const NORM_FLOOR: f32 = 0.05;

/// Each version of [`BLOCK`] patches, about 10 KB per patch. Rows beyond the last patch are zero.
pub struct Block {
    turned: Vec<Vec<u8>>,
    still: Vec<Vec<i8>>,
}

/// Rejects descriptors that are not SIFT: 128 columns of bytes or of floats that are not negative, with any norm.
pub fn check(descriptors: &Descriptors) -> Result<(), Error> {
    let wrong = |found: String| {
        let expected = "SIFT descriptors (128 values each, none negative)";
        Err(Error::new("descriptors for overlap", expected, found).of_kind(ErrorKind::Descriptors))
    };
    if descriptors.dim() != DIM {
        return wrong(format!("{} values each", descriptors.dim()));
    }
    if let Values::F32(values) = descriptors.values()
        && let Some(value) = values.iter().find(|&&x| x < 0.0)
    {
        return wrong(format!("values like {value}"));
    }
    Ok(())
}

impl Likeness for Hypotheses {
    const NAME: &'static str = "overlap";
    /// Scores are integers.
    const STEP: f32 = 1.0;
    type Block = Block;

    fn block(&self, descriptors: &Descriptors, slots: &[u32]) -> Block {
        let length = |version: &Version| BLOCK * version.depth();
        let mut turned: Vec<_> = self.turned.iter().map(|of| vec![0; length(of)]).collect();
        let mut still: Vec<_> = self.still.iter().map(|of| vec![0; length(of)]).collect();
        let mut mixed = vec![Mixed::default(); self.cells.len()];
        for (row, &slot) in slots.iter().enumerate() {
            let squares = squares(descriptors, slot as usize);
            for (mixed, cell) in mixed.iter_mut().zip(&self.cells) {
                *mixed = Mixed::new(&squares, cell);
            }
            for (version, turned) in self.turned.iter().zip(&mut turned) {
                let cells = turned[row * version.depth()..][..version.depth()].as_chunks_mut().0;
                cells.iter_mut().zip(quantized(&mixed, version)).for_each(|(to, cell)| *to = cell);
            }
            for (version, still) in self.still.iter().zip(&mut still) {
                for (at, cell) in quantized(&mixed, version).enumerate() {
                    for (half, four) in cell.as_chunks::<QUAD>().0.iter().enumerate() {
                        let first = packed(row, at * BINS + half * QUAD, version.depth());
                        still[first..first + QUAD].copy_from_slice(&four.map(|byte| byte as i8));
                    }
                }
            }
        }
        Block { turned, still }
    }

    /// Computes the best cosine of shared cells over all hypotheses, as a product of bytes.
    fn scores(&self, a: &Block, b: &Block, scores: &mut [f32]) {
        self.best(a, b, |_| true, scores);
    }
}

impl Hypotheses {
    /// Creates the hypotheses for patches of `descriptors`, which must be SIFT: 8 turns by 21 shifts.
    pub fn of(descriptors: &Descriptors) -> Result<Self, Error> {
        check(descriptors)?;
        let mut all =
            Self { cells: Vec::new(), turned: Vec::new(), still: Vec::new(), pairs: Vec::new() };
        for dy in -LONGEST..=LONGEST {
            for dx in -LONGEST..=LONGEST {
                if dx.abs() + dy.abs() < FARTHEST {
                    all.add_shift([dx, dy], &[0, 2, 4, 6], false);
                    // Turns by 5 and 7 are the inverses of those by 3 and 1.
                    all.add_shift([dx, dy], &[1, 3], true);
                }
            }
        }
        Ok(all)
    }

    /// Computes the best cosine over the hypotheses whose shift `counts`.
    pub fn best(&self, a: &Block, b: &Block, counts: impl Fn(usize) -> bool, scores: &mut [f32]) {
        let mut forth = vec![0i16; BLOCK * BLOCK];
        let mut back = forth.clone();
        for pair in self.pairs.iter().filter(|pair| counts(pair.shift)) {
            let depth = self.turned[pair.turned].depth();
            let product = |a: &Block, b: &Block, best: &mut [i16]| {
                simd::raise_to_products(&a.turned[pair.turned], &b.still[pair.still], depth, best);
            };
            product(a, b, &mut forth);
            if pair.both_ways {
                product(b, a, &mut back);
            }
        }
        // Squares that fit the cache, as `back` is read across its rows.
        const SIDE: usize = 16;
        for (i, j) in (0..BLOCK / SIDE).flat_map(|i| (0..BLOCK / SIDE).map(move |j| (i, j))) {
            for i in i * SIDE..(i + 1) * SIDE {
                for j in j * SIDE..(j + 1) * SIDE {
                    let best = forth[i * BLOCK + j].max(back[j * BLOCK + i]);
                    scores[i * BLOCK + j] = f32::from(best);
                }
            }
        }
    }
}

/// Returns the gradient histogram behind a RootSIFT descriptor: the squares of its values, with sum 1.
fn squares(descriptors: &Descriptors, slot: usize) -> [[f32; BINS]; CELLS] {
    let mut row = [0.0f32; DIM];
    descriptors.read_row(slot, &mut row);
    // Squares of floats may exceed their range.
    let unit = match descriptors.values() {
        Values::U8(_) => 1.0,
        Values::F32(_) => row.into_iter().fold(f32::MIN_POSITIVE, f32::max),
    };
    let squares = row.map(|x| (x / unit) * (x / unit));
    let sum: f32 = squares.iter().sum::<f32>().max(f32::MIN_POSITIVE);
    std::array::from_fn(|cell| std::array::from_fn(|bin| squares[cell * BINS + bin] / sum))
}

/// A cell after a turn: the sum of its histogram, and the square roots of its values.
#[derive(Clone, Copy, Default)]
struct Mixed {
    sum: f32,
    roots: [f32; BINS],
}

impl Mixed {
    /// Mixes histograms, before the square root.
    fn new(squares: &[[f32; BINS]; CELLS], cell: &Cell) -> Self {
        let mut values = [0.0f32; BINS];
        for (from, share) in cell.sources {
            for (value, square) in values.iter_mut().zip(&squares[usize::from(from)]) {
                *value += square * share;
            }
        }
        let sum = values.iter().sum();
        // Orientations of a descriptor turn in the opposite sense of the grid.
        values.rotate_left(cell.turn);
        values.iter_mut().for_each(|value| *value = value.sqrt());
        Self { sum, roots: values }
    }
}

/// Returns the cells of a version as bytes.
fn quantized(mixed: &[Mixed], version: &Version) -> impl Iterator<Item = [u8; BINS]> {
    let cells = || version.cells.iter().map(|&cell| &mixed[usize::from(cell)]);
    let norm = cells().map(|cell| cell.sum).sum::<f32>().sqrt().max(NORM_FLOOR);
    let scale = LENGTH * version.root_weight / norm;
    // Adding 2^23 rounds to the nearest integer, in the low bits.
    cells().map(move |cell| cell.roots.map(|root| (root * scale + 8_388_608.0).to_bits() as u8))
}

// Hypotheses about how two patches overlap: a turn by a multiple of 45 degrees, then a shift by cells.

/// Cells along one side of a SIFT patch.
pub const SIDE: usize = 4;
pub const CELLS: usize = SIDE * SIDE;
/// Orientation bins of a cell, 45 degrees each.
pub const BINS: usize = 8;
/// Number of values of a SIFT descriptor: cells in row order, the bins of a cell side by side.
pub const DIM: usize = CELLS * BINS;

/// Shifts with `|dx| + |dy|` below 4 that keep at least six cells: 21 of them.
const FARTHEST: i32 = 4;
const LONGEST: i32 = 2;

/// Content of a cell after a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Up to four cells of the patch, with weights.
    pub sources: [(u8, f32); 4],
    pub turn: usize,
}

/// A version of a patch: its cells after a turn and a shift, in the order of comparison.
#[derive(Clone, Debug)]
pub struct Version {
    pub cells: Vec<u8>,
    /// Square root of the weight of hypotheses with this many cells; both versions carry it.
    pub root_weight: f32,
}

impl Version {
    pub fn depth(&self) -> usize {
        self.cells.len() * BINS
    }
}

/// Two versions that are compared, one of each patch, with equally many cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    pub turned: usize,
    pub still: usize,
    /// Length of the shift in cells, `|dx| + |dy|`.
    pub shift: usize,
    /// Whether exchanging the patches gives other hypotheses: odd turns resample the cells, even ones come with their inverse.
    pub both_ways: bool,
}

/// All hypotheses. Patches are compared by their best one.
pub struct Hypotheses {
    pub cells: Vec<Cell>,
    /// Versions of the patch that is turned and shifted.
    pub turned: Vec<Version>,
    /// Versions of the other patch: its cells that the turned one covers.
    pub still: Vec<Version>,
    pub pairs: Vec<Pair>,
}

impl Hypotheses {
    fn add_shift(&mut self, shift: [i32; 2], turns: &[usize], both_ways: bool) {
        let still = self.still.len();
        for (at, &turn) in turns.iter().enumerate() {
            let mut version = Version { cells: Vec::new(), root_weight: 0.0 };
            let mut kept = version.clone();
            for cell in 0..CELLS {
                if let Some(sources) = sources(cell, turn, shift) {
                    version.cells.push(self.index(Cell { sources, turn }));
                    let sources = [(cell as u8, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)];
                    kept.cells.push(self.index(Cell { sources, turn: 0 }));
                }
            }
            // Few shared cells agree more easily by chance.
            let share = version.cells.len() as f64 / CELLS as f64;
            version.root_weight = libm::pow(share, 0.5 * WEIGHT_EXPONENT) as f32;
            kept.root_weight = version.root_weight;
            // Turns of the same parity cover the same cells, so they share one still version.
            if at == 0 {
                self.still.push(kept);
            }
            let shift = (shift[0].abs() + shift[1].abs()) as usize;
            self.pairs.push(Pair { turned: self.turned.len(), still, shift, both_ways });
            self.turned.push(version);
        }
    }

    /// Returns the index of a cell, which it adds if it is new.
    fn index(&mut self, cell: Cell) -> u8 {
        let known = self.cells.iter().position(|known| *known == cell);
        if known.is_none() {
            self.cells.push(cell);
        }
        u8::try_from(known.unwrap_or(self.cells.len() - 1)).expect("about a hundred cells")
    }
}

/// Exponent of the fraction of cells that are compared.
const WEIGHT_EXPONENT: f64 = 0.06;

/// Returns the content of `cell` after a turn by `turn` times 45 degrees about the middle and a shift; `None` outside the patch.
fn sources(cell: usize, turn: usize, shift: [i32; 2]) -> Option<[(u8, f32); 4]> {
    let middle = (SIDE - 1) as f64 / 2.0;
    let x = (cell % SIDE) as f64 - middle - f64::from(shift[0]);
    let y = (cell / SIDE) as f64 - middle - f64::from(shift[1]);
    // Exact for even turns; the same bits on every machine for odd ones.
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
    const COSINES: [f64; 8] = [1.0, HALF, 0.0, -HALF, -1.0, -HALF, 0.0, HALF];
    let (cos, sin) = (COSINES[turn % 8], COSINES[(turn + 6) % 8]);
    let from = [cos * x + sin * y + middle, cos * y - sin * x + middle];
    let last = (SIDE - 1) as f64;
    // Rounding may move a border cell slightly outside.
    if from.iter().any(|&c| c < -1e-9 || c > last + 1e-9) {
        return None;
    }
    let low = from.map(|c| c.clamp(0.0, last).floor().min(last - 1.0));
    let part = [from[0].clamp(0.0, last) - low[0], from[1].clamp(0.0, last) - low[1]];
    let share = |high: usize, part: f64| if high == 1 { part } else { 1.0 - part };
    Some([0, 1, 2, 3].map(|at| {
        let (right, down) = (at % 2, at / 2);
        let source = (low[1] as usize + down) * SIDE + low[0] as usize + right;
        (source as u8, (share(right, part[0]) * share(down, part[1])) as f32)
    }))
}
