//! Voxel parity: if a checkerboard of voxels decides the center of a ray, its point lies in every other voxel along the ray.
//!
//! The edge of a voxel is published, the origin of the grid is not. The right origin (up to whole voxels) is the one for which nearly
//! all estimates lie in voxels of their own center.

use rayon::prelude::*;

use crate::recover::result::{Estimate, Status};
use crate::released::Rays;

/// Origins tried per axis and voxel, at first and in each finer step. Between two of them most voxels keep their parity.
const STARTS: usize = 16;
/// Finer steps, each eight times as fine, over the two intervals around the best origin so far.
const FINER: usize = 4;
/// Sweeps over the axes in each finer step. The second one profits from the other axes.
const SWEEPS: usize = 2;
/// Estimates that are scored: for the thousands of first origins, and for the finer ones.
const SAMPLE: (usize, usize) = (1 << 12, 1 << 15);
/// The grid is accepted if agreeing estimates outnumber disagreeing ones by this fraction of all,
const LEAST: f64 = 0.1;
/// and by this many standard deviations of the score of a wrong grid (the best of all wrong origins reaches 4 or 5).
const SIGMAS: f64 = 8.0;
/// An estimate is moved this far past the wall, in voxels, so that rounding does not put it back.
const INSIDE: f32 = 1e-3;

/// A checkerboard: its origin, and the center of the first voxel.
#[derive(Clone, Copy, Debug)]
struct Checkerboard<const D: usize> {
    start: [f64; D],
    edge: f64,
    first: u8,
}

impl<const D: usize> Checkerboard<D> {
    fn center(&self, x: &[f32; D]) -> u8 {
        self.first ^ u8::from(odd(x, &self.start, self.edge))
    }

    /// Returns the distances along `direction` from `x` to just beyond each wall of the voxel of `x`.
    fn steps_to_walls(&self, x: &[f32; D], direction: &[f32; D]) -> Vec<f32> {
        let mut steps = Vec::with_capacity(2 * D);
        for (c, &along) in direction.iter().enumerate() {
            let cell = (f64::from(x[c]) - self.start[c]) / self.edge;
            for wall in [cell.floor(), cell.floor() + 1.0] {
                let step = ((wall - cell) * self.edge) as f32 / along;
                if step.is_finite() {
                    steps.push(step + (INSIDE * self.edge as f32).copysign(step));
                }
            }
        }
        steps
    }
}

/// Whether the voxel of `x` has odd parity.
#[inline(always)]
fn odd<const D: usize>(x: &[f32; D], start: &[f64; D], edge: f64) -> bool {
    let cell = |c: usize| ((f64::from(x[c]) - start[c]) / edge).floor();
    // The remainder of a float by 2 is exact.
    (0..D).map(cell).sum::<f64>().rem_euclid(2.0) != 0.0
}

/// Moves estimates in voxels of another center along their rays to the nearest voxel of their own.
pub(super) fn settle<const D: usize>(
    rays: &Rays<D>,
    mut estimates: Vec<Estimate<D>>,
) -> Vec<Estimate<D>> {
    let Some(board) = find(rays, &estimates) else {
        return estimates;
    };
    estimates.par_iter_mut().enumerate().for_each(|(i, estimate)| {
        let (own, direction) = (rays.center()[i], &rays.direction()[i]);
        if estimate.status == Status::Ok && board.center(&estimate.position) != own {
            let center = &rays.centers()[usize::from(own)];
            // Every wall along a ray changes the parity, so the nearest wall, before or behind, ends the wrong voxel.
            let t: f32 = (0..D).map(|c| (estimate.position[c] - center[c]) * direction[c]).sum();
            let mut steps = board.steps_to_walls(&estimate.position, direction);
            steps.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
            let ahead = steps.into_iter().filter(|step| t + step > 0.0);
            let at = |step| std::array::from_fn(|c| center[c] + (t + step) * direction[c]);
            if let Some(x) = ahead.map(at).find(|x| board.center(x) == own) {
                estimate.position = x;
            }
        }
    });
    estimates
}

/// Finds the checkerboard that fits the estimates, if there are two centers and the edge is known.
fn find<const D: usize>(rays: &Rays<D>, estimates: &[Estimate<D>]) -> Option<Checkerboard<D>> {
    let edge = rays.voxel()?;
    if rays.centers().len() != 2 {
        return None;
    }
    let rows = estimates.iter().zip(rays.center());
    let known =
        rows.filter(|(e, _)| e.status == Status::Ok).map(|(e, &center)| (e.position, center));
    let known: Vec<([f32; D], u8)> = known.collect();
    let sample = |most: usize| -> Vec<([f32; D], u8)> {
        known.iter().step_by(known.len().div_ceil(most).max(1)).copied().collect()
    };
    let (few, many) = (sample(SAMPLE.0), sample(SAMPLE.1));
    // Origins a whole voxel apart differ only in which center is first.
    let step = edge / STARTS as f64;
    let starts: Vec<[f64; D]> = (0..STARTS.pow(D as u32))
        .map(|at| std::array::from_fn(|c| (at / STARTS.pow(c as u32) % STARTS) as f64 * step))
        .collect();
    let scores: Vec<i64> = starts.par_iter().map(|start| score(&few, start, edge).abs()).collect();
    let best = (0..starts.len()).max_by_key(|&at| (scores[at], std::cmp::Reverse(at)))?;
    let mut start = starts[best];
    let mut width = step;
    for _ in 0..FINER {
        for axis in (0..SWEEPS).flat_map(|_| 0..D) {
            let tried = |at: usize| {
                let mut tried = start;
                tried[axis] += width * (2.0 * at as f64 / STARTS as f64 - 1.0);
                tried
            };
            let of = |at| score(&many, &tried(at), edge).abs();
            let scores: Vec<i64> = (0..=STARTS).into_par_iter().map(of).collect();
            let most = scores.iter().copied().max().unwrap_or(0);
            let first = scores.iter().position(|&s| s == most).unwrap_or(STARTS / 2);
            let last = scores.iter().rposition(|&s| s == most).unwrap_or(STARTS / 2);
            // The middle of equally good origins.
            start = tried((first + last) / 2);
        }
        width *= 2.0 / STARTS as f64;
    }
    let agree = score(&many, &start, edge);
    let n = many.len() as f64;
    let believed = agree.unsigned_abs() as f64 >= (LEAST * n).max(SIGMAS * n.sqrt());
    (believed && !many.is_empty()).then_some(Checkerboard {
        start,
        edge,
        first: u8::from(agree < 0),
    })
}

/// Returns how many more estimates agree with the parity of their center than disagree.
fn score<const D: usize>(of: &[([f32; D], u8)], start: &[f64; D], edge: f64) -> i64 {
    of.iter().map(|(x, center)| if odd(x, start, edge) == (*center == 1) { 1 } else { -1 }).sum()
}

#[cfg(test)]
mod tests {
    use super::score;

    #[test]
    fn a_checkerboard_is_seen_or_its_opposite() {
        let of = [([0.5; 3], 0), ([1.5, 0.5, 0.5], 1), ([1.5, 1.5, 0.5], 0), ([0.5, 0.5, 1.5], 1)];
        assert_eq!(score(&of, &[0.0; 3], 1.0), 4);
        assert_eq!(score(&of, &[1.0, 0.0, 0.0], 1.0), -4);
        assert_eq!(score(&of[..3], &[0.0; 3], 1.0), 3);
        // In one cell, half of these disagree.
        assert_eq!(score(&of, &[0.0; 3], 8.0), 0);
    }
}
