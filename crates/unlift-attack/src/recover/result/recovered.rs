//! The result of recovery, in columns.

use super::estimate::{Estimate, Status};
use super::probability::Confidence;
use super::trials::TrialHistogram;
use super::unknown::Unknown;
use crate::{About, Error, Unit};

/// Recovered positions, one row per slot.
#[derive(Clone, Debug, PartialEq)]
pub struct Recovered<const D: usize> {
    origin: [f64; D],
    unit: Unit,
    delta: f64,
    position: Vec<[f32; D]>,
    status: Vec<Status>,
    support: Vec<u16>,
    evidence: Vec<f32>,
    axis: Option<Vec<u8>>,
    descriptor_row: Option<Vec<u32>>,
    confidence: Result<Vec<Confidence>, Unknown>,
    trials: Option<TrialHistogram>,
    about: About,
}

impl<const D: usize> Recovered<D> {
    /// Columns from estimates in slot order. `with_axis` keeps the axis column (axis candidates);
    /// `descriptor_row` is the assignment for paired lines, if one was made.
    ///
    /// # Errors
    /// When a position is NaN although its status is `Ok` (or the reverse), or `descriptor_row` has
    /// another length.
    pub fn try_new(
        estimates: &[Estimate<D>],
        with_axis: bool,
        descriptor_row: Option<Vec<u32>>,
        origin: [f64; D],
        unit: Unit,
        delta: f64,
    ) -> Result<Self, Error> {
        for (slot, estimate) in estimates.iter().enumerate() {
            let finite = estimate.position.iter().all(|x| x.is_finite());
            if finite != (estimate.status == Status::Ok) {
                let what = format!("recovered slot {slot}");
                let expected = "a position if and only if its status is ok";
                return Err(Error::new(what, expected, estimate.status.name()));
            }
        }
        if let Some(rows) = &descriptor_row
            && rows.len() != estimates.len()
        {
            let expected = format!("{} rows", estimates.len());
            return Err(Error::new("descriptor assignment", expected, rows.len().to_string()));
        }
        Ok(Self {
            origin,
            unit,
            delta,
            position: estimates.iter().map(|e| e.position).collect(),
            status: estimates.iter().map(|e| e.status).collect(),
            support: estimates.iter().map(|e| e.support).collect(),
            evidence: estimates.iter().map(|e| e.evidence).collect(),
            axis: with_axis.then(|| estimates.iter().map(|e| e.axis).collect()),
            descriptor_row,
            confidence: Err(Unknown::NotGiven),
            trials: None,
            about: About::default(),
        })
    }

    /// The same positions, said to be of a released map and counted in an order: that of the lists they were
    /// made from.
    #[must_use]
    pub fn with_about(self, about: About) -> Self {
        Self { about, ..self }
    }

    /// Which released map the positions are of, and what their rows are counted by.
    pub fn about(&self) -> About {
        self.about
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.position.len()
    }

    /// The position recovered for `slot` in the map's frame, if there is one.
    #[inline]
    pub fn position(&self, slot: usize) -> Option<[f64; D]> {
        (self.status[slot] == Status::Ok)
            .then(|| std::array::from_fn(|c| f64::from(self.position[slot][c]) + self.origin[c]))
    }

    /// Positions about [`origin`](Self::origin), `(slots, D)`; NaN where the status is not `Ok`.
    pub fn positions(&self) -> &[[f32; D]] {
        &self.position
    }

    /// The released origin.
    pub fn origin(&self) -> [f64; D] {
        self.origin
    }

    /// The unit of positions and of delta.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// The delta that decided support.
    pub fn delta(&self) -> f64 {
        self.delta
    }

    /// What became of each slot.
    pub fn status(&self) -> &[Status] {
        &self.status
    }

    /// Per slot the listed records that its position was made of.
    pub fn support(&self) -> &[u16] {
        &self.support
    }

    /// Per slot how improbable the support is by chance, in nats.
    pub fn evidence(&self) -> &[f32] {
        &self.evidence
    }

    /// Per slot the axis said to be swapped (axis candidates only).
    pub fn axis(&self) -> Option<&[u8]> {
        self.axis.as_deref()
    }

    /// Per slot the released descriptor row said to belong to it (paired lines with descriptors).
    pub fn descriptor_row(&self) -> Option<&[u32]> {
        self.descriptor_row.as_deref()
    }

    /// Per slot how sure the attacker is; `None` where that is not known, see
    /// [`confidence_unknown`](Self::confidence_unknown).
    pub fn confidence(&self) -> Option<&[Confidence]> {
        self.confidence.as_deref().ok()
    }

    /// Why it is not known how sure the attacker is; `None` where it is.
    pub fn confidence_unknown(&self) -> Option<Unknown> {
        self.confidence.as_ref().err().copied()
    }

    /// The probability that the true place of `slot` is within `threshold` (in the unit of the map) of
    /// the recovered one, as the attacker can tell; 0 for a lost slot, `None` where it is not known.
    pub fn probability_within(&self, slot: usize, threshold: f64) -> Option<f64> {
        self.confidence().map(|rows| rows[slot].probability_within(threshold))
    }

    /// Adds how sure the attacker is of every slot.
    ///
    /// # Errors
    /// When there is not one row per slot.
    pub fn with_confidence(self, confidence: Vec<Confidence>) -> Result<Self, Error> {
        if confidence.len() != self.n_slots() {
            let expected = format!("{} rows", self.n_slots());
            return Err(Error::new("confidence", expected, confidence.len().to_string()));
        }
        Ok(Self { confidence: Ok(confidence), ..self })
    }

    /// Says why it is not known how sure the attacker is; what was known is dropped.
    #[must_use]
    pub fn without_confidence(self, unknown: Unknown) -> Self {
        Self { confidence: Err(unknown), ..self }
    }

    /// How many trials the slots took (`ransac` only; not stored in files).
    pub fn trials(&self) -> Option<&TrialHistogram> {
        self.trials.as_ref()
    }

    /// Adds how many trials the slots took.
    #[must_use]
    pub(crate) fn with_trials(self, trials: Option<TrialHistogram>) -> Self {
        Self { trials, ..self }
    }
}
