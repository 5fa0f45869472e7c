//! Errors of a recovery: the original of each row, shares, percentiles, weights of coincident points, and reliability of probabilities.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::geometry::vector::{distance, sub};
use crate::recover::{Recovered, Status};
use crate::truth::{Original, Secret};
use crate::{Error, OriginalId, RowOrder};

/// Errors of a recovery. Shares are of all released points; a lost point is a miss.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Accuracy {
    /// Error per slot in the unit of the points; infinite if not recovered.
    errors: Vec<f64>,
    sorted: Vec<f64>,
    /// Slots that could not be recovered, by reason.
    pub lost: BTreeMap<Status, usize>,
    /// Number of slots recovered exactly, with the original's coordinates as `f32` relative to the
    /// released origin; `None` unless the scheme exchanges coordinates.
    pub n_exact: Option<usize>,
    /// Percentage of slots whose exchanged axis was identified (`cp`).
    pub axis_percent: Option<f64>,
    /// Percentage of slots with the correct descriptor (paired lines).
    pub assignment_percent: Option<f64>,
}

/// Compares `recovered` with the ground truth, row by row, in the row order of `recovered`
/// ([`joined`]). `secret` is the secret that the obfuscation returned.
///
/// For paired lines in an unstated order, each position is compared with the nearer of the record's
/// two points. No order gives a larger share.
///
/// # Errors
/// When the three differ in released map, unit, number of slots or number of points.
pub fn evaluate<const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &Secret,
) -> Result<Accuracy, Error> {
    let points = original.reveal();
    if let Some(map) = secret.map() {
        map.expect(recovered.about().map)?;
    }
    if recovered.unit() != points.unit() {
        let expected = format!("lengths in {}, as in the ground truth", points.unit().name());
        return Err(Error::new("unit", expected, recovered.unit().name()));
    }
    let (n_slots, n_originals) = (secret.n_slots(), secret.n_originals());
    let rule = " slots, as in the ground truth";
    Error::check_len("recovered map", recovered.n_slots(), n_slots, rule)?;
    let rule = " originals, as in the secret";
    Error::check_len("original points", points.len(), n_originals, rule)?;
    let accuracy = compare(recovered, original, &joined(recovered, original, secret));
    if secret.slots_per_record() < 2 || recovered.about().order != RowOrder::Unstated {
        return Ok(accuracy);
    }
    let straight = compare(recovered, original, secret);
    let crossed = compare(recovered, original, &secret.exchanged(|_| true));
    let by_row = compare(recovered, original, &secret.by_descriptor_row());
    let errors = straight.errors.iter().zip(&crossed.errors).map(|(a, b)| a.min(*b)).collect();
    let assigned = [&accuracy, &straight, &by_row].map(|of| of.assignment_percent.unwrap_or(0.0));
    let Accuracy { lost, n_exact, assignment_percent, .. } = accuracy;
    let assignment_percent = assignment_percent.map(|_| assigned.into_iter().fold(0.0, f64::max));
    Ok(Accuracy { lost, n_exact, assignment_percent, ..Accuracy::of(errors) })
}

/// Returns the percentage of points that are recovered within `threshold` at the other point of their line, if it is so large that the
/// stated descriptor rows are doubtful; `None` for lists that are not in the order of descriptor rows.
pub(crate) fn exchanged_percent<const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &Secret,
    threshold: f64,
) -> Option<f64> {
    if secret.slots_per_record() < 2 || recovered.about().order != RowOrder::DescriptorRows {
        return None;
    }
    let by_row = secret.by_descriptor_row();
    let [straight, crossed] = [&by_row, &by_row.exchanged(|_| true)]
        .map(|secret| compare(recovered, original, secret).percent_within(threshold));
    (crossed > MOST_EXCHANGED.0 + MOST_EXCHANGED.1 * straight).then_some(crossed)
}

/// Usual percentage of points recovered at the other point of their line: a constant, and a share of those recovered at their own.
const MOST_EXCHANGED: (f64, f64) = (5.0, 0.25);

/// Compares every row with the original in its slot of `secret`.
fn compare<const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &Secret,
) -> Accuracy {
    let positions = original.reveal().positions();
    let hidden = || secret.hidden().iter().enumerate();
    let error = |(slot, original): (usize, &OriginalId)| {
        let position = recovered.position(slot);
        position.map_or(f64::INFINITY, |at| distance(&at, &positions[original.index()]))
    };
    let mut lost = BTreeMap::new();
    for &status in recovered.status().iter().filter(|&&status| status != Status::Ok) {
        *lost.entry(status).or_insert(0) += 1;
    }
    let origin = recovered.origin();
    let is_exact = |(slot, original): (usize, &OriginalId)| {
        let stored = sub(&positions[original.index()], &origin).map(|x| x as f32);
        // Positions of lost points are NaN, so they are never equal.
        recovered.positions()[slot] == stored
    };
    let n_exact = secret.swapped_axis().map(|_| hidden().filter(|slot| is_exact(*slot)).count());
    let axes = recovered.axis().zip(secret.swapped_axis());
    let axis_percent = axes.and_then(|(axis, true_axis)| percent_equal(axis, true_axis));
    let assignment_percent =
        recovered.descriptor_row().and_then(|row| percent_equal(row, secret.descriptor_row()));
    let errors = Accuracy::of(hidden().map(error).collect());
    Accuracy { lost, n_exact, axis_percent, assignment_percent, ..errors }
}

