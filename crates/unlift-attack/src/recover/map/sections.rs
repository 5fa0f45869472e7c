//! Where listed records pass a feasible line: the common currency of all one-unknown families.
//!
//! Along `x(t)` the squared distance to record `j` is `miss2[j] + bend[j] (t - at[j])^2`: `at` is
//! the parameter of the closest approach, `miss2` the squared distance there, `bend` the squared
//! sine of the angle between the lines (1 when the record is seen square on, 0 when it agrees with
//! every `t` alike, as a parallel axis of a candidate does). Within `delta` of a
//! record is therefore an interval of `t`.

use super::evidence::{MOST_CHANCE, evidence};
use super::lanes::{LANES, ln};

/// Sections of one list of records with one feasible line, in columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sections {
    pub(crate) at: Vec<f32>,
    pub(crate) miss2: Vec<f32>,
    pub(crate) bend: Vec<f32>,
}

/// `miss2` of a record that says nothing here (parallel, same center, behind it).
pub(crate) const NO_VOTE: f32 = f32::INFINITY;

impl Sections {
    /// Makes room for `n` sections, of which the first `n` must then be written; the padding is silent.
    #[inline(always)]
    pub(crate) fn resize(&mut self, n: usize) {
        let padded = n.next_multiple_of(LANES);
        self.at.resize(padded, 0.0);
        self.miss2.resize(padded, NO_VOTE);
        self.bend.resize(padded, 1.0);
        self.at[n..].fill(0.0);
        self.miss2[n..].fill(NO_VOTE);
        self.bend[n..].fill(1.0);
    }

    /// Number of sections, padding included.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.at.len()
    }

    /// How many records say anything at all.
    #[inline(always)]
    pub(crate) fn n_voting(&self) -> usize {
        self.miss2.iter().map(|&miss2| usize::from(miss2 < NO_VOTE)).sum()
    }

    /// Squared distance from `x(t)` to record `j`.
    #[inline(always)]
    pub(crate) fn squared_distance(&self, j: usize, t: f32) -> f32 {
        let d = t - self.at[j];
        self.miss2[j] + self.bend[j] * d * d
    }

    /// One step of least squares over the records within `reach2` (squared) of `x(t)`: the shift of
    /// `t` and the number of these records; no shift when none of them tells where.
    #[inline(always)]
    pub(crate) fn least_squares_step(&self, t: f32, reach2: f32) -> (f32, u32) {
        let (mut weight, mut sum, mut n) = ([0.0f32; LANES], [0.0f32; LANES], [0u32; LANES]);
        let (at, _) = self.at.as_chunks::<LANES>();
        let (miss2, _) = self.miss2.as_chunks::<LANES>();
        let (bend, _) = self.bend.as_chunks::<LANES>();
        for ((at, miss2), bend) in at.iter().zip(miss2).zip(bend) {
            for lane in 0..LANES {
                let d = at[lane] - t;
                let near = miss2[lane] + bend[lane] * d * d <= reach2;
                weight[lane] += if near { bend[lane] } else { 0.0 };
                sum[lane] += if near { bend[lane] * d } else { 0.0 };
                n[lane] += u32::from(near);
            }
        }
        let weight: f32 = weight.iter().sum();
        let sum: f32 = sum.iter().sum();
        (if weight > 0.0 { sum / weight } else { 0.0 }, n.iter().sum())
    }
}

/// Intervals of `t` within delta of the records that pass there, in order of record.
#[derive(Clone, Debug, Default)]
pub(crate) struct Intervals {
    low: Vec<f32>,
    high: Vec<f32>,
    /// Records that are within delta everywhere.
    everywhere: u32,
    at_starts: AtStarts,
}

/// What is looked at where each interval starts, in columns.
#[derive(Clone, Debug, Default)]
struct AtStarts {
    /// How many intervals hold it.
    count: Vec<u32>,
    /// The chance that a random record passes there.
    chance: Vec<f32>,
    cell: Vec<u32>,
    evidence: Vec<f32>,
    score: Vec<f32>,
}

