//! Nearest neighbors of all points of one leaf together, because they share most of them.
//!
//! Let `c` be the middle of the leaf, `R` the distance from `c` within which K + 1 points lie, and `r` the distance of the leaf's
//! farthest point. By the triangle inequality, a point of the leaf has K others within `R + r`, so all its neighbors lie within
//! `R + 2 r` of `c`. These candidates are gathered once; then each query is a few passes over short columns.

use super::tree::{Knn, canonical};
use crate::geometry::vector::squared_distance;
use crate::simd::{Kernel, dispatch};

/// Factor for rounding of distances, with a wide margin. A larger bound costs time but stays exact.
const SLACK: f64 = 1.0 + 1e-9;
/// Largest width of a leaf, as a multiple of the neighborhood's.
const WIDEST: f64 = 1.5;
/// Largest number of points beyond those wanted that are sorted.
const MOST_SURPLUS: usize = 6;
/// Largest number of passes that narrow the bound.
const MOST_PASSES: usize = 12;

/// Buffers of one thread.
pub(super) struct Scratch<const D: usize> {
    columns: [Vec<f64>; D],
    rows: Vec<u32>,
    squared: Vec<f64>,
    keys: Vec<u64>,
    found: Vec<(f64, u32)>,
}

impl<const D: usize> Scratch<D> {
    pub(super) fn new() -> Self {
        Self {
            columns: std::array::from_fn(|_| Vec::new()),
            rows: Vec::new(),
            squared: Vec::new(),
            keys: Vec::new(),
            found: Vec::new(),
        }
    }
}

/// Calls `of(index within the leaf, row, its k nearest)` for every point of `leaf`.
pub(super) fn solve<const D: usize>(
    tree: &Knn<'_, D>,
    leaf: usize,
    k: usize,
    scratch: &mut Scratch<D>,
    mut of: impl FnMut(usize, usize, &[(f64, u32)]),
) {
    let places = tree.range((1 << tree.depth) + leaf);
    let bounds = &tree.boxes[(1 << tree.depth) + leaf];
    let middle: [f64; D] =
        std::array::from_fn(|c| bounds.low[c] + 0.5 * (bounds.high[c] - bounds.low[c]));
    let squared = |place: usize| squared_distance(&middle, &tree.points[tree.rows[place] as usize]);
    let width = places.clone().map(squared).fold(0.0, f64::max).sqrt();
    tree.nearest_to(middle, k + 1, &mut scratch.found);
    let reach = match scratch.found.last() {
        Some(last) if scratch.found.len() > k => last.0.sqrt(),
        _ => f64::INFINITY,
    };
    // The points of a leaf that is much wider than a neighborhood share few neighbors.
    if width > WIDEST * reach || reach == f64::INFINITY {
        for (at, place) in places.enumerate() {
            let row = tree.rows[place] as usize;
            tree.nearest(row, k, &mut scratch.found);
            of(at, row, &scratch.found);
        }
        return;
    }
    gather(tree, &middle, ((reach + 2.0 * width) * SLACK, k + 1), scratch);
    let bound = (reach + width) * SLACK;
    for (at, place) in places.enumerate() {
        let row = tree.rows[place];
        let query = tree.points[row as usize];
        let bound = bound * bound + f64::MIN_POSITIVE;
        dispatch(Query { query, row, k, bound, scratch: &mut *scratch });
        scratch.keys.sort_unstable();
        let low = low_bits(&scratch.rows);
        scratch.found.clear();
        scratch.found.extend(scratch.keys.iter().map(|key| {
            let at = (key & low) as usize;
            (scratch.squared[at], scratch.rows[at])
        }));
        if !scratch.found.is_sorted_by_key(canonical) {
            scratch.found.sort_unstable_by_key(canonical);
        }
        scratch.found.truncate(k);
        of(at, row as usize, &scratch.found);
    }
}

/// Copies every point within `radius` of `middle` to the columns of `scratch`; of coinciding points, at least the `most` with the
/// lowest rows.
fn gather<const D: usize>(
    tree: &Knn<'_, D>,
    middle: &[f64; D],
    (radius, most): (f64, usize),
    scratch: &mut Scratch<D>,
) {
    let bound = radius * radius + f64::MIN_POSITIVE;
    scratch.rows.clear();
    scratch.columns.iter_mut().for_each(Vec::clear);
    tree.within(middle, (bound, most), |row, point| {
        scratch.columns.iter_mut().zip(point).for_each(|(column, x)| column.push(x));
        scratch.rows.push(row);
    });
}

/// Returns the mask of the bits that number the candidates.
#[inline(always)]
fn low_bits(candidates: &[u32]) -> u64 {
    candidates.len().next_power_of_two() as u64 - 1
}

/// Leaves in `keys` the k nearest candidates and a few more, unordered. A key is the squared distance as an integer, with the
/// lowest bits replaced by the candidate's index. Integers sort twice as fast as pairs; where the remaining bits tie, the order
/// is repaired afterwards.
struct Query<'a, const D: usize> {
    query: [f64; D],
    row: u32,
    k: usize,
    /// A squared distance within which k others lie.
    bound: f64,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize> Kernel for Query<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Scratch { columns, rows, squared, keys, .. } = self.scratch;
        squared.clear();
        squared.resize(rows.len(), 0.0);
        // The order of operations equals that of `vector::squared_distance`, so the bits are equal.
        for (column, center) in columns.iter().zip(&self.query) {
            for (sum, x) in squared.iter_mut().zip(column) {
                let d = center - x;
                *sum += d * d;
            }
        }
        // The point itself is among the candidates.
        let bound = narrowed(squared, self.bound, self.k + 1);
        let low = low_bits(rows);
        keys.clear();
        for (at, (&squared, &row)) in squared.iter().zip(rows.iter()).enumerate() {
            if squared <= bound && row != self.row {
                keys.push((squared.to_bits() & !low) | at as u64);
            }
        }
    }
}

/// Returns a bound of at most `high` within which at least `wanted` of `squared` lie, and few more. On surfaces, the number of points is
/// nearly proportional to the squared distance, so guesses converge fast. Ties may prevent that, which only costs time.
#[inline(always)]
fn narrowed(squared: &[f64], mut high: f64, wanted: usize) -> f64 {
    let within = |bound: f64| squared.iter().map(|&s| u64::from(s <= bound)).sum::<u64>() as usize;
    let (mut low, mut below) = (0.0, 0);
    let mut above = within(high);
    for _ in 0..MOST_PASSES {
        if above <= wanted + MOST_SURPLUS {
            break;
        }
        // Aim for the middle of the allowed surplus.
        let share = (wanted + MOST_SURPLUS / 2 - below) as f64 / (above - below) as f64;
        let guess = low + (high - low) * share;
        let count = within(guess);
        if count >= wanted {
            (high, above) = (guess, count);
        } else {
            (low, below) = (guess, count);
        }
    }
    high
}