fn percent_equal<T: PartialEq>(a: &[T], b: &[T]) -> Option<f64> {
    let equal = a.iter().zip(b).filter(|(a, b)| a == b).count();
    (!a.is_empty()).then(|| 100.0 * equal as f64 / a.len() as f64)
}

impl Accuracy {
    /// Returns the accuracy of slots with these errors; all else is unknown.
    pub(super) fn of(errors: Vec<f64>) -> Self {
        let mut sorted = errors.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        Self { errors, sorted, ..Self::default() }
    }

    /// Returns the number of released points.
    pub fn n_points(&self) -> usize {
        self.errors.len()
    }

    /// Returns the number of points that could not be recovered.
    pub fn n_lost(&self) -> usize {
        self.lost.values().sum()
    }

    /// Returns the error per slot in the unit of the points; infinite if not recovered.
    pub fn errors(&self) -> &[f64] {
        &self.errors
    }

    /// Returns the percentage of points recovered exactly, if counted; `None` without points.
    pub fn exact_percent(&self) -> Option<f64> {
        let n = self.n_points();
        self.n_exact.filter(|_| n > 0).map(|exact| 100.0 * exact as f64 / n as f64)
    }

    /// Returns the number of points with an error of at most `threshold`.
    pub fn n_within(&self, threshold: f64) -> usize {
        self.sorted.partition_point(|&error| error <= threshold)
    }

    /// Returns the percentage of points with an error of at most `threshold`; 0 without points.
    pub fn percent_within(&self, threshold: f64) -> f64 {
        let (within, n) = (self.n_within(threshold), self.sorted.len());
        if n == 0 { 0.0 } else { 100.0 * within as f64 / n as f64 }
    }

    /// Returns the sum of `weights` (one per slot) over points within `threshold`.
    pub fn weight_within(&self, threshold: f64, weights: &[f64]) -> f64 {
        let within = self.errors.iter().zip(weights).filter(|(error, _)| **error <= threshold);
        within.map(|(_, weight)| weight).sum()
    }

    /// Returns the error that `percent` of the points do not exceed, if known.
    pub fn percentile(&self, percent: f64) -> Option<f64> {
        let n = self.sorted.len();
        let rank = ((percent / 100.0 * n as f64).ceil() as usize).clamp(1, n.max(1));
        self.sorted.get(rank - 1).copied().filter(|error| error.is_finite())
    }
}

/// Returns `secret` with slots in the row order of `recovered`.
///
/// - [`RowOrder::Slots`][]: unchanged;
/// - [`RowOrder::DescriptorRows`]: by [`Secret::by_descriptor_row`];
/// - [`RowOrder::Either`] and [`RowOrder::Unstated`]: each record's two points in the order with
///   the smaller error, because an attacker without descriptors cannot know it. The published
///   attacks on paired lines are evaluated this way.
pub fn joined<'a, const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &'a Secret,
) -> Cow<'a, Secret> {
    let by_row = match recovered.about().order {
        _ if secret.slots_per_record() < 2 => return Cow::Borrowed(secret),
        RowOrder::Slots => return Cow::Borrowed(secret),
        RowOrder::DescriptorRows => return Cow::Owned(secret.by_descriptor_row()),
        RowOrder::Either | RowOrder::Unstated => secret.by_descriptor_row(),
    };
    let positions = original.reveal().positions();
    let error = |slot: usize, of: usize| {
        let position = recovered.position(slot);
        position.map_or(0.0, |at| distance(&at, &positions[by_row.hidden()[of].index()]))
    };
    Cow::Owned(by_row.exchanged(|a| {
        let b = a + 1;
        error(a, b) + error(b, a) < error(a, a) + error(b, b)
    }))
}

/// Returns for each slot 1 / the number of slots whose points have exactly the same place.
///
/// With these weights every place counts once. They sum to the number of places.
pub fn distinct_weights<const D: usize>(original: &Original<D>, secret: &Secret) -> Vec<f64> {
    let positions = original.reveal().positions();
    let place = |slot: &usize| {
        // Adding 0.0 turns -0.0 into 0.0.
        positions[secret.hidden()[*slot].index()].map(|x| (x + 0.0).to_bits())
    };
    let mut order: Vec<usize> = (0..secret.n_slots()).collect();
    order.sort_unstable_by_key(place);
    let mut weights = vec![1.0; order.len()];
    for twins in order.chunk_by(|a, b| place(a) == place(b)) {
        twins.iter().for_each(|&slot| weights[slot] = 1.0 / twins.len() as f64);
    }
    weights
}

/// Number of bins of the probability. The attacker is sure of the last one, from 90 % on.
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
        for (all, more) in self.bins.iter_mut().zip(&other.bins) {
            all.n += more.n;
            all.expected += more.expected;
            all.within += more.within;
        }
    }
}

/// Compares the probabilities of `recovered` to lie within `threshold` (unit of the map) with the
/// `accuracy` of the same points; `None` without probabilities.
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
        bin.n += 1;
        bin.expected += probability;
        bin.within += usize::from(error <= threshold);
    }
    Some(Reliability { n_points: recovered.n_slots(), bins })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_points_count_as_misses() {
        let accuracy = Accuracy::of(vec![0.1, f64::INFINITY, 0.3, 0.2]);
        assert_eq!(accuracy.percent_within(0.2), 50.0);
        assert_eq!(accuracy.percentile(50.0), Some(0.2));
        assert_eq!(accuracy.percentile(75.0), Some(0.3));
        assert_eq!(accuracy.percentile(99.0), None);
    }
}
