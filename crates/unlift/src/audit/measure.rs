//! All figures of one recovery: what a row of an audit says beside its name, and what `evaluate` prints.

use std::collections::BTreeMap;

use super::row::Row;
use super::threshold::Threshold;
use crate::evaluate::{Accuracy, evaluate, reliability};
use crate::recover::Recovered;
use crate::truth::{DropReason, Original, Secret};
use crate::{Error, Unit};

/// The row of `recovered` without its name: scheme, source, inlier ratio, K and solver are for the caller to fill
/// in. `secret` is that of the obfuscation, as it was made; `blind` the errors of an attacker without
/// neighborhoods, whose figures are missing without it.
///
/// # Errors
/// When the three do not belong together, as [`evaluate`] tells it.
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

/// A row of which only the obfuscation is known.
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
