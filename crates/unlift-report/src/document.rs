//! The structs of `audit.json`, schema 1.
//!
//! One row per (scheme, neighbors, oracle noise, inlier ratio, K, solver). Whatever differs from
//! run to run (seconds, memory, threads, paths on this machine) stands in [`Run`] and nowhere
//! else, so `results` are the same bytes for the same input, options and seed.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::round::round_floats;

pub use crate::round::SIGNIFICANT_DIGITS;
pub use crate::tiles::TileFigures;

/// The schema this build writes and reads.
pub const SCHEMA: u32 = 1;

/// Threshold, as the user typed it, to a number of percent; in the order typed.
pub type ByThreshold = IndexMap<String, f64>;

/// Stands for a solver's name in [`BreakEven::solver`]: at every inlier ratio the attack that got most.
pub const STRONGEST: &str = "strongest";

/// Reason to a number of points.
pub type ByReason = IndexMap<String, u64>;

/// A whole audit: what `audit.json` holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// Version of the program that wrote the document.
    pub unlift: String,
    /// Version of the format, [`SCHEMA`].
    pub schema: u32,
    /// What was audited.
    pub input: Input,
    /// The options that decide the results, by their long name without dashes.
    pub options: serde_json::Map<String, serde_json::Value>,
    /// The integer all randomness came from.
    pub seed: u64,
    /// The figures, one row per combination that was tried.
    pub results: Vec<Row>,
    /// What was to be audited and could not be, with the reason; empty when everything was. No figure
    /// of such a scheme is known: it must never read as a small one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_audited: Vec<NotAudited>,
    /// What whoever reads the figures must know of how they came to be: only a part of the map, unusual lengths, lists
    /// that name nobody.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The smallest inlier ratio at which half of the points come back, per scheme, noise and solver.
    pub break_even: Vec<BreakEven>,
    /// The user's gates and how they ended; empty when none was given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gates: Vec<GateResult>,
    /// Audits of images: every image that was used, in the order of names; empty for maps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub images: Vec<ImageFigures>,
    /// Audits of a large map in tiles: every tile, in the order in which the map was cut; empty for others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tiles: Vec<TileFigures>,
    /// What varies from run to run.
    pub run: Run,
}

/// What was audited.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// The map as the user named it; `None` in a share-safe document.
    pub path: Option<String>,
    /// SHA-256 over the map's files, in lowercase hexadecimal; `None` in a share-safe document: whoever guesses the
    /// map could confirm it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// Points read from the map, before any scheme dropped some.
    pub n_points: u64,
    /// Meters per map unit, as declared by the user; `None` when no scale was declared.
    pub scale_m_per_unit: Option<f64>,
    /// Length of one unit of this document in the map's own units: `1 / scale` with a scale, else
    /// the median distance to the K-th nearest neighbor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit_in_map_units: Option<f64>,
    /// SHA-256 of further files that were read, by role (`descriptors`, `neighbors`).
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub other_sha256: IndexMap<String, String>,
    /// How many images there were; `None` for maps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<ImageCounts>,
}

/// A scheme, or one source of neighborhoods for a scheme, that could not be audited.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotAudited {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The source without lists, as [`Row::neighbors`]; absent when the scheme itself cannot be applied,
    /// and so has no row at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neighbors: Option<String>,
    /// Why, in plain words: what was expected and what was found.
    pub reason: String,
}

/// The unit of every length in a row: thresholds, delta, errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LengthUnit {
    /// Meters, by the declared scale.
    #[serde(rename = "m")]
    Meter,
    /// The median distance of an original to its K-th nearest neighbor; used without a scale.
    #[serde(rename = "kth_neighbor")]
    KthNeighbor,
    /// Pixels of the image: audits of images.
    #[serde(rename = "px")]
    Pixel,
}

