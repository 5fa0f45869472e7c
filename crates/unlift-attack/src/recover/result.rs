//! What recovery says about one slot: a position or a reason.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::neighbors::Neighborhoods;
use crate::recover::assignment::descriptor_rows;
use crate::released::{Obfuscation, Released};
use crate::{About, Error, Unit};

/// What became of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Status {
    /// Recovered.
    Ok = 0,
    /// Fewer than two neighbors are listed that could say anything.
    TooFewNeighbors = 1,
    /// The neighbors do not fix a point (parallel lines, a missing axis).
    Degenerate = 2,
    /// No position agrees with any neighbor.
    NoSupport = 3,
}

impl Status {
    /// Every status.
    pub const ALL: [Status; 4] =
        [Self::Ok, Self::TooFewNeighbors, Self::Degenerate, Self::NoSupport];

    /// The name used in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::TooFewNeighbors => "too_few_neighbors",
            Self::Degenerate => "degenerate",
            Self::NoSupport => "no_support",
        }
    }

    /// The status called `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.name() == name)
    }
}

/// What recovery says about one slot, before it is put in columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const D: usize> {
    /// Position about the released origin; NaN unless `status` is `Ok`.
    pub position: [f32; D],
    /// What became of the slot.
    pub status: Status,
    /// Listed records that the position was made of: within delta of it before the last refit (planes:
    /// within 1.5 delta, summed over the free axes). Joint recovery: records listed by the slot or by
    /// whose slots its own is, with an estimate near. Counts beyond 65,535 stay there.
    pub support: u16,
    /// The axis on which the hidden coordinate lies (axis candidates only, else 0).
    pub axis: u8,
    /// Improbability of the support by chance, in nats (0 or more).
    pub evidence: f32,
}

/// A count as it is stored.
pub(crate) fn stored_support(count: u32) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

impl<const D: usize> Estimate<D> {
    /// A slot that could not be recovered.
    pub fn lost(status: Status) -> Self {
        Self { position: [f32::NAN; D], status, support: 0, axis: 0, evidence: 0.0 }
    }
}

// How sure the attacker is of one recovered point.

/// How sure the attacker is of one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    /// The probability that the right place was found, up to an error.
    pub found: f32,
    /// The median of that error, in the unit of the map.
    pub scale: f32,
}

impl Confidence {
    /// What is said of a slot without a position.
    pub const LOST: Self = Self { found: 0.0, scale: f32::INFINITY };

    /// The probability that the true place is at most `threshold` away, in the unit of the map:
    /// `found / (1 + (scale / threshold)^2)`.
    pub fn probability_within(&self, threshold: f64) -> f64 {
        let ratio = f64::from(self.scale) / threshold;
        if ratio.is_finite() { f64::from(self.found) / (1.0 + ratio * ratio) } else { 0.0 }
    }
}

// Why nobody can say how sure the attacker is.

/// Why a recovered map has no [`Confidence`]. Better none than one that does not come true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// It was not asked for.
    NotAsked,
    /// The positions come from elsewhere, without it.
    NotGiven,
    /// The model was fitted on maps: in images nobody has compared it with what comes true.
    OfImages,
    /// The solver is not `joint`: nothing was fitted for others.
    OtherSolver,
    /// The lists have scores, as sources that rank give them: nothing was fitted on how those err.
    RankedLists,
    /// Nobody says that the oracle made the lists: others err in ways on which nothing was fitted.
    GivenLists,
    /// What came back is flat or thin: records cross everywhere in a plane, and every crossing looks like a point.
    Flat,
    /// Most points fall together, so that their records agree at wrong places, too.
    Coincident,
    /// Lists have more entries per hidden point than in any map that the model was fitted on.
    SmallMap,
}

impl Unknown {
    /// All reasons.
    pub const ALL: [Self; 9] = [
        Self::NotAsked,
        Self::NotGiven,
        Self::OfImages,
        Self::OtherSolver,
        Self::RankedLists,
        Self::GivenLists,
        Self::Flat,
        Self::Coincident,
        Self::SmallMap,
    ];

    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotAsked => "not_asked",
            Self::NotGiven => "not_given",
            Self::OfImages => "images",
            Self::OtherSolver => "other_solver",
            Self::RankedLists => "ranked_lists",
            Self::GivenLists => "given_lists",
            Self::Flat => "flat",
            Self::Coincident => "coincident",
            Self::SmallMap => "small_map",
        }
    }

    /// The reason called so.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|why| why.name() == name)
    }

    /// The reason in plain words, as half a sentence after "not known here: ".
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
        }
    }
}

