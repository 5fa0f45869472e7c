//! Sums and a histogram of errors, of bounded size, for one row over many images or tiles.

use std::collections::BTreeMap;

use super::cells::Finished;
use super::row::{Alone, Distinct, PERCENTILES, Row};
use super::threshold::Threshold;
use crate::evaluate::{Accuracy, Reliability};
use crate::recover::Unknown;

/// Bits of the mantissa of an `f32` that the histogram of errors ignores: bins are 0.05 % wide.
const DROPPED_BITS: u32 = 12;

/// Weighted sum of a figure, and the weight of the points or images that have it.
#[derive(Clone, Copy, Debug, Default)]
struct Figure {
    sum: f64,
    known: usize,
    /// True if images count once, not points.
    of_images: bool,
}

/// Sums over images. Shares are computed at the end, so rounding errors do not add up.
#[derive(Debug)]
pub(super) struct Pool {
    /// Row of the first image, which identifies the cell.
    cell: Row,
    n_points: usize,
    within: Vec<usize>,
    blind_within: Vec<usize>,
    exact: Option<usize>,
    /// Percentage of slots whose axis was identified, times slots.
    axis: Option<f64>,
    n_places: f64,
    places_within: Vec<f64>,
    blind_places_within: Vec<f64>,
    metrics: BTreeMap<String, Figure>,
    /// Delta times slots.
    delta: f64,
    /// Number of true entries of lists.
    hits: f64,
    n_listed: usize,
    lost: BTreeMap<&'static str, usize>,
    dropped: BTreeMap<&'static str, usize>,
    trials: Option<BTreeMap<u32, u64>>,
    /// Percentages times points, for each attack on the records alone.
    alone: BTreeMap<&'static str, Vec<f64>>,
    /// Percentage of descriptors assigned to their own point, times points.
    assignment: Option<f64>,
    reliability: Option<Reliability>,
    sure_unknown: Option<Unknown>,
    errors: Errors,
    blind_errors: Errors,
}

impl Pool {
    pub(super) fn new(row: &Row, thresholds: &[Threshold]) -> Self {
        let n = thresholds.len();
        Self {
            cell: row.clone(),
            n_points: 0,
            within: vec![0; n],
            blind_within: vec![0; n],
            exact: row.exact_percent.map(|_| 0),
            axis: row.axis_accuracy_percent.map(|_| 0.0),
            n_places: 0.0,
            places_within: vec![0.0; n],
            blind_places_within: vec![0.0; n],
            metrics: BTreeMap::new(),
            delta: 0.0,
            hits: 0.0,
            n_listed: 0,
            lost: BTreeMap::new(),
            dropped: BTreeMap::new(),
            trials: row.ransac_trials.as_ref().map(|_| BTreeMap::new()),
            alone: BTreeMap::new(),
            assignment: row.assignment_accuracy_percent.map(|_| 0.0),
            reliability: None,
            sure_unknown: None,
            errors: Errors::default(),
            blind_errors: Errors::default(),
        }
    }

    pub(super) fn add(&mut self, finished: &Finished<'_>, thresholds: &[Threshold]) {
        let Finished { row, accuracy, baseline, weights, whole, n_listed, .. } = finished;
        let n = accuracy.n_points();
        self.n_points += n;
        for (at, threshold) in thresholds.iter().enumerate() {
            self.within[at] += accuracy.n_within(threshold.value);
            self.blind_within[at] += baseline.n_within(threshold.value);
            self.places_within[at] += accuracy.weight_within(threshold.value, weights);
            self.blind_places_within[at] += baseline.weight_within(threshold.value, weights);
        }
        if let Some(n_exact) = accuracy.n_exact {
            *self.exact.get_or_insert(0) += n_exact;
        }
        if let Some(percent) = row.axis_accuracy_percent {
            *self.axis.get_or_insert(0.0) += percent * n as f64;
        }
        for (name, value) in &row.metrics {
            let of_images = whole.contains(name);
            let count = if of_images { 1 } else { n };
            let figure = self.metrics.entry(name.clone()).or_default();
            figure.sum += value * count as f64;
            figure.known += count;
            figure.of_images = of_images;
        }
        self.n_places += weights.iter().sum::<f64>();
        self.delta += row.delta * n as f64;
        self.hits += row.inlier_ratio * *n_listed as f64;
        self.n_listed += n_listed;
        for (&reason, count) in &row.lost {
            *self.lost.entry(reason).or_insert(0) += count;
        }
        for (&reason, count) in &row.dropped {
            *self.dropped.entry(reason).or_insert(0) += count;
        }
        for &(up_to, slots) in row.ransac_trials.iter().flatten() {
            let trials = self.trials.get_or_insert_with(BTreeMap::new);
            *trials.entry(up_to).or_insert(0) += slots;
        }
        for alone in &row.records_alone {
            let percent = alone.percent.iter().map(|percent| percent * n as f64);
            self.alone.insert(alone.name, percent.collect());
        }
        if let Some(percent) = row.assignment_accuracy_percent {
            *self.assignment.get_or_insert(0.0) += percent * n as f64;
        }
        self.reliability.clone_from(&row.reliability);
        self.sure_unknown = row.sure_unknown;
        self.errors.add(accuracy);
        self.blind_errors.add(baseline);
    }

