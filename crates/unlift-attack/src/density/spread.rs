//! Expectation maximization on one grid.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use super::feasible::{Feasible, Hides};
use crate::parallel;
use crate::recover::map::{Grid, LineRow, rows_mut};

/// Rounds on each grid. From 4 to 20 rounds, recovered fractions on procedural rooms change by less than half a point.
const ROUNDS: usize = 4;
/// Least density that a record sees after its own part is subtracted, as a fraction of the density.
const LEAST_OTHERS: f32 = 1e-4;

pub(super) struct Spread<'a> {
    pub(super) feasible: &'a Feasible,
    pub(super) grid: Grid<3>,
    /// For rays, the density from rays of other centers, per center; else empty.
    others: Vec<Grid<3>>,
    pub(super) spans: Vec<Range<i32>>,
    /// Start of the weights of each record, and the end of the last.
    offsets: Vec<usize>,
    /// Weight of the record's point per sample, line after line; 0 at first.
    weights: Vec<f32>,
}

impl<'a> Spread<'a> {
    pub(super) fn new(feasible: &'a Feasible, grid: Grid<3>) -> Self {
        let spans: Vec<Range<i32>> =
            parallel::map(feasible.lines.len(), |at| grid.span(&feasible.lines[at]));
        let (mut offsets, mut n_samples) = (vec![0], 0);
        for spans in spans.chunks(feasible.per_record) {
            n_samples += spans.iter().map(|span| span.len()).sum::<usize>();
            offsets.push(n_samples);
        }
        Self { feasible, grid, others: Vec::new(), spans, offsets, weights: vec![0.0; n_samples] }
    }

    pub(super) fn rounds(&mut self) {
        for _ in 0..ROUNDS {
            self.expect();
            self.maximize();
        }
    }

    pub(super) fn weights_of(&self, record: usize) -> &[f32] {
        &self.weights[self.offsets[record]..self.offsets[record + 1]]
    }

    /// Computes into `out` the likelihood of each sample of `record`, for one of its points, at the density of other records' points.
    pub(super) fn view(&self, record: usize, own: &[f32], out: &mut Vec<f32>) {
        let per_record = self.feasible.per_record;
        let subtracts = self.others.is_empty();
        out.clear();
        for at in record * per_record..(record + 1) * per_record {
            let (line, span) = (&self.feasible.lines[at], self.spans[at].clone());
            let grid = self.others.get(line.group as usize).unwrap_or(&self.grid);
            let prior = self.feasible.prior.get(at).copied().unwrap_or(1.0);
            let own = &own[out.len()..out.len() + span.len()];
            let kernel = self_kernel(line);
            out.extend(span.enumerate().map(|(at, k)| {
                let Some(voxel) = grid.voxel(line, k) else { return 0.0 };
                let all = grid.values[voxel];
                let mine = if subtracts { convolve(own, at, &kernel) } else { 0.0 };
                let others = (all - mine).max(all * LEAST_OTHERS) * prior;
                let t = (k as f32 + 0.5) * grid.cell;
                if line.is_ray() { others * t * t } else { others }
            }));
        }
    }

    /// Expectation: computes the weights from the density.
    fn expect(&mut self) {
        let mut weights = std::mem::take(&mut self.weights);
        let mut rows = rows_mut(&mut weights, &self.offsets);
        let this = &*self;
        parallel::for_each_mut(&mut rows, Vec::new, |view, record, row| {
            this.view(record, row, view);
            let mut points = 1.0;
            if this.feasible.hides == Hides::Two {
                this.pair_up(record, view);
                points = 2.0;
            }
            let total: f64 = view.iter().map(|&x| f64::from(x)).sum();
            let factor = if total > 0.0 { (points / total) as f32 } else { 0.0 };
            for (weight, &likelihood) in row.iter_mut().zip(view.iter()) {
                *weight = likelihood * factor;
            }
        });
        self.weights = weights;
    }

