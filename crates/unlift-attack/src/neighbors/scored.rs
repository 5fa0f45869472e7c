//! Neighborhoods from a function, such as a network, that scores all pairs within sets of descriptors.
//!
//! A map of a few thousand points is one set. A larger map is cut into sets of points that may be near each other by untrained scores, and
//! scores are averaged over sets. For SIFT, two short walks follow, over the pairs with the best scores and with the best untrained scores.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::compare::{Best, KeptPairs, MOST_ROWS, higher_first, search};
use super::kept::Rankings;
use super::overlap::Hypotheses;
use super::rows::{Ranked, Rows};
use super::similarity::Cosine;
use super::walk::CANDIDATES;
use super::{Neighborhoods, overlap, walk};
use crate::parallel;
use crate::released::Released;
use crate::{Descriptors, Error};

/// Largest number of points of a map that is one set.
const WHOLE: usize = 3072;
/// Rows that each walk may reach, as a multiple of those wanted: a row that both reach late may rank first.
const REACHED: usize = 4;

/// Number of rankings that are kept: schemes hide all points, all but an odd one, or most of them.
const MAX_RANKINGS: usize = 3;

/// Descriptors that are scored together.
#[derive(Debug)]
pub struct Part {
    /// One row per point.
    pub descriptors: Descriptors,
    /// For a part of a map: mean and deviation of each descriptor's similarity to all of the map ([`dense`](super::dense())).
    pub usual: Option<Vec<(f64, f64)>>,
}

/// Scores all pairs of the `n` descriptors of a part, `(n, n)`, row-major: the natural logarithm of the probability that the
/// column's point is among the nearest of the row's, up to a constant per row. Scores are finite; those of a point with itself are not read.
pub type Scores<'a> = dyn Fn(&Part) -> Result<Vec<f32>, Error> + Sync + 'a;

/// Lists the `k` records nearest to each slot by `scores`; for SIFT those that two short walks are most likely to reach, over these records
/// and as in [`Overlap`](super::Overlap). The score is the logarithm of a probability, the mean over both ends or walks. Scores of pairs
/// come from `kept` and are kept there: all calls with it must have the same `scores`.
///
/// # Errors
/// When `scores` fails, the map has no descriptors, or it has fewer than `k` other records.
pub fn scored<const D: usize>(
    released: &Released<D>,
    k: usize,
    scores: &Scores<'_>,
    kept: &mut KeptPairs,
) -> Result<Neighborhoods, Error> {
    let mut rows = Rows::new(released, k)?;
    let hypotheses = Hypotheses::of(&rows.descriptors).ok();
    // Enough for two slots per record, so that rankings do not depend on the scheme.
    let n_best = (2 * k + 1).max(CANDIDATES);
    let known = kept.rankings.iter().position(|rankings| rankings.are_of(&rows, n_best));
    let rankings = match known {
        Some(at) => kept.rankings.remove(at),
        None => rankings(&mut rows, n_best, hypotheses.as_ref(), scores, kept)?,
    };
    let record = |row: u32| rows.records[row as usize];
    let without_own = |ranked: &Vec<Ranked>| {
        parallel::map(ranked.len(), |row| -> Ranked {
            let is_other = |entry: &&(f32, u32)| record(entry.1) != rows.records[row];
            ranked[row].iter().filter(is_other).copied().collect()
        })
    };
    let [mut trained, untrained] = [&rankings.trained, &rankings.untrained].map(without_own);
    if rows.len() <= MOST_ROWS {
        kept.rankings.push(rankings);
        let too_many = kept.rankings.len().saturating_sub(MAX_RANKINGS);
        kept.rankings.drain(..too_many);
    }
    let enough = rows.enough_for(k);
    if hypotheses.is_none() {
        // The best scores are right more often than the rows that a walk reaches.
        trained.iter_mut().for_each(|row| row.truncate(enough));
        return rows.lists(released, &trained, k);
    }
    let walked = |ranked: &[_]| walk::walk(ranked, &rows.records, REACHED * enough, overlap::WALK);
    rows.lists(released, &mixed(&walked(&trained), &walked(&untrained), enough), k)
}

