//! One recovery problem: a released map, its lists, a solver and its options; and the steps that solve it.

use crate::density::{Peaks, tomography};
use crate::neighbors::Neighborhoods;
use crate::recover::assignment::descriptor_rows;
use crate::recover::baselines::density::published;
use crate::recover::baselines::ransac::Ransac;
use crate::recover::input::Input;
use crate::recover::map::family::{Family, Settings};
use crate::recover::map::graph::Graph;
use crate::recover::map::lines::LineRow;
use crate::recover::map::lists::Slots;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, Pieces, PlanePieces};
use crate::recover::options::{Delta, RecoverOptions};
use crate::recover::placement::{self, Placement};
use crate::recover::result::{Estimate, Recovered, TrialCounts, Unknown};
use crate::recover::solver::Builtin;
use crate::recover::{anchors, beliefs, confidence, consensus, delta, exact, joint, ranking};
use crate::released::{Obfuscation, Released};
use crate::{About, Error, Fingerprint, RowOrder};

/// Number of joint recoveries from known positions, each after the known ones are put back. With eight instead of three, `dcl2d` on
/// RedKitchen gains less than a point.
const ROUNDS: usize = 3;

/// Least mean evidence, in nats, of estimates on rays whose centers have regions: below it they are hardly better than chance.
const LEAST_EVIDENCE: f64 = 1.5;

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

enum Records<'a, const D: usize> {
    /// For attacks on the records alone: the peak of each slot.
    Alone(Peaks),
    /// For solvers that read lists.
    Listed {
        family: Box<Family<'a, D>>,
        /// For joint recovery: the edges of the lists in both directions.
        graph: Option<Graph>,
        /// The graph as lists, if records have one slot.
        both_ways: Option<Neighborhoods>,
    },
}

