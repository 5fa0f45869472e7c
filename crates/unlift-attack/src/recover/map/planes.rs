//! Axis planes: each free coordinate is solved on its own, as the densest window of offsets.

use crate::RecordId;
use crate::geometry::vector::median;
use crate::recover::map::chance::{are_in_parts, interquartile_range};
use crate::recover::map::lines::{evidence, ln};
use crate::released::AxisPlanes;

/// The planes of each axis, in order of their offsets.
#[derive(Clone, Debug)]
pub(crate) struct SortedPlanes {
    by_axis: Vec<Sorted>,
}

#[derive(Clone, Debug)]
struct Sorted {
    order: Vec<u32>,
    /// Distance between the quartiles of the offsets.
    quartiles: f64,
    /// Sorted offsets if the map has separate parts along this axis, else empty.
    in_parts: Vec<f32>,
}

/// Number of places at which planes are counted to find a typical chance.
const PLACES: usize = 1 << 10;

impl SortedPlanes {
    pub(crate) fn new<const D: usize>(planes: &AxisPlanes<D>) -> Self {
        let mut by_axis = vec![Vec::new(); D];
        for (record, &axis) in planes.axis().iter().enumerate() {
            by_axis[usize::from(axis)].push(record as u32);
        }
        let offset = |record: u32| planes.offset()[record as usize];
        let sorted = |mut order: Vec<u32>| {
            order.sort_unstable_by(|&a, &b| offset(a).total_cmp(&offset(b)).then(a.cmp(&b)));
            let mut offsets: Vec<f32> = order.iter().map(|&record| offset(record)).collect();
            let quartiles = interquartile_range(&offsets);
            if !are_in_parts(&offsets) {
                offsets = Vec::new();
            }
            Sorted { order, quartiles, in_parts: offsets }
        };
        Self { by_axis: by_axis.into_iter().map(sorted).collect() }
    }

    /// Returns the largest interquartile range of the offsets of an axis.
    pub(crate) fn extent(&self) -> f64 {
        self.by_axis.iter().map(|axis| axis.quartiles).fold(0.0, f64::max)
    }

    /// Returns the chance that a random plane of any axis passes within `delta` of a typical place.
    pub(crate) fn typical_chance(&self, delta: f32) -> f32 {
        let of_axis = |axis: &Sorted| match axis.in_parts.is_empty() {
            // Half of the planes lie between the quartiles.
            true => (f64::from(delta) / axis.quartiles.max(f64::from(f32::MIN_POSITIVE))) as f32,
            false => typical_share(&axis.in_parts, delta),
        };
        self.by_axis.iter().map(of_axis).fold(0.5, f32::min)
    }
}

/// Returns the fraction of sorted `offsets` within `delta` of a typical one.
fn typical_share(offsets: &[f32], delta: f32) -> f32 {
    let within = |&at: &f32| {
        let low = offsets.partition_point(|&offset| offset < at - delta);
        let high = offsets.partition_point(|&offset| offset <= at + delta);
        (high - low) as f64 / offsets.len() as f64
    };
    let every = offsets.len().div_ceil(PLACES);
    let mut shares: Vec<f64> = offsets.iter().step_by(every).map(within).collect();
    median(&mut shares) as f32
}

/// Returns, per record, the chance that a random plane of its axis has an offset in `[offset, offset + 2 delta]`. It is counted exactly.
pub(crate) fn window_chance<const D: usize>(
    planes: &AxisPlanes<D>,
    sorted: &SortedPlanes,
    delta: f32,
) -> Vec<f32> {
    let mut chance = vec![0.0; planes.axis().len()];
    for Sorted { order, .. } in &sorted.by_axis {
        let mut end = 0;
        for (start, &record) in order.iter().enumerate() {
            let reach = planes.offset()[record as usize] + 2.0 * delta;
            while end < order.len() && planes.offset()[order[end] as usize] <= reach {
                end += 1;
            }
            chance[record as usize] = ((end - start) as f32 - 0.5) / (order.len() as f32 + 1.0);
        }
    }
    chance
}

/// Half width of the final mean in deltas. The window is already sharp, and a wider mean is more stable.
const REFIT: f32 = 1.5;

/// The best window of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Window {
    /// Mean of the offsets in the window, after the window was centered anew.
    pub(crate) offset: f32,
    /// Number of offsets that support it.
    pub(crate) count: u32,
    /// Improbability of the agreement by chance, in nats.
    pub(crate) evidence: f32,
}

/// Returns the window of width `2 delta` over the listed planes of one axis with the largest evidence plus prior. `listed` has the
/// (offset, record) of these planes and gets sorted; `chance` is that of [`window_chance`].
// Without inlining, consensus on planes takes half as long again.
#[inline(always)]
pub(crate) fn best_window(
    listed: &mut [(f32, RecordId)],
    chance: &[f32],
    delta: f32,
) -> Option<Window> {
    listed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best: Option<(f32, f32, usize, usize)> = None;
    let mut end = 0;
    for start in 0..listed.len() {
        while end < listed.len() && listed[end].0 <= listed[start].0 + 2.0 * delta {
            end += 1;
        }
        let p = chance[listed[start].1.index()];
        let evidence = evidence((end - start) as f32, listed.len() as f32, p);
        let score = evidence + ln(p);
        if best.is_none_or(|b| score > b.0) {
            best = Some((score, evidence, start, end));
        }
    }
    let (_, evidence, start, end) = best?;
    // Offsets are summed relative to the first, so that maps far from the origin lose no digits.
    let mean = |rows: &[(f32, RecordId)]| {
        rows[0].0 + rows.iter().map(|r| r.0 - rows[0].0).sum::<f32>() / rows.len() as f32
    };
    let first = mean(&listed[start..end]);
    let low = listed.partition_point(|r| r.0 < first - REFIT * delta);
    let high = listed.partition_point(|r| r.0 <= first + REFIT * delta);
    let (offset, count) =
        if low < high { (mean(&listed[low..high]), high - low) } else { (first, end - start) };
    Some(Window { offset, count: count as u32, evidence })
}