/// Ranks the partners of `rows`, which it reorders if there are many.
fn rankings(
    rows: &mut Rows<'_>,
    n_best: usize,
    hypotheses: Option<&Hypotheses>,
    scores: &Scores<'_>,
    kept: &mut KeptPairs,
) -> Result<Rankings, Error> {
    let mut apart = rows.apart();
    let found = match hypotheses {
        Some(hypotheses) => search(hypotheses, &mut apart, n_best, true, MOST_ROWS, kept)?,
        None => search(&Cosine, &mut apart, n_best, true, MOST_ROWS, kept)?,
    };
    let untrained = walk::standardized(&found);
    let n = apart.len();
    let (sets, usual) = if n <= WHOLE {
        (vec![Set { rows: (0..n as u32).collect(), inner: vec![true; n] }], None)
    } else {
        let usual: Vec<_> = found.iter().map(|found| (found.mean, found.deviation)).collect();
        (around(&untrained), Some(usual))
    };
    drop(found);
    let part = |set: &Set| {
        let slots: Vec<u32> = set.rows.iter().map(|&row| apart.slots[row as usize]).collect();
        let of_set = |all: &Vec<_>| set.rows.iter().map(|&row| all[row as usize]).collect();
        let usual = usual.as_ref().map(of_set);
        Part { descriptors: apart.descriptors.select(&slots), usual }
    };
    let of_set = |at: usize| within(&sets[at], scores(&part(&sets[at]))?, n_best);
    let found = parallel::map(sets.len(), of_set).into_iter().collect::<Result<Vec<_>, Error>>()?;
    let mut trained: Vec<Ranked> = vec![Vec::new(); n];
    for (set, found) in sets.iter().zip(found) {
        for (&row, pairs) in set.rows.iter().zip(found) {
            trained[row as usize].extend(pairs);
        }
    }
    let mean = |entries: &[(f32, u32)]| {
        entries.iter().map(|&(score, _)| score).sum::<f32>() / entries.len() as f32
    };
    let trained = both_ways(parallel::map(n, |row| merged(trained[row].clone(), mean)));
    let (slots, descriptors) = (apart.slots.clone(), apart.descriptors.clone().into_owned());
    rows.reorder(slots.clone());
    Ok(Rankings { descriptors, slots, n_best, untrained, trained })
}

/// Returns the `n_best` rows with the largest mean probability over two walks.
fn mixed(a: &[Ranked], b: &[Ranked], n_best: usize) -> Vec<Ranked> {
    let mean = |entries: &[(f32, u32)]| {
        let sum: f64 = entries.iter().map(|&(log, _)| libm::exp(f64::from(log)) / 2.0).sum();
        libm::log(sum.max(f64::MIN_POSITIVE)) as f32
    };
    let row = |row: usize| {
        let mut ranked = merged([&a[row][..], &b[row]].concat(), mean);
        ranked.truncate(n_best);
        ranked
    };
    parallel::map(a.len(), row)
}

/// Returns the best partners per row of a set by the mean of both rows' log probabilities.
fn within(
    Set { rows: set, inner }: &Set,
    mut logs: Vec<f32>,
    n_best: usize,
) -> Result<Vec<Ranked>, Error> {
    let n = set.len();
    let wrong = |found: String| Error::new("scores of pairs", format!("{n} x {n} numbers"), found);
    if logs.len() != n * n {
        return Err(wrong(logs.len().to_string()));
    }
    let odd = |&(at, score): &(usize, &f32)| !score.is_finite() && at / n != at % n;
    if let Some((_, score)) = logs.iter().enumerate().find(odd) {
        return Err(wrong(score.to_string()));
    }
    for (i, line) in logs.chunks_exact_mut(n).enumerate() {
        line[i] = f32::NEG_INFINITY;
        let top = line.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let sum: f64 = line.iter().map(|score| libm::exp(f64::from(score - top))).sum();
        let log = top + libm::log(sum.max(f64::MIN_POSITIVE)) as f32;
        line.iter_mut().for_each(|score| *score -= log);
    }
    let best = |i: usize| {
        let mut best = Best::new(n_best);
        for j in (0..n).filter(|&j| j != i) {
            best.push((logs[i * n + j] + logs[j * n + i]) / 2.0, set[j]);
        }
        best.into_sorted()
    };
    Ok((0..n).map(|i| if inner[i] { best(i) } else { Vec::new() }).collect())
}

