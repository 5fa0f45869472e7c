//! Where votes along a line crowd: rules and constants of the published programs.

/// Votes left out at either end before anything is counted.
const CUT: usize = 5;
/// Bins of the histogram of votes.
const BINS: usize = 500;
/// The crowd begins within this share of the range.
const BEGINS_WITHIN: f64 = 0.9;
/// A crowd is narrowed down while the votes differ from even ones by more than this (Kuiper's
/// statistic), and while more than [`CUT`] are left.
const EVEN: f64 = 0.3;

/// The middle of the crowd that `votes` (reordered) form, by Chelani et al.: where the cumulative votes
/// rise most above even ones, again and again. `None` without votes.
pub(super) fn crowd(votes: &mut [f64]) -> Option<f64> {
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
        // Nothing left out means nothing more to narrow down.
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
    let mut found = 0;
    for (at, &value) in values.iter().enumerate() {
        if beats(value, values[found]) {
            found = at;
        }
    }
    found
}

/// The kernel's standard deviation, in standard deviations of the votes.
const BANDWIDTH: f64 = 0.07;
/// Places at which the density of votes is evaluated. (10,000 as published; the kernel spans many of these.)
const PLACES: usize = 1024;
/// Share of the votes left out at either end: lines nearly parallel vote anywhere. (The published range
/// comes from distances between true points.)
const FAR: f64 = 0.01;

/// The two highest peaks of the density of `votes` (reordered), in ascending order, by Lee et al.; twice
/// the same if there is one peak. `None` without votes.
pub(super) fn two_crowds(votes: &mut [f64]) -> Option<[f64; 2]> {
    votes.sort_unstable_by(f64::total_cmp);
    let cut = (FAR * votes.len() as f64).ceil() as usize;
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
    let height = |at: Option<usize>| at.and_then(|at| density.get(at)).copied().unwrap_or(0.0);
    let mut peaks: Vec<usize> = (0..PLACES)
        .filter(|&at| {
            density[at] > height(at.checked_sub(1)) && density[at] >= height(Some(at + 1))
        })
        .collect();
    peaks.sort_by(|&a, &b| density[b].total_cmp(&density[a]));
    let place = |at: usize| low + (at as f64 + 0.5) * step;
    let (&first, second) = (peaks.first()?, peaks.get(1).or(peaks.first())?);
    let pair = [place(first), place(*second)];
    Some([pair[0].min(pair[1]), pair[0].max(pair[1])])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Draws, Stage};

    fn votes(crowds: &[(f64, usize)], strays: usize) -> Vec<f64> {
        let mut draws = Draws::new(8, Stage::Synthetic, 0);
        let mut votes: Vec<f64> = (0..strays).map(|_| draws.between(-10.0, 10.0)).collect();
        for &(middle, n) in crowds {
            votes.extend((0..n).map(|_| middle + 0.1 * draws.normal()));
        }
        votes
    }

    #[test]
    fn one_crowd_is_found_among_strays() {
        let t = crowd(&mut votes(&[(3.0, 150)], 350)).unwrap();
        assert!((t - 3.0).abs() < 0.1, "{t}");
        assert_eq!(crowd(&mut []), None);
        assert_eq!(crowd(&mut [2.0]), Some(2.0));
        assert_eq!(crowd(&mut [2.0; 40]), Some(2.0));
    }

    #[test]
    fn two_crowds_are_found_among_strays() {
        let [a, b] = two_crowds(&mut votes(&[(4.0, 200), (-2.0, 300)], 500)).unwrap();
        assert!((a + 2.0).abs() < 0.2 && (b - 4.0).abs() < 0.2, "{a} {b}");
        assert_eq!(two_crowds(&mut []), None);
        assert_eq!(two_crowds(&mut [2.0; 9]), Some([2.0; 2]));
    }
}