impl Intervals {
    /// The intervals of `sections` at `delta`, as far as they lie between `floor` and `top`.
    #[inline(always)]
    pub(crate) fn fill(&mut self, sections: &Sections, delta2: f32, floor: f32, top: f32) {
        let n = sections.len();
        self.low.resize(n, f32::INFINITY);
        self.high.resize(n, f32::NEG_INFINITY);
        let (at, miss2, bend) = (&sections.at[..n], &sections.miss2[..n], &sections.bend[..n]);
        let (low, high) = (&mut self.low[..n], &mut self.high[..n]);
        for j in 0..n {
            let room = delta2 - miss2[j];
            let half = (room.max(0.0) / bend[j]).sqrt();
            let (start, end) = (at[j] - half, at[j] + half);
            let empty = (room < 0.0) | (end < floor) | (start > top);
            low[j] = if empty { f32::INFINITY } else { start.max(floor) };
            high[j] = end;
        }
        // Every row is written, and stays if it begins somewhere: no branch to guess.
        let (mut kept, mut everywhere) = (0, 0);
        for j in 0..n {
            let start = low[j];
            (low[kept], high[kept]) = (start, high[j]);
            kept += usize::from(start.is_finite());
            everywhere += u32::from(start == f32::NEG_INFINITY);
        }
        self.everywhere = everywhere;
        self.low.truncate(kept);
        self.high.truncate(kept);
        let padded = kept.next_multiple_of(LANES);
        self.low.resize(padded, f32::INFINITY);
        self.high.resize(padded, f32::NEG_INFINITY);
    }
}

/// A position along a feasible line and why it was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    /// The position.
    pub(crate) t: f32,
    /// Improbability by chance that so many records pass there, in nats.
    pub(crate) evidence: f32,
    /// Evidence and prior: what is maximized.
    pub(crate) score: f32,
}

impl Intervals {
    /// The start of a listed interval that maximizes evidence plus prior. The number of agreeing records
    /// changes only at interval ends and is largest at some start, so no position has more votes than the
    /// starts looked at.
    ///
    /// `k` listed records could vote; `chances` adds to its last argument the chance that a random record
    /// passes at each start (of the first), with room for cells of a grid (in the second). The prior is the chance
    /// itself: a point is likelier to lie where the map is dense, and chance measures density (without it the empty
    /// parts of a map, where two votes are already improbable, win too often). Ties are won by the lower record.
    #[inline(always)]
    pub(crate) fn best_start(
        &mut self,
        k: usize,
        chances: impl Fn(&[f32], &mut [u32], &mut [f32]),
    ) -> Option<Peak> {
        let n = self.low.len();
        self.at_starts.resize(n);
        let AtStarts { count, chance, cell, evidence: nats, score } = &mut self.at_starts;
        let (count, chance, nats, score) =
            (&mut count[..n], &mut chance[..n], &mut nats[..n], &mut score[..n]);
        // A vector of starts at a time is compared with every interval.
        let (starts, counts) = (self.low.as_chunks::<LANES>().0, count.as_chunks_mut::<LANES>().0);
        for (starts, counts) in starts.iter().zip(counts) {
            let mut sums = [self.everywhere; LANES];
            for (low, high) in self.low.iter().zip(&self.high) {
                for lane in 0..LANES {
                    sums[lane] += u32::from((*low <= starts[lane]) & (starts[lane] <= *high));
                }
            }
            *counts = sums;
        }
        chance.fill(0.0);
        chances(&self.low, cell, chance);
        for i in 0..n {
            let p = chance[i].min(MOST_CHANCE);
            nats[i] = evidence(count[i] as i32 as f32, k as f32, p);
            score[i] = nats[i] + ln(p);
        }
        let mut best: Option<usize> = None;
        for (i, start) in self.low.iter().enumerate() {
            if *start < f32::INFINITY && best.is_none_or(|best| score[i] > score[best]) {
                best = Some(i);
            }
        }
        best.map(|i| Peak { t: self.low[i], evidence: nats[i], score: score[i] })
    }
}

impl AtStarts {
    #[inline(always)]
    fn resize(&mut self, n: usize) {
        self.count.resize(n, 0);
        self.cell.resize(n, 0);
        for column in [&mut self.chance, &mut self.evidence, &mut self.score] {
            column.resize(n, 0.0);
        }
    }
}