    /// Turns the likelihood of one point into that of one of two: a pair at distance `d` is `d^2` times as probable.
    fn pair_up(&self, record: usize, view: &mut [f32]) {
        let first = self.spans[record].start;
        // Relative to the middle of the span, to avoid a difference of large squares.
        let middle = f64::from(first) + 0.5 * view.len() as f64;
        let place = |at: usize| f64::from(first) + at as f64 + 0.5 - middle;
        let mut moments = [0.0f64; 3];
        for (at, &x) in view.iter().enumerate() {
            let (x, t) = (f64::from(x), place(at));
            moments[0] += x;
            moments[1] += x * t;
            moments[2] += x * t * t;
        }
        for (at, x) in view.iter_mut().enumerate() {
            let t = place(at);
            let other = moments[2] - 2.0 * t * moments[1] + t * t * moments[0];
            *x *= other.max(0.0) as f32;
        }
    }

    /// Maximization: computes the density from the weights.
    fn maximize(&mut self) {
        self.others.clear();
        let of_group = |group| self.deposit(|line| line.group == group as u32);
        let mut sums: Vec<Vec<u32>> = (0..self.feasible.n_groups).map(of_group).collect();
        let all = if sums.is_empty() { self.deposit(|_| true) } else { of_others(&mut sums) };
        self.grid.values = Vec::new();
        let density = |sums: Vec<u32>| {
            let mut grid = self.grid.clone();
            grid.values = sums.into_iter().map(|sum| sum as f32 / QUANTA).collect();
            grid.smooth(1);
            grid
        };
        self.others = sums.into_iter().map(density).collect();
        self.grid = density(all);
    }

    /// Sums the weights of the lines that `admit` accepts, per voxel. Sums of integers depend neither on threads nor on order.
    fn deposit(&self, admit: impl Fn(&LineRow<3>) -> bool + Sync) -> Vec<u32> {
        let (grid, per_record) = (&self.grid, self.feasible.per_record);
        let sums: Vec<AtomicU32> = grid.values.iter().map(|_| AtomicU32::new(0)).collect();
        parallel::for_each(self.feasible.n_records(), &|record| {
            let mut weights = self.weights_of(record);
            for at in record * per_record..(record + 1) * per_record {
                let (line, span) = (&self.feasible.lines[at], self.spans[at].clone());
                let (own, rest) = weights.split_at(span.len());
                weights = rest;
                if !admit(line) {
                    continue;
                }
                for (k, weight) in span.zip(own) {
                    let quantum = (weight * QUANTA + 0.5) as u32;
                    if quantum > 0
                        && let Some(voxel) = grid.voxel(line, k)
                    {
                        let add = |sum: u32| Some(sum.saturating_add(quantum));
                        let _ = sums[voxel].fetch_update(Ordering::Relaxed, Ordering::Relaxed, add);
                    }
                }
            }
        });
        sums.into_iter().map(AtomicU32::into_inner).collect()
    }
}

/// Units of weight per point in sums. A voxel holds up to 4,096 points; larger sums saturate.
const QUANTA: f32 = 1_048_576.0;

/// Replaces the sums of each group by those of all other groups, and returns those of all groups.
fn of_others(groups: &mut [Vec<u32>]) -> Vec<u32> {
    let saturated = |sum: u64| sum.min(u64::from(u32::MAX)) as u32;
    let n_voxels = groups[0].len();
    let of_voxel = |voxel: usize| {
        let total: u64 = groups.iter().map(|sums| u64::from(sums[voxel])).sum();
        for sums in groups.iter_mut() {
            sums[voxel] = saturated(total - u64::from(sums[voxel]));
        }
        saturated(total)
    };
    (0..n_voxels).map(of_voxel).collect()
}

/// Returns the fraction of a sample's weight that smoothing leaves at the sample, and at samples one and two steps away on the line.
fn self_kernel(line: &LineRow<3>) -> [f32; 3] {
    // Linear between the taps of the binomial kernel, as for a shift by a part of a voxel.
    let tap = |x: f32| {
        let (x, here, next) = (x.abs(), 0.5, 0.25);
        if x <= 1.0 { here + x * (next - here) } else { next * (2.0 - x).max(0.0) }
    };
    [0.0, 1.0, 2.0].map(|steps| line.direction.iter().map(|d| tap(steps * d)).product())
}

