//! Lines and rays as rows of one table, their sections with a feasible line, and the evidence of agreement.

use crate::RecordId;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{along, widen};
use crate::released::{Obfuscation, Released};

/// A line or ray. A row is half a cache line, so that a neighbor costs one memory access.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct LineRow<const D: usize> {
    /// A point of the line: its foot, the entry into known bounds, or the center of a ray.
    pub(crate) through: [f32; D],
    /// Unit direction; rays extend in this direction.
    pub(crate) direction: [f32; D],
    /// The center of a ray, or [`NO_GROUP`].
    pub(crate) group: u32,
    /// Parameter where the row ends: infinite without known bounds.
    pub(crate) to: f32,
}

/// The group of lines, which may all vote for each other.
pub(crate) const NO_GROUP: u32 = u32::MAX;

/// Lines with a smaller squared sine are parallel, so that they give no position along each other.
const PARALLEL: f32 = 1e-6;

/// Converts lines or rays to rows; no rows for other families. `bounds`, relative to the released origin, cut lines to chords that start
/// where the line enters. Rays end at the region of their center or else at `bounds`, where these are known.
pub(crate) fn rows_of<const D: usize>(
    released: &Released<D>,
    bounds: Option<&Bounds<D>>,
) -> Vec<LineRow<D>> {
    match released.obfuscation() {
        Obfuscation::Lines(lines) => {
            let row = |(foot, &direction): (&[f32; D], &[f32; D])| {
                let (at, toward) = (widen(foot), widen(&direction));
                let clip = |(from, to): (f64, f64)| {
                    (along(&at, from, &toward).map(|x| x as f32), (to - from) as f32)
                };
                let chord = bounds.and_then(|bounds| bounds.clip(&at, &toward)).map(clip);
                let (through, to) = chord.unwrap_or((*foot, f32::INFINITY));
                LineRow { through, direction, group: NO_GROUP, to }
            };
            lines.foot().iter().zip(lines.direction()).map(row).collect()
        }
        Obfuscation::Rays(rays) => {
            let row = |(&center, &direction): (&u8, &[f32; D])| {
                let through = rays.centers()[usize::from(center)];
                let region = rays.regions().map(|regions| &regions[usize::from(center)]);
                let clip = |region: &Bounds<D>| region.clip(&widen(&through), &widen(&direction));
                // A ray that leaves its region at once is an error of the file; it is not cut.
                let to = region.or(bounds).and_then(clip).map(|(_, to)| to as f32);
                let to = to.filter(|&to| to > 0.0).unwrap_or(f32::INFINITY);
                LineRow { through, direction, group: u32::from(center), to }
            };
            rays.center().iter().zip(rays.direction()).map(row).collect()
        }
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => Vec::new(),
    }
}

impl<const D: usize> LineRow<D> {
    #[inline(always)]
    pub(crate) fn is_ray(&self) -> bool {
        self.group != NO_GROUP
    }

    /// Whether this record is evidence for a point on `own`: rays of one center always meet there.
    #[inline(always)]
    pub(crate) fn may_vote_for(&self, own: &Self) -> bool {
        !own.is_ray() || self.group != own.group
    }

    /// Returns the parameter where the row begins: 0 for rays and chords.
    #[inline(always)]
    pub(crate) fn floor(&self) -> f32 {
        if self.group == NO_GROUP && self.to == f32::INFINITY { f32::NEG_INFINITY } else { 0.0 }
    }

    /// Returns the parameter of the row nearest to `t`.
    #[inline(always)]
    pub(crate) fn clamp(&self, t: f32) -> f32 {
        t.max(self.floor()).min(self.to)
    }

    /// Returns the point of this line nearest to another `row`; `None` if they are parallel or the point is not on this one.
    pub(crate) fn crossing(&self, row: &Self) -> Option<[f32; D]> {
        let (t, miss2, _) = self.section(row);
        (miss2 < NO_VOTE && t >= self.floor() && t <= self.to).then(|| self.at(t))
    }

