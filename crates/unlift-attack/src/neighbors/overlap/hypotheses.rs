//! Hypotheses about how two patches overlap: a turn by a multiple of 45 degrees, then a shift by cells.

/// Cells along one side of a SIFT patch.
pub const SIDE: usize = 4;
/// Cells of a patch.
pub const CELLS: usize = SIDE * SIDE;
/// Orientation bins of a cell, 45 degrees each.
pub const BINS: usize = 8;
/// Number of values of a SIFT descriptor: cells in row order, the bins of a cell side by side.
pub const DIM: usize = CELLS * BINS;

/// Shifts with `|dx| + |dy|` below 4 that keep at least six cells: 21 of them.
const FARTHEST: i32 = 4;
/// The longest shift along one axis.
const LONGEST: i32 = 2;

/// Content of a cell after a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Up to four cells of the patch, with weights.
    pub sources: [(u8, f32); 4],
    /// Number of bins by which orientations turn.
    pub turn: usize,
}

/// A version of a patch: its cells after a turn and a shift, in the order of comparison.
#[derive(Clone, Debug)]
pub struct Version {
    /// Indices into [`Hypotheses::cells`].
    pub cells: Vec<u8>,
    /// Square root of the weight of hypotheses with this many cells; both versions carry it.
    pub root_weight: f32,
}

impl Version {
    /// Number of values.
    pub fn depth(&self) -> usize {
        self.cells.len() * BINS
    }
}

/// Two versions that are compared, one of each patch, with equally many cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    /// Index into [`Hypotheses::turned`].
    pub turned: usize,
    /// Index into [`Hypotheses::still`].
    pub still: usize,
    /// Length of the shift in cells, `|dx| + |dy|`.
    pub shift: usize,
    /// Whether exchanging the patches gives other hypotheses: odd turns resample the cells, even ones come with their inverse.
    pub both_ways: bool,
}

/// All hypotheses. Patches are compared by their best one.
#[derive(Clone, Debug)]
pub struct Hypotheses {
    /// All different cells of versions.
    pub cells: Vec<Cell>,
    /// Versions of the patch that is turned and shifted.
    pub turned: Vec<Version>,
    /// Versions of the other patch: its cells that the turned one covers.
    pub still: Vec<Version>,
    /// Versions that are compared.
    pub pairs: Vec<Pair>,
}

impl Hypotheses {
    /// Creates the hypotheses: 8 turns by 21 shifts.
    pub fn new() -> Self {
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
        all
    }

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
        let at = known.unwrap_or_else(|| {
            self.cells.push(cell);
            self.cells.len() - 1
        });
        u8::try_from(at).expect("about a hundred cells")
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
