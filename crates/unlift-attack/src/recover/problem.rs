//! A released map and its lists in the form that solvers read.

use std::ops::Range;

use crate::density::{Peaks, tomography};
use crate::neighbors::Neighborhoods;
use crate::recover::assignment::descriptor_rows;
use crate::recover::confidence::cues::{Seen, Solved};
use crate::recover::map::family::Family;
use crate::recover::map::graph::Graph;
use crate::recover::map::lists::Slots;
use crate::recover::model::Model;
use crate::recover::options::{Delta, RecoverOptions};
use crate::recover::published_density::published;
use crate::recover::ransac::Ransac;
use crate::recover::records_alone::{self, Placement};
use crate::recover::result::{Estimate, Recovered, TrialCounts, Unknown};
use crate::recover::solver::Builtin;
use crate::recover::{confidence, consensus, delta, exact, joint};
use crate::released::{Obfuscation, Released};
use crate::{About, Error, Fingerprint};

/// One map to be recovered.
pub(super) struct Problem<'a, const D: usize> {
    released: &'a Released<D>,
    map: Fingerprint,
    lists: &'a Neighborhoods,
    solver: Builtin,
    options: RecoverOptions,
    delta: f64,
    records: Records<'a, D>,
    trials: TrialCounts,
}

/// Records as solvers read them.
enum Records<'a, const D: usize> {
    /// Where records alone say that points are.
    Alone(Peaks),
    /// Records with their lists.
    Listed {
        family: Family<'a, D>,
        /// Who lists whom in both directions, for joint recovery.
        graph: Option<Graph>,
        /// The graph as lists, where records have one slot.
        both_ways: Option<Neighborhoods>,
    },
}

impl<'a, const D: usize> Problem<'a, D> {
    /// `released` with its `lists`; what a model would say is learned here.
    /// Fails when options are out of range, or the lists are of another map.
    pub(super) fn new(
        released: &'a Released<D>,
        lists: &'a Neighborhoods,
        solver: Builtin,
        options: &RecoverOptions,
    ) -> Result<Self, Error> {
        Self::make(released, lists, solver, options, None)
    }

    /// [`new`](Self::new), where the lists may be some of those that a `model` was made of.
    fn make(
        released: &'a Released<D>,
        lists: &'a Neighborhoods,
        solver: Builtin,
        options: &RecoverOptions,
        model: Option<&Model<D>>,
    ) -> Result<Self, Error> {
        check_lists(released, lists)?;
        options.check()?;
        let map = released.fingerprint();
        map.expect(lists.about().map)?;
        map.expect(model.map(|model| model.map)).map_err(|error| error.within("model"))?;
        let at_peaks = |peaks: Peaks| (records_alone::delta(&peaks), Records::Alone(peaks));
        let (delta, records) = match solver {
            Builtin::Density => at_peaks(published(released)),
            Builtin::Tomography => at_peaks(tomography(released)),
            Builtin::Consensus | Builtin::Joint | Builtin::JointStart | Builtin::Ransac => {
                Self::listed(released, lists, solver, options, model)?
            }
        };
        let trials = TrialCounts::default();
        Ok(Self { released, map, lists, solver, options: *options, delta, records, trials })
    }

    fn listed(
        released: &'a Released<D>,
        lists: &'a Neighborhoods,
        solver: Builtin,
        options: &RecoverOptions,
        model: Option<&Model<D>>,
    ) -> Result<(f64, Records<'a, D>), Error> {
        let family = Family::new(released, lists, model.map(|model| model.chance.clone()))?;
        // Joint recovery also asks who lists whom, from the first pass on.
        let is_joint = matches!(solver, Builtin::Joint | Builtin::JointStart);
        let graph = is_joint.then(|| Graph::new(lists, released.slots_per_record()));
        let single = graph.as_ref().filter(|_| released.slots_per_record() == 1);
        let both_ways = single.map(Graph::neighborhoods);
        let delta = match (model, options.delta) {
            (Some(model), _) => model.delta,
            (None, Delta::Fixed(delta)) => delta,
            (None, Delta::Auto) => {
                let used = both_ways.as_ref().unwrap_or(lists);
                delta::learn(released, &family, (used, lists), is_joint, options.seed)
            }
        };
        Ok((delta, Records::Listed { family, graph, both_ways }))
    }

    /// What was learned of the map.
    /// Fails when the solver does not read lists.
    pub(super) fn model(&self) -> Result<Model<D>, Error> {
        let Records::Listed { family, .. } = &self.records else {
            return Err(Error::new(
                "solver of parts",
                Builtin::Consensus.name(),
                self.solver.name(),
            ));
        };
        let (map, delta, chance) = (self.map, self.delta, family.chance());
        Ok(Model { options: self.options, about: self.about(), map, delta, chance })
    }