    /// Returns where another row passes nearest (parameter), its squared distance there, and the squared sine of the angle.
    ///
    /// Let `v` and `u` be the components of `self.through - through` and `self.direction` perpendicular to the record. Then the squared
    /// distance is `|v + t u|^2`. It is no difference of large squares, so `f32` suffices far from the origin.
    #[inline(always)]
    pub(crate) fn section(&self, row: &Self) -> (f32, f32, f32) {
        let Self { through, direction, group, .. } = *row;
        let (mut w_e, mut d_e) = (0.0, 0.0);
        for c in 0..D {
            w_e += (self.through[c] - through[c]) * direction[c];
            d_e += self.direction[c] * direction[c];
        }
        let v = |c: usize| self.through[c] - through[c] - w_e * direction[c];
        let u = |c: usize| self.direction[c] - d_e * direction[c];
        let (mut v_u, mut u_u) = (0.0, 0.0);
        for c in 0..D {
            v_u += v(c) * u(c);
            u_u += u(c) * u(c);
        }
        let parallel = u_u < PARALLEL;
        let t = if parallel { 0.0 } else { -v_u / u_u };
        let mut miss = 0.0;
        for c in 0..D {
            let m = v(c) + t * u(c);
            miss += m * m;
        }
        // Rays of one center always meet there; a closest approach behind a center does not count.
        let behind = self.is_ray() & ((group == self.group) | (w_e + t * d_e <= 0.0));
        let miss2 = if parallel | behind { NO_VOTE } else { miss };
        (t, miss2, if parallel { 1.0 } else { u_u })
    }

    /// Returns the parameter at which the whole line of this row passes closest to `x`.
    #[inline(always)]
    pub(crate) fn along(&self, x: &[f32; D]) -> f32 {
        (0..D).map(|c| (x[c] - self.through[c]) * self.direction[c]).sum()
    }

    /// Returns the squared distance from `x` to the point at `t`, without a difference of large squares.
    #[inline(always)]
    pub(crate) fn distance2(&self, x: &[f32; D], t: f32) -> f32 {
        let across = |c: usize| x[c] - self.through[c] - t * self.direction[c];
        (0..D).map(|c| across(c) * across(c)).sum()
    }

    #[inline(always)]
    pub(crate) fn at(&self, t: f32) -> [f32; D] {
        std::array::from_fn(|c| self.through[c] + t * self.direction[c])
    }
}

/// Points or directions in columns, one per coordinate, so that loops run over whole vectors.
pub(crate) struct Columns<const D: usize>(pub(crate) [Vec<f32>; D]);

impl<const D: usize> Default for Columns<D> {
    fn default() -> Self {
        Self(std::array::from_fn(|_| Vec::new()))
    }
}

impl<const D: usize> Columns<D> {
    /// Resizes to `n` rows; new ones are `x` in each coordinate.
    #[inline(always)]
    pub(crate) fn resize(&mut self, n: usize, x: f32) {
        self.0.iter_mut().for_each(|column| column.resize(n, x));
    }

    #[inline(always)]
    pub(crate) fn fill<T>(&mut self, items: &[T], row: impl Fn(&T) -> [f32; D]) {
        self.resize(items.len(), 0.0);
        let mut columns = self.0.each_mut().map(|column| &mut column[..items.len()]);
        for (j, item) in items.iter().enumerate() {
            columns.iter_mut().zip(row(item)).for_each(|(column, x)| column[j] = x);
        }
    }

    #[inline(always)]
    pub(crate) fn first(&self, n: usize) -> [&[f32]; D] {
        std::array::from_fn(|c| &self.0[c][..n])
    }
}

#[derive(Default)]
pub(crate) struct LineColumns<const D: usize> {
    through: Columns<D>,
    direction: Columns<D>,
    group: Vec<u32>,
}

impl<const D: usize> LineColumns<D> {
    /// Computes the sections of the rows of `records` with `own`. Returns how many of them may vote, see [`LineRow::may_vote_for`].
    #[inline(always)]
    pub(crate) fn sections(
        &mut self,
        rows: &[LineRow<D>],
        records: &[RecordId],
        own: &LineRow<D>,
        out: &mut Sections,
    ) -> usize {
        self.through.fill(records, |record| rows[record.index()].through);
        self.direction.fill(records, |record| rows[record.index()].direction);
        self.group.clear();
        self.group.extend(records.iter().map(|record| rows[record.index()].group));
        let n = self.group.len();
        out.resize(n);
        let (through, direction) = (self.through.first(n), self.direction.first(n));
        let group = &self.group[..n];
        let (at, miss2, bend) = (&mut out.at[..n], &mut out.miss2[..n], &mut out.bend[..n]);
        for j in 0..n {
            let through = std::array::from_fn(|c| through[c][j]);
            let direction = std::array::from_fn(|c| direction[c][j]);
            let row = LineRow { through, direction, group: group[j], to: f32::INFINITY };
            (at[j], miss2[j], bend[j]) = own.section(&row);
        }
        group.iter().filter(|&&group| !own.is_ray() || group != own.group).count()
    }
}

