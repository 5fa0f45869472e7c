//! The sampling loop itself: along a line, and on an axis plane.

use crate::recover::map::sections::{NO_VOTE, Sections};
use crate::recover::result::estimate::Status;
use crate::recover::result::trials::MAX_TRIALS;
use crate::seed::Draws;

/// Probability of having drawn a sample free of outliers at which the loop stops.
const CONFIDENCE: f64 = 0.99;

/// Trials after which a sample of `size` among `inliers` of `n` was drawn with [`CONFIDENCE`].
#[inline(always)]
fn trials_needed(inliers: u32, n: u32, size: u32) -> u32 {
    let mut all_inliers = 1.0;
    for drawn in 0..size.min(n) {
        all_inliers *= f64::from(inliers.saturating_sub(drawn)) / f64::from(n - drawn);
    }
    if all_inliers <= 0.0 {
        return MAX_TRIALS;
    }
    let trials = libm::log(1.0 - CONFIDENCE) / libm::log1p(-all_inliers.min(1.0 - 1e-12));
    (trials.ceil() as u32).clamp(1, MAX_TRIALS)
}

/// Votes along one line, without those that say nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct LineLoop {
    votes: Sections,
}

/// Records per sample along a line: twice what fixes a place, as the paper leaves it open.
const LINE_SAMPLE: u32 = 2;

impl LineLoop {
    /// The position with the largest support and that support, after the final least squares;
    /// `None` when no position has any. Also the number of trials.
    #[inline(always)]
    pub(super) fn run(
        &mut self,
        sections: &Sections,
        delta: f32,
        draws: &mut Draws,
    ) -> (Option<(f32, u32)>, u32) {
        let votes = &mut self.votes;
        votes.at.clear();
        votes.miss2.clear();
        votes.bend.clear();
        for j in 0..sections.len() {
            if sections.miss2[j] < NO_VOTE {
                votes.at.push(sections.at[j]);
                votes.miss2.push(sections.miss2[j]);
                votes.bend.push(sections.bend[j]);
            }
        }
        let n = votes.len();
        let delta2 = delta * delta;
        let (mut best_t, mut best) = (0.0, 0);
        let (mut trials, mut needed) = (0, MAX_TRIALS);
        while trials < needed {
            trials += 1;
            let one = draws.below(n as u64) as usize;
            let mut other = draws.below(n as u64 - 1) as usize;
            other += usize::from(other >= one);
            let (a, b) = (votes.bend[one], votes.bend[other]);
            let t = (a * votes.at[one] + b * votes.at[other]) / (a + b);
            let support = count(votes, t, delta2);
            if support > best {
                (best_t, best) = (t, support);
                needed = trials_needed(support, n as u32, LINE_SAMPLE);
            }
        }
        if best == 0 {
            return (None, trials);
        }
        let (mut weight, mut sum) = (0.0f32, 0.0f32);
        for j in 0..n {
            if votes.squared_distance(j, best_t) <= delta2 {
                weight += votes.bend[j];
                sum += votes.bend[j] * (votes.at[j] - best_t);
            }
        }
        (Some((best_t + sum / weight, best)), trials)
    }
}

#[inline(always)]
fn count(votes: &Sections, t: f32, delta2: f32) -> u32 {
    let n = votes.len();
    let (at, miss2, bend) = (&votes.at[..n], &votes.miss2[..n], &votes.bend[..n]);
    let mut support = 0;
    for j in 0..n {
        let d = t - at[j];
        support += u32::from(miss2[j] + bend[j] * d * d <= delta2);
    }
    support
}

/// Votes on the free axes of one plane.
#[derive(Clone, Debug, Default)]
pub(super) struct PlaneLoop {
    /// Offsets by axis.
    offsets: Vec<Vec<f32>>,
}

/// Records per sample and free axis of a plane: the same.
const PLANE_SAMPLE: u32 = 2;

impl PlaneLoop {
    /// Takes the votes of one slot, as (axis, offset).
    #[inline(always)]
    pub(super) fn fill(&mut self, votes: impl Iterator<Item = (u8, f32)>) {
        self.offsets.iter_mut().for_each(Vec::clear);
        for (axis, offset) in votes {
            let axis = usize::from(axis);
            if self.offsets.len() <= axis {
                self.offsets.resize_with(axis + 1, Vec::new);
            }
            self.offsets[axis].push(offset);
        }
    }

    /// Fills the free coordinates of `position`; returns (support, trials).
    ///
    /// # Errors
    /// `Degenerate` when a free axis has no vote.
    #[inline(always)]
    pub(super) fn run<const D: usize>(
        &self,
        position: &mut [f32; D],
        own: usize,
        delta: f32,
        draws: &mut Draws,
    ) -> Result<(u32, u32), Status> {
        let of = |axis: usize| self.offsets.get(axis).map_or(&[][..], Vec::as_slice);
        let free = (0..D).filter(|&axis| axis != own);
        if free.clone().any(|axis| of(axis).is_empty()) {
            return Err(Status::Degenerate);
        }
        let n: u32 = free.clone().map(|axis| of(axis).len() as u32).sum();
        let (mut best_place, mut best) = (*position, 0);
        let (mut trials, mut needed) = (0, MAX_TRIALS);
        while trials < needed {
            trials += 1;
            let mut place = *position;
            for axis in free.clone() {
                let offsets = of(axis);
                let mut draw = || offsets[draws.below(offsets.len() as u64) as usize];
                let sum: f32 = (0..PLANE_SAMPLE).map(|_| draw()).sum();
                place[axis] = sum / PLANE_SAMPLE as f32;
            }
            let support = free.clone().map(|a| count_within(of(a), place[a], delta)).sum();
            if support > best {
                (best_place, best) = (place, support);
                needed = trials_needed(support, n, PLANE_SAMPLE * (D as u32 - 1));
            }
        }
        if best == 0 {
            return Err(Status::NoSupport);
        }
        for axis in free {
            let near = of(axis).iter().filter(|x| (*x - best_place[axis]).abs() <= delta);
            let (sum, count) =
                near.fold((0.0, 0), |(sum, n), x| (sum + (x - best_place[axis]), n + 1));
            position[axis] = best_place[axis] + if count > 0 { sum / count as f32 } else { 0.0 };
        }
        Ok((best, trials))
    }
}

#[inline(always)]
fn count_within(offsets: &[f32], place: f32, delta: f32) -> u32 {
    offsets.iter().map(|x| u32::from((x - place).abs() <= delta)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_follow_the_hypergeometric_law() {
        // All inliers: one trial. 5 of 50, pairs: ln 0.01 / ln(1 - 20/2450) = 562.
        assert_eq!(trials_needed(50, 50, 2), 1);
        assert_eq!(trials_needed(5, 50, 2), 562);
        assert_eq!(trials_needed(1, 50, 2), MAX_TRIALS);
    }
}