#[inline(always)]
fn convolve(weights: &[f32], at: usize, kernel: &[f32; 3]) -> f32 {
    let mut sum = kernel[0] * weights[at];
    for steps in 1..=2 {
        let before = if at >= steps { weights[at - steps] } else { 0.0 };
        let after = weights.get(at + steps).copied().unwrap_or(0.0);
        sum += kernel[steps] * (before + after);
    }
    sum
}

// Samples of the density along lines, and other boxes of it.

impl Grid<3> {
    /// Returns the steps of `line` in the box. Step `k` is at parameter `(k + 1/2) cell`. A few at its ends may lie just outside.
    pub(super) fn span(&self, line: &LineRow<3>) -> Range<i32> {
        let (from, to) = self.clip(line).unwrap_or_default();
        // Farther away, parameters of neighboring steps are equal.
        let far = (1 << 22) as f32 * self.cell;
        if !(from < to && from.abs() < far && to.abs() < far) {
            return 0..0;
        }
        let first = (from / self.cell - 0.5).ceil() as i32;
        first..((to / self.cell - 0.5).floor() as i32 + 1).max(first)
    }

    /// Returns the voxel of step `k` of `line`; `None` outside the box.
    #[inline(always)]
    pub(super) fn voxel(&self, line: &LineRow<3>, k: i32) -> Option<usize> {
        let t = (k as f32 + 0.5) * self.cell;
        let x: [f32; 3] = std::array::from_fn(|c| {
            (line.through[c] + t * line.direction[c] - self.low[c]) / self.cell
        });
        let at = x.map(|x| x as usize);
        if !(0..3).all(|c| x[c] >= 0.0 && at[c] < self.dims[c]) {
            return None;
        }
        Some((at[0] * self.dims[1] + at[1]) * self.dims[2] + at[2])
    }

    /// Returns the density in another box, linearly interpolated, up to a common factor.
    pub(super) fn resampled(&self, low: [f32; 3], cell: f32, dims: [usize; 3]) -> Self {
        let mut finer = Self::even(low, cell, dims, 0.0);
        // Per axis and voxel: the lower of the two coarse voxels, and the weight of the upper one.
        let places: [Vec<(usize, f32)>; 3] = std::array::from_fn(|c| {
            let place = |i: usize| self.lower(c, low[c] + (i as f32 + 0.5) * cell);
            (0..dims[c]).map(place).collect()
        });
        let mut rows: Vec<&mut [f32]> = finer.values.chunks_mut(dims[2]).collect();
        parallel::for_each_mut(
            &mut rows,
            || (),
            |(), row, out| {
                let [x, y] = [places[0][row / dims[1]], places[1][row % dims[1]]];
                for (out, &z) in out.iter_mut().zip(&places[2]) {
                    for corner in 0..8 {
                        let (at, share) = self.corner(corner, &[x, y, z], 1.0);
                        *out += share * self.values[at];
                    }
                }
            },
        );
        finer
    }

    /// Returns the box that leaves the fraction `q` of the mass beyond each wall, extended by a voxel.
    pub(super) fn bounds(&self, q: f64) -> ([f32; 3], [f32; 3]) {
        let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
        let layer = self.dims[1] * self.dims[2];
        for c in 0..3 {
            let mut profile = vec![0.0f64; self.dims[c]];
            for (at, &mass) in self.values.iter().enumerate() {
                let place = [at / layer, at / self.dims[2] % self.dims[1], at % self.dims[2]];
                profile[place[c]] += f64::from(mass);
            }
            let beyond = q * profile.iter().sum::<f64>();
            let below = count_below(profile.iter(), beyond);
            let above = self.dims[c] - count_below(profile.iter().rev(), beyond);
            low[c] = self.low[c] + (below as f32 - 1.0) * self.cell;
            high[c] = self.low[c] + (above.max(below + 1) as f32 + 1.0) * self.cell;
        }
        (low, high)
    }
}

/// Returns how many leading entries have a sum of at most `most`.
fn count_below<'a>(entries: impl Iterator<Item = &'a f64>, most: f64) -> usize {
    let sums = entries.scan(0.0, |sum, mass| {
        *sum += mass;
        Some(*sum)
    });
    sums.take_while(|&sum| sum <= most).count()
}
