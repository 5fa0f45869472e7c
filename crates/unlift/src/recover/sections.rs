//! Where listed records pass a feasible line: the common currency of all one-unknown families.
//!
//! Along `x(t)` the squared distance to record `j` is `miss2[j] + bend[j] (t - at[j])^2`: `at` is
//! the parameter of the closest approach, `miss2` the squared distance there, `bend` the squared
//! sine of the angle between the lines (1 when the record is seen square on, 0 when it agrees with
//! every `t` alike, as a parallel axis of a candidate does). Within `delta` of a
//! record is therefore an interval of `t`.

use super::chance::Chance;

/// Sections of one list of records with one feasible line, in columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sections {
    pub(crate) at: Vec<f32>,
    pub(crate) miss2: Vec<f32>,
    pub(crate) bend: Vec<f32>,
}

/// `miss2` of a record that says nothing here (parallel, same center, behind it).
pub(crate) const NO_VOTE: f32 = f32::INFINITY;

/// Columns are padded to a multiple of this many entries that do not vote, so that every loop runs
/// over whole vectors, with the same order of additions whatever the machine.
pub(crate) const LANES: usize = 8;

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

/// Intervals of `t` within delta of each record; empty ones have `low > high`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Intervals {
    pub(crate) low: Vec<f32>,
    pub(crate) high: Vec<f32>,
}

impl Intervals {
    /// The intervals of `sections` at `delta`, as far as they lie above `floor`.
    #[inline(always)]
    pub(crate) fn fill(&mut self, sections: &Sections, delta2: f32, floor: f32) {
        let n = sections.len();
        self.low.resize(n, f32::INFINITY);
        self.high.resize(n, f32::NEG_INFINITY);
        let (at, miss2, bend) = (&sections.at[..n], &sections.miss2[..n], &sections.bend[..n]);
        let (low, high) = (&mut self.low[..n], &mut self.high[..n]);
        for j in 0..n {
            let room = delta2 - miss2[j];
            let half = (room.max(0.0) / bend[j]).sqrt();
            let end = at[j] + half;
            let empty = (room < 0.0) | (end < floor);
            low[j] = if empty { f32::INFINITY } else { (at[j] - half).max(floor) };
            high[j] = if empty { f32::NEG_INFINITY } else { end };
        }
    }

    /// How many of the intervals `from..to` contain `t`; both are multiples of [`LANES`].
    #[inline(always)]
    pub(crate) fn count(&self, from: usize, to: usize, t: f32) -> u32 {
        let mut lanes = [0u32; LANES];
        let (low, _) = self.low[from..to].as_chunks::<LANES>();
        let (high, _) = self.high[from..to].as_chunks::<LANES>();
        for (low, high) in low.iter().zip(high) {
            for lane in 0..LANES {
                lanes[lane] += u32::from((low[lane] <= t) & (t <= high[lane]));
            }
        }
        lanes.iter().sum()
    }
}

/// A position along a feasible line and why it was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    /// The position.
    pub(crate) t: f32,
    /// Listed records within delta of it.
    pub(crate) count: u32,
    /// Improbability of that by chance, in nats.
    pub(crate) evidence: f32,
    /// Evidence and prior: what is maximized.
    pub(crate) score: f32,
}

/// Null records counted before a start that cannot win any more is given up.
const NULL_BLOCK: usize = 64;

/// Starts of listed intervals in order of how many listed intervals contain them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Starts {
    /// Votes and (inverted) index of the interval in one integer: sorts by votes, then index.
    order: Vec<u64>,
}

impl Starts {
    /// The start of a listed interval that maximizes evidence plus prior. The number of agreeing
    /// records changes only at interval ends and is largest at some start, so no position has more
    /// votes than the starts looked at.
    ///
    /// `k` listed records could vote. Ties are won by more votes, then by the lower record.
    #[inline(always)]
    pub(crate) fn best(
        &mut self,
        listed: &Intervals,
        null: &Intervals,
        k: usize,
        chance: &Chance,
    ) -> Option<Peak> {
        let n = listed.low.len();
        self.order.clear();
        for (j, &t) in listed.low.iter().enumerate() {
            if t.is_finite() {
                self.order.push(u64::from(listed.count(0, n, t)) << 32 | u64::from(!(j as u32)));
            }
        }
        self.order.sort_unstable();
        let mut best: Option<Peak> = None;
        for &key in self.order.iter().rev() {
            let count = (key >> 32) as u32;
            let t = listed.low[!(key as u32) as usize];
            let mut c = 0;
            let mut from = 0;
            // As more null records agree the score falls, then rises again towards 0 at most: once
            // it is below a best that is above 0, this start cannot win.
            let mut score = chance.score(count as usize, k, c as usize);
            while best.is_none_or(|b| score > b.score || b.score < 0.0) && from < null.low.len() {
                let to = (from + NULL_BLOCK).min(null.low.len());
                c += null.count(from, to, t);
                score = chance.score(count as usize, k, c as usize);
                from = to;
            }
            if best.is_none_or(|b| score > b.score) {
                let evidence = chance.evidence(count as usize, k, c as usize);
                best = Some(Peak { t, count, evidence, score });
            }
        }
        best
    }
}
