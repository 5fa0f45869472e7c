//! The published density attacks, for comparison. They read only the records and use the published constants.
//!
//! One point per line (Chelani et al., CVPR 2021): lines vote at their closest approach, and those near the peaks vote again. Two points
//! per line (Lee et al., CVPR 2023): the two highest peaks. Rays (Moon et al., CVPR 2024): rays of other centers vote once.
//!
//! The published programs use true points and distances. Here votes are measured from the foot, and ranges come from the votes.

use crate::density::Peaks;
use crate::density::feasible::{Feasible, Hides};
use crate::density::peaks::maxima;
use crate::geometry::vector::median;
use crate::parallel;
use crate::recover::map::{LineRow, NO_GROUP, NO_VOTE};
use crate::recover::result::Estimate;
use crate::released::Released;

/// Largest fraction of all lines that votes first: the nearest ones.
const COARSE: f64 = 0.05;
/// Rounds of refinement, each with new voting lines.
const REFINEMENTS: usize = 3;
/// Number of estimates nearest to a line, and of lines nearest to its estimate; lines in both sets vote.
const REFINE: usize = 100;
/// With fewer lines in both sets, all lines of the near estimates vote.
const FEWEST: usize = 10;
/// Largest number of lines that vote, spread evenly over the file: all pairs of a larger map would be too many.
const MAX_VOTERS: usize = 100_000;

/// Returns the points that the published attacks find. They support neither planes, nor axis candidates, nor 2D maps.
pub(crate) fn published<const D: usize>(released: &Released<D>) -> Option<Peaks> {
    let feasible = Feasible::new(released).filter(|feasible| feasible.hides != Hides::OnAxis)?;
    let lines: &[LineRow<3>] = &feasible.lines;
    let every = lines.len().div_ceil(MAX_VOTERS);
    let is_paired = feasible.hides == Hides::Two;
    // A vote for paired lines may mean either point.
    let limit = if is_paired { 1000 } else { 500 };
    let k = limit.min((COARSE * lines.len() as f64) as usize).max(2);
    let place = |row: usize| {
        let own = &lines[row];
        let (near, reach) = nearest(k, (lines, row), every, |_, line| section(own, line).1);
        let mut votes = passes(own, near.iter().map(|&at| &lines[at]));
        let one = |votes: &mut [f64]| mode(votes).map(|t| [t; 2]);
        let modes = if is_paired { two_modes(&mut votes) } else { one(&mut votes) };
        (modes.map_or([None; 2], |modes| modes.map(|t| on(own, t))), reach)
    };
    let rows: Vec<([Option<Estimate<3>>; 2], f32)> = parallel::map(lines.len(), place);
    let reaches = rows.iter().map(|row| f64::from(row.1));
    let mut reaches: Vec<f64> = reaches.filter(|reach| reach.is_finite()).collect();
    let resolution = if reaches.is_empty() { 0.0 } else { median(&mut reaches) };
    let per_record = released.slots_per_record();
    let peaks = rows.into_iter().flat_map(|row| row.0.into_iter().take(per_record));
    let mut of: Vec<Option<Estimate<3>>> = peaks.collect();
    if feasible.hides == Hides::One {
        for _ in 0..REFINEMENTS {
            of = refine(lines, &of, every);
        }
    }
    Some(Peaks { of, resolution })
}

