//! One row of an audit: its scheme, source, inlier ratio and solver, and its figures.

use std::collections::BTreeMap;

use indexmap::IndexMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::share::{
    ByThreshold, Interval, Share, Shares, Threshold, WithInterval, interval_of_largest, intervals,
    over_repeats, percents, shares,
};
use crate::evaluate::{Accuracy, Bin, Reliability, evaluate, exchanged_percent, reliability};
use crate::recover::Recovered;
use crate::truth::{DropReason, Original, Secret};
use crate::{Error, Unit};

/// Percentiles of the error in a row.
pub const PERCENTILES: [f64; 9] = [2.0, 5.0, 10.0, 25.0, 50.0, 75.0, 90.0, 95.0, 99.0];

/// Numbers of points by reason.
pub type ByReason = BTreeMap<String, usize>;

/// A row of an audit, as `audit.json` has it: means over repeats, and counts of the first repeat.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Scheme name, for example `ppl+`.
    pub scheme: String,
    /// Source of the neighborhoods: `oracle`, `file`, or the name of a source.
    pub neighbors: String,
    /// Noise model of the oracle: `uniform`, `near` or `clustered`; `None` for other sources.
    pub oracle_noise: Option<String>,
    /// Inlier ratio, requested (oracle) or measured.
    pub inlier_ratio: f64,
    /// Records per list: requested, the longest of given lists, or chosen by the source.
    ///
    /// The inlier ratio of given lists uses this many true neighbors. That of an attacker's own
    /// lists uses the K of the plan, so that short lists are not measured by a stricter rule.
    pub k: usize,
    /// Solver name.
    pub solver: String,
    /// Distance within which a listed record supports a position, in `unit`.
    pub delta: f64,
    /// Unit of all lengths.
    #[serde(serialize_with = "write_unit", deserialize_with = "read_unit")]
    pub unit: Unit,
    /// Number of released points, the base of all percentages.
    pub n_points: usize,
    /// Released points that could not be recovered; they count as misses.
    pub n_lost: usize,
    /// `n_lost` by reason.
    pub lost: ByReason,
    /// Points that the scheme left out, by reason.
    pub dropped: ByReason,
    /// Percentage recovered within each threshold.
    pub recovered_percent: ByThreshold,
    /// Percentage that the blind baseline recovers: no neighborhoods, one record at a time.
    pub blind_percent: ByThreshold,
    /// Percentage that the best attack on the released records alone recovers, without neighborhoods
    /// or descriptors. Equal in all rows of a scheme; absent without such an attack.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub records_alone_percent: Option<ByThreshold>,
    /// Best attack on the records alone within each threshold: `tomography`, `geometric, joint`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub records_alone_by: Option<IndexMap<String, String>>,
    /// Percentage of exchanged axes that were identified (`cp`).
    pub axis_accuracy_percent: Option<f64>,
    /// Percentage recovered exactly, with the very value that another record publishes (`cp`,
    /// `cp2d`): all coordinates equal the original's as `f32` relative to the released origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact_percent: Option<f64>,
    /// Percentage of descriptors assigned to their own point (paired lines with descriptors).
    pub assignment_accuracy_percent: Option<f64>,
    /// Figures of the plan's [measures](super::Measure) by name, and `inlier_ratio_at_k` of other
    /// lists than the oracle's, by as many true neighbors as they have records.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub metrics: BTreeMap<String, f64>,
    /// Median error; lost points count as infinitely far, and `None` is infinite.
    pub median_error: Option<f64>,
    /// Median error of the blind baseline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blind_median_error: Option<f64>,
    /// Errors at [`PERCENTILES`]; `None` if fewer points were recovered.
    pub error_percentiles: IndexMap<String, Option<f64>>,
    /// Percentage of released points that the attacker estimates to be within the smallest threshold
    /// with a probability of at least 90 %, over all repeats; `None` if unknown.
    #[serde(default)]
    pub sure_percent: Option<f64>,
    /// Reason why `sure_percent` is unknown; absent if it is known, and for a row that is no attack.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sure_unknown: Option<String>,
    /// Percentage of these points that are within the smallest threshold; absent without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sure_correct_percent: Option<f64>,
    /// Ten bins of the attacker's probability, from 0 to 1, over recovered points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reliability: Option<Vec<ReliabilityBin>>,
    /// (Upper bound of trials, number of slots) of the sampling loop (`ransac`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ransac_trials: Option<Vec<(u32, u64)>>,
    /// Number of runs with different seeds.
    #[serde(default = "single", skip_serializing_if = "is_single")]
    pub repeats: u32,
    /// Spread over repeats, if there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<Spread>,
    /// 95 % intervals of the percentages; absent in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<Intervals>,
    /// Shares of distinct places (images only).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distinct: Option<Distinct>,
    /// What means over repeats and items need; not written.
    #[serde(skip)]
    pub parts: Parts,
}

