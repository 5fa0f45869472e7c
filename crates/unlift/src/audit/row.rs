//! One result: a scheme, a source of neighborhoods, an inlier ratio and a solver.

use std::collections::BTreeMap;

use super::threshold::Threshold;
use crate::Unit;
use crate::evaluate::{Accuracy, Reliability};
use crate::recover::Unknown;

/// Percentiles of the error that a row keeps.
pub const PERCENTILES: [f64; 5] = [50.0, 75.0, 90.0, 95.0, 99.0];

/// A row of an audit. Means over repeats, where there are several; counts are of the first repeat.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Scheme name.
    pub scheme: String,
    /// Source of the neighborhoods: `oracle`, `file`, or the name of a source.
    pub neighbors: String,
    /// Noise model of the oracle; `None` for other sources.
    pub oracle_noise: Option<&'static str>,
    /// As requested (oracle) or measured.
    pub inlier_ratio: f64,
    /// Records per list: of the oracle, the longest of given lists, or the attacker's choice. The
    /// ratio of given lists is measured against as many true neighbors; that of an attacker's own
    /// lists against those of the plan, so that a short list is not judged by a stricter rule.
    pub k: usize,
    /// Solver name.
    pub solver: String,
    /// The distance that decided support, in the unit of the points.
    pub delta: f64,
    /// The unit of lengths.
    pub unit: Unit,
    /// Released points.
    pub n_points: usize,
    /// Points that could not be recovered, by reason.
    pub lost: BTreeMap<&'static str, usize>,
    /// Points the scheme left out, by reason.
    pub dropped: BTreeMap<&'static str, usize>,
    /// Percentage recovered within each threshold, in the plan's order.
    pub recovered_percent: Vec<f64>,
    /// The same for a blind guess: no neighborhoods, and no look at more than one record.
    pub blind_percent: Vec<f64>,
    /// What attacks on the released records alone got, without neighborhoods and descriptors; the same in
    /// all rows of a scheme, empty where there is none.
    pub records_alone: Vec<Alone>,
    /// Share of exchanged axes named (`cp`).
    pub axis_accuracy_percent: Option<f64>,
    /// Percentage recovered exactly, that is with the very value that another record publishes (`cp`, `cp2d`):
    /// all coordinates equal those of the original as `f32` about the released origin.
    pub exact_percent: Option<f64>,
    /// Share of descriptors given to their own point (paired lines with descriptors).
    pub assignment_accuracy_percent: Option<f64>,
    /// `inlier_ratio_at_k` of an attacker's own lists, against as many true neighbors as they have records; and figures
    /// of the plan's [measures](super::Measure), by name; means over repeats and, weighted by points, over
    /// images.
    pub metrics: BTreeMap<String, f64>,
    /// Errors at [`PERCENTILES`]; `None` where that many points were lost.
    pub error_percentiles: Vec<Option<f64>>,
    /// Median error of an attacker without neighborhoods.
    pub blind_median_error: Option<f64>,
    /// Whether the attacker's probabilities to lie within the smallest threshold came true, over all
    /// repeats; `None` for solvers that give none.
    pub reliability: Option<Reliability>,
    /// Why there are no such probabilities; `None` where there are, and for a row that is no attack.
    pub sure_unknown: Option<Unknown>,
    /// (trials at most, slots) of the sampling loop (`ransac`).
    pub ransac_trials: Option<Vec<(u32, u64)>>,
    /// Spread over repeats, if there are several.
    pub repeats: Option<Repeats>,
    /// The shares over distinct places (images only).
    pub distinct: Option<Distinct>,
}

/// An attack on the records alone, and how much it got.
#[derive(Clone, Debug, PartialEq)]
pub struct Alone {
    /// The solver, or source and solver: `tomography`, `geometric, joint`.
    pub name: &'static str,
    /// Percentage recovered within each threshold, in the plan's order.
    pub percent: Vec<f64>,
}