/// Refines once: lines vote that pass near the estimate of a line and whose own estimates are near that line. Every `every`-th line votes.
fn refine(
    lines: &[LineRow<3>],
    estimates: &[Option<Estimate<3>>],
    every: usize,
) -> Vec<Option<Estimate<3>>> {
    let distance2 = |line: &LineRow<3>, x: [f32; 3]| line.distance2(&x, line.along(&x));
    let step = |row: usize| {
        let estimate = estimates[row]?;
        let nearest = |squared: &dyn Fn(usize, &LineRow<3>) -> f32| {
            nearest(REFINE, (lines, row), every, squared).0
        };
        let near = nearest(&|at, _| {
            estimates[at].map_or(f32::NAN, |other| distance2(&lines[row], other.position))
        });
        let mut passing = nearest(&|_, line| distance2(line, estimate.position));
        passing.sort_unstable();
        let passes_too = |at: &usize| passing.binary_search(at).is_ok();
        let both: Vec<usize> = near.iter().copied().filter(passes_too).collect();
        let chosen = if both.len() > FEWEST { &both } else { &near };
        let mut votes = passes(&lines[row], chosen.iter().map(|&at| &lines[at]));
        mode(&mut votes).and_then(|t| on(&lines[row], t)).or(Some(estimate))
    };
    parallel::map(lines.len(), step)
}

/// Returns the parameters at which `line` is passed most closely by `others`, except parallel ones.
fn passes<'a>(line: &LineRow<3>, others: impl Iterator<Item = &'a LineRow<3>>) -> Vec<f64> {
    let sections = others.map(|passing| section(line, passing));
    let voting = sections.filter(|&(t, miss2, _)| miss2 < NO_VOTE && t > line.floor());
    voting.map(|(t, _, _)| f64::from(t)).collect()
}

/// Returns where two whole lines pass each other, see [`LineRow::section`].
fn section(line: &LineRow<3>, passing: &LineRow<3>) -> (f32, f32, f32) {
    LineRow { group: NO_GROUP, ..*line }.section(passing)
}

/// Returns the `k` voting lines with the smallest finite distances, and the largest of these. `squared` returns the squared distance of a
/// line. Every `every`-th line votes, but no ray of the own center.
fn nearest(
    k: usize,
    (lines, row): (&[LineRow<3>], usize),
    every: usize,
    squared: impl Fn(usize, &LineRow<3>) -> f32,
) -> (Vec<usize>, f32) {
    let key = |(at, line): (usize, &LineRow<3>)| {
        let votes = at != row && line.may_vote_for(&lines[row]);
        let distance = Some(squared(at, line)).filter(|d| votes && d.is_finite())?;
        // Distances are not negative, so their bits sort as they do.
        Some(u64::from(distance.to_bits()) << 32 | at as u64)
    };
    let mut keys: Vec<u64> = lines.iter().enumerate().step_by(every).filter_map(key).collect();
    if keys.len() > k {
        keys.select_nth_unstable(k - 1);
        keys.truncate(k);
    }
    let farthest = |&key: &u64| f32::from_bits((key >> 32) as u32).sqrt();
    let reach = keys.iter().max().map_or(f32::INFINITY, farthest);
    (keys.iter().map(|&key| key as u32 as usize).collect(), reach)
}

fn on(line: &LineRow<3>, t: f64) -> Option<Estimate<3>> {
    let position = line.at(t as f32);
    let finite = position.iter().all(|x: &f32| x.is_finite());
    finite.then(|| Estimate::at(position, 0, 0, 0.0))
}

// Peaks of the votes along a line: rules and constants of the published programs.

/// Votes dropped at either end.
const CUT: usize = 5;
/// Bins of the histogram of votes.
const BINS: usize = 500;
/// The peak begins within this fraction of the range.
const BEGINS_WITHIN: f64 = 0.9;
/// Narrowing continues while votes differ from uniform ones by more than this (Kuiper's statistic) and more than [`CUT`] are left.
const EVEN: f64 = 0.3;

