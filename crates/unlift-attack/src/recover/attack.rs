//! The attacks of this crate, from released records and lists to recovered points: the steps in their order.

use crate::density::{Peaks, tomography};
use crate::neighbors::{Geometric, Neighborhoods, geometric_by};
use crate::recover::baselines::density::published;
use crate::recover::baselines::ransac::{self, Trials};
use crate::recover::map::{CandidateFamily, Family, Graph, LineFamily, PlaneFamily};
use crate::recover::problem::Problem;
use crate::recover::ranking;
use crate::recover::result::{Estimate, Recovered, Unknown};
use crate::recover::solver::{Builtin, Delta, RecoverOptions, Solver};
use crate::recover::{anchors, beliefs, confidence, consensus, delta, exact, joint, peaks};
use crate::released::{Obfuscation, Released};
use crate::{About, Error, RowOrder};

/// Number of joint recoveries from known positions. With eight, `dcl2d` on RedKitchen gains less than a point.
const ROUNDS: usize = 3;

/// Least mean evidence, in nats, of estimates on rays whose centers have regions: below it they are hardly better than chance.
const LEAST_EVIDENCE: f64 = 1.5;

struct Attack<'a, const D: usize> {
    released: &'a Released<D>,
    lists: &'a Neighborhoods,
    options: RecoverOptions,
    solver: Builtin,
    /// Whether [`Builtin::Joint`] ends after its first step, `consensus`.
    only_starts: bool,
    /// Estimates that stay as they are, per slot; empty if none is known.
    known: &'a [Option<Estimate<D>>],
}

impl<const D: usize> Solver<D> for Builtin {
    fn name(&self) -> &str {
        Self::name(*self)
    }

    fn recover(
        &self,
        released: &Released<D>,
        lists: &Neighborhoods,
        options: &RecoverOptions,
    ) -> Result<Recovered<D>, Error> {
        check(released, lists, options)?;
        let options = *options;
        Attack { released, lists, options, solver: *self, only_starts: false, known: &[] }.run()
    }

    fn reads_lists(&self) -> bool {
        Self::FROM_LISTS.contains(self)
    }

    fn builtin(&self) -> Option<Builtin> {
        Some(*self)
    }
}

