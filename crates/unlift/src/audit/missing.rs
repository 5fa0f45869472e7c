//! Parts of a plan without a row.

use super::plan::Variant;
use crate::Error;
use crate::neighbors::oracle::Noise;
use crate::truth::{DropReason, Secret};

/// A scheme, or a scheme with one source, that could not be audited. It has no row, because an
/// unknown value must not look like a small one.
#[derive(Clone, Debug, PartialEq)]
pub struct NotAudited {
    /// Scheme name.
    pub scheme: String,
    /// Source without lists, as in [`Row::neighbors`](super::Row::neighbors); `None` if the scheme
    /// has no rows at all.
    pub neighbors: Option<String>,
    /// Noise model, if the source is the oracle.
    pub oracle_noise: Option<&'static str>,
    /// Inlier ratio requested of the oracle.
    pub inlier_ratio: Option<f64>,
    /// Error message: what was expected and what was found.
    pub reason: String,
}

impl NotAudited {
    pub(super) fn scheme(scheme: &str, error: &Error) -> Self {
        Self {
            scheme: scheme.to_owned(),
            neighbors: None,
            oracle_noise: None,
            inlier_ratio: None,
            reason: error.to_string(),
        }
    }

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
                " ({scheme} leaves out {left} of {all} points, most of them as {most})"
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

    /// Returns true if both have the same scheme and variant. Reasons are not compared.
    pub(super) fn is_same_cell(&self, other: &Self) -> bool {
        self.scheme == other.scheme
            && self.neighbors == other.neighbors
            && self.oracle_noise == other.oracle_noise
            && self.inlier_ratio == other.inlier_ratio
    }
}

/// Shortens `missing` of one scheme: a scheme without rows that failed for a single reason becomes
/// one entry.
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
