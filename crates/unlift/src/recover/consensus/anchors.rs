//! Consensus for rays whose centers have a region of points each (anchors of an image): a range from
//! the spread of bearings.
//!
//! Rays of one anchor meet in it, and those of two anchors meet nowhere that both may lie. What is left is
//! perspective: neighbors within a distance `s` of a point at range `r` are seen from the anchor within
//! an angle of `s / r`. The window of bearings that holds the listed rays least probably by chance
//! gives that angle. What `s` is follows from the map itself: of an even density half of the points
//! lie beyond `1 / sqrt 2` of where their rays end.

use rayon::prelude::*;

use crate::geometry::vector::median;
use crate::recover::chance::evidence;
use crate::recover::chunks::{Chunks, solve_chunks};
use crate::recover::line_rows::LineRow;
use crate::recover::lists::Lists;
use crate::recover::{Estimate, Status, stored_support};

/// Slots whose lists are mixed to see what chance alone yields.
const SAMPLE: usize = 1 << 9;
/// Evidence counts in excess of this many times what chance alone yields in the mean.
const CHANCE: f32 = 2.0;

/// What the listed rays of a slot's own anchor say.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// Sine of the half angle.
    sine: f32,
    count: u32,
    evidence: f32,
}

/// Estimates for the slots of `chunks`, one slot per record.
pub(super) fn solve<const D: usize>(
    rows: &[LineRow<D>],
    lists: Lists<'_>,
    chunks: Chunks<'_>,
) -> Vec<Estimate<D>> {
    let bearings = Bearings::new(rows);
    let windows: Vec<Option<Window>> = (0..lists.n_slots())
        .into_par_iter()
        .map(|slot| window(rows, &bearings, slot, &lists))
        .collect();
    // The best of several windows has some evidence whatever is listed.
    let mixed = lists.turned_to_mixed();
    let every = lists.n_slots().div_ceil(SAMPLE).max(1);
    let by_chance: Vec<f32> = (0..lists.n_slots())
        .step_by(every)
        .filter_map(|slot| Some(window(rows, &bearings, slot, &mixed)?.evidence))
        .collect();
    let by_chance = CHANCE * by_chance.iter().sum::<f32>() / by_chance.len().max(1) as f32;
    // Without evidence the range is the one that half of an even density lies within.
    let half = libm::pow(0.5, 1.0 / D as f64);
    // What a range would be of a neighborhood of size 1, as a share of the ray.
    let mut shares: Vec<f64> = rows
        .iter()
        .zip(&windows)
        .filter_map(|(row, window)| Some(1.0 / f64::from(row.to * (*window)?.sine)))
        .filter(|share| share.is_finite())
        .collect();
    let size = match shares.is_empty() {
        true => 1.0,
        false => half / median(&mut shares),
    };
    solve_chunks(
        lists.n_slots(),
        chunks,
        || (),
        |(), first, out| {
            for (at, estimate) in out.iter_mut().enumerate() {
                let own = &rows[first + at];
                *estimate = match windows[first + at] {
                    None => Estimate::lost(Status::TooFewNeighbors),
                    Some(Window { sine, count, evidence }) => {
                        let excess = (evidence - by_chance).max(0.0);
                        let trust = excess / evidence.max(f32::MIN_POSITIVE);
                        let (seen, blind) = (own.clamp(size as f32 / sine), half as f32 * own.to);
                        Estimate {
                            position: own.at(blind + trust * (seen - blind)),
                            status: Status::Ok,
                            support: stored_support(count),
                            axis: 0,
                            evidence: excess,
                        }
                    }
                };
            }
        },
    )
}

/// The window around `slot` that is least probable by chance; `None` with fewer than two listed rays of
/// its anchor.
fn window<const D: usize>(
    rows: &[LineRow<D>],
    bearings: &Bearings,
    slot: usize,
    lists: &Lists<'_>,
) -> Option<Window> {
    let own = &rows[slot];
    let mut buffer = Vec::new();
    let listed = lists.of(slot, &mut buffer);
    let others = listed.iter().map(|record| &rows[record.index()]);
    let mut sines: Vec<f32> =
        others.filter(|row| row.group == own.group).map(|row| sine(own, row)).collect();
    sines.sort_unstable_by(f32::total_cmp);
    let mut best: Option<Window> = None;
    for (at, &sine) in sines.iter().enumerate().skip(1) {
        // Twins are seen in the very same direction, which tells no range.
        let sine = sine.max(bearings.finest);
        let count = at + 1;
        let chance = bearings.share_within(own, sine);
        let evidence = evidence(count, listed.len(), chance);
        if best.is_none_or(|b| evidence > b.evidence) {
            best = Some(Window { sine, count: count as u32, evidence });
        }
    }
    best
}

/// The sine of the angle between two rays of one anchor.
fn sine<const D: usize>(a: &LineRow<D>, b: &LineRow<D>) -> f32 {
    let cosine: f32 = (0..D).map(|c| a.direction[c] * b.direction[c]).sum();
    // Not 1 - cosine^2, which is rounded to nothing at small angles.
    let across: f32 = (0..D).map(|c| b.direction[c] - cosine * a.direction[c]).map(|x| x * x).sum();
    if cosine > 0.0 { across.sqrt().min(1.0) } else { 1.0 }
}

/// All bearings, sorted within their groups.
struct Bearings {
    /// (group, angle).
    sorted: Vec<(u32, f64)>,
    /// Windows narrower than this tell nothing.
    finest: f32,
}

impl Bearings {
    fn new<const D: usize>(rows: &[LineRow<D>]) -> Self {
        let mut sorted: Vec<(u32, f64)> = rows.iter().map(|row| (row.group, angle(row))).collect();
        sorted.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // A window holds a few bearings of the map at least.
        let finest = 4.0 / rows.len().max(4) as f32;
        Self { sorted, finest }
    }

    /// The share of all records that are rays of the anchor of `own` within `sine` of it.
    fn share_within<const D: usize>(&self, own: &LineRow<D>, sine: f32) -> f32 {
        let (middle, half) = (angle(own), libm::asin(f64::from(sine)));
        let below = |at: f64| self.sorted.partition_point(|row| *row < (own.group, at));
        let n = below(middle + half) - below(middle - half);
        ((n as f32 + 0.5) / (self.sorted.len() as f32 + 1.0)).min(0.5)
    }
}

/// The angle of a ray in the plane of the first two coordinates.
fn angle<const D: usize>(row: &LineRow<D>) -> f64 {
    libm::atan2(f64::from(row.direction[1]), f64::from(row.direction[0]))
}