/// The figures of one (scheme, neighbors, oracle noise, inlier ratio, K, solver).
///
/// With repeats, the figures are means over the repeats and [`Row::std`] holds their spread.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scheme's user-facing name, for example `ppl+`.
    pub scheme: String,
    /// Where the neighborhoods came from: `oracle`, `file`, or the name of a source.
    pub neighbors: String,
    /// How the oracle chose the false neighbors: `uniform`, `near` or `clustered`; `None` without
    /// an oracle.
    pub oracle_noise: Option<String>,
    /// Share of true neighbors: as requested for the oracle, measured for other sources.
    pub inlier_ratio: f64,
    /// Neighbors per hidden point.
    pub k: u32,
    /// `joint`, `joint-start`, `consensus`, `ransac`, `density` or `tomography`.
    pub solver: String,
    /// The distance that decided support, in `unit`; `None` when it was chosen per point.
    pub delta: Option<f64>,
    /// The unit of all lengths in this row.
    pub unit: LengthUnit,
    /// Points released under the scheme: the base of all percentages.
    pub n_points: u64,
    /// Released points without a position after recovery; they count as misses.
    pub n_lost: u64,
    /// `n_lost` by reason.
    pub lost: ByReason,
    /// Points the scheme's rule did not release, by reason.
    pub dropped: ByReason,
    /// Percent of the released points recovered within each threshold.
    pub recovered_percent: ByThreshold,
    /// The same for a blind guess: no neighborhoods, and no look at more than one record.
    pub blind_percent: ByThreshold,
    /// The same for the best of our attacks that need the released records alone, neither neighborhoods nor
    /// descriptors; per threshold the best. The same in all rows of a scheme; absent where there is no
    /// such attack. What neighborhoods add is what exceeds [`Row::baseline_percent`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub records_alone_percent: Option<ByThreshold>,
    /// Which attack that was, by threshold: `tomography`, `density` or `geometric, joint`; has the keys of
    /// `records_alone_percent` and is absent with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub records_alone_by: Option<IndexMap<String, String>>,
    /// Percent of points whose swapped axis was told correctly (`cp` only).
    pub axis_accuracy_percent: Option<f64>,
    /// Percent of points recovered exactly: every coordinate is the original's as published (`cp`, `cp2d` only).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact_percent: Option<f64>,
    /// Percent of descriptors assigned to the right point of their line (`ppl`, `ppl+` only).
    pub assignment_accuracy_percent: Option<f64>,
    /// Figures of measures that whoever planned the audit added, by name; each in a unit of its own.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub metrics: IndexMap<String, f64>,
    /// Median error over the released points, in `unit`; lost points count as infinitely far, so
    /// `None` when half of them or more are lost.
    pub median_error: Option<f64>,
    /// The same of an attacker without neighborhoods; absent in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blind_median_error: Option<f64>,
    /// Percentiles of the error by their number (`50`, `75`, `90`, `95`, `99`), as `median_error`.
    pub error_percentiles: IndexMap<String, Option<f64>>,
    /// Percent of the released points that the attacker is 90 % sure to have within the smallest
    /// threshold, from its own data alone; `None` where that is not known.
    #[serde(default)]
    pub sure_percent: Option<f64>,
    /// Why `sure_percent` is not known here, in plain words; absent where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sure_unknown: Option<String>,
    /// Percent of those that are within it; absent without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sure_correct_percent: Option<f64>,
    /// Ten bins of the probability that the attacker states, from 0 to 1, over recovered points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reliability: Option<Vec<ReliabilityBin>>,
    /// RANSAC's trials per point: (largest number of trials in the bin, points in it).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ransac_trials: Option<Vec<(u64, u64)>>,
    /// Runs with different seeds behind this row.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub repeats: u32,
    /// Standard deviation over the repeats; `None` for a single run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<Spread>,
    /// The shares over distinct places; images only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distinct: Option<Distinct>,
}

/// Points of similar stated probability, over all repeats.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ReliabilityBin {
    /// The mean stated probability, 0 to 1; `None` without points.
    pub predicted: Option<f64>,
    /// The share that was within the smallest threshold; `None` without points.
    pub observed: Option<f64>,
    /// Points in the bin.
    pub n: u64,
}

/// Standard deviations of a row's figures over its repeats.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Of [`Row::recovered_percent`], in percentage points.
    pub recovered_percent: ByThreshold,
    /// Of [`Row::blind_percent`], in percentage points.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub blind_percent: ByThreshold,
    /// Of [`Row::median_error`], in the row's unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub median_error: Option<f64>,
}

/// The smallest inlier ratio at which half of the points come back within a threshold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BreakEven {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The solver's name, or [`STRONGEST`] where several attacks ran.
    pub solver: String,
    /// How the oracle chose the false neighbors, as [`Row::oracle_noise`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub oracle_noise: Option<String>,
    /// The threshold as typed.
    pub threshold: String,
    /// The ratio: interpolated, or the smallest / largest tested one as [`BreakEven::bound`] says.
    pub inlier_ratio: Option<f64>,
    /// How to read the ratio.
    pub bound: Bound,
}

/// How a break-even ratio relates to the ratios that were tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// Between two tested ratios, by linear interpolation.
    Interpolated,
    /// Half comes back even at the smallest tested ratio: the true value is at most this.
    BelowTested,
    /// Half does not come back at any tested ratio.
    AboveTested,
}