impl<'a, const D: usize> Problem<'a, D> {
    /// Prepares the problem.
    /// Fails when options are out of range, or the lists belong to another map.
    pub(super) fn new(
        released: &'a Released<D>,
        lists: &'a Neighborhoods,
        solver: Builtin,
        options: &RecoverOptions,
    ) -> Result<Self, Error> {
        check_lists(released, lists)?;
        options.check()?;
        let map = released.fingerprint();
        map.expect(lists.about().map)?;
        let at_peaks = |peaks: Peaks| (placement::delta(&peaks), Records::Alone(peaks));
        let (delta, records) = match solver {
            Builtin::Density => at_peaks(published(released)),
            Builtin::Tomography => at_peaks(tomography(released)),
            Builtin::Consensus | Builtin::Joint | Builtin::Ransac => {
                Self::listed(released, lists, solver, options)
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
    ) -> (f64, Records<'a, D>) {
        let family = Box::new(Family::new(released, lists));
        // Joint recovery reads lists in both directions from its start on.
        let is_joint = solver == Builtin::Joint;
        let graph = is_joint.then(|| Graph::new(lists, released.slots_per_record()));
        let single = graph.as_ref().filter(|_| released.slots_per_record() == 1);
        let both_ways = single.map(Graph::neighborhoods);
        let delta = match options.delta {
            Delta::Fixed(delta) => delta,
            Delta::Auto => {
                let used = both_ways.as_ref().unwrap_or(lists);
                delta::learn(released, &family, (used, lists), is_joint, options.seed)
            }
        };
        (delta, Records::Listed { family, graph, both_ways })
    }

    pub(super) fn n_slots(&self) -> usize {
        self.released.n_slots()
    }

    /// Returns the estimates of all slots. For joint recovery these are the estimates it starts from.
    pub(super) fn start(&self) -> Vec<Estimate<D>> {
        let (lists, delta) = (self.lists, self.delta as f32);
        match &self.records {
            Records::Alone(peaks) => Placement::new(self.released, lists, peaks).solve(),
            Records::Listed { family, .. } if self.solver == Builtin::Ransac => {
                let (seed, trials) = (self.options.seed, &self.trials);
                Ransac { family, lists, delta, seed, trials }.solve()
            }
            Records::Listed { family, both_ways, .. } => {
                let lists = both_ways.as_ref().unwrap_or(lists);
                consensus::solve(family, lists, delta, &Slots::all(lists.n_slots()))
            }
        }
    }

    /// Returns the estimates of all slots after joint recovery from `start`; for other solvers, `start`. Estimates that are `known`,
    /// per slot, stay as they are; the list is empty if none is known.
    pub(super) fn joint(
        &self,
        start: Vec<Estimate<D>>,
        known: &[Option<Estimate<D>>],
    ) -> Vec<Estimate<D>> {
        let Records::Listed { family, graph: Some(graph), .. } = &self.records else {
            return start;
        };
        let (lists, delta, seed) = ((self.lists, graph), self.delta as f32, self.options.seed);
        match &**family {
            Family::Lines { rows, slots_per_record, chance, has_regions } => {
                let pieces =
                    LinePieces::new(rows, *slots_per_record, (chance, *has_regions), delta);
                let rays = has_regions.then_some(&rows[..]);
                steps(&Input::new(pieces, lists, delta, seed), rays, start, known)
            }
            Family::Planes { planes, sorted } => {
                let pieces = PlanePieces::new(planes, sorted, delta);
                steps(&Input::new(pieces, lists, delta, seed), None, start, known)
            }
            Family::Candidates { rows, chance } => {
                let pieces = CandidatePieces::new(rows, chance, delta);
                steps(&Input::new(pieces, lists, delta, seed), None, start, known)
            }
        }
    }

    /// Applies exact constraints to the last estimates and adds confidence.
    /// Fails when there is not one estimate per slot.
    pub(super) fn finish(&self, unsettled: Vec<Estimate<D>>) -> Result<Recovered<D>, Error> {
        if unsettled.len() != self.n_slots() {
            let expected = format!("{}, one per slot", self.n_slots());
            return Err(Error::new("estimates", expected, unsettled.len().to_string()));
        }
        let settled = self.settled(&unsettled);
        let estimates = settled.as_ref().unwrap_or(&unsettled);
        let descriptor_row = descriptor_rows(self.released, self.lists);
        let trials = (self.solver == Builtin::Ransac).then(|| self.trials.histogram());
        let recovered = self.in_columns(estimates, descriptor_row)?.with_trials(trials);
        if let Some(unknown) = confidence::not_asked::<D>(self.solver, &self.options) {
            return Ok(recovered.without_confidence(unknown));
        }
        let Records::Listed { graph: Some(graph), .. } = &self.records else {
            return Ok(recovered.without_confidence(Unknown::OtherSolver));
        };
        if let Some(unknown) = confidence::unknown(self.released, self.lists, estimates) {
            return Ok(recovered.without_confidence(unknown));
        }
        match confidence::predict(graph, self.released, estimates) {
            Ok(confidence) => recovered.with_confidence(confidence),
            Err(unknown) => Ok(recovered.without_confidence(unknown)),
        }
    }

    /// Applies exact constraints, if the family has any, and repeats joint recovery from the result where that helps. The paper's
    /// sampling loop stays as published.
    fn settled(&self, estimates: &[Estimate<D>]) -> Option<Vec<Estimate<D>>> {
        if self.solver == Builtin::Ransac || matches!(self.records, Records::Alone(_)) {
            return None;
        }
        let settle = |estimates: &[_]| exact::settle(self.released, estimates, self.delta);
        let mut settled = settle(estimates)?;
        if self.solver == Builtin::Joint {
            for _ in 0..Settings::of_dimension::<D>().joint_reruns {
                settled = settle(&self.joint(settled, &[]))?;
            }
        }
        Some(settled)
    }

    /// Puts estimates in columns, with the rows of descriptors where they are known.
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

/// Rejects lists that do not fit the map.
pub(super) fn check_lists<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
) -> Result<(), Error> {
    if lists.n_slots() != released.n_slots() {
        let expected = format!("{} rows, one per slot", released.n_slots());
        return Err(Error::new("neighborhoods", expected, lists.n_slots().to_string()));
    }
    // Lists of another map may have the same number of rows.
    let n_records = released.n_records();
    if let Some(record) = lists.records().iter().find(|record| record.index() >= n_records) {
        let expected = format!("records below {n_records}");
        return Err(Error::new("neighborhoods", expected, record.0.to_string()));
    }
    Ok(())
}

/// Returns the estimates of all slots after the steps of joint recovery from `start`. `rays` are those whose centers have regions. Estimates
/// that are `known`, per slot, stay as they are.
fn steps<const D: usize, P: Pieces<D>>(
    input: &Input<'_, P>,
    rays: Option<&[LineRow<D>]>,
    start: Vec<Estimate<D>>,
    known: &[Option<Estimate<D>>],
) -> Vec<Estimate<D>> {
    let Input { pieces, lists, graph, .. } = input;
    let restore = |mut estimates: Vec<Estimate<D>>| {
        for (estimate, known) in estimates.iter_mut().zip(known) {
            *estimate = known.unwrap_or(*estimate);
        }
        estimates
    };
    let mut estimates = restore(start);
    // All slots together: each by its neighbors' estimates. From rays that say hardly more than chance, neighbors add nothing.
    for _ in 0..if known.is_empty() { 1 } else { ROUNDS } {
        if rays.is_none() || mean_evidence(&estimates) >= LEAST_EVIDENCE {
            estimates = restore(joint::recover(input, estimates));
        }
    }
    // Lists from the records alone say what the records say. The following steps would count it twice.
    if lists.about().order == RowOrder::Either {
        return estimates;
    }
    // A layout of the whole image, which known positions replace.
    if let Some(rays) = rays.filter(|_| known.is_empty()) {
        estimates = anchors::layout::recover(rays, (lists, &graph.listers), estimates);
    }
    // The likeliest places under the whole lists; or under their entries alone, where what is not listed says too little. Beliefs
    // are for maps with one slot per record: points of paired lines and of images lose as often as they gain.
    let with_beliefs = D == 3 && pieces.slots_per_record() == 1 && lists.scores().is_some();
    restore(match ranking::recover(input, estimates) {
        Err(estimates) if with_beliefs => beliefs::recover(input, estimates),
        Ok(estimates) | Err(estimates) => estimates,
    })
}

fn mean_evidence<const D: usize>(estimates: &[Estimate<D>]) -> f64 {
    let sum: f64 = estimates.iter().map(|e| f64::from(e.evidence)).sum();
    sum / estimates.len().max(1) as f64
}