    /// Number of slots.
    pub(super) fn n_slots(&self) -> usize {
        self.released.n_slots()
    }

    /// The estimates of `slots`, in order, by the solver; of joint recovery those that it starts from.
    pub(super) fn solve(&self, slots: Range<usize>) -> Vec<Estimate<D>> {
        let (lists, delta) = (self.lists, self.delta as f32);
        match &self.records {
            Records::Alone(peaks) => Placement::new(self.released, lists, peaks).solve(slots),
            Records::Listed { family, .. } if self.solver == Builtin::Ransac => {
                let (seed, trials) = (self.options.seed, &self.trials);
                Ransac { family, lists, delta, seed, trials }.solve(slots)
            }
            Records::Listed { family, both_ways, .. } => {
                let lists = both_ways.as_ref().unwrap_or(lists);
                consensus::solve(family, lists, delta, &Slots::range(slots))
            }
        }
    }

    /// The estimates of all slots after joint recovery from `start`; `start` for other solvers.
    pub(super) fn run_joint(&self, start: Vec<Estimate<D>>) -> Vec<Estimate<D>> {
        match &self.records {
            Records::Listed { family, graph: Some(graph), .. } if self.solver == Builtin::Joint => {
                let (delta, seed) = (self.delta as f32, self.options.seed);
                joint::recover(family, graph, delta, seed, start)
            }
            _ => start,
        }
    }

    /// Recovered points from the last estimates of all slots, with exact constraints and confidence. Beside it what confidence
    /// is made of, if it `want_features` for.
    /// Fails when there is not one estimate per slot.
    pub(super) fn finish(
        &self,
        estimates: Vec<Estimate<D>>,
        want_features: bool,
    ) -> Result<(Recovered<D>, Seen), Error> {
        let rows = descriptor_rows(self.released, self.lists, 0..self.released.n_records());
        self.finish_with(estimates, rows, want_features)
    }

    /// [`finish`](Self::finish), where it is known which descriptor is whose.
    fn finish_with(
        &self,
        unsettled: Vec<Estimate<D>>,
        descriptor_row: Option<Vec<u32>>,
        want_features: bool,
    ) -> Result<(Recovered<D>, Seen), Error> {
        if unsettled.len() != self.n_slots() {
            let expected = format!("{}, one per slot", self.n_slots());
            return Err(Error::new("estimates", expected, unsettled.len().to_string()));
        }
        // Most schemes settle nothing: a copy of all estimates would double their memory.
        let settled = self.is_settled().then(|| self.settled(unsettled.clone()));
        let estimates = settled.as_ref().unwrap_or(&unsettled);
        let trials = (self.solver == Builtin::Ransac).then(|| self.trials.histogram());
        let recovered = self.in_columns(estimates, descriptor_row)?.with_trials(trials);
        let nothing = |recovered: Recovered<D>, unknown: Unknown| {
            Ok((recovered.without_confidence(unknown), Seen::NOTHING))
        };
        if let Some(unknown) = confidence::not_asked::<D>(self.solver, &self.options) {
            return nothing(recovered, unknown);
        }
        let Records::Listed { family, graph: Some(graph), .. } = &self.records else {
            return nothing(recovered, Unknown::OtherSolver);
        };
        let unknown = confidence::unknown(self.released, self.lists, estimates);
        if let (Some(unknown), false) = (unknown, want_features) {
            return nothing(recovered, unknown);
        }
        let solved = Solved { estimates, unsettled: &unsettled, delta: self.delta as f32 };
        let (sure, seen) = confidence::predict(family, graph, self.released, &solved);
        let recovered = match unknown {
            Some(unknown) => recovered.without_confidence(unknown),
            None => recovered.with_confidence(sure)?,
        };
        Ok((recovered, seen))
    }

    /// The first pass of joint recovery as [`Builtin::JointStart`] finishes it, beside the `last` one.
    /// Fails when there is not one estimate per slot.
    pub(super) fn finish_start(
        &self,
        start: Vec<Estimate<D>>,
        last: &Recovered<D>,
    ) -> Result<Recovered<D>, Error> {
        let rows = last.descriptor_row().map(<[u32]>::to_vec);
        let recovered = self.in_columns(&self.settle(start), rows)?;
        Ok(recovered.without_confidence(Unknown::OtherSolver))
    }

    /// Whether a rule of the scheme moves estimates. The paper's loop stays as published.
    fn is_settled(&self) -> bool {
        let asked = self.options.exact_constraints && self.solver != Builtin::Ransac;
        let listed = matches!(self.records, Records::Listed { .. });
        asked && listed && exact::can_settle(self.released)
    }

    /// Estimates moved to where rules of the scheme allow them to be.
    fn settle(&self, estimates: Vec<Estimate<D>>) -> Vec<Estimate<D>> {
        match self.is_settled() {
            true => exact::settle(self.released, estimates, self.delta),
            false => estimates,
        }
    }