impl<const D: usize> Columns<D> {
    /// Computes the sections of axis candidates at these points with the line through `own` along `axis`.
    ///
    /// A record has `D` axis lines and counts once, by the nearest. The one along `axis` agrees, within delta, with every `t`, which is
    /// evidence for the axis alone. Of the others, the nearest is free along the coordinate with the largest difference.
    #[inline(always)]
    pub(crate) fn sections(&self, own: &[f32; D], axis: usize, delta2: f32, out: &mut Sections) {
        let n = self.0[0].len();
        out.resize(n);
        let position = self.first(n);
        let along = position[axis];
        let (at, miss2, bend) = (&mut out.at[..n], &mut out.miss2[..n], &mut out.bend[..n]);
        // Factors instead of branches keep the loop in vectors.
        let counts: [f32; D] = std::array::from_fn(|c| if c == axis { 0.0 } else { 1.0 });
        for j in 0..n {
            let (mut sum, mut largest) = (0.0f32, 0.0f32);
            for c in 0..D {
                let d = (position[c][j] - own[c]) * counts[c];
                sum += d * d;
                largest = largest.max(d * d);
            }
            let crossing = (sum - largest).max(0.0);
            let free = if sum <= delta2 { 0.0 } else { 1.0 };
            at[j] = along[j] * free;
            bend[j] = free;
            let miss = crossing + (1.0 - free) * (sum - crossing);
            // On overflow the sum is infinite and the record does not vote.
            let near = (crossing <= delta2) & (sum < f32::INFINITY);
            miss2[j] = if near { miss } else { NO_VOTE };
        }
    }
}

/// Where listed records pass a feasible line, in columns.
///
/// The squared distance from `x(t)` to record `j` is `miss2[j] + bend[j] (t - at[j])^2`, where `bend` is the squared sine of the angle
/// between the lines (0 for a parallel line of an axis candidate). So the places within `delta` of a record form an interval of `t`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sections {
    pub(crate) at: Vec<f32>,
    pub(crate) miss2: Vec<f32>,
    pub(crate) bend: Vec<f32>,
}

/// `miss2` of a record that does not vote: parallel, of the same center, or behind it.
pub(crate) const NO_VOTE: f32 = f32::INFINITY;

impl Sections {
    /// Resizes to `n` sections, all of which must then be written. The padding does not vote.
    #[inline(always)]
    pub(crate) fn resize(&mut self, n: usize) {
        let padded = n.next_multiple_of(LANES);
        let columns = [(&mut self.at, 0.0), (&mut self.miss2, NO_VOTE), (&mut self.bend, 1.0)];
        for (column, padding) in columns {
            column.truncate(n);
            column.resize(padded, padding);
        }
    }

    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.at.len()
    }

    #[inline(always)]
    pub(crate) fn n_voting(&self) -> usize {
        self.miss2.iter().map(|&miss2| usize::from(miss2 < NO_VOTE)).sum()
    }

    #[inline(always)]
    pub(crate) fn squared_distance(&self, j: usize, t: f32) -> f32 {
        let d = t - self.at[j];
        self.miss2[j] + self.bend[j] * d * d
    }

    /// Returns `t` after two least-squares steps, Eq. (4) with squared distances, over the records within delta, and its support.
    #[inline(always)]
    pub(crate) fn refit(&self, t: f32, delta2: f32) -> (f32, u32) {
        // The start of an interval is at distance delta up to rounding, and must count as within.
        let reach = delta2.sqrt() * (1.0 + 5e-5) + 4.0 * f32::EPSILON * t.abs();
        let reach2 = reach * reach;
        let (shift, _) = self.least_squares_step(t, reach2);
        let t = t + shift;
        let (shift, support) = self.least_squares_step(t, reach2);
        (t + shift, support)
    }

    /// Returns the shift of `t` by one least-squares step over the records within `reach2` (squared) of `x(t)`, and their number.
    #[inline(always)]
    fn least_squares_step(&self, t: f32, reach2: f32) -> (f32, u32) {
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

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    pub(crate) t: f32,
    /// Improbability by chance of the agreement, in nats.
    pub(crate) evidence: f32,
    /// Evidence plus prior, which is maximized.
    pub(crate) score: f32,
}

/// Intervals of `t` within delta of each record, in order of record.
#[derive(Clone, Debug, Default)]
pub(crate) struct Intervals {
    low: Vec<f32>,
    high: Vec<f32>,
    /// For the start of each interval: how many intervals contain it, the chance there, its cell of the grid, evidence and score.
    count: Vec<u32>,
    chance: Vec<f32>,
    cell: Vec<u32>,
    evidence: Vec<f32>,
    score: Vec<f32>,
}

impl Intervals {
    /// Computes the intervals of `sections`, cut to `floor..=top`. Returns the number of records within delta for every `t`.
    #[inline(always)]
    fn fill(&mut self, sections: &Sections, (delta2, floor, top): (f32, f32, f32)) -> u32 {
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
        // Every row is written and kept only if it is not empty, without a branch.
        let (mut kept, mut everywhere) = (0, 0);
        for j in 0..n {
            let start = low[j];
            (low[kept], high[kept]) = (start, high[j]);
            kept += usize::from(start.is_finite());
            everywhere += u32::from(start == f32::NEG_INFINITY);
        }
        let padded = kept.next_multiple_of(LANES);
        self.low.truncate(kept);
        self.low.resize(padded, f32::INFINITY);
        self.high.truncate(kept);
        self.high.resize(padded, f32::NEG_INFINITY);
        everywhere
    }

