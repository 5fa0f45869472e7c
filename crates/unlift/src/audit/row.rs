//! One row of an audit: its scheme, source, inlier ratio and solver, and its figures.

use std::collections::BTreeMap;

use super::plan::Threshold;
use crate::evaluate::{Accuracy, Reliability, evaluate, reliability};
use crate::recover::{Recovered, Unknown};
use crate::truth::{DropReason, Original, Secret};
use crate::{Error, Unit};

/// Percentiles of the error in a row.
pub const PERCENTILES: [f64; 5] = [50.0, 75.0, 90.0, 95.0, 99.0];

/// A row of an audit. Figures are means over repeats; counts are those of the first repeat.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Scheme name.
    pub scheme: String,
    /// Source of the neighborhoods: `oracle`, `file`, or the name of a source.
    pub neighbors: String,
    /// Noise model of the oracle; `None` for other sources.
    pub oracle_noise: Option<&'static str>,
    /// Inlier ratio, requested (oracle) or measured.
    pub inlier_ratio: f64,
    /// Records per list: requested of the oracle, the longest of given lists, or chosen by an
    /// attacker's own source.
    ///
    /// The inlier ratio of given lists uses this many true neighbors. That of an attacker's own
    /// lists uses the K of the plan, so that short lists are not measured by a stricter rule.
    pub k: usize,
    /// Solver name.
    pub solver: String,
    /// Distance within which a listed record supports a position, in the unit of the points.
    pub delta: f64,
    /// The unit of lengths.
    pub unit: Unit,
    /// Number of released points.
    pub n_points: usize,
    /// Points that could not be recovered, by reason.
    pub lost: BTreeMap<&'static str, usize>,
    /// Points that the scheme left out, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
    /// Percentage recovered within each threshold, in the plan's order.
    pub recovered_percent: Vec<f64>,
    /// Percentage that the blind baseline recovers: no neighborhoods, one record at a time.
    pub blind_percent: Vec<f64>,
    /// Results of attacks on the released records alone, without neighborhoods or descriptors.
    /// Equal in all rows of a scheme; empty if there are none.
    pub records_alone: Vec<Alone>,
    /// Percentage of exchanged axes that were identified (`cp`).
    pub axis_accuracy_percent: Option<f64>,
    /// Percentage recovered exactly, with the very value that another record publishes (`cp`,
    /// `cp2d`): all coordinates equal the original's as `f32` relative to the released origin.
    pub exact_percent: Option<f64>,
    /// Percentage of descriptors assigned to their own point (paired lines with descriptors).
    pub assignment_accuracy_percent: Option<f64>,
    /// Figures of the plan's [measures](super::Measure) by name, and `inlier_ratio_at_k` of an
    /// attacker's own lists, which uses as many true neighbors as they have records. Means over
    /// repeats; over images, weighted by points.
    pub metrics: BTreeMap<String, f64>,
    /// Errors at [`PERCENTILES`]; `None` if fewer points were recovered.
    pub error_percentiles: Vec<Option<f64>>,
    /// Median error of the blind baseline.
    pub blind_median_error: Option<f64>,
    /// Reliability of the attacker's probabilities to lie within the smallest threshold, over all
    /// repeats; `None` for solvers without probabilities.
    pub reliability: Option<Reliability>,
    /// Reason why there are no such probabilities; `None` if there are, and for a row that is no
    /// attack.
    pub sure_unknown: Option<Unknown>,
    /// (Upper bound of trials, number of slots) of the sampling loop (`ransac`).
    pub ransac_trials: Option<Vec<(u32, u64)>>,
    /// Spread over repeats, if there are several.
    pub repeats: Option<Repeats>,
    /// Shares of distinct places (images only).
    pub distinct: Option<Distinct>,
}

/// Result of an attack on the records alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Alone {
    /// Solver, or source and solver: `tomography`, `geometric, joint`.
    pub name: &'static str,
    /// Percentage recovered within each threshold, in the plan's order.
    pub percent: Vec<f64>,
}

/// Shares of distinct places, each counted once: a fifth of the keypoints of an image share their
/// place with another. Keypoints at the same place have equal weights that sum to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Distinct {
    /// Number of distinct places.
    pub n_places: usize,
    /// Percentage recovered within each threshold, in the plan's order.
    pub recovered_percent: Vec<f64>,
    /// Percentage recovered by the blind baseline.
    pub blind_percent: Vec<f64>,
}

