//! What a plan asked for and a map does not allow.

use super::plan::Variant;
use crate::Error;
use crate::neighbors::oracle::Noise;
use crate::truth::{DropReason, Secret};

/// A scheme that cannot be applied to a map, or one source of neighborhoods for it. It has no row: nothing
/// is known of it, least of all that little comes back.
#[derive(Clone, Debug, PartialEq)]
pub struct NotAudited {
    /// The scheme.
    pub scheme: String,
    /// The source without lists, as [`Row::neighbors`](super::Row::neighbors); `None` when the scheme has
    /// no rows at all.
    pub neighbors: Option<String>,
    /// The noise model of the oracle, where that was the source.
    pub oracle_noise: Option<&'static str>,
    /// The inlier ratio that was asked of the oracle.
    pub inlier_ratio: Option<f64>,
    /// Why: what was expected and what was found.
    pub reason: String,
}

impl NotAudited {
    /// A scheme that cannot hide the points.
    pub(super) fn scheme(scheme: &str, error: &Error) -> Self {
        Self {
            scheme: scheme.to_owned(),
            neighbors: None,
            oracle_noise: None,
            inlier_ratio: None,
            reason: error.to_string(),
        }
    }

    /// A variant without lists for points that are hidden as `secret` says.
    pub(super) fn variant<const D: usize>(
        scheme: &str,
        variant: &Variant<'_, D>,
        error: &Error,
        secret: &Secret,
    ) -> Self {
        let mut reason = error.to_string();
        let (left, all) = (secret.dropped().len(), secret.n_originals());
        if left > 0 {
            let why = DropReason::ALL
                .map(|why| (why, secret.dropped().iter().filter(|d| d.reason == why).count()));
            let most = why.into_iter().max_by_key(|(_, n)| *n).map_or("", |(why, _)| why.name());
            let most = most.replace('_', " ");
            reason.push_str(&format!(
                " ({scheme} leaves out {left} of {all} points, most as {most})"
            ));
        }
        Self {
            scheme: scheme.to_owned(),
            neighbors: Some(variant.by.name().to_owned()),
            oracle_noise: variant.noise.map(Noise::name),
            inlier_ratio: variant.inlier_ratio,
            reason,
        }
    }

    /// Whether both are about the same scheme and variant, for whatever reason.
    pub(super) fn is_same_cell(&self, other: &Self) -> bool {
        self.scheme == other.scheme
            && self.neighbors == other.neighbors
            && self.oracle_noise == other.oracle_noise
            && self.inlier_ratio == other.inlier_ratio
    }
}

/// `missing` of one scheme, as short as it can be told: a scheme without any row, always for one reason,
/// is told once.
pub(super) fn told(missing: Vec<NotAudited>, has_rows: bool) -> Vec<NotAudited> {
    match missing.first() {
        Some(first) if !has_rows && missing.iter().all(|m| m.reason == first.reason) => {
            let (scheme, reason) = (first.scheme.clone(), first.reason.clone());
            let (neighbors, oracle_noise, inlier_ratio) = (None, None, None);
            vec![NotAudited { scheme, neighbors, oracle_noise, inlier_ratio, reason }]
        }
        _ => missing,
    }
}
