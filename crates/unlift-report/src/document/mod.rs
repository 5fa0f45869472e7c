//! The structs of `audit.json`, schema 1.
//!
//! `results` has one [`Row`] per (scheme, neighbors, oracle noise, inlier ratio, K, solver). Only [`Run`] holds what differs
//! between runs (seconds, memory, threads, command line), so `results` are byte-identical for the same input, options and seed.

mod check;
mod share;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Number, Value};
pub use unlift::audit::{
    Bound, BreakEven, ByReason, ByThreshold, Distinct, Intervals, NotAudited, ReliabilityBin, Row,
    STRONGEST, Spread,
};

pub use unlift::localization::{FEWEST_HELD_OUT, HeldOut, Localization, UNPROTECTED};

use crate::words;

/// The schema that this build writes and reads.
pub const SCHEMA: u32 = 1;

/// A whole audit: the content of `audit.json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// Version of the program that wrote the document.
    pub unlift: String,
    /// Version of the format, [`SCHEMA`].
    pub schema: u32,
    /// The audited input.
    pub input: Input,
    /// The options that decide the results, by their long names without dashes.
    pub options: Map<String, Value>,
    /// The random seed.
    pub seed: u64,
    /// The figures, one row per combination that was tried.
    pub results: Vec<Row>,
    /// Schemes and sources that could not be audited; their figures must not look like small ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_audited: Vec<NotAudited>,
    /// Notes for readers of the figures: only a part of the map was audited, unusual lengths, empty lists.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The notes that are reasons why figures may be too small: no gate holds with one, and nothing is decided.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<String>,
    /// The smallest inlier ratio at which half of the points come back, per scheme, noise and solver.
    pub break_even: Vec<BreakEven>,
    /// How precisely a camera can be placed under every scheme; the first entry is the map without
    /// protection. Empty unless the map has cameras and tracks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub localization: Vec<Localization>,
    /// The user's gates and their results; empty if there were none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gates: Vec<GateResult>,
    /// Every used image, in the order of names; empty for maps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub images: Vec<ImageFigures>,
    /// Every tile of a large map, in the order of cutting; empty for other audits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tiles: Vec<TileFigures>,
    /// The data that differ between runs.
    pub run: Run,
}

/// The audited input.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Path of the map, as typed; `None` in a share-safe document.
    pub path: Option<String>,
    /// SHA-256 over the map's files, in lowercase hexadecimal; `None` in a share-safe document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// Points read from the map, before a scheme drops some.
    pub n_points: u64,
    /// Declared scale in meters per map unit, if any.
    pub scale_m_per_unit: Option<f64>,
    /// Length of one unit of this document in the map's own units: `1 / scale` with a scale, else
    /// the median distance to the K-th nearest neighbor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit_in_map_units: Option<f64>,
    /// Sides of the box around all points but the outer 1 % of each axis, in meters, if lengths are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extent_m: Option<[f64; 3]>,
    /// The longest side of this box in the unit of the rows, if lengths are not in meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longest_side: Option<f64>,
    /// SHA-256 of further files that were read, by role (`descriptors`, `neighbors`).
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub other_sha256: IndexMap<String, String>,
    /// Counts of images; `None` for maps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<ImageCounts>,
}

impl Input {
    /// Returns the size of the map: "15.9 m x 8.2 m x 3.1 m".
    pub fn size(&self) -> Option<String> {
        let sides = self.extent_m?.map(|side| format!("{} m", words::significant(side, 3)));
        Some(sides.join(" x "))
    }

    /// Returns the size of the map and the scale that it follows from: "15.9 m x 8.2 m x 3.1 m at --scale 1".
    pub fn extent(&self) -> Option<String> {
        let scale = self.scale_m_per_unit.map(|scale| format!(" at --scale {scale}"));
        Some(self.size()? + &scale.unwrap_or_default())
    }
}

/// A gate of the user and its result.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct GateResult {
    /// The gate as typed, for example `ppl@0.5:0.10<=20`.
    pub gate: String,
    /// The figure that was compared, in percent (or percentage points for a gain over the larger
    /// baseline, or multiples for localization); `None` if it is not known or infinite.
    pub found_percent: Option<f64>,
    /// The upper end of the 95 % interval of `found_percent`, which the bound limits; absent for localization
    /// and in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub highest_percent: Option<f64>,
    /// The attack behind the figure: scheme, source and ratio, solver, distance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// The bound of the figure.
    pub bound_percent: f64,
    /// Whether every figure is known and keeps the bound.
    pub passed: bool,
    /// Why the gate failed although no figure exceeds the bound, for example what was not audited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// The data that differ between runs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The command line, ready to paste into a shell; `None` in a share-safe document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// Worker threads.
    pub threads: u32,
    /// Peak resident memory of the process, if known.
    pub peak_memory_bytes: Option<u64>,
    /// Wall time.
    pub seconds: Seconds,
}

