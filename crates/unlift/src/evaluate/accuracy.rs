//! The share of points that came back, and how far off the others are.

use std::collections::BTreeMap;

use crate::Error;
use crate::geometry::vector::distance;
use crate::recover::{Recovered, Status};
use crate::truth::{Original, Secret};

/// How much of a map came back. Shares are over *all* released points: lost ones are misses.
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    /// Error per slot in the unit of the points; infinite where nothing was recovered.
    errors: Vec<f64>,
    /// The same, ascending.
    sorted: Vec<f64>,
    /// Slots that could not be recovered, by reason.
    pub lost: BTreeMap<Status, usize>,
    /// Share of slots whose exchanged axis was named, in percent (`cp`).
    pub axis_percent: Option<f64>,
    /// Share of slots that were given their own descriptor, in percent (paired lines).
    pub assignment_percent: Option<f64>,
}

/// Compares `recovered` with the truth, slot by slot.
///
/// # Errors
/// When the three do not belong together (numbers of slots or points differ).
pub fn evaluate<const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &Secret,
) -> Result<Accuracy, Error> {
    let positions = original.reveal().positions();
    if recovered.n_slots() != secret.n_slots() {
        let expected = format!("{} slots, as the truth has", secret.n_slots());
        return Err(Error::new("recovered map", expected, recovered.n_slots().to_string()));
    }
    if secret.n_originals() != positions.len() {
        let expected = format!("{} originals, as the secret says", secret.n_originals());
        return Err(Error::new("original points", expected, positions.len().to_string()));
    }
    let errors: Vec<f64> = secret
        .hidden()
        .iter()
        .enumerate()
        .map(|(slot, original)| match recovered.position(slot) {
            Some(position) => distance(&position, &positions[original.index()]),
            None => f64::INFINITY,
        })
        .collect();
    let mut lost = BTreeMap::new();
    for &status in recovered.status().iter().filter(|&&status| status != Status::Ok) {
        *lost.entry(status).or_insert(0) += 1;
    }
    let axis_percent = match (recovered.axis(), secret.swapped_axis()) {
        (Some(said), Some(true_axis)) => percent_equal(said, true_axis),
        _ => None,
    };
    let assignment_percent =
        recovered.descriptor_row().and_then(|said| percent_equal(said, secret.descriptor_row()));
    Ok(Accuracy::new(errors, lost, axis_percent, assignment_percent))
}

fn percent_equal<T: PartialEq>(a: &[T], b: &[T]) -> Option<f64> {
    let equal = a.iter().zip(b).filter(|(a, b)| a == b).count();
    (!a.is_empty()).then(|| 100.0 * equal as f64 / a.len() as f64)
}

impl Accuracy {
    pub(super) fn new(
        errors: Vec<f64>,
        lost: BTreeMap<Status, usize>,
        axis_percent: Option<f64>,
        assignment_percent: Option<f64>,
    ) -> Self {
        let mut sorted = errors.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        Self { errors, sorted, lost, axis_percent, assignment_percent }
    }

    /// Number of released points.
    pub fn n_points(&self) -> usize {
        self.errors.len()
    }

    /// Number of points that could not be recovered at all.
    pub fn n_lost(&self) -> usize {
        self.lost.values().sum()
    }

    /// Error per slot in the unit of the points; infinite where nothing was recovered.
    pub fn errors(&self) -> &[f64] {
        &self.errors
    }

    /// Number of points with an error of at most `threshold`.
    pub fn n_within(&self, threshold: f64) -> usize {
        self.sorted.partition_point(|&error| error <= threshold)
    }

    /// Percentage of points with an error of at most `threshold`; 0 without points.
    pub fn percent_within(&self, threshold: f64) -> f64 {
        let (within, n) = (self.n_within(threshold), self.sorted.len());
        if n == 0 { 0.0 } else { 100.0 * within as f64 / n as f64 }
    }

    /// The sum of `weights` (one per slot) over the points with an error of at most `threshold`.
    pub fn weight_within(&self, threshold: f64, weights: &[f64]) -> f64 {
        let within = self.errors.iter().zip(weights).filter(|(error, _)| **error <= threshold);
        within.map(|(_, weight)| weight).sum()
    }

    /// The error that `percent` of the points do not exceed; `None` when that many were not
    /// recovered.
    pub fn percentile(&self, percent: f64) -> Option<f64> {
        let n = self.sorted.len();
        let rank = ((percent / 100.0 * n as f64).ceil() as usize).clamp(1, n.max(1));
        self.sorted.get(rank - 1).copied().filter(|error| error.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_points_count_as_misses() {
        let accuracy =
            Accuracy::new(vec![0.1, f64::INFINITY, 0.3, 0.2], BTreeMap::new(), None, None);
        assert_eq!(accuracy.percent_within(0.2), 50.0);
        assert_eq!(accuracy.percentile(50.0), Some(0.2));
        assert_eq!(accuracy.percentile(75.0), Some(0.3));
        assert_eq!(accuracy.percentile(99.0), None);
    }
}
