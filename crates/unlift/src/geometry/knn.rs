//! Exact K nearest neighbors with canonical ties: by distance, then by index.
//!
//! The search is kiddo's; it does not promise an order among equal distances, and SfM maps hold
//! many coincident points. A few more neighbors than asked for are queried; when the tie reaches
//! beyond them, everything within the K-th distance is taken.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::vector::squared_distance;
use crate::Error;

/// A search tree over points that are looked up by row.
pub struct Knn<'a, const D: usize> {
    tree: ImmutableKdTree<f64, D>,
    points: &'a [[f64; D]],
}

/// How many more neighbors than asked for are queried to see ties at the K-th place.
const TIE_MARGIN: usize = 4;

impl<'a, const D: usize> Knn<'a, D> {
    /// A tree over `points`.
    ///
    /// # Errors
    /// When there are no points.
    pub fn new(points: &'a [[f64; D]]) -> Result<Self, Error> {
        let tree = ImmutableKdTree::new_from_slice(points)
            .map_err(|e| Error::new("points", "a searchable set", e.to_string()))?;
        Ok(Self { tree, points })
    }

    /// The `k` nearest other rows of row `row` (fewer when there are fewer), as (squared distance,
    /// row) in canonical order, into `found`.
    pub fn nearest(&self, row: usize, k: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        let query = &self.points[row];
        let ask = k + 1 + TIE_MARGIN;
        let Some(count) = NonZero::new(ask) else {
            return;
        };
        let results = self.tree.query(query).nearest_n::<SquaredEuclidean<f64>>(count).execute();
        // The last distance decides whether a tie may go on beyond what was returned.
        let complete = results.len() < ask;
        let push = |item: usize, found: &mut Vec<(f64, u32)>| {
            if item != row {
                found.push((squared_distance(query, &self.points[item]), item as u32));
            }
        };
        for result in &results {
            push(result.item as usize, found);
        }
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if !complete && found.len() > k && k > 0 {
            let kth = found[k - 1].0;
            // Rounding in the library's distance may differ from ours in the last bits.
            let reach = kth * (1.0 + 1e-9) + f64::MIN_POSITIVE;
            if found[found.len() - 1].0 <= reach {
                found.clear();
                let within = self
                    .tree
                    .query(query)
                    .within::<SquaredEuclidean<f64>>(reach)
                    .unsorted()
                    .execute();
                for result in &within {
                    push(result.item as usize, found);
                }
                found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            }
        }
        found.truncate(k);
    }

    /// The distance of every row to its `k`-th nearest other row (to its last one in small sets).
    pub fn kth_distances(&self, k: usize) -> Vec<f64> {
        (0..self.points.len())
            .into_par_iter()
            .map_init(Vec::new, |found, row| {
                self.nearest(row, k, found);
                found.last().map_or(0.0, |last| last.0.sqrt())
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    fn brute_force(points: &[[f64; 3]], row: usize, k: usize) -> Vec<(f64, u32)> {
        let mut all: Vec<(f64, u32)> = (0..points.len())
            .filter(|&other| other != row)
            .map(|other| (squared_distance(&points[row], &points[other]), other as u32))
            .collect();
        all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        all.truncate(k);
        all
    }

    #[test]
    fn equals_brute_force_with_many_ties() {
        let mut draws = Draws::new(5, Stage::Synthetic, 0);
        // A coarse lattice: most distances tie, many points coincide.
        let points: Vec<[f64; 3]> =
            (0..800).map(|_| std::array::from_fn(|_| draws.below(6) as f64)).collect();
        let knn = Knn::new(&points).unwrap();
        let mut found = Vec::new();
        for row in 0..points.len() {
            for k in [1, 7, 50] {
                knn.nearest(row, k, &mut found);
                assert_eq!(found, brute_force(&points, row, k), "row {row}, k {k}");
            }
        }
    }

    #[test]
    fn fewer_points_than_asked_for() {
        let points = [[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]];
        let knn = Knn::new(&points).unwrap();
        let mut found = Vec::new();
        knn.nearest(0, 50, &mut found);
        assert_eq!(found, vec![(1.0, 1), (9.0, 2)]);
    }
}
