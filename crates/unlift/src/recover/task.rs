//! One map to be recovered: records and lists in the form that solvers read, with what was learned of them.

use std::ops::Range;

use super::baselines::density::published;
use super::baselines::ransac::Ransac;
use super::checks::{check_anchors, check_lists, check_slots};
use super::confidence::seen::{Seen, Solved};
use super::consensus::Consensus;
use super::joint::{Joint, Outline};
use super::kept::{Headed, Kept};
use super::learned::Model;
use super::map::lists::Listed;
use super::options::{RecoverOptions, Solver};
use super::pairs_of_descriptors::descriptor_rows;
use super::placement::Placement;
use super::records::{Records, at_peaks, listed, used};
use super::result::estimate::Estimate;
use super::result::recovered::Recovered;
use super::result::trials::TrialCounts;
use super::result::unknown::Unknown;
use super::rounds::Rounds;
use super::solve::{Begin, Solve};
use super::{confidence, exact};
use crate::density::tomography;
use crate::neighbors::{Neighborhoods, ShelvedLists};
use crate::released::{Obfuscation, Released};
use crate::{About, Error, Fingerprint, Shelf};

/// A released map and its lists, ready to be solved in any parts.
///
/// ```
/// # use unlift::recover::{RecoverOptions, Solver};
/// # use unlift::{neighbors::Neighborhoods, released::Released, Error};
/// use unlift::recover::{Model, Recovered, Task, prepare};
///
/// fn in_two_parts(map: &Released<3>, lists: &Neighborhoods) -> Result<Recovered<3>, Error> {
///     let options = RecoverOptions { solver: Solver::Consensus, ..RecoverOptions::default() };
///     let model: Model<3> = prepare(map, lists, &options)?;
///     // Elsewhere, from `model.to_bytes()`:
///     let task = Task::new(&model, map, lists)?;
///     let half = map.n_slots() / 2;
///     let mut estimates = task.solve(0..half)?;
///     estimates.extend(task.solve(half..map.n_slots())?);
///     task.finish(estimates)
/// }
/// ```
#[derive(Debug)]
pub struct Task<'a, const D: usize> {
    released: &'a Released<D>,
    map: Fingerprint,
    lists: Listed<'a>,
    options: RecoverOptions,
    delta: f64,
    records: Records<'a, D>,
    trials: TrialCounts,
}

impl<'a, const D: usize> Task<'a, D> {
    /// `released` with its `lists`, and `model` made of these very two.
    ///
    /// # Errors
    /// When the model or the lists are of another map.
    pub fn new(
        model: &Model<D>,
        released: &'a Released<D>,
        lists: &'a Neighborhoods,
    ) -> Result<Self, Error> {
        check_lists(released, lists)?;
        Self::make(released, (Listed::Here(lists), None), &model.options, Some(model))
    }

    /// The same, with what the model says learned here.
    pub(super) fn learn(
        released: &'a Released<D>,
        lists: &'a Neighborhoods,
        options: &RecoverOptions,
    ) -> Result<Self, Error> {
        check_lists(released, lists)?;
        Self::make(released, (Listed::Here(lists), None), options, None)
    }