/// Returns one entry per partner, with the `mean` of its entries; best first.
fn merged(mut entries: Ranked, mean: impl Fn(&[(f32, u32)]) -> f32) -> Ranked {
    // A stable sort keeps the order of entries, so sums do not depend on threads.
    entries.sort_by_key(|&(_, partner)| partner);
    let of_partner = entries.chunk_by(|a, b| a.1 == b.1);
    let mut ranked: Ranked = of_partner.map(|entries| (mean(entries), entries[0].1)).collect();
    ranked.sort_unstable_by(higher_first);
    ranked
}

/// Makes scores symmetric: a pair may be in more sets of one row than of the other.
fn both_ways(ranked: Vec<Ranked>) -> Vec<Ranked> {
    let score = |row: u32, other: u32| {
        ranked[row as usize].iter().find(|&&(_, at)| at == other).map(|&(score, _)| score)
    };
    let row = |row: usize| {
        let shared = |&(own, other): &(f32, u32)| match score(other, row as u32) {
            Some(others) => ((own + others) / 2.0, other),
            None => (own, other),
        };
        let mut list: Ranked = ranked[row].iter().map(shared).collect();
        list.sort_unstable_by(higher_first);
        list
    };
    parallel::map(ranked.len(), row)
}

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
struct Set {
    rows: Vec<u32>,
    /// Whether each row is in the middle of the set.
    inner: Vec<bool>,
}

/// Grows sets along the best pairs: every row is in the middle of [`TIMES`]. `ranked` has partners, best first, in standard deviations.
fn around(ranked: &[Ranked]) -> Vec<Set> {
    let n = ranked.len();
    let mut edges = walk::edges(ranked, EDGES);
    for (_, weight) in edges.iter_mut().flatten() {
        *weight = libm::expf(weight.min(8.0));
    }
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
        order.sort_by_key(|&row| Reverse(place[row as usize]));
    }
    sets
}

/// A set, and the weights that connect other rows to it.
struct Growth<'a> {
    edges: &'a [Vec<(u32, f32)>],
    set: Vec<u32>,
    /// Sum of weights per row; negative infinity for rows in the set.
    ties: HashMap<u32, f32>,
    /// Rows after the bits of their sums, which are ordered as the sums are because none is negative. Among equal sums, the lower row is first.
    heap: BinaryHeap<(u32, Reverse<u32>)>,
}

impl<'a> Growth<'a> {
    fn new(edges: &'a [Vec<(u32, f32)>]) -> Self {
        Self { edges, set: Vec::new(), ties: HashMap::new(), heap: BinaryHeap::new() }
    }

