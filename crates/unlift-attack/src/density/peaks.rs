//! Peaks: the most probable place of each record's point.

use std::ops::Range;

use rayon::prelude::*;

use super::Peaks;
use super::feasible::Hides;
use super::spread::Spread;
use crate::recover::map::LineRow;
use crate::recover::result::Estimate;

/// Samples to either side that count as the same place, about as many as smoothing reaches.
const REACH: usize = 2;

/// Returns the most probable place of every slot's point.
pub(super) fn find(spread: &Spread<'_>) -> Peaks {
    let feasible = spread.feasible;
    let slots = if feasible.hides == Hides::Two { 2 } else { 1 };
    let mut of: Vec<Option<Estimate<3>>> = vec![None; slots * feasible.n_records()];
    of.par_chunks_mut(slots).enumerate().for_each_init(
        || (Vec::new(), Vec::new()),
        |(view, windows), (record, out)| {
            spread.view(record, spread.weights_of(record), view);
            let lines = record * feasible.per_record..(record + 1) * feasible.per_record;
            if let [first, second] = out {
                let (line, span) = (&feasible.lines[record], &spread.spans[record]);
                Window::all(view, span, spread.grid.cell, windows);
                let total = view.iter().sum();
                if let Some(pair) = best_pair(windows) {
                    [*first, *second] = pair.map(|w| peak(&w, line, 0, total, view.len()));
                }
            } else {
                out[0] = best(spread, lines, view, windows);
            }
        },
    );
    Peaks { of, resolution: f64::from(spread.grid.cell) }
}

/// Returns the place with the largest likelihood around it on any line of a record.
fn best(
    spread: &Spread<'_>,
    lines: Range<usize>,
    view: &[f32],
    windows: &mut Vec<Window>,
) -> Option<Estimate<3>> {
    let total = view.iter().sum();
    let mut found: Option<(Window, usize)> = None;
    let mut begin = 0;
    for at in lines.clone() {
        let span = &spread.spans[at];
        Window::all(&view[begin..begin + span.len()], span, spread.grid.cell, windows);
        begin += span.len();
        for window in windows.iter() {
            if window.likelihood > found.map_or(0.0, |(best, _)| best.likelihood) {
                found = Some((*window, at));
            }
        }
    }
    let (window, at) = found?;
    peak(&window, &spread.feasible.lines[at], at - lines.start, total, view.len())
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

/// Likelihood around one sample.
#[derive(Clone, Copy, Debug)]
struct Window {
    likelihood: f32,
    /// Mean parameter.
    t: f32,
}

impl Window {
    /// Computes one window per sample of a line.
    fn all(view: &[f32], span: &Range<i32>, side: f32, out: &mut Vec<Self>) {
        out.clear();
        for at in 0..view.len() {
            let from = at.saturating_sub(REACH);
            let near = &view[from..view.len().min(at + REACH + 1)];
            let likelihood: f32 = near.iter().sum();
            let moment: f32 = near.iter().enumerate().map(|(i, x)| i as f32 * x).sum();
            let first = (span.start + from as i32) as f32 + 0.5;
            let shift = if likelihood > 0.0 { moment / likelihood } else { 0.0 };
            out.push(Self { likelihood, t: (first + shift) * side });
        }
    }
}

fn peak(
    window: &Window,
    line: &LineRow<3>,
    axis: usize,
    total: f32,
    n_samples: usize,
) -> Option<Estimate<3>> {
    let position = line.at(window.t);
    let blind = (2 * REACH + 1) as f32 / n_samples as f32;
    let evidence = libm::logf(window.likelihood / total / blind).max(0.0);
    let sound = evidence.is_finite() && position.iter().all(|x| x.is_finite());
    sound.then(|| Estimate::at(position, 0, axis, evidence))
}