    /// Estimates of which a rule of the scheme fixes coordinates; joint recovery goes on from there.
    fn settled(&self, estimates: Vec<Estimate<D>>) -> Vec<Estimate<D>> {
        let mut settled = self.settle(estimates);
        if self.solver == Builtin::Joint {
            for _ in 0..exact::joint_reruns(self.released) {
                settled = self.settle(self.run_joint(settled));
            }
        }
        settled
    }

    /// Estimates in columns, by rows of descriptors where these are known.
    fn in_columns(
        &self,
        estimates: &[Estimate<D>],
        descriptor_row: Option<Vec<u32>>,
    ) -> Result<Recovered<D>, Error> {
        let released = self.released;
        let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
        let (origin, unit) = (released.origin(), released.unit());
        Recovered::try_new(estimates, with_axis, descriptor_row, origin, unit, self.delta)
            .map(|recovered| recovered.with_about(self.about()))
    }

    fn about(&self) -> About {
        About { map: Some(self.map), ..self.lists.about() }
    }
}

/// Refuses rays that are compared with all others of their anchor, which takes all lists.
fn check_anchors<const D: usize>(released: &Released<D>) -> Result<(), Error> {
    match released.obfuscation() {
        Obfuscation::Rays(rays) if rays.regions().is_some() => {
            Err(Error::new("records of parts", "such as say nothing about others", "anchors"))
        }
        _ => Ok(()),
    }
}

/// Refuses lists that are not of this map.
pub(super) fn check_lists<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Result<(), Error> {
    if lists.n_slots() != released.n_slots() {
        let expected = format!("{} rows, one per slot", released.n_slots());
        return Err(Error::new("neighborhoods", expected, lists.n_slots().to_string()));
    }
    // Lists of another map may have as many rows.
    let n_records = released.n_records();
    if let Some(record) = lists.records().iter().find(|record| record.index() >= n_records) {
        let expected = format!("records below {n_records}");
        return Err(Error::new("neighborhoods", expected, record.0.to_string()));
    }
    Ok(())
}

// Consensus in parts, each with its own lists alone: what the machines of a cluster solve.

/// What came of some slots of a map, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Part<const D: usize> {
    /// An estimate per slot.
    pub estimates: Vec<Estimate<D>>,
    /// Per slot the descriptor row said to belong to it, if records hide two points and have descriptors.
    pub descriptor_row: Option<Vec<u32>>,
}

impl<const D: usize> Model<D> {
    /// Solves `slots` of `released` by consensus with the lists of these slots alone, made by
    /// [`Neighborhoods::of_slots`]: whatever other lists say changes nothing. Reads all records once: parts should be large.
    ///
    /// # Errors
    /// When the model is of another map, records are rays from anchors in regions (which are compared with each other), or `slots` are
    /// not there or end within a record.
    pub fn solve_part(
        &self,
        released: &Released<D>,
        lists: &Neighborhoods,
        slots: Range<usize>,
    ) -> Result<Part<D>, Error> {
        check_anchors(released)?;
        let per_record = released.slots_per_record();
        let is_there = slots.start <= slots.end && slots.end <= released.n_slots();
        if !is_there || slots.start % per_record + slots.end % per_record > 0 {
            let expected = format!("a range of whole records, {per_record} slots each");
            return Err(Error::new("slots", expected, format!("{slots:?}")));
        }
        let estimates =
            Problem::make(released, lists, Builtin::Consensus, &self.options, Some(self))?
                .solve(slots.clone());
        let records = slots.start / per_record..slots.end / per_record;
        let descriptor_row = descriptor_rows(released, lists, records);
        Ok(Part { estimates, descriptor_row })
    }

    /// What came back of the whole map: `parts` in the order of their slots. The same as
    /// [`recover`](crate::recover::recover), bit for bit.
    ///
    /// # Errors
    /// As there, and when the parts are not those of all slots.
    pub fn join(
        &self,
        released: &Released<D>,
        parts: impl IntoIterator<Item = Part<D>>,
    ) -> Result<Recovered<D>, Error> {
        check_anchors(released)?;
        let (mut estimates, mut rows) = (Vec::new(), Vec::new());
        for part in parts {
            estimates.extend(part.estimates);
            rows.extend(part.descriptor_row.into_iter().flatten());
        }
        let none = Neighborhoods::unchecked(vec![0; released.n_slots() + 1], Vec::new());
        let lists = none.with_about(self.about);
        let has_rows = released.slots_per_record() == 2 && released.descriptors().is_some();
        let problem =
            Problem::make(released, &lists, Builtin::Consensus, &self.options, Some(self))?;
        problem
            .finish_with(estimates, has_rows.then_some(rows), false)
            .map(|(recovered, _)| recovered)
    }
}