/// Results that a row summarizes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// Results of all attacks on the records alone.
    pub alone: Vec<Alone>,
    /// Reliability of the probabilities to lie within the smallest threshold, if any.
    pub reliability: Option<Reliability>,
}

/// Result of an attack on the records alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Alone {
    /// Solver, or source and solver: `tomography`, `geometric, joint`.
    pub name: &'static str,
    /// Share recovered within each threshold.
    pub shares: Shares,
}

/// Points with similar probabilities, over all repeats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReliabilityBin {
    /// Mean probability, 0 to 1; `None` without points.
    pub predicted: Option<f64>,
    /// Share of points within the smallest threshold; `None` without points.
    pub observed: Option<f64>,
    /// Number of points.
    pub n: usize,
}

/// Shares of distinct places, each counted once: a fifth of the keypoints of an image share their
/// place with another. Keypoints at the same place have equal weights that sum to 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distinct {
    /// Number of distinct places.
    pub n_places: usize,
    /// Percentage recovered within each threshold.
    pub recovered_percent: ByThreshold,
    /// Percentage recovered by the blind baseline.
    pub blind_percent: ByThreshold,
}

impl Distinct {
    pub(super) fn of(places: f64, recovered: &Shares, blind: &Shares) -> Self {
        let (recovered_percent, blind_percent) = (percents(recovered), percents(blind));
        Self { n_places: places.round() as usize, recovered_percent, blind_percent }
    }
}

/// Standard deviations over repeats (with n - 1).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Deviation of each recovered percentage.
    pub recovered_percent: ByThreshold,
    /// Deviation of each blind percentage.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub blind_percent: ByThreshold,
    /// Deviation of the median error; `None` if it is unknown in any repeat.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_error: Option<f64>,
}

/// 95 % intervals: the widest of those over points, over several items, and over repeats.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Intervals {
    /// Interval of each recovered percentage.
    pub recovered_percent: IndexMap<String, Interval>,
    /// Interval of each blind percentage.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub blind_percent: IndexMap<String, Interval>,
    /// Interval of the best attack on the records alone.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub records_alone_percent: IndexMap<String, Interval>,
}

/// Returns the share of points within each threshold.
pub(super) fn within(accuracy: &Accuracy, thresholds: &[Threshold]) -> Shares {
    let n = accuracy.n_points() as f64;
    shares(thresholds, |t| Share::of(accuracy.n_within(t.value) as f64, n))
}

/// Returns the share of distinct places within each threshold; `weights` has one entry per slot.
pub(super) fn places_within(
    accuracy: &Accuracy,
    weights: &[f64],
    thresholds: &[Threshold],
) -> Shares {
    let n: f64 = weights.iter().sum();
    shares(thresholds, |t| Share::of(accuracy.weight_within(t.value, weights), n))
}

/// Returns the numbers of points that a scheme left out.
pub(super) fn dropped(secret: &Secret) -> ByReason {
    let count = |reason: DropReason| (reason.name().to_owned(), secret.n_dropped(reason));
    DropReason::ALL.map(count).into_iter().filter(|(_, n)| *n > 0).collect()
}

fn write_unit<S: Serializer>(unit: &Unit, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(unit.name())
}

fn read_unit<'de, D: Deserializer<'de>>(from: D) -> Result<Unit, D::Error> {
    let name = String::deserialize(from)?;
    let expected = "unit: expected m, px or kth_neighbor, found";
    Unit::named(&name).ok_or_else(|| serde::de::Error::custom(format!("{expected} {name}")))
}

fn single() -> u32 {
    1
}

fn is_single(value: &u32) -> bool {
    *value == 1
}

impl Row {
    /// Returns the larger baseline within `threshold`, in percent: blind, or the records alone.
    pub fn baseline_percent(&self, threshold: &str) -> Option<f64> {
        let alone = self.records_alone_percent.as_ref().and_then(|by| by.get(threshold));
        self.blind_percent.get(threshold).into_iter().chain(alone).copied().reduce(f64::max)
    }

    /// Returns the recovered percentage within `threshold` with its interval.
    pub fn recovered(&self, threshold: &str) -> Option<WithInterval> {
        let interval = self.interval.as_ref()?.recovered_percent.get(threshold)?;
        Some(WithInterval { percent: *self.recovered_percent.get(threshold)?, interval: *interval })
    }