/// Returns the middle of the peak of `votes` (reordered): repeatedly, the interval where they rise most above uniform ones.
fn mode(votes: &mut [f64]) -> Option<f64> {
    votes.sort_unstable_by(f64::total_cmp);
    let all: &[f64] = votes;
    let mut left = if all.len() > 2 * CUT { &all[CUT..all.len() - CUT] } else { all };
    while left.len() > CUT {
        let (low, width) = (left[0], (left[left.len() - 1] - left[0]) / BINS as f64);
        if width <= 0.0 {
            break;
        }
        let mut counts = [0usize; BINS];
        for &vote in left {
            counts[(((vote - low) / width) as usize).min(BINS - 1)] += 1;
        }
        let mut excess = [0.0; BINS];
        let mut sum = 0;
        for bin in 0..BINS {
            sum += counts[bin];
            excess[bin] = sum as f64 / left.len() as f64 - (bin + 1) as f64 / BINS as f64;
        }
        let most_begin = (BEGINS_WITHIN * BINS as f64) as usize;
        let begin = first_extreme(&excess[..most_begin], |a, b| a < b);
        let end = begin + first_extreme(&excess[begin..], |a, b| a > b);
        let kuiper = excess[end] - excess[begin];
        let edge = |bin: usize| low + (bin + 1) as f64 * width;
        let inside = left.partition_point(|&vote| vote <= edge(begin))
            ..left.partition_point(|&vote| vote < edge(end));
        // The interval no longer shrinks.
        if inside.len() == left.len() {
            break;
        }
        left = left.get(inside).unwrap_or(&[]);
        if kuiper <= EVEN {
            break;
        }
    }
    let middle = if left.is_empty() { all } else { left };
    middle.get(middle.len().saturating_sub(1) / 2).copied()
}

fn first_extreme(values: &[f64], beats: impl Fn(f64, f64) -> bool) -> usize {
    (1..values.len()).fold(0, |best, at| if beats(values[at], values[best]) { at } else { best })
}

/// Standard deviation of the kernel, in standard deviations of the votes.
const BANDWIDTH: f64 = 0.07;
/// Places at which the density is evaluated. The published number is 10,000; the kernel spans many of these.
const PLACES: usize = 1024;
/// Fraction of the votes dropped at either end, because nearly parallel lines vote anywhere.
const TRIMMED: f64 = 0.01;

/// Returns the two highest peaks of the density of `votes` (which are reordered), ascending, by Lee et al.; `None` without votes.
fn two_modes(votes: &mut [f64]) -> Option<[f64; 2]> {
    votes.sort_unstable_by(f64::total_cmp);
    let cut = (TRIMMED * votes.len() as f64).ceil() as usize;
    let kept = votes.get(cut..votes.len().saturating_sub(cut)).filter(|kept| !kept.is_empty());
    let kept = kept.unwrap_or(votes);
    let (&low, &high) = (kept.first()?, kept.last()?);
    let n = kept.len() as f64;
    let mean = kept.iter().sum::<f64>() / n;
    let deviation = (kept.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt();
    let step = (high - low) / PLACES as f64;
    if step <= 0.0 || deviation <= 0.0 {
        return Some([mean; 2]);
    }
    let mut counts = vec![0.0f64; PLACES];
    for &vote in kept {
        counts[(((vote - low) / step) as usize).min(PLACES - 1)] += 1.0;
    }
    let sigma = BANDWIDTH * deviation / step;
    let reach = (4.0 * sigma).ceil() as usize;
    let kernel: Vec<f64> =
        (0..=reach).map(|x| libm::exp(-0.5 * (x as f64 / sigma) * (x as f64 / sigma))).collect();
    let mut density = vec![0.0f64; PLACES];
    for (at, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0.0) {
        for place in at.saturating_sub(reach)..(at + reach + 1).min(PLACES) {
            density[place] += count * kernel[place.abs_diff(at)];
        }
    }
    let mut peaks: Vec<usize> = maxima(&density).collect();
    peaks.sort_by(|&a, &b| density[b].total_cmp(&density[a]));
    let place = |at: usize| low + (at as f64 + 0.5) * step;
    let (&first, second) = (peaks.first()?, peaks.get(1).or(peaks.first())?);
    let pair = [place(first), place(*second)];
    Some([pair[0].min(pair[1]), pair[0].max(pair[1])])
}
