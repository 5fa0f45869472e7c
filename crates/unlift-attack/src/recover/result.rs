//! Results of recovery: estimates, confidence, and the recovered map.

use crate::RecordId;
use crate::neighbors::Neighborhoods;
use crate::parallel;
use crate::released::{Obfuscation, Released};
use crate::{About, Error, Unit, named};

named! {
    /// Whether a slot was recovered, or why not.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[repr(u8)]
    pub enum Status {
        /// Recovered.
        Ok = "ok",
        /// Fewer than two listed records can give evidence.
        TooFewNeighbors = "too_few_neighbors",
        /// The listed records do not fix a point (parallel lines, or no plane of some axis).
        Degenerate = "degenerate",
        /// No position agrees with any listed record.
        NoSupport = "no_support",
    }
}

impl Status {
    /// The status of a slot whose neighbors do not fix a point; `n` of them may vote.
    pub(crate) fn not_fixed(n: usize) -> Self {
        if n < 2 { Self::TooFewNeighbors } else { Self::Degenerate }
    }
}

/// The estimate of one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const D: usize> {
    /// Position relative to the released origin; NaN unless `status` is `Ok`.
    pub position: [f32; D],
    /// Whether the slot was recovered, or why not.
    pub status: Status,
    /// Number of records that agree with the position, at most 65,535. Consensus: listed records within delta before the last refit
    /// (planes: within 1.5 delta, summed over the free axes). Joint recovery: records at the ends of edges with an estimate nearby.
    pub support: u16,
    /// Axis of the hidden coordinate (axis candidates; else 0).
    pub axis: u8,
    /// Improbability of the support by chance, in nats; not negative.
    pub evidence: f32,
}

impl<const D: usize> Estimate<D> {
    #[inline(always)]
    pub(crate) fn is_known(&self) -> bool {
        self.status == Status::Ok
    }

    /// Creates the estimate of a slot that was recovered.
    pub(crate) fn at(position: [f32; D], support: u32, axis: usize, evidence: f32) -> Self {
        let support = u16::try_from(support).unwrap_or(u16::MAX);
        Self { position, status: Status::Ok, support, axis: axis as u8, evidence }
    }

    /// Returns the mean evidence of `estimates`, in nats; 0 without any.
    pub(crate) fn mean_evidence(estimates: &[Self]) -> f64 {
        let sum: f64 = estimates.iter().map(|e| f64::from(e.evidence)).sum();
        sum / estimates.len().max(1) as f64
    }

    /// Creates the estimate of a slot that was not recovered.
    pub fn lost(status: Status) -> Self {
        Self { position: [f32::NAN; D], status, support: 0, axis: 0, evidence: 0.0 }
    }
}

/// The attacker's confidence in the estimate of one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    /// Probability that the estimate is not grossly wrong.
    pub found: f32,
    /// Median error of such an estimate, in the unit of the map.
    pub scale: f32,
}

impl Confidence {
    /// Confidence of a slot without a position.
    pub const LOST: Self = Self { found: 0.0, scale: f32::INFINITY };

    /// Returns the probability that the true point is within `threshold` (in the unit of the map):
    /// `found / (1 + (scale / threshold)^2)`.
    pub fn probability_within(&self, threshold: f64) -> f64 {
        let ratio = f64::from(self.scale) / threshold;
        if ratio.is_finite() { f64::from(self.found) / (1.0 + ratio * ratio) } else { 0.0 }
    }
}

named! {
    /// Why a recovered map has no [`Confidence`]: in these cases predicted probabilities were wrong or never tested.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Unknown {
        /// The options turn confidence off.
        NotAsked = "not_asked",
        /// The positions were given without confidence.
        NotGiven = "not_given",
        /// The points are in 2D: the model was fitted and tested on 3D maps alone.
        OfImages = "images",
        /// The solver is not `joint`, the only one that the model was fitted for.
        OtherSolver = "other_solver",
        /// The lists have scores. The model was not fitted on the errors of sources that rank.
        RankedLists = "ranked_lists",
        /// The lists are not known to come from the oracle. The model was not fitted on the errors of other lists.
        GivenLists = "given_lists",
        /// The recovered map is flat or thin: lines in a plane cross everywhere, so that records agree at wrong places.
        Flat = "flat",
        /// Most points coincide, so that their records agree at wrong places, too.
        Coincident = "coincident",
        /// Lists have more entries per hidden point than in all maps on which the model was fitted.
        SmallMap = "small_map",
        /// Wrong entries of lists are near, too, so that they are no sign of a wrong place.
        NearEntries = "near_entries",
    }
}

