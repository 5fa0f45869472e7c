//! Exact K nearest neighbors. Ties are ordered by row.
//!
//! The search tree is a balanced k-d tree. Points are stored leaf by leaf, one column per coordinate, so that a leaf takes a few vector
//! instructions. The index of a node determines its place in the columns, so only boxes are stored.
//!
//! A query first takes an upper bound from a node around its point that holds enough others, then every point within that bound.

use std::ops::Range;

use crate::Error;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::squared_distance;
use crate::parallel;
use crate::simd::{Kernel, dispatch};

pub(crate) const LEAF: usize = 16;
/// Nodes with fewer points are split without parallelism.
const ALONE: usize = 1 << 14;

/// A search tree over points, which are identified by row.
pub struct Knn<'a, const D: usize> {
    points: &'a [[f64; D]],
    /// Number of levels below the root: there are `2^depth` leaves.
    depth: u32,
    /// Boxes of the nodes: the root is 1, the halves of node `i` are `2 i` and `2 i + 1`.
    boxes: Vec<Bounds<D>>,
    columns: [Vec<f64>; D],
    /// Row at each place of the leaf order.
    pub(crate) rows: Vec<u32>,
    /// Place of each row.
    places: Vec<u32>,
}

impl<const D: usize> Bounds<D> {
    const EMPTY: Self = Self { low: [f64::INFINITY; D], high: [f64::NEG_INFINITY; D] };

    fn and(mut self, other: &Self) -> Self {
        for c in 0..D {
            self.low[c] = self.low[c].min(other.low[c]);
            self.high[c] = self.high[c].max(other.high[c]);
        }
        self
    }

    fn of(points: impl Iterator<Item = [f64; D]>) -> Self {
        points.fold(Self::EMPTY, |all, p| all.and(&Self { low: p, high: p }))
    }

    /// Returns a lower bound, rounding included, of the squared distance from `query` to any point inside: each operation is monotonic.
    #[inline(always)]
    fn squared_distance(&self, query: &[f64; D]) -> f64 {
        let mut sum = 0.0;
        for (c, x) in query.iter().enumerate() {
            let gap = (self.low[c] - x).max(x - self.high[c]).max(0.0);
            sum += gap * gap;
        }
        sum
    }
}

