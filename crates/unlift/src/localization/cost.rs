//! What protection costs: rows of errors of localization.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use crate::geometry::camera::PoseError;

/// The accuracy of localization under a scheme: medians over the images of the map.
///
/// These figures are an information bound: all true matches of an image, at the true pose, with noise of 1 px. Errors are standard
/// deviations. A value is `None` if at least half of the images do not localize.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Localization {
    /// The scheme's user-facing name; [`UNPROTECTED`] for the map without protection.
    pub scheme: String,
    /// Whether the scheme protects keypoints of queries; else it protects the map.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub of_queries: bool,
    /// Error of the camera center, as a multiple of the unprotected one: the median over images.
    pub multiple: Option<f64>,
    /// Error of the camera center, in the unit of the rows.
    pub center_error: Option<f64>,
    /// Error of the rotation in degrees.
    pub rotation_error_degrees: Option<f64>,
    /// Percent of the images that do not localize.
    pub failed_percent: f64,
    /// Whether the scheme changes descriptors. The bound does not include matching, so it does not tell what this costs.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub changes_descriptors: bool,
    /// What was measured on images that were held out; `None` if it was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOut>,
}

/// The accuracy of localization of images that the map was made without.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Number of held-out images.
    pub n_images: u64,
    /// Median number of matches within 3 px of the true projection.
    pub right_matches: f64,
    /// Median number of matches.
    pub matches: f64,
    /// Median error of the camera center, in the unit of the rows. `None` if at least half of the images have no pose.
    pub center_error: Option<f64>,
    /// Median error of the rotation in degrees.
    pub rotation_error_degrees: Option<f64>,
    /// The median error of the center as a multiple of the unprotected one.
    pub multiple: Option<f64>,
    /// Percent of the images within limits of both errors, by limit: `5 cm, 5 deg`.
    pub recall_percent: IndexMap<String, f64>,
}

/// The value of [`Localization::scheme`] for the map without protection.
pub const UNPROTECTED: &str = "none";

/// The smallest number of held-out images whose median tells schemes apart.
pub const FEWEST_HELD_OUT: u64 = 10;

impl Localization {
    /// Summarizes the errors of images under `scheme` beside the unprotected ones; `None` is an image that does
    /// not localize. Images that do not localize even without protection have no multiple.
    pub fn of(
        scheme: &str,
        errors: &[Option<PoseError>],
        unprotected: &[Option<PoseError>],
    ) -> Self {
        let value = |of: fn(&PoseError) -> f64| {
            let value = |error: &Option<PoseError>| error.as_ref().map_or(f64::INFINITY, of);
            upper_median(errors.iter().map(value).collect())
        };
        let multiples = errors.iter().zip(unprotected).filter_map(|(error, base)| {
            let base = base.as_ref()?;
            Some(error.map_or(f64::INFINITY, |error| error.center / base.center))
        });
        let failed = errors.iter().filter(|error| error.is_none()).count();
        Self {
            scheme: scheme.to_owned(),
            center_error: value(|error| error.center),
            rotation_error_degrees: value(|error| error.rotation_degrees),
            multiple: upper_median(multiples.collect()),
            failed_percent: 100.0 * failed as f64 / errors.len().max(1) as f64,
            ..Self::default()
        }
    }

    /// Returns the figures of held-out images if there are at least [`FEWEST_HELD_OUT`] of them.
    pub fn measured(&self) -> Option<&HeldOut> {
        self.held_out.as_ref().filter(|found| found.n_images >= FEWEST_HELD_OUT)
    }

    /// Returns the error as a multiple of the unprotected one: as [measured](Self::measured), else by
    /// the bound. `None` if cameras do not localize, or if the bound does not tell.
    pub fn cost(&self) -> Option<f64> {
        match self.measured() {
            Some(found) => found.multiple,
            None => self.multiple.filter(|_| !self.changes_descriptors),
        }
    }

    /// Returns true if what localization costs under this scheme was not measured.
    pub fn is_unknown(&self) -> bool {
        self.measured().is_none() && self.changes_descriptors
    }
}

/// Returns the upper median, which does not err toward accuracy; `None` without values, or if it is infinite.
pub(super) fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().filter(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_count_lost_images_as_infinite() {
        let error = |center| Some(PoseError { center, rotation_degrees: 1.0 });
        let base = [error(1.0), error(1.0), error(1.0), error(1.0)];
        let found = Localization::of("olc", &[error(2.0), None, error(3.0), None], &base);
        assert_eq!((found.center_error, found.multiple), (None, None));
        assert_eq!(found.failed_percent, 50.0);
        let found = Localization::of("olc", &[error(2.0), error(5.0), error(3.0), None], &base);
        assert_eq!((found.center_error, found.multiple), (Some(5.0), Some(5.0)));
    }
}
