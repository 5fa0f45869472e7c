//! The start: ranges from the spread of bearings.
//!
//! Rays of one anchor meet only there, and rays of two anchors not at all, so crossings give no position. Perspective gives a range:
//! neighbors within a distance `s` of a point at range `r` are seen within an angle of `s / r`, that of the least probable window of
//! bearings. `s` is unknown, but among rays of similar bearing those with narrow windows are likely long: ranks give ranges.

use crate::neighbors::Neighborhoods;
use crate::parallel;
use crate::recover::map::{LineRow, evenly, evidence, mixed, sorted};
use crate::recover::result::{Estimate, Status};

/// Only evidence beyond this many times the mean by chance counts, because half of the slots exceed the mean.
const CHANCE: f32 = 2.0;
/// Number of times that scores are averaged with those of neighbors. Each time halves the weight of a slot's own score.
const SMOOTHINGS: usize = 3;
/// On each side, scores are compared with this part of the anchor's rays (a divisor), because density depends on bearing.
const SECTORS: usize = 12;
/// Least number of rays compared on each side, because ranks among fewer are coarse.
const LEAST_SECTOR: usize = 20;

/// A window of bearings around a slot's ray.
#[derive(Clone, Copy, Debug)]
struct Window {
    sine: f32,
    count: u32,
    evidence: f32,
}

pub(in crate::recover) fn solve<const D: usize>(
    rows: &[LineRow<D>],
    lists: &Neighborhoods,
) -> Vec<Estimate<D>> {
    let bearing = |(slot, row): (usize, &LineRow<D>)| (row.group, angle(row), slot as u32);
    let mut bearings: Vec<_> = rows.iter().enumerate().map(bearing).collect();
    bearings.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let n = lists.n_slots();
    let windows: Vec<Option<Window>> =
        parallel::map(n, |slot| window(rows, &bearings, slot, lists));
    // The best of several windows has some evidence even by chance. A mean over so many has an error of a few percent.
    let sample: Vec<usize> = evenly(n, 1 << 9).collect();
    let mixed = mixed(lists, &sample, 1);
    let window_by_chance = |&slot: &usize| window(rows, &bearings, slot, &mixed);
    let by_chance: Vec<f32> =
        sample.iter().filter_map(window_by_chance).map(|window| window.evidence).collect();
    let by_chance = CHANCE * by_chance.iter().sum::<f32>() / by_chance.len().max(1) as f32;
    let fractions = fractions_before(rows, lists, &bearings, &windows);
    let estimate = |slot: usize| {
        let Some(Window { count, evidence, .. }) = windows[slot] else {
            return Estimate::lost(Status::TooFewNeighbors);
        };
        let excess = (evidence - by_chance).max(0.0);
        let trust = excess / evidence.max(f32::MIN_POSITIVE);
        // Without evidence, use the range with half of the points before it.
        let fraction = 0.5 + trust * (fractions[slot] - 0.5);
        let range = libm::powf(fraction, 1.0 / D as f32) * rows[slot].to;
        Estimate::at(rows[slot].at(range), count, 0, excess)
    };
    (0..n).map(estimate).collect()
}

