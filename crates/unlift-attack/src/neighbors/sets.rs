//! Sets of rows that may be near each other: a network scores each set, where all rows are too many.

use std::collections::{BinaryHeap, HashMap};

use super::best::higher_first;

/// Number of rows of a set.
const SIZE: usize = 1024;
/// Number of these that are spread over the map, to give typical scores.
const USUAL: usize = 256;
/// Number of rows in the middle of a set; most of their neighbors are in the set.
const INNER: usize = 384;
/// Number of sets in whose middle each row is.
const TIMES: usize = 2;
/// Number of edges per row along which a set grows.
const EDGES: usize = 24;

/// Rows that are scored together.
pub struct Set {
    /// The rows, ascending.
    pub rows: Vec<u32>,
    /// Whether each row is in the middle of the set.
    pub inner: Vec<bool>,
}

/// Grows sets along the best pairs. `ranked` has the partners of each row, best first, with scores in standard deviations. Every row is in
/// the middle of [`TIMES`] sets.
pub fn around(ranked: &[Vec<(f32, u32)>]) -> Vec<Set> {
    let n = ranked.len();
    let edges = edges(ranked);
    let mut order: Vec<u32> = (0..n as u32).collect();
    let mut sets = Vec::new();
    for _ in 0..TIMES {
        let mut is_done = vec![false; n];
        let mut place = vec![0; n];
        let mut starts = order.iter().copied();
        loop {
            let mut growth = Growth::new(&edges);
            while growth.set.len() < INNER {
                // After a connected part of the graph is used up, continue with the next one.
                let next = growth.next(|row| !is_done[row as usize]);
                let Some(row) = next.or_else(|| starts.find(|&row| !is_done[row as usize])) else {
                    break;
                };
                is_done[row as usize] = true;
                place[row as usize] = growth.set.len();
                growth.take(row);
            }
            if growth.set.is_empty() {
                break;
            }
            sets.push(growth.filled(sets.len()));
        }
        // Rows at the edge of a middle become starts in the next round.
        order.sort_by_key(|&row| std::cmp::Reverse(place[row as usize]));
    }
    sets
}

/// Returns the edges with their weights, in both directions.
fn edges(ranked: &[Vec<(f32, u32)>]) -> Vec<Vec<(u32, f32)>> {
    let mut edges: Vec<Vec<(u32, f32)>> = vec![Vec::new(); ranked.len()];
    for (row, list) in ranked.iter().enumerate() {
        for &(z, other) in list.iter().take(EDGES) {
            let weight = libm::expf(z.min(8.0));
            edges[row].push((other, weight));
            edges[other as usize].push((row as u32, weight));
        }
    }
    for list in &mut edges {
        list.sort_unstable_by_key(|&(other, _)| other);
        list.dedup_by_key(|&mut (other, _)| other);
    }
    edges
}

/// A set, and the weights that connect other rows to it.
struct Growth<'a> {
    edges: &'a [Vec<(u32, f32)>],
    set: Vec<u32>,
    /// Sum of weights per row; negative infinity for rows in the set.
    ties: HashMap<u32, f32>,
    heap: BinaryHeap<Tied>,
}

impl<'a> Growth<'a> {
    fn new(edges: &'a [Vec<(u32, f32)>]) -> Self {
        Self { edges, set: Vec::new(), ties: HashMap::new(), heap: BinaryHeap::new() }
    }

    /// Returns the allowed row with the largest sum of weights.
    fn next(&mut self, may: impl Fn(u32) -> bool) -> Option<u32> {
        while let Some(Tied(tie, row)) = self.heap.pop() {
            // Skip outdated entries.
            if self.ties.get(&row) == Some(&tie) && may(row) {
                return Some(row);
            }
        }
        None
    }

    fn take(&mut self, row: u32) {
        self.ties.insert(row, f32::NEG_INFINITY);
        self.set.push(row);
        for &(other, weight) in &self.edges[row as usize] {
            let tied = self.ties.entry(other).or_insert(0.0);
            if *tied != f32::NEG_INFINITY {
                *tied += weight;
                self.heap.push(Tied(*tied, other));
            }
        }
    }

    /// Completes the set around this middle with the most connected rows and with rows from all over the map; `at` is its index.
    fn filled(mut self, at: usize) -> Set {
        let n = self.edges.len();
        let mut inner = self.set.clone();
        inner.sort_unstable();
        // Grow ring by ring. Always taking the most connected row would grow the set in one direction.
        while self.set.len() < SIZE - USUAL {
            let outside = self.ties.iter().filter(|&(_, &tie)| tie != f32::NEG_INFINITY);
            let mut ring: Vec<Tied> = outside.map(|(&row, &tie)| Tied(tie, row)).collect();
            if ring.is_empty() {
                break;
            }
            ring.sort_unstable_by(|a, b| b.cmp(a));
            for Tied(_, row) in ring.into_iter().take(SIZE - USUAL - self.set.len()) {
                self.take(row);
            }
        }
        let mut rows = self.set;
        // Another sample for every set.
        rows.extend((0..USUAL).map(|sample| ((at * 7919 + sample * n / USUAL) % n) as u32));
        rows.sort_unstable();
        rows.dedup();
        let inner = rows.iter().map(|row| inner.binary_search(row).is_ok()).collect();
        Set { rows, inner }
    }
}

/// A row and its sum of weights; among equal sums the lower row is first.
#[derive(PartialEq)]
struct Tied(f32, u32);

impl Eq for Tied {}

impl Ord for Tied {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        higher_first(&(self.0, self.1), &(other.0, other.1)).reverse()
    }
}

impl PartialOrd for Tied {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_in_with_its_best_partners() {
        // A ring in which every row lists its eight nearest.
        let n = 5000;
        let near = |row: usize| -> Vec<(f32, u32)> {
            let at = |step: usize, other: usize| (6.0 - step as f32 / 2.0, (other % n) as u32);
            (1..=4).flat_map(|step| [at(step, row + step), at(step, row + n - step)]).collect()
        };
        let ranked: Vec<_> = (0..n).map(near).collect();
        let sets = around(&ranked);
        let mut with_all = vec![0; n];
        for Set { rows, inner } in &sets {
            assert!(rows.len() <= SIZE && rows.is_sorted_by(|a, b| a < b));
            assert_eq!(rows.len(), inner.len());
            for (&row, _) in rows.iter().zip(inner).filter(|(_, inner)| **inner) {
                let all = ranked[row as usize].iter().all(|(_, other)| rows.contains(other));
                with_all[row as usize] += usize::from(all);
            }
        }
        assert!(with_all.iter().all(|&times| times == TIMES), "a row without its partners");
        assert_eq!(sets.len(), TIMES * n.div_ceil(INNER));
    }

    #[test]
    fn rows_without_partners_fill_sets_nevertheless() {
        let ranked = vec![Vec::new(); 1500];
        let sets = around(&ranked);
        assert_eq!(sets.len(), TIMES * 1500usize.div_ceil(INNER));
        let middles: usize = sets.iter().flat_map(|set| &set.inner).filter(|inner| **inner).count();
        assert_eq!(middles, TIMES * 1500);
    }
}