impl<'a, const D: usize> Knn<'a, D> {
    /// Creates a tree over `points`.
    ///
    /// # Errors
    /// When there are no points, more than 2^32 of them, or one is not finite.
    pub fn new(points: &'a [[f64; D]]) -> Result<Self, Error> {
        let n = points.len();
        if n == 0 || u32::try_from(n).is_err() {
            return Err(Error::new("points", "1 to 4294967295 of them", n));
        }
        if let Some(at) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            let what = format!("point {at}");
            return Err(Error::new(what, "finite coordinates", format!("{:?}", points[at])));
        }
        let depth = n.div_ceil(LEAF).next_power_of_two().trailing_zeros();
        let mut items: Vec<([f64; D], u32)> = points.iter().copied().zip(0..).collect();
        split(&mut items, depth, &|leaf| (leaf * n) >> depth, 0);
        let columns = std::array::from_fn(|c| items.iter().map(|item| item.0[c]).collect());
        let rows: Vec<u32> = items.iter().map(|item| item.1).collect();
        let mut places = vec![0; n];
        for (place, &row) in rows.iter().enumerate() {
            places[row as usize] = place as u32;
        }
        let n_leaves = 1usize << depth;
        let mut boxes = vec![Bounds::EMPTY; 2 * n_leaves];
        for leaf in 0..n_leaves {
            let places = (leaf * n) >> depth..((leaf + 1) * n) >> depth;
            boxes[n_leaves + leaf] = Bounds::of(items[places].iter().map(|item| item.0));
        }
        for node in (1..n_leaves).rev() {
            boxes[node] = boxes[2 * node].and(&boxes[2 * node + 1]);
        }
        Ok(Self { points, depth, boxes, columns, rows, places })
    }

    /// Returns all rows in patches of near ones: the box is split along its longest side down to leaves or at most `most` rows.
    pub fn patches(&self, most: usize) -> Vec<&[u32]> {
        let n = self.rows.len();
        let fits = |level: &u32| n.div_ceil(1 << level) <= most.max(1);
        let level = (0..self.depth).find(fits).unwrap_or(self.depth);
        (1usize << level..2 << level).map(|node| &self.rows[self.range(node)]).collect()
    }

    /// Finds the `k` nearest other rows of `row` (or all, if there are fewer) as (squared distance, row), sorted, into `found`.
    pub fn nearest(&self, row: usize, k: usize, found: &mut Vec<(f64, u32)>) {
        let place = self.places[row] as usize;
        self.search(self.points[row], Some(place), (k, 0.0), found);
    }

    /// Finds the `k` nearest rows of any position, in the same form.
    pub fn nearest_to(&self, position: [f64; D], k: usize, found: &mut Vec<(f64, u32)>) {
        self.search(position, None, (k, 0.0), found);
    }

    /// Returns the row nearest to a position if it is within `radius`, the first of equal ones, and its squared distance.
    pub fn nearest_within(&self, position: [f64; D], radius: f64) -> Option<(f64, usize)> {
        let mut nearest = Vec::new();
        self.nearest_to(position, 1, &mut nearest);
        let &(distance2, row) = nearest.first()?;
        (distance2 <= radius * radius).then_some((distance2, row as usize))
    }

    /// Returns `of(row, its k(row) nearest other rows)` for every row. The nearest are (squared distance, row), nearest first.
    pub fn per_row<T: Send>(
        &self,
        k: impl Fn(usize) -> usize + Sync,
        of: impl Fn(usize, &[(f64, u32)]) -> T + Sync,
    ) -> Vec<T> {
        self.per_row_within(|row| (k(row), 0.0), of)
    }

    /// Returns what [`per_row`](Self::per_row) does. `within` returns k and the squared distance within which so many probably are,
    /// or 0: only the time depends on it.
    pub(crate) fn per_row_within<T: Send>(
        &self,
        within: impl Fn(usize) -> (usize, f64) + Sync,
        of: impl Fn(usize, &[(f64, u32)]) -> T + Sync,
    ) -> Vec<T> {
        let value = |found: &mut Vec<_>, place: usize| {
            let row = self.rows[place] as usize;
            self.search(self.points[row], Some(place), within(row), found);
            Some(of(row, found))
        };
        // In the order of leaves, what a query reads is cached since the one before.
        let mut at_place = parallel::map_with(self.rows.len(), Vec::new, value);
        let places = self.places.iter();
        places.map(|&place| at_place[place as usize].take().expect("one row per place")).collect()
    }

    /// Returns the distance of every row to its `k`-th nearest other row (to the last one in small sets).
    pub fn kth_distances(&self, k: usize) -> Vec<f64> {
        self.per_row(|_| k, |_, found| found.last().map_or(0.0, |last| last.0.sqrt()))
    }

    /// Calls `of(row)` for all points whose squared distance to a position is at most `bound`.
    #[inline(always)]
    pub fn within(&self, position: &[f64; D], bound: f64, mut of: impl FnMut(u32)) {
        self.leaves(position, bound, |places| {
            for place in places {
                let point = std::array::from_fn(|c| self.columns[c][place]);
                if squared_distance(position, &point) <= bound {
                    of(self.rows[place]);
                }
            }
        });
    }

    /// Calls `of` with ranges of the leaf order that contain every point whose squared distance to a position is at most `bound`.
    #[inline(always)]
    pub(crate) fn leaves(&self, position: &[f64; D], bound: f64, of: impl FnMut(Range<usize>)) {
        self.leaves_within(position, (bound, usize::MAX), usize::MAX, of);
    }

    fn search(
        &self,
        query: [f64; D],
        own: Option<usize>,
        (k, within): (usize, f64),
        found: &mut Vec<(f64, u32)>,
    ) {
        found.clear();
        if k == 0 {
            return;
        }
        // A row starts from its own leaf; another position walks down the tree.
        let leaf = match own {
            Some(place) => self.leaf_of(place),
            None => self.leaf_towards(&query),
        };
        let own = own.map_or(u32::MAX, |place| place as u32);
        dispatch(Search { tree: self, query, own, leaf, k, within, found: &mut *found });
        if found.len() > k {
            found.select_nth_unstable_by_key(k - 1, canonical);
            found.truncate(k);
        }
        found.sort_unstable_by_key(canonical);
    }

    fn leaf_towards(&self, query: &[f64; D]) -> usize {
        let mut node = 1;
        for _ in 0..self.depth {
            let [a, b] = [2 * node, 2 * node + 1].map(|n| self.boxes[n].squared_distance(query));
            node = 2 * node + usize::from(b < a);
        }
        node - (1 << self.depth)
    }

    /// Calls `take` with the places of every leaf within the squared distance `bound`, except below `but`, by [`lowest`](Self::lowest).
    #[inline(always)]
    fn leaves_within(
        &self,
        query: &[f64; D],
        (bound, most): (f64, usize),
        but: usize,
        mut take: impl FnMut(Range<usize>),
    ) {
        let mut stack = [0usize; usize::BITS as usize];
        let mut height = 1;
        stack[0] = 1;
        while height > 0 {
            height -= 1;
            let node = stack[height];
            if node == but {
                continue;
            }
            if node >> self.depth != 0 || self.is_pile(node) {
                take(self.lowest(node, most));
                continue;
            }
            for half in [2 * node, 2 * node + 1] {
                if self.boxes[half].squared_distance(query) <= bound {
                    stack[height] = half;
                    height += 1;
                }
            }
        }
    }

    #[inline(always)]
    fn is_pile(&self, node: usize) -> bool {
        self.boxes[node].low == self.boxes[node].high
    }

    /// Returns the places of a node; of coinciding points only leaves with the `most` lowest rows, as no others can be among the nearest.
    #[inline(always)]
    fn lowest(&self, node: usize, most: usize) -> Range<usize> {
        let all = self.range(node);
        if all.len() <= most || !self.is_pile(node) {
            return all;
        }
        // In such a node rows ascend from leaf to leaf.
        let last = self.leaf_of(all.start + most.max(1) - 1);
        all.start..self.range((1 << self.depth) + last).end
    }

    #[inline(always)]
    fn leaf_of(&self, place: usize) -> usize {
        (((place + 1) << self.depth) - 1) / self.rows.len()
    }

    #[inline(always)]
    fn range(&self, node: usize) -> Range<usize> {
        let level = usize::BITS - 1 - node.leading_zeros();
        let below = self.depth - level;
        let first = (node << below) - (1 << self.depth);
        let n = self.rows.len();
        (first * n) >> self.depth..((first + (1 << below)) * n) >> self.depth
    }
}

