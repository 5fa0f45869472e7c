//! Exact K nearest neighbors. Ties are ordered by row.
//!
//! The search tree is a balanced k-d tree. Points are stored leaf by leaf, one column per coordinate, so that a leaf takes a few vector
//! instructions, and queries in [`spatial_order`](Knn::spatial_order) find their neighbors in the cache. The index of a node
//! determines its place in the columns, so only boxes are stored.
//!
//! A query first searches the smallest node around its point that holds enough others. The K-th distance found there is an upper bound.
//! Then it takes every point within that bound, so that no tie is missed. Queries of all rows run leaf by leaf (`leaf`).

mod leaf;
mod tree;

pub use tree::Knn;

use rayon::prelude::*;

impl<const D: usize> Knn<'_, D> {
    /// Calls `of(row, its k nearest, entry)` for every row, with `entries` in spatial order. It is several times faster than single
    /// queries. The nearest are other rows, as (squared distance, row), nearest first.
    ///
    /// # Panics
    /// When there is not one entry per row.
    pub fn each<T: Send>(
        &self,
        k: usize,
        entries: &mut [T],
        of: impl Fn(usize, &[(f64, u32)], &mut T) + Sync,
    ) {
        assert_eq!(entries.len(), self.rows.len(), "one entry per row");
        let mut rest = entries;
        let mut leaves = Vec::with_capacity(1 << self.depth);
        for leaf in 0..1 << self.depth {
            let (entries, others) = rest.split_at_mut(self.range((1 << self.depth) + leaf).len());
            leaves.push((leaf, entries));
            rest = others;
        }
        leaves.into_par_iter().for_each_init(leaf::Scratch::new, |scratch, (leaf, entries)| {
            leaf::solve(self, leaf, k, scratch, |at, row, found| of(row, found, &mut entries[at]));
        });
    }

    /// Returns `of(row, its k nearest)` for every row, in the order of rows, see [`each`](Self::each).
    pub fn per_row<T: Clone + Send>(
        &self,
        k: usize,
        of: impl Fn(usize, &[(f64, u32)]) -> T + Sync,
    ) -> Vec<T> {
        let mut by_place: Vec<Option<T>> = vec![None; self.rows.len()];
        self.each(k, &mut by_place, |row, found, entry| *entry = Some(of(row, found)));
        self.places.iter().filter_map(|&place| by_place[place as usize].take()).collect()
    }

    /// Returns the distance of every row to its `k`-th nearest other row (to the last one in small sets).
    pub fn kth_distances(&self, k: usize) -> Vec<f64> {
        self.per_row(k, |_, found| found.last().map_or(0.0, |last| last.0.sqrt()))
    }
}

#[cfg(test)]
mod tests;