/// Spread over seeds.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeats {
    /// Number of seeds.
    pub n: u32,
    /// Standard deviation of each recovered percentage (with n - 1).
    pub recovered_percent_std: Vec<f64>,
    /// Standard deviation of each blind percentage.
    pub blind_percent_std: Vec<f64>,
    /// Standard deviation of the median error; `None` if it is unknown in any repeat.
    pub median_error_std: Option<f64>,
}

impl Row {
    /// Returns the number of points that could not be recovered.
    pub fn n_lost(&self) -> usize {
        self.lost.values().sum()
    }

    /// Returns the name and the percentage of the best attack on the records alone within threshold
    /// `at`.
    pub fn best_alone(&self, at: usize) -> Option<(&'static str, f64)> {
        let found = self.records_alone.iter().map(|alone| (alone.name, alone.percent[at]));
        found.reduce(|best, other| if other.1 > best.1 { other } else { best })
    }

    /// Returns the larger baseline within threshold `at`, in percent: the blind guess or the best
    /// attack on the records alone.
    pub fn baseline_percent(&self, at: usize) -> f64 {
        let blind = self.blind_percent[at];
        self.best_alone(at).map_or(blind, |(_, alone)| blind.max(alone))
    }

    /// Returns true if both have the same scheme, source, noise model, requested inlier ratio and
    /// solver. Measured ratios are not compared, because they differ between seeds.
    pub fn is_same_cell(&self, other: &Self) -> bool {
        self.scheme == other.scheme
            && self.neighbors == other.neighbors
            && self.oracle_noise == other.oracle_noise
            && self.solver == other.solver
            && (self.oracle_noise.is_none() || self.inlier_ratio == other.inlier_ratio)
    }

    pub(super) fn smallest(thresholds: &[Threshold]) -> f64 {
        thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min)
    }

    pub(super) fn fill(
        &mut self,
        accuracy: &Accuracy,
        blind: Option<&Accuracy>,
        thresholds: &[Threshold],
    ) {
        let within = |accuracy: &Accuracy| {
            thresholds.iter().map(|t| accuracy.percent_within(t.value)).collect()
        };
        self.n_points = accuracy.n_points();
        self.lost = accuracy.lost.iter().map(|(status, &n)| (status.name(), n)).collect();
        self.recovered_percent = within(accuracy);
        self.blind_percent = blind.map(within).unwrap_or_default();
        self.axis_accuracy_percent = accuracy.axis_percent;
        self.exact_percent = accuracy.exact_percent();
        self.assignment_accuracy_percent = accuracy.assignment_percent;
        self.error_percentiles = PERCENTILES.map(|p| accuracy.percentile(p)).to_vec();
        self.blind_median_error = blind.and_then(|blind| blind.percentile(50.0));
    }

    /// Adds the shares of distinct places; `weights` has one entry per slot.
    pub(super) fn fill_distinct(
        &mut self,
        accuracy: &Accuracy,
        blind: &Accuracy,
        weights: &[f64],
        thresholds: &[Threshold],
    ) {
        let all: f64 = weights.iter().sum();
        let within = |accuracy: &Accuracy| {
            let percent = |t: &Threshold| match all {
                0.0 => 0.0,
                _ => 100.0 * accuracy.weight_within(t.value, weights) / all,
            };
            thresholds.iter().map(percent).collect()
        };
        self.distinct = Some(Distinct {
            n_places: all.round() as usize,
            recovered_percent: within(accuracy),
            blind_percent: within(blind),
        });
    }

    pub(super) fn mean(rows: &[Row]) -> Row {
        let mut mean = rows[0].clone();
        if rows.len() < 2 {
            return mean;
        }
        let n = rows.len() as f64;
        let average = |value: &dyn Fn(&Row) -> Option<f64>| {
            let values: Option<Vec<f64>> = rows.iter().map(value).collect();
            values.map(|values| values.iter().sum::<f64>() / n)
        };
        let spread = |value: &dyn Fn(&Row) -> Option<f64>| {
            let m = average(value)?;
            let squares: f64 = rows.iter().filter_map(value).map(|x| (x - m) * (x - m)).sum();
            Some((squares / (n - 1.0)).sqrt())
        };
        let columns = 0..mean.recovered_percent.len();
        let known = |x: Option<f64>| x.unwrap_or(0.0);
        type Column = fn(&Row) -> Option<&Vec<f64>>;
        let means = |of: Column| -> Vec<f64> {
            columns.clone().map(|c| known(average(&|r| Some(of(r)?[c])))).collect()
        };
        let spreads = |of: Column| -> Vec<f64> {
            columns.clone().map(|c| known(spread(&|r| Some(of(r)?[c])))).collect()
        };
        let repeats = Repeats {
            n: rows.len() as u32,
            recovered_percent_std: spreads(|r| Some(&r.recovered_percent)),
            blind_percent_std: spreads(|r| Some(&r.blind_percent)),
            median_error_std: spread(&|r| r.error_percentiles[0]),
        };
        mean.recovered_percent = means(|r| Some(&r.recovered_percent));
        mean.blind_percent = means(|r| Some(&r.blind_percent));
        if let Some(distinct) = &mut mean.distinct {
            distinct.recovered_percent = means(|r| Some(&r.distinct.as_ref()?.recovered_percent));
            distinct.blind_percent = means(|r| Some(&r.distinct.as_ref()?.blind_percent));
        }
        for p in 0..mean.error_percentiles.len() {
            mean.error_percentiles[p] = average(&|r| r.error_percentiles[p]);
        }
        mean.blind_median_error = average(&|r| r.blind_median_error);
        mean.delta = average(&|r| Some(r.delta)).unwrap_or(mean.delta);
        // A requested ratio identifies the row; averaging would change its last bit.
        if mean.oracle_noise.is_none() {
            mean.inlier_ratio = known(average(&|r| Some(r.inlier_ratio)));
        }
        mean.exact_percent = average(&|r| r.exact_percent);
        mean.axis_accuracy_percent = average(&|r| r.axis_accuracy_percent);
        mean.metrics.retain(|name, value| {
            let all = average(&|r| r.metrics.get(name).copied());
            *value = all.unwrap_or(*value);
            all.is_some()
        });
        mean.assignment_accuracy_percent = average(&|r| r.assignment_accuracy_percent);
        for row in &rows[1..] {
            if let (Some(all), Some(more)) = (&mut mean.reliability, &row.reliability) {
                all.merge(more);
            }
        }
        // Confidence counts only if it is known in all repeats; a part of them would be biased.
        mean.sure_unknown = rows.iter().find_map(|row| row.sure_unknown);
        if mean.sure_unknown.is_some() {
            mean.reliability = None;
        }
        mean.records_alone.retain_mut(|alone| {
            let of = |row: &Row| row.records_alone.iter().find(|a| a.name == alone.name).cloned();
            let all: Option<Vec<Alone>> = rows.iter().map(of).collect();
            for (c, percent) in alone.percent.iter_mut().enumerate() {
                let values = all.iter().flatten().map(|alone| alone.percent[c]);
                *percent = values.sum::<f64>() / n;
            }
            all.is_some()
        });
        mean.repeats = Some(repeats);
        mean
    }
}

