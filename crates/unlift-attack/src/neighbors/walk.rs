//! A short random walk over the graph of best matches: neighbors of neighbors are neighbors.
//!
//! The patches of two near points need not overlap, but a few steps over reliable matches lead from one to the other.

use super::Neighborhoods;
use super::compare::{Best, Found, KeptPairs, Likeness, MOST_ROWS, higher_first, search};
use super::rows::{Ranked, Rows};
use crate::Error;
use crate::parallel;
use crate::released::Released;

const EDGES: usize = 6;
/// The weight of an edge is `exp(SHARPNESS * (z - USUAL))`.
const SHARPNESS: f64 = 2.0;
const USUAL: f64 = 3.0;
/// Least number of partners that a row keeps for the walk.
pub const CANDIDATES: usize = 64;
#[derive(Clone, Copy, Debug)]
pub struct Walk {
    pub steps: usize,
    /// Weight of each further step.
    pub decay: f64,
}

/// Largest number of rows that a walk keeps after each step, the most probable ones.
const WIDEST: usize = 128;

/// Lists the `k` best records of a released map by a likeness, or those that a walk over the best ones reaches.
pub fn ranked_by<L: Likeness, const D: usize>(
    likeness: &L,
    mut rows: Rows<'_>,
    how: Option<Walk>,
    (released, k): (&Released<D>, usize),
    kept: &mut KeptPairs,
) -> Result<Neighborhoods, Error> {
    let enough = rows.enough_for(k);
    let n_best = if how.is_some() { enough.max(CANDIDATES) } else { enough };
    let found = search(likeness, &mut rows, n_best, how.is_some(), MOST_ROWS, kept)?;
    let ranked = match how {
        Some(how) => walk(&standardized(&found), &rows.records, enough, how),
        None => found.into_iter().map(|row| row.best).collect(),
    };
    rows.lists(released, &ranked, k)
}

/// Converts the scores of pairs to standard deviations above the mean score of their rows, averaged over both rows.
pub fn standardized(found: &[Found]) -> Vec<Ranked> {
    let z = |row: usize, score: f32| {
        (f64::from(score) - found[row].mean) / found[row].deviation.max(1e-9)
    };
    let row = |row: usize| {
        let both = |&(score, other): &(f32, u32)| {
            (((z(row, score) + z(other as usize, score)) / 2.0) as f32, other)
        };
        let mut ranked: Ranked = found[row].best.iter().map(both).collect();
        ranked.sort_unstable_by(higher_first);
        ranked
    };
    parallel::map(found.len(), row)
}

/// Ranks at most `n_best` rows that a walk from each row reaches, then the others of `ranked`. Scores are natural logarithms.
pub fn walk(ranked: &[Ranked], record_of: &[u32], n_best: usize, how: Walk) -> Vec<Ranked> {
    let steps = graph(ranked);
    let scratch = || Scratch { at: vec![0.0; ranked.len()], sum: vec![0.0; ranked.len()] };
    parallel::map_with(ranked.len(), scratch, |scratch, row| {
        let reached = scratch.reached(&steps, row, how);
        let mut best = Best::new(n_best);
        for &(other, sum) in &reached {
            if record_of[other as usize] != record_of[row] {
                best.push(libm::log(sum) as f32, other);
            }
        }
        let mut list = best.into_sorted();
        let missing = n_best - list.len();
        // Rows that are not reached rank below all others.
        let lowest = list.last().map_or(0.0, |&(score, _)| score);
        let top = ranked[row].first().map_or(0.0, |&(z, _)| z);
        let is_new = |&&(_, other): &&(f32, u32)| {
            reached.binary_search_by_key(&other, |&(row, _)| row).is_err()
        };
        let rest = ranked[row].iter().filter(is_new).take(missing);
        list.extend(rest.map(|&(z, other)| (lowest + z.min(top) - top, other)));
        list
    })
}

/// Returns the first `n` partners of each row, and the rows that have it among theirs, with their scores, in ascending order of rows.
pub fn edges(ranked: &[Ranked], n: usize) -> Vec<Vec<(u32, f32)>> {
    let mut edges: Vec<Vec<(u32, f32)>> = vec![Vec::new(); ranked.len()];
    for (row, list) in ranked.iter().enumerate() {
        for &(score, partner) in list.iter().take(n) {
            edges[row].push((partner, score));
            edges[partner as usize].push((row as u32, score));
        }
    }
    // An edge that both ends keep is one edge with the same score.
    let merge = |(): &mut (), _, row: &mut Vec<(u32, f32)>| {
        row.sort_unstable_by_key(|&(partner, _)| partner);
        row.dedup_by_key(|&mut (partner, _)| partner);
    };
    parallel::for_each_mut(&mut edges, || (), merge);
    edges
}

/// Returns the probabilities of one step, per row in ascending order of the other row.
fn graph(ranked: &[Ranked]) -> Vec<Vec<(u32, f64)>> {
    let edges = edges(ranked, EDGES);
    let step = |row: usize| {
        let row = || edges[row].iter().map(|&(partner, z)| (partner, f64::from(z)));
        let weight = |z: f64, usual: f64| libm::exp(SHARPNESS * (z - usual));
        let total = |usual: f64| row().map(|(_, z)| weight(z, usual)).sum::<f64>();
        // Rows with a deviation of 0 may have scores beyond the range of an exponential.
        let top = row().map(|(_, z)| z).fold(f64::NEG_INFINITY, f64::max);
        let (usual, sum) = match total(USUAL) {
            sum if sum.is_normal() => (USUAL, sum),
            _ => (top, total(top)),
        };
        row().map(|(partner, z)| (partner, weight(z, usual) / sum)).collect()
    };
    parallel::map(edges.len(), step)
}

struct Scratch {
    at: Vec<f64>,
    sum: Vec<f64>,
}

impl Scratch {
    /// Returns the rows that a walk from `start` reaches, ascending, with the discounted sum of their probabilities after each step.
    fn reached(&mut self, steps: &[Vec<(u32, f64)>], start: usize, how: Walk) -> Vec<(u32, f64)> {
        let mut here = vec![(start as u32, 1.0)];
        let (mut touched, mut ever) = (Vec::new(), Vec::new());
        let mut discount = 1.0;
        for _ in 0..how.steps {
            for &(row, probability) in &here {
                for &(other, step) in &steps[row as usize] {
                    if self.at[other as usize] == 0.0 {
                        touched.push(other);
                    }
                    self.at[other as usize] += probability * step;
                }
            }
            here.clear();
            for other in touched.drain(..) {
                let probability = std::mem::take(&mut self.at[other as usize]);
                if self.sum[other as usize] == 0.0 {
                    ever.push(other);
                }
                self.sum[other as usize] += discount * probability;
                here.push((other, probability));
            }
            if here.len() > WIDEST {
                here.select_nth_unstable_by(WIDEST - 1, |a, b| {
                    b.1.total_cmp(&a.1).then(a.0.cmp(&b.0))
                });
                here.truncate(WIDEST);
            }
            // Sums are in row order, independent of pruning.
            here.sort_unstable_by_key(|&(row, _)| row);
            discount *= how.decay;
        }
        ever.sort_unstable();
        let sum = |row: u32| (row, std::mem::take(&mut self.sum[row as usize]));
        ever.into_iter().map(sum).filter(|&(_, sum)| sum > 0.0).collect()
    }
}