    /// The same with lists that are on a shelf, where other things may be put.
    pub(super) fn learn_shelved(
        released: &'a Released<D>,
        (lists, shelf): (&'a ShelvedLists, &dyn Shelf),
        options: &RecoverOptions,
    ) -> Result<Self, Error> {
        if !options.solver.reads_shelved() {
            let can = Solver::ALL.into_iter().filter(|solver| solver.reads_shelved());
            let expected = can.map(Solver::name).collect::<Vec<_>>().join(", ");
            let what = "solver for lists that are not in memory";
            return Err(Error::new(what, expected, options.solver.name()));
        }
        check_anchors(released)?;
        check_slots(released, lists.n_slots())?;
        Self::make(released, (Listed::Away(lists), Some(shelf)), options, None)
    }

    fn make(
        released: &'a Released<D>,
        (lists, shelf): (Listed<'a>, Option<&dyn Shelf>),
        options: &RecoverOptions,
        model: Option<&Model<D>>,
    ) -> Result<Self, Error> {
        options.check()?;
        let map = released.fingerprint();
        map.expect(lists.about().map)?;
        map.expect(model.map(|model| model.map)).map_err(|error| error.within("model"))?;
        let (records, delta) = match options.solver {
            Solver::Density => at_peaks(published(released)),
            Solver::Tomography => at_peaks(tomography(released)),
            Solver::Consensus | Solver::Joint | Solver::JointStart | Solver::Ransac => {
                listed(released, (lists, shelf), options, model)?
            }
        };
        let trials = TrialCounts::default();
        Ok(Self { released, map, lists, options: *options, delta, records, trials })
    }

    /// What was learned of the map.
    pub(super) fn model(&self) -> Model<D> {
        let chance = match &self.records {
            Records::Alone(_) => None,
            Records::Listed { family, .. } => Some(family.chance()),
        };
        let about = About { map: Some(self.map), ..self.lists.about() };
        let rule = match &self.records {
            Records::Listed { graph: Some(graph), .. } => Some(graph.rule().clone()),
            _ => None,
        };
        Model { options: self.options, about, map: self.map, delta: self.delta, chance, rule }
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.released.n_slots()
    }

    /// The estimates of `slots`, in order: for joint recovery those that its rounds start from. They are the same
    /// whichever slots are asked for together.
    ///
    /// What slots share beyond the model (ranks of windows of anchors, votes on the exchanged axis) is made anew by every call:
    /// ranges should be large.
    ///
    /// # Errors
    /// When the map has fewer slots.
    pub fn solve(&self, slots: Range<usize>) -> Result<Vec<Estimate<D>>, Error> {
        if slots.end > self.n_slots() || slots.start > slots.end {
            let expected = format!("a range of slots up to {}", self.n_slots());
            return Err(Error::new("slots", expected, format!("{slots:?}")));
        }
        self.solver(self.options.solver)?.solve(slots)
    }

    /// The rounds of joint recovery from `start`, the estimates of all slots; `None` where there are none to come: for other
    /// solvers, and where estimates say nothing about each other.
    ///
    /// # Errors
    /// When there is not one estimate per slot.
    pub fn rounds(&self, start: &[Estimate<D>]) -> Result<Option<Rounds<'_, D>>, Error> {
        self.check_estimates(start)?;
        Ok(self.solver(self.options.solver)?.rounds(Begin::At(start))?.map(Rounds::new))
    }

    /// Recovered points from the last estimates of all slots: exact constraints are met where a rule fixes coordinates, and it
    /// is said how sure the attacker is. Both look at the whole map.
    ///
    /// # Errors
    /// When there is not one estimate per slot.
    pub fn finish(&self, estimates: Vec<Estimate<D>>) -> Result<Recovered<D>, Error> {
        let rows = self.descriptor_rows()?;
        self.finish_with(estimates, rows, false).map(|(recovered, _)| recovered)
    }

    /// [`finish`](Self::finish), with what confidence is made of.
    pub(super) fn finish_and_look(
        &self,
        estimates: Vec<Estimate<D>>,
    ) -> Result<(Recovered<D>, Seen), Error> {
        let rows = self.descriptor_rows()?;
        self.finish_with(estimates, rows, true)
    }

    fn descriptor_rows(&self) -> Result<Option<Vec<u32>>, Error> {
        descriptor_rows(self.released, self.lists, 0..self.released.n_records())
    }

    /// The same, where it is known which descriptor is whose; what was seen is empty unless it is to be `kept`.
    pub(super) fn finish_with(
        &self,
        estimates: Vec<Estimate<D>>,
        descriptor_row: Option<Vec<u32>>,
        kept: bool,
    ) -> Result<(Recovered<D>, Seen), Error> {
        self.check_estimates(&estimates)?;
        let settled = self.settled(&estimates)?;
        let unsettled = &estimates[..];
        let estimates = settled.as_deref().unwrap_or(unsettled);
        let recovered = self.in_columns(estimates, descriptor_row)?;
        let trials = (self.options.solver == Solver::Ransac).then(|| self.trials.histogram());
        let recovered = recovered.with_trials(trials);
        if let Some(unknown) = confidence::not_asked::<D>(&self.options) {
            return Ok((recovered.without_confidence(unknown), Seen::NOTHING));
        }
        let Records::Listed { family, graph: Some(graph), .. } = &self.records else {
            return Ok((recovered.without_confidence(Unknown::OtherSolver), Seen::NOTHING));
        };
        let unknown = confidence::unknown(self.released, self.lists, estimates);
        if let (Some(unknown), false) = (unknown, kept) {
            return Ok((recovered.without_confidence(unknown), Seen::NOTHING));
        }
        let solved = Solved { estimates, unsettled, delta: self.delta as f32 };
        let (sure, seen) = confidence::look(family, graph, self.released, &solved, kept)?;
        let recovered = match unknown {
            Some(unknown) => recovered.without_confidence(unknown),
            None => recovered.with_confidence(sure)?,
        };
        Ok((recovered, seen))
    }

    /// The first pass of joint recovery as [`Solver::JointStart`] finishes it, beside the `last` one.
    pub(super) fn finish_start(
        &self,
        start: Vec<Estimate<D>>,
        last: &Recovered<D>,
    ) -> Result<Recovered<D>, Error> {
        let start = if self.is_settled() { self.settle(start) } else { start };
        let rows = last.descriptor_row().map(<[u32]>::to_vec);
        Ok(self.in_columns(&start, rows)?.without_confidence(Unknown::OtherSolver))
    }

    /// The solver called so, over this map.
    fn solver(&self, solver: Solver) -> Result<Box<dyn Solve<'_, D> + '_>, Error> {
        let (lists, delta, seed) = (self.lists, self.delta as f32, self.options.seed);
        // Those of the paper's loop and of attacks on records alone, which are not looked for on a shelf.
        let here = || match lists {
            Listed::Here(lists) => Ok(lists),
            _ => Err(Error::new("lists", "some in memory", "others")),
        };
        Ok(match &self.records {
            Records::Alone(peaks) => Box::new(Placement::new(self.released, here()?, peaks)),
            Records::Listed { family, graph, both_ways } => {
                // Joint recovery starts from who lists whom in both directions, where a record hides one point.
                let used = used(lists, graph.as_deref(), both_ways.as_ref());
                let start = Consensus { family, lists: used, delta };
                match (solver, graph) {
                    (Solver::Joint, Some(graph)) => {
                        Box::new(Joint { start, family, graph, delta, seed })
                    }
                    (Solver::Ransac, _) => Box::new(Ransac {
                        family,
                        lists: here()?,
                        delta,
                        seed,
                        trials: &self.trials,
                    }),
                    (Solver::Consensus | Solver::JointStart, _) | (Solver::Joint, None) => {
                        Box::new(start)
                    }
                    // Their records are read alone, without lists.
                    (Solver::Density | Solver::Tomography, _) => Box::new(start),
                }
            }
        })
    }

    /// Whether a rule of the scheme moves estimates. The paper's loop stays as published.
    fn is_settled(&self) -> bool {
        let asked = self.options.exact_constraints && self.options.solver != Solver::Ransac;
        let listed = matches!(self.records, Records::Listed { .. });
        asked && listed && exact::can_settle(self.released)
    }

    fn settle(&self, estimates: Vec<Estimate<D>>) -> Vec<Estimate<D>> {
        exact::settle(self.released, estimates, self.delta)
    }

    /// Estimates moved to where rules allow them to be, if they move any; joint recovery may go on from there.
    fn settled(&self, estimates: &[Estimate<D>]) -> Result<Option<Vec<Estimate<D>>>, Error> {
        if !self.is_settled() {
            return Ok(None);
        }
        let mut settled = self.settle(estimates.to_vec());
        if self.options.solver == Solver::Joint {
            for _ in 0..exact::feeds(self.released) {
                settled = self.settle(self.go_on(settled)?);
            }
        }
        Ok(Some(settled))
    }

    /// Estimates after all rounds from `start`.
    pub(super) fn go_on(&self, start: Vec<Estimate<D>>) -> Result<Vec<Estimate<D>>, Error> {
        let Some(rounds) = self.rounds(&start)? else { return Ok(start) };
        // They have copies of their own, and maps may be large.
        drop(start);
        rounds.run(None)
    }

    /// Estimates after all rounds, from where those stood that were `kept`, or from the beginning.
    pub(super) fn run(&self, kept: &mut dyn Kept) -> Result<Vec<Estimate<D>>, Error> {
        let solver = self.solver(self.options.solver)?;
        let mut kept = Headed::new(kept, &self.model());
        let recalled = kept.recall();
        let rounds = match &recalled {
            Some(bytes) => solver.rounds(Begin::Written(kept.rounds_of(bytes)?))?,
            None => {
                let start = solver.solve(0..self.n_slots())?;
                match solver.rounds(Begin::At(&start))? {
                    None => return Ok(start),
                    rounds => rounds,
                }
            }
        };
        drop(recalled);
        match rounds {
            Some(rounds) => Rounds::new(rounds).run(Some(kept)),
            None => {
                Err(Error::new("kept rounds", "a solver of rounds", self.options.solver.name()))
            }
        }
    }

    fn in_columns(
        &self,
        estimates: &[Estimate<D>],
        descriptor_row: Option<Vec<u32>>,
    ) -> Result<Recovered<D>, Error> {
        let about = About { map: Some(self.map), ..self.lists.about() };
        in_columns(self.released, (estimates, descriptor_row), self.delta, about)
    }

    /// What is known of the edges to whoever leads rounds without them.
    ///
    /// # Errors
    /// When the solver asks for no edges, or they cannot be read.
    pub(super) fn outline(&self) -> Result<Outline, Error> {
        match &self.records {
            Records::Listed { graph: Some(graph), .. } => {
                Outline::new(self.map, graph, self.options.seed)
            }
            _ => {
                let solver = self.options.solver.name();
                Err(Error::new("solver of rounds", Solver::Joint.name(), solver))
            }
        }
    }

    fn check_estimates(&self, estimates: &[Estimate<D>]) -> Result<(), Error> {
        if estimates.len() == self.n_slots() {
            return Ok(());
        }
        let expected = format!("{}, one per slot", self.n_slots());
        Err(Error::new("estimates", expected, estimates.len().to_string()))
    }
}

/// Estimates of `released` in columns, by rows of descriptors where these are known.
pub(super) fn in_columns<const D: usize>(
    released: &Released<D>,
    (estimates, descriptor_row): (&[Estimate<D>], Option<Vec<u32>>),
    delta: f64,
    about: About,
) -> Result<Recovered<D>, Error> {
    let with_axis = matches!(released.obfuscation(), Obfuscation::AxisCandidates(_));
    let (origin, unit) = (released.origin(), released.unit());
    Recovered::try_new(estimates, with_axis, descriptor_row, origin, unit, delta)
        .map(|recovered| recovered.with_about(about))
}