/// Computes the row of `recovered` and its errors. The caller fills in scheme, source, inlier
/// ratio, K and solver.
///
/// `secret` is the secret that the obfuscation returned. `blind` contains the errors of the blind
/// baseline; without it, the row has no blind figures.
///
/// # Errors
/// When the three do not belong together, see [`evaluate`].
pub fn measure<const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &Secret,
    blind: Option<&Accuracy>,
    thresholds: &[Threshold],
) -> Result<(Row, Accuracy), Error> {
    let accuracy = evaluate(recovered, original, secret)?;
    let mut row = unmeasured(recovered.unit(), secret);
    row.delta = recovered.delta();
    row.ransac_trials = recovered.trials().map(|trials| trials.bins().collect());
    row.fill(&accuracy, blind, thresholds);
    row.sure_unknown = recovered.confidence_unknown();
    row.reliability = reliability(recovered, &accuracy, Row::smallest(thresholds));
    Ok((row, accuracy))
}

/// Returns a row with the figures of the obfuscation only.
pub(super) fn unmeasured(unit: Unit, secret: &Secret) -> Row {
    let mut dropped = BTreeMap::new();
    for reason in DropReason::ALL {
        let n = secret.dropped().iter().filter(|d| d.reason == reason).count();
        if n > 0 {
            dropped.insert(reason.name(), n);
        }
    }
    Row {
        scheme: String::new(),
        neighbors: String::new(),
        oracle_noise: None,
        inlier_ratio: 0.0,
        k: 0,
        solver: String::new(),
        delta: 0.0,
        unit,
        n_points: secret.n_slots(),
        lost: BTreeMap::new(),
        dropped,
        recovered_percent: Vec::new(),
        blind_percent: Vec::new(),
        records_alone: Vec::new(),
        axis_accuracy_percent: None,
        exact_percent: None,
        assignment_accuracy_percent: None,
        metrics: BTreeMap::new(),
        error_percentiles: Vec::new(),
        blind_median_error: None,
        reliability: None,
        sure_unknown: None,
        ransac_trials: None,
        repeats: None,
        distinct: None,
    }
}