/// Shares over distinct places: a fifth of the keypoints of an image have a twin at the same place, and
/// every place counts once here. Of twins with different fates each counts half.
#[derive(Clone, Debug, PartialEq)]
pub struct Distinct {
    /// Places.
    pub n_places: usize,
    /// Percentage recovered within each threshold, in the plan's order.
    pub recovered_percent: Vec<f64>,
    /// Percentage recovered by an attacker without neighborhoods.
    pub blind_percent: Vec<f64>,
}

/// Spread over seeds.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeats {
    /// Number of seeds.
    pub n: u32,
    /// Standard deviation of each recovered percentage (with n - 1).
    pub recovered_percent_std: Vec<f64>,
    /// The same of each blind percentage.
    pub blind_percent_std: Vec<f64>,
    /// The same of the median error; `None` where it is not known in every repeat.
    pub median_error_std: Option<f64>,
}

impl Row {
    /// Points that could not be recovered.
    pub fn n_lost(&self) -> usize {
        self.lost.values().sum()
    }

    /// The best attack on the records alone within the threshold numbered `at`: its name, and the percentage.
    pub fn best_alone(&self, at: usize) -> Option<(&'static str, f64)> {
        let found = self.records_alone.iter().map(|alone| (alone.name, alone.percent[at]));
        found.reduce(|best, other| if other.1 > best.1 { other } else { best })
    }

    /// What an attacker without neighborhoods gets within the threshold numbered `at`, in percent: the
    /// larger of a blind guess and the best attack on the records alone.
    pub fn baseline_percent(&self, at: usize) -> f64 {
        let blind = self.blind_percent[at];
        self.best_alone(at).map_or(blind, |(_, alone)| blind.max(alone))
    }

    /// Whether both are of the same scheme, source, noise model, requested inlier ratio and solver. A
    /// measured ratio tells nothing apart: it differs from seed to seed.
    pub fn is_same_cell(&self, other: &Self) -> bool {
        self.scheme == other.scheme
            && self.neighbors == other.neighbors
            && self.oracle_noise == other.oracle_noise
            && self.solver == other.solver
            && (self.oracle_noise.is_none() || self.inlier_ratio == other.inlier_ratio)
    }

    /// The smallest of `thresholds`.
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

    /// Adds the shares over distinct places; `weights` are those of the slots.
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

    /// The mean of the same row over several seeds.
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
        let repeats = Repeats {
            n: rows.len() as u32,
            recovered_percent_std: columns
                .clone()
                .map(|c| known(spread(&|r| Some(r.recovered_percent[c]))))
                .collect(),
            blind_percent_std: columns
                .clone()
                .map(|c| known(spread(&|r| Some(r.blind_percent[c]))))
                .collect(),
            median_error_std: spread(&|r| r.error_percentiles[0]),
        };
        for c in columns {
            mean.recovered_percent[c] = known(average(&|r| Some(r.recovered_percent[c])));
            mean.blind_percent[c] = known(average(&|r| Some(r.blind_percent[c])));
        }
        if let Some(distinct) = &mut mean.distinct {
            let of = |r: &Row| r.distinct.clone();
            for c in 0..distinct.recovered_percent.len() {
                distinct.recovered_percent[c] =
                    known(average(&|r| of(r).map(|d| d.recovered_percent[c])));
                distinct.blind_percent[c] = known(average(&|r| of(r).map(|d| d.blind_percent[c])));
            }
        }
        for p in 0..mean.error_percentiles.len() {
            mean.error_percentiles[p] = average(&|r| r.error_percentiles[p]);
        }
        mean.blind_median_error = average(&|r| r.blind_median_error);
        mean.delta = average(&|r| Some(r.delta)).unwrap_or(mean.delta);
        // A requested ratio is a name, not a measurement: a mean would change its last bit.
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
        // Known in some repeats is not known: those may be the ones that went well.
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
