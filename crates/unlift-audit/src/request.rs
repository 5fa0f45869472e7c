//! What a user requests of an attack, and the plan that this makes.

use std::sync::Arc;

use unlift::audit::{NeighborsBy, Plan, Threshold};
use unlift::neighbors::Source;
use unlift::neighbors::oracle::Noise;
use unlift::obfuscate::{Change, Changed, Scheme};
use unlift::recover::Solver;
use unlift::{Descriptors, PointSet, Unit};

use crate::document::distinct;
use crate::doubts::{Remarks, check_thresholds};
use crate::sources::check_fit;
use crate::{Error, bail, sources};

/// What a user requests of an attack.
#[derive(Clone, Debug)]
pub struct Request<const D: usize> {
    /// The requested plan. Lists that are empty have their defaults; built-in names count once.
    pub plan: Plan<D>,
    /// Changes under which every scheme is audited, too.
    pub changes: Vec<Change>,
}

impl<const D: usize> Request<D> {
    /// Creates a request of defaults.
    pub fn new(k: usize, seed: u64) -> Self {
        let plan = Plan {
            schemes: Vec::new(),
            neighbors: Vec::new(),
            oracle_noise: Vec::new(),
            inlier_ratios: Vec::new(),
            solvers: Vec::new(),
            thresholds: Vec::new(),
            k,
            seed,
            ..Plan::new(if D == 2 { Unit::Pixel } else { Unit::Meter })
        };
        Self { plan, changes: Vec::new() }
    }

    /// Returns the plan `usual` with what is requested; `described` is true if there are descriptors.
    ///
    /// # Errors
    /// If a threshold or a source repeats, or an option of the oracle is given without it.
    pub fn plan(self, usual: Plan<D>, described: bool) -> Result<Plan<D>, Error> {
        let Self { plan, changes } = self;
        let neighbors = match plan.neighbors.is_empty() {
            true => sources::usual(described),
            false => each_once(plan.neighbors)?,
        };
        for (option, is_given) in [
            ("--inlier-ratios", !plan.inlier_ratios.is_empty()),
            ("--oracle-noise", !plan.oracle_noise.is_empty()),
        ] {
            if is_given && !neighbors.iter().any(NeighborsBy::is_oracle) {
                let names = neighbors.iter().map(NeighborsBy::name).collect::<Vec<_>>().join(", ");
                bail!("{option}: expected with --neighbors oracle, found only {names}");
            }
        }
        let thresholds = given_or(plan.thresholds, usual.thresholds);
        if let Some(threshold) = repeated(&thresholds, |a, b| a.value == b.value) {
            bail!("--thresholds: expected each once, found {} again", threshold.label);
        }
        let is_ours = |name: &str| unlift::obfuscate::scheme(name).is_ok();
        let schemes = distinct(plan.schemes, |a, b| a.name() == b.name() && is_ours(a.name()));
        let mut schemes = given_or(schemes, usual.schemes);
        schemes.extend(Changed::all(&schemes, &changes));
        let is_ours = |solver: &dyn Solver<D>| solver.builtin().is_some();
        let same = |a: &Arc<dyn Solver<D>>, b: &Arc<dyn Solver<D>>| {
            a.name() == b.name() && is_ours(&**a) && is_ours(&**b)
        };
        Ok(Plan {
            schemes,
            neighbors,
            inlier_ratios: given_or(distinct(plan.inlier_ratios, f64::eq), usual.inlier_ratios),
            oracle_noise: given_or(distinct(plan.oracle_noise, Noise::eq), usual.oracle_noise),
            solvers: given_or(distinct(plan.solvers, same), usual.solvers),
            headline: if D == 2 { headline(&thresholds) } else { usual.headline },
            thresholds,
            measures: usual.measures,
            ..plan
        })
    }
}

/// Schemes of a quick audit: the best-known one, and one that hides two points per record.
const QUICK_SCHEMES: [&str; 2] = ["olc", "ppl"];
const QUICK_RATIO: f64 = 0.5;
/// Source of a quick audit: the fastest one, for any descriptors.
const QUICK_SOURCE: &str = "similarity";

impl Request<3> {
    /// Requests a small audit in place of the usual schemes and sources.
    pub fn quick(&mut self, usual: &Plan<3>, described: bool) -> Result<(), Error> {
        let is_quick = |scheme: &&Arc<dyn Scheme<3>>| QUICK_SCHEMES.contains(&scheme.name());
        self.plan.schemes = usual.schemes.iter().filter(is_quick).cloned().collect();
        self.plan.inlier_ratios = vec![QUICK_RATIO];
        self.plan.neighbors = vec![NeighborsBy::Oracle];
        if described {
            let source = sources::named(QUICK_SOURCE)?.of_dimension()?;
            self.plan.neighbors.push(NeighborsBy::Source(source));
        }
        Ok(())
    }

    /// Returns the plan for a map whose release has `descriptors`; `place` says where they are expected. Adds to
    /// `remarks` what there is to say of it.
    ///
    /// # Errors
    /// As of [`plan`](Self::plan), if a source does not support the descriptors, or if thresholds mean nothing for the map.
    pub fn of_map(
        self,
        usual: Plan<3>,
        points: &PointSet<3>,
        (descriptors, place): (Option<&Descriptors>, &str),
        remarks: &mut Remarks,
    ) -> Result<Plan<3>, Error> {
        let typed = !self.plan.thresholds.is_empty();
        let plan = self.plan(usual, descriptors.is_some())?;
        check_thresholds(remarks, points, &plan.thresholds, typed)?;
        check_fit(&plan, descriptors, place)?;
        remarks.notes.extend(plan.own_sources().filter_map(|source| source.note(points.len())));
        Ok(plan)
    }
}

/// Returns the index of the headline threshold of images in `thresholds`.
pub fn headline(thresholds: &[Threshold]) -> usize {
    unlift_report::headline(thresholds.iter().map(|threshold| threshold.value))
}

/// Returns each source once. Different files, or different sources of the user with one name, are an error.
fn each_once<const D: usize>(neighbors: Vec<NeighborsBy<D>>) -> Result<Vec<NeighborsBy<D>>, Error> {
    let is_ours = |source: &dyn Source<D>| sources::named(source.name()).is_ok();
    let neighbors = distinct(neighbors, |a, b| match (a, b) {
        (NeighborsBy::Oracle, NeighborsBy::Oracle) => true,
        (NeighborsBy::Given(a), NeighborsBy::Given(b)) => a == b,
        (NeighborsBy::Source(a), NeighborsBy::Source(b)) => a.name() == b.name() && is_ours(&**a),
        _ => false,
    });
    let n_files = neighbors.iter().filter(|by| matches!(by, NeighborsBy::Given(_))).count();
    if n_files > 1 {
        bail!("--neighbors: expected at most one file, found {n_files}");
    }
    if let Some(by) = repeated(&neighbors, |a, b| a.name() == b.name()) {
        bail!("--neighbors: expected each name once, found {}", by.name());
    }
    Ok(neighbors)
}

/// Returns the first item that repeats an earlier one.
fn repeated<T>(items: &[T], same: impl Fn(&T, &T) -> bool) -> Option<&T> {
    let repeats = |at: &usize| items[..*at].iter().any(|earlier| same(earlier, &items[*at]));
    (0..items.len()).find(repeats).map(|at| &items[at])
}

fn given_or<T>(given: Vec<T>, usual: Vec<T>) -> Vec<T> {
    if given.is_empty() { usual } else { given }
}
