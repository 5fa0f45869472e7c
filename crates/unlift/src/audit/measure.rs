//! Figures of one recovery, as in a row of an audit and in the output of `evaluate`.

use std::collections::BTreeMap;

use super::row::Row;
use super::threshold::Threshold;
use crate::evaluate::{Accuracy, evaluate, reliability};
use crate::recover::Recovered;
use crate::truth::{DropReason, Original, Secret};
use crate::{Error, Unit};

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