/// Returns, per slot, the fraction of its ray's region before its point: the rank of its window among rays of similar bearing.
fn fractions_before<const D: usize>(
    rows: &[LineRow<D>],
    lists: &Neighborhoods,
    bearings: &Bearings,
    windows: &[Option<Window>],
) -> Vec<f32> {
    let known = |slot: usize| windows[slot].map(|window| -libm::logf(window.sine));
    let mut score: Vec<f32> = (0..rows.len()).map(|slot| known(slot).unwrap_or(f32::NAN)).collect();
    // Neighbors lie at similar ranges.
    for _ in 0..SMOOTHINGS {
        let smooth = |slot: usize| {
            let Some(window) = windows[slot] else { return score[slot] };
            let own = &rows[slot];
            let (mut sum, mut n) = (0.0f32, 0.0f32);
            for record in lists.of(slot) {
                let (row, score) = (&rows[record.index()], score[record.index()]);
                if row.group == own.group && score.is_finite() && sine(own, row) <= window.sine {
                    (sum, n) = (sum + score, n + 1.0);
                }
            }
            if n > 0.0 { 0.5 * (score[slot] + sum / n) } else { score[slot] }
        };
        score = parallel::map(rows.len(), smooth);
    }
    let fraction = |at: usize| {
        let (group, _, slot) = bearings[at];
        let own = score[slot as usize];
        if own.is_nan() {
            return 0.5;
        }
        let of_group = bearings.partition_point(|row| row.0 < group)
            ..bearings.partition_point(|row| row.0 <= group);
        let half = (of_group.len() / SECTORS).max(LEAST_SECTOR);
        let from = at.saturating_sub(half).max(of_group.start);
        let (mut below, mut all) = (0.0f32, 0.0f32);
        for &(_, _, near) in &bearings[from..(at + half + 1).min(of_group.end)] {
            let near = score[near as usize];
            all += f32::from(u8::from(!near.is_nan()));
            below += f32::from(u8::from(near < own));
            below += 0.5 * f32::from(u8::from(near == own));
        }
        below / all
    };
    let in_order = parallel::map(bearings.len(), fraction);
    let mut fractions = vec![0.5; rows.len()];
    for (&(_, _, slot), fraction) in bearings.iter().zip(in_order) {
        fractions[slot as usize] = fraction;
    }
    fractions
}

/// Returns the window around `slot` that is least probable by chance; `None` with fewer than two listed rays of its anchor.
fn window<const D: usize>(
    rows: &[LineRow<D>],
    bearings: &Bearings,
    slot: usize,
    lists: &Neighborhoods,
) -> Option<Window> {
    let own = &rows[slot];
    let listed = lists.of(slot);
    let others = listed.iter().map(|record| &rows[record.index()]);
    let sines = sorted(others.filter(|row| row.group == own.group).map(|row| sine(own, row)));
    // A window must be wide enough for a few bearings of the map.
    let finest = 4.0 / rows.len().max(4) as f32;
    let mut best: Option<Window> = None;
    for (at, &sine) in sines.iter().enumerate().skip(1) {
        // Points at the same place have the same bearing, which gives no range.
        let sine = sine.max(finest);
        let count = at + 1;
        let chance = fraction_within(bearings, own, sine);
        let evidence = evidence(count as f32, listed.len() as f32, chance);
        if best.is_none_or(|b| evidence > b.evidence) {
            best = Some(Window { sine, count: count as u32, evidence });
        }
    }
    best
}

fn sine<const D: usize>(a: &LineRow<D>, b: &LineRow<D>) -> f32 {
    let cosine: f32 = (0..D).map(|c| a.direction[c] * b.direction[c]).sum();
    // Not 1 - cosine^2, which loses all digits at small angles.
    let across: f32 = (0..D).map(|c| b.direction[c] - cosine * a.direction[c]).map(|x| x * x).sum();
    if cosine > 0.0 { across.sqrt().min(1.0) } else { 1.0 }
}

/// All bearings as (group, angle, slot), sorted.
type Bearings = [(u32, f64, u32)];

/// Returns the fraction of all records that are rays of the anchor of `own` within `sine` of it.
fn fraction_within<const D: usize>(bearings: &Bearings, own: &LineRow<D>, sine: f32) -> f32 {
    let (middle, half) = (angle(own), libm::asin(f64::from(sine)));
    let below = |at: f64| bearings.partition_point(|row| (row.0, row.1) < (own.group, at));
    let n = below(middle + half) - below(middle - half);
    ((n as f32 + 0.5) / (bearings.len() as f32 + 1.0)).min(0.5)
}

/// Returns the angle of a ray in the plane of the first two coordinates.
fn angle<const D: usize>(row: &LineRow<D>) -> f64 {
    libm::atan2(f64::from(row.direction[1]), f64::from(row.direction[0]))
}
