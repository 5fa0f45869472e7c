//! Parts of a plan without a row.

use serde::{Deserialize, Serialize};

use super::plan::Variant;
use crate::Error;
use crate::neighbors::oracle::Noise;
use crate::truth::{DropReason, Secret};

/// A scheme, or one with a source, without a row: unknown values must not look like small ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotAudited {
    /// Scheme name.
    pub scheme: String,
    /// Source without lists, as in a row; `None` if the scheme has no rows at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neighbors: Option<String>,
    /// Noise model, if the source is the oracle; not written.
    #[serde(skip)]
    pub oracle_noise: Option<&'static str>,
    /// Inlier ratio requested of the oracle; not written.
    #[serde(skip)]
    pub inlier_ratio: Option<f64>,
    /// Error message: what was expected and what was found.
    pub reason: String,
}

impl NotAudited {
    /// Creates the entry of a scheme, or of one source for it.
    pub fn new(scheme: &str, neighbors: Option<&str>, reason: impl ToString) -> Self {
        let (scheme, neighbors) = (scheme.to_owned(), neighbors.map(str::to_owned));
        let reason = reason.to_string();
        Self { scheme, neighbors, oracle_noise: None, inlier_ratio: None, reason }
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
            let main = DropReason::ALL.into_iter().max_by_key(|why| secret.n_dropped(*why));
            let main = main.map_or("", DropReason::name).replace('_', " ");
            reason.push_str(&format!(
                " ({scheme} leaves out {left} of {all} points, most of them as {main})"
            ));
        }
        Self {
            oracle_noise: variant.noise.map(Noise::name),
            inlier_ratio: variant.inlier_ratio,
            ..Self::new(scheme, Some(variant.by.name()), reason)
        }
    }

    /// Returns all but the reason.
    fn cell(&self) -> (&str, Option<&str>, Option<&str>, Option<f64>) {
        (&self.scheme, self.neighbors.as_deref(), self.oracle_noise, self.inlier_ratio)
    }
}

/// Adds the cells of `more` that `known` lacks. Reasons are not compared.
pub(super) fn add_new(known: &mut Vec<NotAudited>, more: Vec<NotAudited>) {
    for missing in more {
        if known.iter().all(|known| known.cell() != missing.cell()) {
            known.push(missing);
        }
    }
}

/// Shortens `missing` of one scheme to one entry if it has no rows for a single reason.
pub(super) fn shortened(missing: Vec<NotAudited>, has_rows: bool) -> Vec<NotAudited> {
    match missing.first() {
        Some(first) if !has_rows && missing.iter().all(|m| m.reason == first.reason) => {
            vec![NotAudited::new(&first.scheme, None, &first.reason)]
        }
        _ => missing,
    }
}