    /// Returns the [baseline](Self::baseline_percent) within `threshold` with its interval.
    pub fn baseline(&self, threshold: &str) -> Option<WithInterval> {
        let of = self.interval.as_ref()?;
        let both = [of.blind_percent.get(threshold), of.records_alone_percent.get(threshold)];
        let interval = interval_of_largest(both.into_iter().flatten().copied())?;
        Some(WithInterval { percent: self.baseline_percent(threshold)?, interval })
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

    /// Adds results of attacks on the records alone.
    pub fn add_alone(&mut self, more: impl IntoIterator<Item = Alone>) {
        self.parts.alone.extend(more);
        self.summarize();
    }

    /// Computes what is written of [`Parts`].
    pub(super) fn summarize(&mut self) {
        let best = |label: &String| {
            let all = self.parts.alone.iter().map(|alone| (alone.name, alone.shares[label]));
            let better = |a: &Share, b: &Share| b.percent() > a.percent();
            all.reduce(|best, next| if better(&best.1, &next.1) { next } else { best })
        };
        let labels = self.recovered_percent.keys();
        let best =
            labels.filter_map(|label| best(label).map(|(name, of)| (label.clone(), name, of)));
        let best: Vec<(String, &str, Share)> = best.collect();
        let named = best.iter().map(|(label, name, _)| (label.clone(), (*name).to_owned()));
        let shares = best.iter().map(|(label, _, share)| (label.clone(), *share)).collect();
        self.records_alone_by = (!best.is_empty()).then(|| named.collect());
        self.records_alone_percent = (!best.is_empty()).then(|| percents(&shares));
        self.interval.get_or_insert_default().records_alone_percent = intervals(&shares);
        let reliability = self.parts.reliability.as_ref();
        self.sure_percent = reliability.map(Reliability::sure_percent);
        self.sure_correct_percent = reliability.and_then(Reliability::sure_correct_percent);
        self.reliability = reliability.map(|all| {
            let bin = |bin: &Bin| ReliabilityBin {
                predicted: bin.predicted(),
                observed: bin.observed(),
                n: bin.n,
            };
            all.bins.iter().map(bin).collect()
        });
    }

    pub(super) fn fill_shares(&mut self, recovered: &Shares, blind: &Shares) {
        self.recovered_percent = percents(recovered);
        self.blind_percent = percents(blind);
        let of = self.interval.get_or_insert_default();
        of.recovered_percent = intervals(recovered);
        of.blind_percent = intervals(blind);
    }

    /// Fills in the error at each of [`PERCENTILES`].
    pub(super) fn fill_errors(&mut self, at: impl Fn(f64) -> Option<f64>) {
        self.error_percentiles = PERCENTILES.iter().map(|&p| (format!("{p:.0}"), at(p))).collect();
        self.median_error = at(50.0);
    }

    /// Adds the shares of distinct places; `weights` has one entry per slot.
    pub(super) fn fill_distinct(
        &mut self,
        accuracy: &Accuracy,
        blind: &Accuracy,
        weights: &[f64],
        thresholds: &[Threshold],
    ) {
        let [recovered, blind] = [accuracy, blind].map(|of| places_within(of, weights, thresholds));
        self.distinct = Some(Distinct::of(weights.iter().sum(), &recovered, &blind));
    }

    pub(super) fn mean(rows: &[Row]) -> Row {
        let mut mean = rows[0].clone();
        if rows.len() < 2 {
            return mean;
        }
        let n = rows.len() as f64;
        let mean_and_std = |value: &dyn Fn(&Row) -> Option<f64>| {
            let values: Vec<f64> = rows.iter().map(value).collect::<Option<_>>()?;
            let mean = values.iter().sum::<f64>() / n;
            let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
            Some((mean, (squares / (n - 1.0)).sqrt()))
        };
        let average = |value: &dyn Fn(&Row) -> Option<f64>| Some(mean_and_std(value)?.0);
        type Column = fn(&Row) -> Option<&ByThreshold>;
        let each = |of: Column| -> (ByThreshold, ByThreshold) {
            let labels = of(&rows[0]).into_iter().flat_map(|by| by.keys());
            let of_label = |label: &String| {
                let both = mean_and_std(&|r| of(r)?.get(label).copied());
                let (mean, std) = both.unwrap_or_default();
                ((label.clone(), mean), (label.clone(), std))
            };
            labels.map(of_label).unzip()
        };
        mean.repeats = rows.len() as u32;
        let (recovered, recovered_std) = each(|r| Some(&r.recovered_percent));
        let (blind, blind_std) = each(|r| Some(&r.blind_percent));
        type Ends = fn(&Intervals) -> &IndexMap<String, Interval>;
        let ends = |of: Ends, means: &ByThreshold, std: &ByThreshold| {
            let interval = |(label, mean): (&String, &f64)| {
                let of = |row: &Row| of(row.interval.as_ref()?).get(label).copied();
                let of: Option<Vec<Interval>> = rows.iter().map(of).collect();
                Some((label.clone(), over_repeats(&of?, *mean, *std.get(label)?)))
            };
            means.iter().filter_map(interval).collect()
        };
        mean.interval = Some(Intervals {
            recovered_percent: ends(|of| &of.recovered_percent, &recovered, &recovered_std),
            blind_percent: ends(|of| &of.blind_percent, &blind, &blind_std),
            ..Intervals::default()
        });
        (mean.recovered_percent, mean.blind_percent) = (recovered, blind);
        mean.std = Some(Spread {
            recovered_percent: recovered_std,
            blind_percent: blind_std,
            median_error: mean_and_std(&|r| r.median_error).map(|(_, std)| std),
        });
        if let Some(distinct) = &mut mean.distinct {
            (distinct.recovered_percent, _) =
                each(|r| Some(&r.distinct.as_ref()?.recovered_percent));
            (distinct.blind_percent, _) = each(|r| Some(&r.distinct.as_ref()?.blind_percent));
        }
        mean.fill_errors(|p| average(&|r| r.error_percentiles[&format!("{p:.0}")]));
        mean.blind_median_error = average(&|r| r.blind_median_error);
        mean.delta = average(&|r| Some(r.delta)).unwrap_or(mean.delta);
        // A requested ratio identifies the row; averaging would change its last bit.
        if mean.oracle_noise.is_none() {
            mean.inlier_ratio = average(&|r| Some(r.inlier_ratio)).unwrap_or(0.0);
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
            if let (Some(all), Some(more)) = (&mut mean.parts.reliability, &row.parts.reliability) {
                all.merge(more);
            }
        }
        // Confidence counts only if it is known in all repeats; a part of them would be biased.
        mean.sure_unknown = rows.iter().find_map(|row| row.sure_unknown.clone());
        if mean.sure_unknown.is_some() {
            mean.parts.reliability = None;
        }
        mean.parts.alone.retain_mut(|alone| {
            let of = |row: &Row| row.parts.alone.iter().find(|a| a.name == alone.name).cloned();
            let all: Option<Vec<Alone>> = rows.iter().map(of).collect();
            for (label, share) in &mut alone.shares {
                *share = Share::mean(all.iter().flatten().map(|alone| alone.shares[label]));
            }
            all.is_some()
        });
        mean.summarize();
        mean
    }
}

/// Metric of a row: the percentage of points recovered at the other point of their line. It is absent where this is usual.
pub(super) const EXCHANGED: &str = "exchanged_percent";

/// Computes the row of `recovered` and its errors, without the fields that name the cell.
///
/// `secret` is that which the obfuscation returned. Without `blind`, there are no blind figures.
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
    let lost = accuracy.lost.iter().map(|(status, &n)| (status.name().to_owned(), n));
    let mut row = Row {
        unit: recovered.unit(),
        delta: recovered.delta(),
        n_points: accuracy.n_points(),
        n_lost: accuracy.n_lost(),
        lost: lost.collect(),
        dropped: dropped(secret),
        axis_accuracy_percent: accuracy.axis_percent,
        exact_percent: accuracy.exact_percent(),
        assignment_accuracy_percent: accuracy.assignment_percent,
        blind_median_error: blind.and_then(|blind| blind.percentile(50.0)),
        ransac_trials: recovered.trials().map(<[_]>::to_vec),
        repeats: 1,
        sure_unknown: recovered.confidence_unknown().map(|unknown| unknown.reason().to_owned()),
        ..Row::default()
    };
    let shares_of = |of| within(of, thresholds);
    row.fill_shares(&shares_of(&accuracy), &blind.map(shares_of).unwrap_or_default());
    row.fill_errors(|p| accuracy.percentile(p));
    let smallest = thresholds.iter().map(|t| t.value).fold(f64::INFINITY, f64::min);
    row.parts.reliability = reliability(recovered, &accuracy, smallest);
    let exchanged = exchanged_percent(recovered, original, secret, smallest);
    row.metrics.extend(exchanged.map(|percent| (EXCHANGED.to_owned(), percent)));
    row.summarize();
    Ok((row, accuracy))
}