    /// Returns the least probable position by chance among the starts of intervals. `limits` are the squared delta and the range.
    ///
    /// `k` listed records may vote. `chances` gets the starts, a buffer for cells, and a column to which it adds the chance that a random
    /// record passes there. The prior is proportional to that chance. The lower record wins ties.
    #[inline(always)]
    pub(crate) fn peak(
        &mut self,
        sections: &Sections,
        limits: (f32, f32, f32),
        k: usize,
        chances: impl Fn(&[f32], &mut [u32], &mut [f32]),
    ) -> Option<Peak> {
        let everywhere = self.fill(sections, limits);
        let n = self.low.len();
        self.count.resize(n, 0);
        self.cell.resize(n, 0);
        for column in [&mut self.chance, &mut self.evidence, &mut self.score] {
            column.resize(n, 0.0);
        }
        let Self { count, chance, evidence: nats, score, .. } = self;
        let (count, chance, nats, score) =
            (&mut count[..n], &mut chance[..n], &mut nats[..n], &mut score[..n]);
        // A vector of starts at a time is compared with every interval.
        let (starts, counts) = (self.low.as_chunks::<LANES>().0, count.as_chunks_mut::<LANES>().0);
        for (starts, counts) in starts.iter().zip(counts) {
            let mut sums = [everywhere; LANES];
            for (low, high) in self.low.iter().zip(&self.high) {
                for lane in 0..LANES {
                    sums[lane] += u32::from((*low <= starts[lane]) & (starts[lane] <= *high));
                }
            }
            *counts = sums;
        }
        chance.fill(0.0);
        chances(&self.low, &mut self.cell, chance);
        for i in 0..n {
            let p = chance[i].min(MOST_CHANCE);
            nats[i] = evidence(count[i] as i32 as f32, k as f32, p);
            score[i] = nats[i] + ln(p);
        }
        let starts = (0..n).filter(|&i| self.low[i] < f32::INFINITY);
        let best = starts.reduce(|best, i| if score[i] > score[best] { i } else { best })?;
        Some(Peak { t: self.low[best], evidence: nats[best], score: score[best] })
    }
}

/// Upper bound of chance: a density can give values that are no probability.
pub(crate) const MOST_CHANCE: f32 = 0.5;

/// Returns the evidence in nats that `n` of `k` listed records agree where a random one does with probability `p` (in `(0, 1)`): the
/// Chernoff bound `k KL(n/k || p)` on the tail of Bin(k, p), and 0 if `n` is at most the mean by chance.
#[inline(always)]
pub(crate) fn evidence(n: f32, k: f32, p: f32) -> f32 {
    let missed = k - n;
    // `ln(0)` is finite here and is multiplied by 0.
    let evidence = n * (ln(n) - ln(k * p)) + missed * (ln(missed) - ln(k * (1.0 - p)));
    // Just above chance the two terms cancel except for rounding.
    if n <= p * k { 0.0 } else { evidence.max(0.0) }
}

/// Columns are padded to a multiple of this length with entries that do not vote, so that additions have one order on every machine.
pub(crate) const LANES: usize = 8;

pub(crate) type Lanes = [f32; LANES];

/// Returns the logarithm of a positive number, to 2e-6, without branches: the exponent plus a polynomial of the mantissa.
#[inline(always)]
pub(crate) fn ln(y: f32) -> f32 {
    let bits = y.to_bits();
    let exponent = (bits >> 23) as i32 - 127;
    let m = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000) - 1.0;
    // ln(1 + m) on [0, 1), exact at 0, fitted for the least maximum error.
    let p = m * (0.317_648_7 + m * (-0.193_760_2 + m * (0.085_569_24 - m * 0.018_338_63)));
    exponent as f32 * std::f32::consts::LN_2 + m * (0.999_901_65 + m * (-0.497_875 + p))
}

/// Buffers of one thread, for the records that a slot lists.
#[derive(Default)]
pub(crate) struct Scratch<const D: usize> {
    pub(crate) lines: LineColumns<D>,
    pub(crate) candidates: Columns<D>,
    pub(crate) sections: Sections,
    pub(crate) intervals: Intervals,
    /// Indices of the sections that vote.
    pub(crate) voting: Vec<usize>,
    /// Listed planes by axis, as (offset, record).
    pub(crate) by_axis: Vec<Vec<(f32, RecordId)>>,
}