type Run<const D: usize> = fn(&Attack<'_, D>) -> Result<Recovered<D>, Error>;
type Attacks<const D: usize> = Vec<(&'static str, Recovered<D>)>;
type Alone<const D: usize> = fn(&Released<D>, &RecoverOptions) -> Result<Attacks<D>, Error>;

crate::both! { RUN: Run = run }
crate::both! { ALONE: Alone = alone }

/// Runs our attacks on the records alone; returns the name and result of each. Planes and rays from one center yield nothing.
///
/// They read the whole map: a sample gives less. The published attack runs on rays only: on lines, tomography recovers more.
///
/// # Errors
/// When `options` are out of range.
pub fn records_alone<const D: usize>(
    released: &Released<D>,
    options: &RecoverOptions,
) -> Result<Attacks<D>, Error> {
    let alone: Alone<D> = ALONE.of()?;
    alone(released, options)
}

fn alone<const D: usize>(
    released: &Released<D>,
    options: &RecoverOptions,
) -> Result<Attacks<D>, Error> {
    options.check()?;
    let none = Neighborhoods::empty(released.n_slots());
    // For paired lines, the order of the two points is unknown.
    let none = none.with_about(About { order: RowOrder::Either, ..About::default() });
    let mut attacks = Vec::new();
    if matches!(released.obfuscation(), Obfuscation::Rays(_)) {
        let peaks = published(released).unwrap_or_default();
        attacks.push((Builtin::Density.name(), peaks::at_peaks(released, &none, &peaks)?));
    }
    let peaks = tomography(released).unwrap_or_default();
    attacks.push((Builtin::Tomography.name(), peaks::at_peaks(released, &none, &peaks)?));
    // Planes and rays from one center have no geometric lists.
    if let Ok(lists) = geometric_by(released, Geometric::K, &peaks) {
        let options = RecoverOptions { confidence: false, ..*options };
        let (lists, solver) = (&lists, Builtin::Joint);
        let joint = Attack { released, lists, options, solver, only_starts: false, known: &[] };
        let recovered = joint.run()?;
        // Delta does not need to be learned twice.
        let options = RecoverOptions { delta: Delta::Fixed(recovered.delta()), ..options };
        let start = Attack { options, only_starts: true, ..joint }.run()?;
        attacks.extend([("geometric, consensus", start), ("geometric, joint", recovered)]);
    }
    Ok(attacks)
}

/// Recovers by [`Builtin::Joint`] from known positions of some slots. Positions that are more likely right than wrong, by
/// the confidence in `known`, stay as they are until exact constraints apply (axis candidates).
///
/// # Errors
/// When options are out of range, the lists do not have one row per slot, or `known` belongs to another map.
pub fn recover_from<const D: usize>(
    known: &Recovered<D>,
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<Recovered<D>, Error> {
    check(released, lists, options)?;
    released.fingerprint().expect(known.about().map)?;
    let known: Vec<_> = (0..released.n_slots()).map(|slot| known.sure_estimate(slot)).collect();
    let (known, options, solver) = (&known[..], *options, Builtin::Joint);
    Attack { released, lists, options, solver, only_starts: false, known }.run()
}

/// Rejects options out of range, and lists of another map.
pub(super) fn check<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    options: &RecoverOptions,
) -> Result<(), Error> {
    let n_slots = released.n_slots();
    Error::check_len("neighborhoods", lists.n_slots(), n_slots, " rows, one per slot")?;
    released.fingerprint().expect(lists.about().map)?;
    let n_records = released.n_records();
    if let Some(record) = lists.records().iter().find(|record| record.index() >= n_records) {
        let expected = format!("records below {n_records}");
        return Err(Error::new("neighborhoods", expected, record.0));
    }
    if lists.slots().is_some() && released.slots_per_record() != 2 {
        return Err(Error::new("neighborhoods", "no slots, as a record has one", "slots"));
    }
    options.check()
}

fn run<const D: usize>(attack: &Attack<'_, D>) -> Result<Recovered<D>, Error> {
    let Attack { released, lists, solver, .. } = *attack;
    let at = |peaks: Option<Peaks>| peaks::at_peaks(released, lists, &peaks.unwrap_or_default());
    match (solver, released.obfuscation()) {
        (Builtin::Density, _) => at(published(released)),
        (Builtin::Tomography, _) => at(tomography(released)),
        (_, Obfuscation::Lines(_) | Obfuscation::Rays(_)) => {
            attack.run_on(&LineFamily::new(released, lists))
        }
        (_, Obfuscation::AxisPlanes(planes)) => attack.run_on(&PlaneFamily::new(planes)),
        (_, Obfuscation::AxisCandidates(candidates)) => {
            attack.run_on(&CandidateFamily::new(candidates.position(), lists))
        }
    }
}

impl<const D: usize> Attack<'_, D> {
    fn run(&self) -> Result<Recovered<D>, Error> {
        let run: Run<D> = RUN.of()?;
        run(self)
    }

    /// Runs the attack on records of one family: delta, consensus, [`joint`], exact constraints, confidence.
    fn run_on<F: Family<D> + Trials<D>>(&self, family: &F) -> Result<Recovered<D>, Error> {
        let Self { released, lists, options: RecoverOptions { seed, .. }, solver, .. } = *self;
        let is_joint = solver == Builtin::Joint;
        // Joint recovery reads lists in both directions from its start on.
        let graph = is_joint.then(|| Graph::new(lists, released.slots_per_record()));
        let both_ways = graph.as_ref().and_then(Graph::neighborhoods);
        let used = both_ways.as_ref().unwrap_or(lists);
        let delta = match self.options.delta {
            Delta::Fixed(delta) => delta,
            Delta::Auto => delta::learn(released, family, (used, lists), is_joint, seed),
        };
        let slots: Vec<usize> = (0..lists.n_slots()).collect();
        let start = || match family.anchored() {
            Some(rays) => anchors::start::solve(rays, used),
            None => consensus::solve(family, used, delta as f32, &slots),
        };
        let settle = |estimates| exact::settle(released, estimates, delta);
        let mut trials = None;
        let estimates = if solver == Builtin::Ransac {
            let (estimates, counts) = ransac::solve(family, lists, delta as f32, &slots, seed);
            trials = Some(counts);
            estimates
        } else if let Some(graph) = graph.as_ref().filter(|_| !self.only_starts) {
            let problem = Problem::new(family, (lists, graph), delta as f32, seed);
            let mut estimates = settle(joint(&problem, start(), self.known));
            for _ in 0..F::RERUNS {
                estimates = settle(joint(&problem, estimates, &[]));
            }
            peaks::place_unlisted(&mut estimates, released, lists);
            estimates
        } else {
            settle(start())
        };
        let mut recovered = Recovered::new(released, lists, &estimates, delta)?;
        recovered.trials = trials;
        recovered.confidence = match &graph {
            None => Err(Unknown::OtherSolver),
            Some(_) if !self.options.confidence => Err(Unknown::NotAsked),
            Some(graph) => confidence::predict(released, lists, graph, &estimates),
        };
        Ok(recovered)
    }
}

/// Returns the estimates of all slots after the steps of joint recovery from `start`. Those that are `known` stay as they are.
fn joint<const D: usize, F: Family<D>>(
    problem: &Problem<'_, D, F>,
    start: Vec<Estimate<D>>,
    known: &[Option<Estimate<D>>],
) -> Vec<Estimate<D>> {
    let Problem { family, lists, graph, .. } = problem;
    let restore = |mut estimates: Vec<Estimate<D>>| {
        for (estimate, known) in estimates.iter_mut().zip(known) {
            *estimate = known.unwrap_or(*estimate);
        }
        estimates
    };
    let mut estimates = restore(start);
    // All slots together: each by its neighbors' estimates. From rays that say hardly more than chance, neighbors add nothing.
    for _ in 0..if known.is_empty() { 1 } else { ROUNDS } {
        if family.anchored().is_none() || Estimate::mean_evidence(&estimates) >= LEAST_EVIDENCE {
            estimates = restore(joint::recover(problem, estimates));
        }
    }
    // Lists from the records alone say what the records say. The following steps would count it twice.
    if lists.about().order == RowOrder::Either {
        return estimates;
    }
    // A layout of the whole image, which known positions replace.
    if let Some(rays) = family.anchored().filter(|_| known.is_empty()) {
        estimates = anchors::layout::recover(rays, (lists, &graph.listers), estimates);
    }
    // The likeliest places under whole lists, or under their entries where the rest says too little. If entries mean either point of a
    // line, beliefs would lose.
    let with_beliefs = graph.slots_per_target == 1 && lists.scores().is_some();
    restore(match ranking::recover(problem, &estimates) {
        Some(ranked) => ranked,
        None if with_beliefs => beliefs::recover(problem, estimates),
        None => estimates,
    })
}