/// Packs distance and row into one integer. The bits of nonnegative numbers are ordered as the numbers are.
#[inline(always)]
fn canonical(&(squared, row): &(f64, u32)) -> u128 {
    (u128::from(squared.to_bits()) << 32) | u128::from(row)
}

/// Sorts `items`, the leaves from `first` on, into leaf order. `starts` returns the first place of a leaf.
fn split<const D: usize>(
    items: &mut [([f64; D], u32)],
    depth: u32,
    starts: &(impl Fn(usize) -> usize + Sync),
    first: usize,
) {
    if depth == 0 {
        return;
    }
    let bounds = Bounds::of(items.iter().map(|item| item.0));
    let side = |c: usize| bounds.high[c] - bounds.low[c];
    let longest = (1..D).fold(0, |best, c| if side(c) > side(best) { c } else { best });
    let middle = first + (1 << (depth - 1));
    let at = starts(middle) - starts(first);
    if at < items.len() && side(longest) == 0.0 {
        items.select_nth_unstable_by_key(at, |item| item.1);
    } else if at < items.len() {
        items.select_nth_unstable_by(at, |a, b| {
            a.0[longest].total_cmp(&b.0[longest]).then(a.1.cmp(&b.1))
        });
    }
    let is_small = items.len() < ALONE;
    let (left, right) = items.split_at_mut(at);
    let mut left = || split(left, depth - 1, starts, first);
    let mut right = || split(right, depth - 1, starts, middle);
    if is_small {
        left();
        right();
    } else {
        rayon::join(left, right);
    }
}

/// Finds all points within the K-th distance, and a few more, unordered.
struct Search<'a, 'b, const D: usize> {
    tree: &'a Knn<'b, D>,
    query: [f64; D],
    /// The query's own place, which is no neighbor.
    own: u32,
    leaf: usize,
    k: usize,
    /// A squared distance within which the K-th neighbor probably is, or 0.
    within: f64,
    found: &'a mut Vec<(f64, u32)>,
}

impl<const D: usize> Kernel for Search<'_, '_, D> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        let Self { tree, k, within, .. } = self;
        let (most, query) = (k + 1, self.query);
        if within > 0.0 {
            let all = usize::MAX;
            tree.leaves_within(&query, (within, most), all, |places| self.take(places, within));
            if self.found.len() >= k {
                return;
            }
            self.found.clear();
        }
        // The smallest node with so many others that their K-th distance is near the true one.
        let mut near = (1 << tree.depth) + self.leaf;
        while near > 1 && tree.range(near).len() < 2 * k + 1 {
            near /= 2;
        }
        // Extend to all points that coincide with these. The lowest rows suffice: one more than k, as the point itself may be one.
        while near > 1 && tree.is_pile(near / 2) {
            near /= 2;
        }
        self.take(tree.lowest(near, most), f64::INFINITY);
        if near == 1 {
            return;
        }
        let bound = self.found.select_nth_unstable_by_key(k - 1, canonical).1.0;
        self.found.retain(|item| item.0 <= bound);
        tree.leaves_within(&query, (bound, most), near, |places| self.take(places, bound));
    }
}