    /// Returns the allowed row with the largest sum of weights.
    fn next(&mut self, may: impl Fn(u32) -> bool) -> Option<u32> {
        while let Some((tie, Reverse(row))) = self.heap.pop() {
            // Skip outdated entries.
            if self.ties.get(&row).is_some_and(|now| now.to_bits() == tie) && may(row) {
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
                self.heap.push((tied.to_bits(), Reverse(other)));
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
            let mut ring: Ranked = outside.map(|(&row, &tie)| (tie, row)).collect();
            if ring.is_empty() {
                break;
            }
            ring.sort_unstable_by(higher_first);
            for (_, row) in ring.into_iter().take(SIZE - USUAL - self.set.len()) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptors::Values;
    use crate::neighbors::described;

    /// Points along a closed curve, whose descriptors change slowly.
    fn released(n: usize, is_sift: bool, slots: usize) -> Released<3> {
        let byte = |at: usize, bin: usize| {
            let turn = std::f64::consts::TAU * at as f64 / n as f64;
            let wave = libm::sin(turn * (1 + bin % 9) as f64 + (bin * bin) as f64);
            (60.0 + 50.0 * wave) as u8
        };
        let bytes = (0..n).flat_map(|at| (0..128).map(move |bin| byte(at, bin)));
        let values = match is_sift {
            true => Values::U8(bytes.collect()),
            false => Values::F32(bytes.map(|byte| f32::from(byte) - 60.0).collect()),
        };
        described(Descriptors::try_new(values, 128).unwrap(), slots)
    }

    fn alike(part: &Part) -> Result<Vec<f32>, Error> {
        // A few of the values suffice to tell points apart.
        let Values::U8(values) = part.descriptors.values() else { panic!("bytes") };
        let few = values.chunks_exact(128).flat_map(|row| &row[..9]).copied().collect();
        let (few, n) = (Descriptors::try_new(Values::U8(few), 9)?, part.descriptors.len());
        Ok((0..n * n).map(|at| few.squared_distance(at / n, at % n) / -30.0).collect())
    }

    /// Scores of one set in which opposite points are near.
    fn opposite(part: &Part) -> Result<Vec<f32>, Error> {
        let n = part.descriptors.len();
        let near = |i: usize, j: usize| -((i.abs_diff(j) as f32 - n as f32 / 2.0).abs());
        Ok((0..n * n).map(|at| near(at / n, at % n)).collect())
    }

    /// Fraction of entries at most `k / 2 + 3` steps away along the curve.
    fn right(lists: &Neighborhoods, n: usize, k: usize) -> f64 {
        let is_near = |slot: usize, record: usize| {
            let steps = slot.abs_diff(record);
            steps.min(n - steps) <= k / 2 + 3
        };
        let near = |slot: usize| lists.of(slot).iter().filter(|r| is_near(slot, r.index())).count();
        (0..n).map(near).sum::<usize>() as f64 / (n * k) as f64
    }

    #[test]
    fn what_scores_call_near_is_listed_in_one_set_and_in_several() {
        for n in [300, WHOLE + 500] {
            let map = released(n, true, 1);
            let lists = scored(&map, 10, &alike, &mut KeptPairs::default()).unwrap();
            let right = right(&lists, n, 10);
            assert!(right > 0.9, "{n} points: {right}");
        }
        // Scores alone decide the lists of others than SIFT.
        let map = released(300, false, 1);
        let lists = scored(&map, 10, &opposite, &mut KeptPairs::default()).unwrap();
        let right = right(&lists, 300, 10);
        assert!(right < 0.15, "{right}");
    }

    #[test]
    fn lists_from_kept_rankings_equal_those_of_the_map_alone() {
        let mut kept = KeptPairs::default();
        for (n, slots, n_kept) in
            [(400, 1, 1), (400, 2, 1), (398, 2, 2), (400, 1, 2), (40, 1, 3), (42, 1, 3)]
        {
            let map = released(n, true, slots);
            let alone = scored(&map, 12, &alike, &mut KeptPairs::default()).unwrap();
            assert_eq!(scored(&map, 12, &alike, &mut kept).unwrap(), alone, "{n} points");
            assert_eq!(kept.rankings.len(), n_kept);
        }
    }

    #[test]
    fn scores_that_are_none_are_refused() {
        let scored = |values: Vec<f32>| {
            let scores = |_: &Part| Ok(values.clone());
            scored(&released(20, true, 1), 5, &scores, &mut KeptPairs::default())
        };
        for (values, found) in [
            (vec![0.0; 7], "7"),
            (vec![f32::NAN; 400], "NaN"),
            (vec![f32::NEG_INFINITY; 400], "-inf"),
        ] {
            let expected = format!("scores of pairs: expected 20 x 20 numbers, found {found}");
            assert_eq!(scored(values).unwrap_err().to_string(), expected);
        }
        let diagonal = (0..400).map(|at| if at % 21 == 0 { f32::NAN } else { 0.0 });
        assert!(scored(diagonal.collect()).is_ok());
    }

    #[test]
    fn every_row_is_in_with_its_best_partners() {
        // A ring in which every row lists its eight nearest.
        let n = 5000;
        let near = |row: usize| -> Vec<(f32, u32)> {
            let at = |step: usize, other: usize| (6.0 - step as f32 / 2.0, (other % n) as u32);
            (1..=4).flat_map(|step| [at(step, row + step), at(step, row + n - step)]).collect()
        };
        let lonely = vec![Vec::new(); 1500];
        for ranked in [(0..n).map(near).collect(), lonely] {
            let sets = around(&ranked);
            let mut with_all = vec![0; ranked.len()];
            for Set { rows, inner } in &sets {
                assert!(rows.len() <= SIZE && rows.is_sorted_by(|a, b| a < b));
                assert_eq!(rows.len(), inner.len());
                for (&row, _) in rows.iter().zip(inner).filter(|(_, inner)| **inner) {
                    let all = ranked[row as usize].iter().all(|(_, other)| rows.contains(other));
                    with_all[row as usize] += usize::from(all);
                }
            }
            assert!(with_all.iter().all(|&times| times == TIMES), "a row without its partners");
            assert_eq!(sets.len(), TIMES * ranked.len().div_ceil(INNER));
        }
    }
}