/// Wall times of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// The whole run.
    pub total: f64,
    /// Seconds by stage, per row of `results` in the same order.
    pub rows: Vec<IndexMap<String, f64>>,
    /// Seconds by stage over the whole run.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub stages: IndexMap<String, f64>,
}

/// Counts of the images of an audit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageCounts {
    /// Images in the folder or file.
    pub found: u64,
    /// Images that were used, neither left out by choice nor unusable.
    pub used: u64,
    /// Images that could not be used; stderr had the reasons.
    pub unusable: u64,
    /// Used images with at most K keypoints; their lists are shorter than K.
    pub too_small: u64,
}

/// The figures of one tile.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TileFigures {
    /// The lowest and the highest corner of its points in plan view, in the unit of the audit, without a fiftieth of the points on
    /// every side; `None` in a share-safe document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bounds: Option<[[f64; 2]; 2]>,
    /// Number of its points.
    pub n_points: u64,
    /// Percent recovered within each threshold; one per row of `results`, in the same order.
    pub recovered_percent: Vec<ByThreshold>,
}

/// The figures of one image.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageFigures {
    /// The image's name; `None` in a share-safe document.
    pub name: Option<String>,
    /// Number of keypoints.
    pub n_points: u64,
    /// Figures per row of `results`, in the same order; empty for an image without keypoints.
    pub rows: Vec<ImageRow>,
}

/// The figures of one image in one row of `results`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageRow {
    /// Percent of the image's keypoints recovered within each threshold.
    pub recovered_percent: ByThreshold,
    /// Percent of the distinct places of the image recovered within each threshold.
    pub distinct_percent: ByThreshold,
    /// Share of true neighbors in this image: as requested for the oracle, else measured.
    pub inlier_ratio: f64,
    /// Median error in pixels; `None` if half of the keypoints or more are lost.
    pub median_error: Option<f64>,
}

impl Document {
    /// Returns the text of `audit.json`, indented, with measured numbers rounded to [`SIGNIFICANT_DIGITS`].
    ///
    /// `options` and `input.scale_m_per_unit` are numbers of the user and keep every digit.
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] if a rule of the format is broken, see [`Document::check`].
    pub fn to_json(&self) -> Result<String, Error> {
        self.check()?;
        let mut value = serde_json::to_value(self)?;
        let lengths = ["input/unit_in_map_units", "input/extent_m", "input/longest_side"];
        let parts = ["results", "break_even", "gates", "images", "tiles", "run"];
        for place in parts.into_iter().chain(lengths) {
            value.pointer_mut(&format!("/{place}")).into_iter().for_each(round_floats);
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
    /// [`Error::Invalid`] if a rule of the format is broken.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        // Editors on Windows write a byte order mark first.
        let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
        let value: Value = serde_json::from_str(text)?;
        // A later schema would fail with an unclear error about a missing field.
        let schema = value.get("schema").and_then(Value::as_u64);
        if let Some(schema) = schema.filter(|schema| *schema != u64::from(SCHEMA)) {
            return Err(Error::Schema { expected: SCHEMA, found: schema });
        }
        let document: Self = serde_json::from_value(value)?;
        document.check()?;
        Ok(document)
    }
}

/// Significant decimal digits of every measured number in `audit.json`.
///
/// Six digits resolve a micron in a meter, far below any threshold and far above the rounding noise of sums.
pub const SIGNIFICANT_DIGITS: usize = 6;

/// Returns `value` as JSON, with numbers rounded as in `audit.json`.
pub fn rounded(value: &impl Serialize) -> serde_json::Result<Value> {
    let mut value = serde_json::to_value(value)?;
    round_floats(&mut value);
    Ok(value)
}

/// Rounds every float in `value`; integers keep all digits.
fn round_floats(value: &mut Value) {
    match value {
        Value::Number(number) if number.is_f64() => {
            let rounded = number.as_f64().map(|value| words::rounded(value, SIGNIFICANT_DIGITS));
            if let Some(rounded) = rounded.and_then(Number::from_f64) {
                *number = rounded;
            }
        }
        Value::Array(items) => items.iter_mut().for_each(round_floats),
        Value::Object(fields) => fields.values_mut().for_each(round_floats),
        _ => {}
    }
}

/// An error in reading, checking or writing an audit's files.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The text is not an `audit.json` of this schema.
    #[error("audit.json: {0}")]
    Json(#[from] serde_json::Error),
    /// The page could not be rendered.
    #[error("report.html: {0}")]
    Template(#[from] minijinja::Error),
    /// The document was written by another version of the format.
    #[error("audit.json: expected schema {expected}, found {found}")]
    Schema {
        /// The schema this build reads.
        expected: u32,
        /// The schema the text declares.
        found: u64,
    },
    /// A field breaks a rule of the format, for example a NaN or a repeated row.
    #[error("audit.json: {place}: expected {expected}, found {found}")]
    Invalid {
        /// Where in the document, for example `results[3].recovered_percent["0.10"]`.
        place: String,
        /// The rule of the format.
        expected: String,
        /// The value found.
        found: String,
    },
}
