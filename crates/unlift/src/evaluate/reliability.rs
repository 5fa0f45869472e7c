//! Reliability of the attacker's probabilities: calibration against observed shares.

use super::Accuracy;
use crate::recover::{Recovered, Status};

/// Number of bins of the predicted probability. The attacker is sure of the points in the last one,
/// from 90 % on.
const BINS: usize = 10;

/// Predicted probabilities and observed results, over the recovered points.
#[derive(Clone, Debug, PartialEq)]
pub struct Reliability {
    /// Number of released points, including lost ones.
    pub n_points: usize,
    /// Bins of equal width from 0 to 1.
    pub bins: [Bin; BINS],
}

/// Points with similar probabilities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bin {
    /// Number of points.
    pub n: usize,
    /// Sum of their probabilities.
    pub expected: f64,
    /// Number of points within the threshold.
    pub within: usize,
}

impl Bin {
    fn add(&mut self, probability: f64, within: bool) {
        self.n += 1;
        self.expected += probability;
        self.within += usize::from(within);
    }

    fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.expected += other.expected;
        self.within += other.within;
    }

    /// Returns the mean probability; `None` without points.
    pub fn predicted(&self) -> Option<f64> {
        (self.n > 0).then(|| self.expected / self.n as f64)
    }

    /// Returns the share within the threshold; `None` without points.
    pub fn observed(&self) -> Option<f64> {
        (self.n > 0).then(|| self.within as f64 / self.n as f64)
    }
}

impl Reliability {
    /// Returns the points of which the attacker is sure.
    pub fn sure(&self) -> &Bin {
        &self.bins[BINS - 1]
    }

    /// Returns the percentage of released points of which the attacker is sure.
    pub fn sure_percent(&self) -> f64 {
        if self.n_points == 0 { 0.0 } else { 100.0 * self.sure().n as f64 / self.n_points as f64 }
    }

    /// Returns the percentage of these points within the threshold; `None` without any.
    pub fn sure_correct_percent(&self) -> Option<f64> {
        self.sure().observed().map(|share| 100.0 * share)
    }

    /// Adds the points of another run.
    pub fn merge(&mut self, other: &Self) {
        self.n_points += other.n_points;
        self.bins.iter_mut().zip(&other.bins).for_each(|(a, b)| a.merge(b));
    }
}

/// Compares the probabilities of `recovered` to lie within `threshold` (unit of the map) with
/// `accuracy`, which must be of the same points. Returns `None` if `recovered` has no
/// probabilities.
pub fn reliability<const D: usize>(
    recovered: &Recovered<D>,
    accuracy: &Accuracy,
    threshold: f64,
) -> Option<Reliability> {
    let confidence = recovered.confidence()?;
    let mut bins = [Bin::default(); BINS];
    let slots = confidence.iter().zip(recovered.status()).zip(accuracy.errors());
    for ((confidence, _), &error) in slots.filter(|((_, status), _)| **status == Status::Ok) {
        let probability = confidence.probability_within(threshold);
        let bin = &mut bins[((probability * BINS as f64) as usize).min(BINS - 1)];
        bin.add(probability, error <= threshold);
    }
    Some(Reliability { n_points: recovered.n_slots(), bins })
}
