//! Peaks: the most probable place of each record's point.

use std::ops::Range;

use super::Peaks;
use super::feasible::{Feasible, Hides};
use super::spread::Spread;
use crate::parallel;
use crate::recover::result::Estimate;

/// Samples to either side that count as the same place, about as many as smoothing reaches.
const REACH: usize = 2;

/// Returns the most probable place of every slot's point.
pub(super) fn find(spread: &Spread<'_>) -> Peaks {
    let Feasible { hides, lines, per_record, .. } = spread.feasible;
    let slots = if *hides == Hides::Two { 2 } else { 1 };
    let n_records = spread.feasible.n_records();
    let place = |(view, windows): &mut (Vec<f32>, Vec<Window>), record: usize| {
        spread.view(record, spread.weights_of(record), view);
        windows.clear();
        for axis in 0..*per_record {
            let span = &spread.spans[record * per_record + axis];
            let view = &view[windows.len()..windows.len() + span.len()];
            windows.extend(Window::all(view, span, axis, spread.grid.cell));
        }
        let pair = if slots == 2 { best_pair(windows) } else { best(windows).map(|one| [one; 2]) };
        let total: f32 = view.iter().sum();
        let blind = (2 * REACH + 1) as f32 / view.len() as f32;
        let estimate = |window: Window| {
            let position = lines[record * per_record + window.axis].at(window.t);
            let evidence = libm::logf(window.likelihood / total / blind).max(0.0);
            let sound = evidence.is_finite() && position.iter().all(|x| x.is_finite());
            sound.then(|| Estimate::at(position, 0, window.axis, evidence))
        };
        pair.map_or([None; 2], |pair| pair.map(estimate))
    };
    let scratch = || (Vec::new(), Vec::new());
    let found = parallel::map_with(n_records, scratch, place);
    let of = found.into_iter().flat_map(|of_record| of_record.into_iter().take(slots)).collect();
    Peaks { of, resolution: f64::from(spread.grid.cell) }
}

/// Returns the window with the largest likelihood; the first one of equal ones.
fn best(windows: &[Window]) -> Option<Window> {
    let possible = windows.iter().filter(|window| window.likelihood > 0.0).copied();
    possible.reduce(|best, next| if next.likelihood > best.likelihood { next } else { best })
}

/// Returns the two places with the largest joint likelihood, which grows with their distance.
fn best_pair(windows: &[Window]) -> Option<[Window; 2]> {
    let likelihoods: Vec<f32> = windows.iter().map(|window| window.likelihood).collect();
    let maxima: Vec<&Window> = maxima(&likelihoods).map(|at| &windows[at]).collect();
    let (mut best, mut highest) = (None, 0.0);
    for (at, second) in maxima.iter().enumerate() {
        for first in &maxima[..at] {
            let apart = second.t - first.t;
            let likelihood = first.likelihood * second.likelihood * apart * apart;
            if likelihood > highest {
                (best, highest) = (Some([**first, **second]), likelihood);
            }
        }
    }
    // If there is only one maximum, both points are there.
    best.or_else(|| maxima.first().map(|&&only| [only; 2]))
}

/// Returns the indices of local maxima; the first one of equal neighbors.
pub(crate) fn maxima<T: Copy + Default + PartialOrd>(values: &[T]) -> impl Iterator<Item = usize> {
    let value =
        move |at: Option<usize>| at.and_then(|at| values.get(at)).copied().unwrap_or_default();
    let is_maximum = move |&at: &usize| {
        values[at] > value(at.checked_sub(1)) && values[at] >= value(Some(at + 1))
    };
    (0..values.len()).filter(is_maximum)
}

#[derive(Clone, Copy, Debug)]
struct Window {
    likelihood: f32,
    /// Number of its line among those of the record.
    axis: usize,
    /// Mean parameter.
    t: f32,
}

impl Window {
    /// Returns one window per sample of a line.
    fn all(view: &[f32], span: &Range<i32>, axis: usize, side: f32) -> impl Iterator<Item = Self> {
        (0..view.len()).map(move |at| {
            let from = at.saturating_sub(REACH);
            let near = &view[from..view.len().min(at + REACH + 1)];
            let likelihood: f32 = near.iter().sum();
            let moment: f32 = near.iter().enumerate().map(|(i, x)| i as f32 * x).sum();
            let first = (span.start + from as i32) as f32 + 0.5;
            let shift = if likelihood > 0.0 { moment / likelihood } else { 0.0 };
            Self { likelihood, axis, t: (first + shift) * side }
        })
    }
}