impl<const D: usize> Search<'_, '_, D> {
    #[inline(always)]
    fn take(&mut self, places: Range<usize>, bound: f64) {
        let mut at = places.start;
        while at < places.end {
            let end = places.end.min(at + LEAF);
            let mut squared = [0.0; LEAF];
            // The order of operations equals that of `vector::squared_distance`, so the bits are equal.
            for (column, center) in self.tree.columns.iter().zip(&self.query) {
                for (sum, x) in squared.iter_mut().zip(&column[at..end]) {
                    let d = center - x;
                    *sum += d * d;
                }
            }
            for (place, &distance) in (at..end).zip(&squared) {
                if distance <= bound && place as u32 != self.own {
                    self.found.push((distance, self.tree.rows[place]));
                }
            }
            at = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Knn, canonical};
    use crate::geometry::vector::squared_distance;
    use crate::seed::{Draws, Stage};

    /// Compares the neighbors of all rows, and of some places between them, with brute force.
    fn compare<const D: usize>(points: &[[f64; D]]) {
        let brute_force = |query: &[f64; D], skip: usize, k: usize| {
            let mut all: Vec<(f64, u32)> = (0..points.len())
                .filter(|&other| other != skip)
                .map(|other| (squared_distance(query, &points[other]), other as u32))
                .collect();
            all.sort_unstable_by_key(canonical);
            all.truncate(k);
            all
        };
        let knn = Knn::new(points).unwrap();
        let mut found = Vec::new();
        for k in [1, 7, 50] {
            let (all, kth) = (knn.per_row(|_| k, |_, found| found.to_vec()), knn.kth_distances(k));
            for (row, point) in points.iter().enumerate() {
                let expected = brute_force(point, row, k);
                assert_eq!(kth[row], expected.last().map_or(0.0, |last| last.0.sqrt()));
                knn.nearest(row, k, &mut found);
                assert_eq!([&all[row], &found], [&expected; 2], "{row}, k {k}");
                // Whatever is said about where they probably are.
                let near = expected.last().map_or(0.0, |last| last.0);
                for within in [0.5 * near, near, 4.0 * near] {
                    knn.search(*point, Some(knn.places[row] as usize), (k, within), &mut found);
                    assert_eq!(found, expected, "{row}, k {k}, within {within}");
                }
                if row % 8 == 0 {
                    let query = std::array::from_fn(|c| 0.7 * point[c] + 0.4 * points[row / 2][c]);
                    knn.nearest_to(query, k, &mut found);
                    assert_eq!(found, brute_force(&query, usize::MAX, k), "at {query:?}, k {k}");
                }
            }
        }
    }

    #[test]
    fn equals_brute_force_at_every_size_and_density_and_with_many_ties() {
        for n in [2, 23, 24, 25, 48, 49, 97, 300, 1000] {
            let mut draws = Draws::new(n, Stage::Synthetic, 0);
            // Cubing makes the middle a million times denser than the border.
            let points = (0..n).map(|_| [0; 3].map(|_| draws.between(-1.0, 1.0).powi(3) * 1e3));
            let points: Vec<[f64; 3]> = points.collect();
            compare(&points);
            compare(&points.iter().map(|p| [p[0], p[1]]).collect::<Vec<[f64; 2]>>());
        }
        // A coarse lattice: most distances tie, many points coincide.
        let mut draws = Draws::new(5, Stage::Synthetic, 0);
        let lattice = (0..800).map(|_| std::array::from_fn(|_| draws.below(6) as f64));
        compare(&lattice.collect::<Vec<[f64; 3]>>());
        // Depth cameras write (0, 0, 0) for missing points, so that thousands coincide.
        for share in [0.3, 0.9] {
            let point = |row| match draws.unit() < share {
                // Zeros of both signs are equal.
                true => [if row % 2 == 0 { 0.0 } else { -0.0 }, 0.0, 0.0],
                false => std::array::from_fn(|_| draws.between(-1.0, 1.0)),
            };
            compare(&(0..900).map(point).collect::<Vec<[f64; 3]>>());
        }
    }

    #[test]
    fn points_at_one_place_cost_no_more_than_others() {
        assert!(Knn::<3>::new(&[]).is_err() && Knn::new(&[[0.0, f64::NAN]]).is_err());
        let points = vec![[1.0; 3]; 200_000];
        let knn = Knn::new(&points).unwrap();
        let sums = knn.per_row(|_| 50, |_, found| found.iter().map(|item| item.1).sum::<u32>());
        assert_eq!(sums[199_999], (0..50).sum::<u32>());
        let mut found = Vec::new();
        (0..points.len()).for_each(|row| knn.nearest(row, 50, &mut found));
    }
}