/// One gate of the user and its outcome.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GateResult {
    /// The gate as typed, for example `ppl@0.5:0.10<=20`.
    pub gate: String,
    /// The figure that was compared, in percent (or percentage points for a gain over the larger
    /// baseline); `None` when no row could be audited that the gate is about.
    pub found_percent: Option<f64>,
    /// What that figure is of: scheme, source and ratio, solver, distance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// The bound it may not exceed.
    pub bound_percent: f64,
    /// Whether every figure keeps the bound; `false` whenever one that the gate is about is not known.
    pub passed: bool,
    /// Why the gate did not pass although no figure exceeds the bound: what was not audited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// What varies from run to run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The command line, ready to paste into a shell; `None` in a share-safe document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// Worker threads.
    pub threads: u32,
    /// Peak resident memory of the process, where the system tells it.
    pub peak_memory_bytes: Option<u64>,
    /// Wall time.
    pub seconds: Seconds,
}

/// Wall times of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// The whole run.
    pub total: f64,
    /// Per row of `results`, in the same order: stage to seconds.
    pub rows: Vec<IndexMap<String, f64>>,
    /// Stage to seconds over the whole run.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub stages: IndexMap<String, f64>,
}

/// How many images an audit had, and what became of them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageCounts {
    /// Images in the folder or file.
    pub found: u64,
    /// Images that were used: the rest was left out by choice, or could not be used.
    pub used: u64,
    /// Images that could not be used; a line on stderr told why.
    pub unusable: u64,
    /// Used images with at most K keypoints: attacked with lists as long as can be.
    pub too_small: u64,
}

/// Shares over distinct places: a fifth of the keypoints of an image lie exactly on another one, and
/// every place counts once here.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Distinct {
    /// Places.
    pub n_places: u64,
    /// Percent of the places recovered within each threshold.
    pub recovered_percent: ByThreshold,
    /// Percentage recovered by an attacker without neighborhoods.
    pub blind_percent: ByThreshold,
}

/// The figures of one image.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageFigures {
    /// Its name; `None` in a share-safe document.
    pub name: Option<String>,
    /// Its keypoints.
    pub n_points: u64,
    /// One per row of `results`, in the same order; empty for an image without keypoints.
    pub rows: Vec<ImageRow>,
}

/// The figures of one image in one row of `results`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageRow {
    /// Percent of the image's keypoints recovered within each threshold.
    pub recovered_percent: ByThreshold,
    /// Percent of the distinct places of the image recovered within each threshold.
    pub distinct_percent: ByThreshold,
    /// Share of true neighbors in this image, as requested or measured.
    pub inlier_ratio: f64,
    /// Median error in pixels; `None` when half of the keypoints or more are lost.
    pub median_error: Option<f64>,
}

impl Row {
    /// What an attacker without neighborhoods gets within `threshold` (as typed): the larger of a blind guess
    /// and the best attack on the records alone. What neighborhoods add is what exceeds it.
    pub fn baseline_percent(&self, threshold: &str) -> Option<f64> {
        let alone = self.records_alone_percent.as_ref().and_then(|map| map.get(threshold));
        let blind = self.blind_percent.get(threshold);
        blind.into_iter().chain(alone).copied().reduce(f64::max)
    }
}

fn one() -> u32 {
    1
}

fn is_one(value: &u32) -> bool {
    *value == 1
}

impl Document {
    /// The text of `audit.json`: indented, measured numbers rounded to [`SIGNIFICANT_DIGITS`].
    ///
    /// `options` and `input.scale_m_per_unit` are the user's own numbers and keep every digit.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] when a rule of the format is broken, see [`Document::check`].
    pub fn to_json(&self) -> Result<String, Error> {
        self.check()?;
        let mut value = serde_json::to_value(self)?;
        for field in ["results", "break_even", "gates", "images", "tiles", "run"] {
            if let Some(part) = value.get_mut(field) {
                round_floats(part);
            }
        }
        if let Some(unit) = value.pointer_mut("/input/unit_in_map_units") {
            round_floats(unit);
        }
        let mut text = serde_json::to_string_pretty(&value)?;
        text.push('\n');
        Ok(text)
    }

    /// Reads the text of an `audit.json`.
    ///
    /// # Errors
    ///
    /// [`Error::Schema`] for another schema, [`Error::Json`] for text that is not such a document,
    /// [`Error::Invalid`] when a rule of the format is broken.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let value: serde_json::Value = serde_json::from_str(text)?;
        // Asked first: a later schema would fail on some missing field, which helps nobody.
        if let Some(found) = value.get("schema").and_then(serde_json::Value::as_u64)
            && found != u64::from(SCHEMA)
        {
            return Err(Error::Schema { expected: SCHEMA, found });
        }
        let document: Self = serde_json::from_value(value)?;
        document.check()?;
        Ok(document)
    }
}