    /// Adds the sums of `more`, a pool of the same row.
    pub(super) fn merge(&mut self, more: &Self) {
        self.n_points += more.n_points;
        let counts = |to: &mut [usize], more: &[usize]| {
            to.iter_mut().zip(more).for_each(|(to, more)| *to += more);
        };
        let sums = |to: &mut [f64], more: &[f64]| {
            to.iter_mut().zip(more).for_each(|(to, more)| *to += more);
        };
        counts(&mut self.within, &more.within);
        counts(&mut self.blind_within, &more.blind_within);
        sums(&mut self.places_within, &more.places_within);
        sums(&mut self.blind_places_within, &more.blind_places_within);
        if let Some(more) = more.exact {
            *self.exact.get_or_insert(0) += more;
        }
        if let Some(more) = more.axis {
            *self.axis.get_or_insert(0.0) += more;
        }
        for (name, more) in &more.metrics {
            let figure = self.metrics.entry(name.clone()).or_default();
            figure.sum += more.sum;
            figure.known += more.known;
            figure.of_images = more.of_images;
        }
        self.n_places += more.n_places;
        self.delta += more.delta;
        self.hits += more.hits;
        self.n_listed += more.n_listed;
        for (name, more) in &more.alone {
            // An attack that cannot run on an item recovers nothing there.
            sums(self.alone.entry(name).or_insert_with(|| vec![0.0; more.len()]), more);
        }
        if let Some(more) = more.assignment {
            *self.assignment.get_or_insert(0.0) += more;
        }
        if let (Some(all), Some(more)) = (&mut self.reliability, &more.reliability) {
            all.merge(more);
        }
        // Confidence counts only if it is known for all items.
        self.sure_unknown = self.sure_unknown.or(more.sure_unknown);
        merge_counts(&mut self.lost, &more.lost);
        merge_counts(&mut self.dropped, &more.dropped);
        merge_counts(&mut self.errors.0, &more.errors.0);
        merge_counts(&mut self.blind_errors.0, &more.blind_errors.0);
        for (&up_to, slots) in more.trials.iter().flatten() {
            *self.trials.get_or_insert_with(BTreeMap::new).entry(up_to).or_insert(0) += slots;
        }
    }

    pub(super) fn row(&self, thresholds: &[Threshold]) -> Row {
        let n = self.n_points.max(1) as f64;
        let percent = |counts: &[usize]| counts.iter().map(|&c| 100.0 * c as f64 / n).collect();
        let places = self.n_places.max(f64::MIN_POSITIVE);
        let of_places = |sums: &[f64]| sums.iter().map(|sum| 100.0 * sum / places).collect();
        debug_assert_eq!(self.within.len(), thresholds.len());
        Row {
            // A requested ratio identifies the cell. A measured one is a mean over entries.
            inlier_ratio: match self.cell.oracle_noise {
                None if self.n_listed > 0 => self.hits / self.n_listed as f64,
                _ => self.cell.inlier_ratio,
            },
            delta: self.delta / n,
            n_points: self.n_points,
            lost: self.lost.clone(),
            dropped: self.dropped.clone(),
            recovered_percent: percent(&self.within),
            blind_percent: percent(&self.blind_within),
            axis_accuracy_percent: self.axis.map(|sum| sum / n),
            exact_percent: self.exact.map(|exact| 100.0 * exact as f64 / n),
            metrics: self
                .metrics
                .iter()
                .filter(|(_, figure)| figure.of_images || figure.known == self.n_points)
                .map(|(name, figure)| (name.clone(), figure.sum / figure.known.max(1) as f64))
                .collect(),
            error_percentiles: PERCENTILES
                .map(|p| self.errors.percentile(p, self.n_points))
                .to_vec(),
            blind_median_error: self.blind_errors.percentile(50.0, self.n_points),
            ransac_trials: self
                .trials
                .as_ref()
                .map(|trials| trials.iter().map(|(&up_to, &slots)| (up_to, slots)).collect()),
            records_alone: self
                .alone
                .iter()
                .map(|(&name, sums)| Alone {
                    name,
                    percent: sums.iter().map(|sum| sum / n).collect(),
                })
                .collect(),
            assignment_accuracy_percent: self.assignment.map(|sum| sum / n),
            reliability: self.reliability.clone().filter(|_| self.sure_unknown.is_none()),
            sure_unknown: self.sure_unknown,
            distinct: self.cell.distinct.as_ref().map(|_| Distinct {
                n_places: self.n_places.round() as usize,
                recovered_percent: of_places(&self.places_within),
                blind_percent: of_places(&self.blind_places_within),
            }),
            ..self.cell.clone()
        }
    }
}

/// Histogram of finite errors by their leading bits.
#[derive(Debug, Default)]
struct Errors(BTreeMap<u32, usize>);

impl Errors {
    fn add(&mut self, accuracy: &Accuracy) {
        for &error in accuracy.errors().iter().filter(|error| error.is_finite()) {
            *self.0.entry((error as f32).to_bits() >> DROPPED_BITS).or_insert(0) += 1;
        }
    }

    /// Returns the error that `percent` of `of` keypoints do not exceed, to the width of a bin;
    /// `None` if fewer were recovered.
    fn percentile(&self, percent: f64, of: usize) -> Option<f64> {
        let rank = ((percent / 100.0 * of as f64).ceil() as usize).max(1);
        let mut below = 0;
        for (&bin, &count) in &self.0 {
            below += count;
            if below >= rank {
                // Errors of exactly 0 stay 0; other bins return their middle.
                let half = if bin == 0 { 0 } else { 1 << (DROPPED_BITS - 1) };
                return Some(f64::from(f32::from_bits(bin << DROPPED_BITS | half)));
            }
        }
        None
    }
}

fn merge_counts<K: Copy + Ord>(to: &mut BTreeMap<K, usize>, more: &BTreeMap<K, usize>) {
    for (&key, count) in more {
        *to.entry(key).or_insert(0) += count;
    }
}