// How many trials the sampling loop took.

/// Trials at most, as in the paper's timings.
pub(crate) const MAX_TRIALS: u32 = 10_000;

/// How many slots took how many trials.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrialHistogram {
    counts: [u64; TrialHistogram::UP_TO.len()],
}

impl TrialHistogram {
    /// Upper ends (inclusive) of the bins.
    pub const UP_TO: [u32; 9] = [1, 3, 10, 30, 100, 300, 1_000, 3_000, MAX_TRIALS];

    /// (upper end, slots) per bin.
    pub fn bins(&self) -> impl Iterator<Item = (u32, u64)> {
        Self::UP_TO.into_iter().zip(self.counts)
    }
}

/// A histogram that threads add to. Sums of integers: the order in which they add does not matter.
#[derive(Debug, Default)]
pub(crate) struct TrialCounts {
    bins: [AtomicU64; TrialHistogram::UP_TO.len()],
}

impl TrialCounts {
    /// One more slot took so many trials.
    pub(crate) fn note(&self, trials: u32) {
        let bin = TrialHistogram::UP_TO.partition_point(|&up_to| up_to < trials);
        self.bins[bin.min(self.bins.len() - 1)].fetch_add(1, Ordering::Relaxed);
    }

    /// What was noted so far.
    pub(crate) fn histogram(&self) -> TrialHistogram {
        TrialHistogram { counts: self.bins.each_ref().map(|bin| bin.load(Ordering::Relaxed)) }
    }
}

// The result of recovery, in columns.

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

    /// What a solver of your own returns: `positions` about the released origin, one per slot. A position that is not finite
    /// stands for a point that could not be placed.
    ///
    /// Of axis candidates the hidden axis is taken to be the one along which a position is farthest from the published one.
    ///
    /// # Errors
    /// When there is not one position per slot.
    pub fn from_positions(
        released: &Released<D>,
        lists: &Neighborhoods,
        positions: &[[f32; D]],
    ) -> Result<Self, Error> {
        if positions.len() != released.n_slots() {
            let expected = format!("{}, one per slot", released.n_slots());
            return Err(Error::new("positions", expected, positions.len().to_string()));
        }
        let candidates = match released.obfuscation() {
            Obfuscation::AxisCandidates(candidates) => Some(candidates.position()),
            _ => None,
        };
        let estimate = |(slot, &position): (usize, &[f32; D])| {
            if !position.iter().all(|x| x.is_finite()) {
                return Estimate::lost(Status::NoSupport);
            }
            let moved = |published: &[f32; D], c: usize| (position[c] - published[c]).abs();
            let axis = candidates.map_or(0, |published| {
                let farther = |&a: &usize, &b: &usize| {
                    moved(&published[slot], a).total_cmp(&moved(&published[slot], b))
                };
                (0..D).max_by(farther).unwrap_or(0)
            });
            Estimate { position, status: Status::Ok, support: 0, axis: axis as u8, evidence: 0.0 }
        };
        let estimates: Vec<Estimate<D>> = positions.iter().enumerate().map(estimate).collect();
        let rows = descriptor_rows(released, lists, 0..released.n_records());
        let (origin, unit) = (released.origin(), released.unit());
        let about = About { map: Some(released.fingerprint()), ..lists.about() };
        Self::try_new(&estimates, candidates.is_some(), rows, origin, unit, 0.0)
            .map(|recovered| recovered.with_about(about).without_confidence(Unknown::OtherSolver))
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

#[cfg(test)]
mod tests {
    use super::Unknown;

    #[test]
    fn names_are_read_back() {
        for (at, why) in Unknown::ALL.into_iter().enumerate() {
            assert_eq!(Unknown::from_name(why.name()), Some(why));
            assert_eq!(why as usize, at, "in the order of the type, none left out");
        }
        assert_eq!(Unknown::from_name("unknown"), None);
    }
}