impl Unknown {
    /// Returns the reason in words, to follow "not known here: ".
    pub fn reason(self) -> &'static str {
        match self {
            Self::NotAsked => "confidence was not requested",
            Self::NotGiven => "the recovered points have no confidence values",
            Self::OfImages => "the confidence model was fitted on maps and not tested on images",
            Self::OtherSolver => "only the solver joint estimates confidence",
            Self::RankedLists => {
                "the confidence model was not fitted on lists that a source ranked"
            }
            Self::GivenLists => "the confidence model was fitted on lists of the oracle only",
            Self::Flat => "the confidence model was not fitted on flat or thin maps",
            Self::Coincident => {
                "the confidence model was not fitted on maps in which most points coincide"
            }
            Self::SmallMap => {
                "the map is small: a list holds more than a hundredth of its points, and the confidence model was not fitted on such maps"
            }
            Self::NearEntries => {
                "wrong entries of the lists are near, too, and the confidence model was not fitted on such lists"
            }
        }
    }
}

/// Recovered positions, one row per slot, in columns.
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
    pub(super) confidence: Result<Vec<Confidence>, Unknown>,
    pub(super) trials: Option<Vec<(u32, u64)>>,
    about: About,
}

impl<const D: usize> Recovered<D> {
    /// Creates columns from estimates in slot order. `with_axis` keeps the axis column (axis candidates); `descriptor_row` is the
    /// assignment of descriptors of paired lines, if there is one.
    ///
    /// # Errors
    /// When a position is finite although its status is not `Ok` (or the reverse), or `descriptor_row` has another length.
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
        if let Some(rows) = &descriptor_row {
            Error::check_len("descriptor assignment", rows.len(), estimates.len(), " rows")?;
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

    /// Creates the result of your own solver from one position per slot, relative to the released origin. One that is not finite is lost.
    ///
    /// For axis candidates, the hidden axis is the one along which the position is farthest from the published one.
    ///
    /// # Errors
    /// When there is not one position per slot.
    pub fn from_positions(
        released: &Released<D>,
        lists: &Neighborhoods,
        positions: &[[f32; D]],
    ) -> Result<Self, Error> {
        Error::check_len("positions", positions.len(), released.n_slots(), ", one per slot")?;
        let estimate = |(slot, &position): (usize, &[f32; D])| {
            if !position.iter().all(|x| x.is_finite()) {
                return Estimate::lost(Status::NoSupport);
            }
            let mut axis = 0;
            if let Obfuscation::AxisCandidates(candidates) = released.obfuscation() {
                let published = candidates.position()[slot];
                let moved = |&c: &usize| (position[c] - published[c]).abs();
                axis = (0..D).max_by(|a, b| moved(a).total_cmp(&moved(b))).unwrap_or(0);
            }
            Estimate::at(position, 0, axis, 0.0)
        };
        let estimates: Vec<Estimate<D>> = positions.iter().enumerate().map(estimate).collect();
        let recovered = Self::new(released, lists, &estimates, 0.0)?;
        Ok(recovered.without_confidence(Unknown::OtherSolver))
    }

    pub(crate) fn new(
        released: &Released<D>,
        lists: &Neighborhoods,
        estimates: &[Estimate<D>],
        delta: f64,
    ) -> Result<Self, Error> {
        let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
        let rows = descriptor_rows(released, lists);
        let (origin, unit) = (released.origin(), released.unit());
        let about = About { map: Some(released.fingerprint()), ..lists.about() };
        let recovered = Self::try_new(estimates, with_axis, rows, origin, unit, delta)?;
        Ok(recovered.with_about(about))
    }

    /// Sets the released map and the row order of these positions: those of the lists they were made from.
    #[must_use]
    pub fn with_about(self, about: About) -> Self {
        Self { about, ..self }
    }

    /// The released map of these positions, and the order of their rows.
    pub fn about(&self) -> About {
        self.about
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.position.len()
    }

    /// Position of `slot` in the map's frame, if it was recovered.
    #[inline]
    pub fn position(&self, slot: usize) -> Option<[f64; D]> {
        (self.status[slot] == Status::Ok)
            .then(|| std::array::from_fn(|c| f64::from(self.position[slot][c]) + self.origin[c]))
    }

    /// Positions relative to [`origin`](Self::origin), `(slots, D)`; NaN where the status is not `Ok`.
    pub fn positions(&self) -> &[[f32; D]] {
        &self.position
    }

    /// The released origin.
    pub fn origin(&self) -> [f64; D] {
        self.origin
    }

    /// Unit of positions and of delta.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// The distance that decided support.
    pub fn delta(&self) -> f64 {
        self.delta
    }

    /// Status per slot.
    pub fn status(&self) -> &[Status] {
        &self.status
    }

    /// Number of agreeing records per slot, see [`Estimate::support`].
    pub fn support(&self) -> &[u16] {
        &self.support
    }

    /// Improbability of the support by chance per slot, in nats.
    pub fn evidence(&self) -> &[f32] {
        &self.evidence
    }

    /// Predicted exchanged axis per slot (axis candidates only).
    pub fn axis(&self) -> Option<&[u8]> {
        self.axis.as_deref()
    }

    /// Predicted row of the released descriptors per slot (paired lines with descriptors).
    pub fn descriptor_row(&self) -> Option<&[u32]> {
        self.descriptor_row.as_deref()
    }

    /// Confidence per slot; `None` if it is not known, see [`confidence_unknown`](Self::confidence_unknown).
    pub fn confidence(&self) -> Option<&[Confidence]> {
        self.confidence.as_deref().ok()
    }

    /// Why confidence is not known; `None` if it is.
    pub fn confidence_unknown(&self) -> Option<Unknown> {
        self.confidence.as_ref().err().copied()
    }

    /// Predicted probability that the true point of `slot` is within `threshold` (in the unit of the map) of the recovered one; 0
    /// for a slot that was not recovered, `None` if confidence is not known.
    pub fn probability_within(&self, slot: usize, threshold: f64) -> Option<f64> {
        self.confidence().map(|rows| rows[slot].probability_within(threshold))
    }

    pub(crate) fn sure_estimate(&self, slot: usize) -> Option<Estimate<D>> {
        let found = self.confidence()?.get(slot)?.found;
        let axis = self.axis().map_or(0, |axis| axis[slot].into());
        // How much likelier right than wrong, in nats.
        let evidence = libm::logf(found / (1.0 - found).max(f32::EPSILON));
        (self.status[slot] == Status::Ok && found > 0.5)
            .then(|| Estimate::at(self.position[slot], self.support[slot].into(), axis, evidence))
    }

    /// Adds the confidence of every slot.
    ///
    /// # Errors
    /// When there is not one row per slot.
    pub fn with_confidence(self, confidence: Vec<Confidence>) -> Result<Self, Error> {
        Error::check_len("confidence", confidence.len(), self.n_slots(), " rows")?;
        Ok(Self { confidence: Ok(confidence), ..self })
    }

    /// Removes confidence and records the reason.
    #[must_use]
    pub fn without_confidence(self, unknown: Unknown) -> Self {
        Self { confidence: Err(unknown), ..self }
    }

    /// Histogram of trials per slot (`ransac` only; not stored in files): the largest number of trials in each bin, and the number of slots.
    pub fn trials(&self) -> Option<&[(u32, u64)]> {
        self.trials.as_deref()
    }
}

/// Per slot, the released descriptor row that belongs to it (supplement B); `None` unless paired lines have descriptors.
///
/// The cheaper assignment wins. Its cost is the sum of the distances from each descriptor to the nearer one of each listed record.
fn descriptor_rows<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Option<Vec<u32>> {
    let descriptors = released.descriptors().filter(|_| released.slots_per_record() == 2)?;
    let cost = |row: usize, slot: usize| {
        let to_record = |record: &RecordId| {
            let [first, second] =
                [0, 1].map(|side| descriptors.squared_distance(row, 2 * record.index() + side));
            f64::from(first.min(second).sqrt())
        };
        lists.of(slot).iter().map(to_record).sum::<f64>()
    };
    let rows_of = |record: usize| {
        let [a, b] = [2 * record, 2 * record + 1];
        let is_straight = cost(a, a) + cost(b, b) <= cost(a, b) + cost(b, a);
        let first = if is_straight { [a, b] } else { [b, a] };
        first.map(|row| row as u32)
    };
    Some(parallel::map(released.n_records(), rows_of).concat())
}
