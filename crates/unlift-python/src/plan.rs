//! Conversion of arguments to a plan.

use std::sync::Arc;

use pyo3::prelude::*;
use unlift::Unit;
use unlift::audit::{NeighborsBy, Plan, Threshold};
use unlift::neighbors::Source;
use unlift::neighbors::oracle::Noise;
use unlift::obfuscate::{SCHEMES, Scheme, SchemeOptions};
use unlift::recover::{Delta, Solver};
use unlift_audit::images::choice::headline;
use unlift_audit::{Prepared, check_thresholds, sources};

use crate::errors::{raised, wrong};
use crate::lists;
use crate::obfuscate::scheme_of;
use crate::own::{OwnScheme, OwnSolver, OwnSource, Raised, solver_of};
use crate::work;

/// Options of an audit; `None` means the default.
#[derive(FromPyObject)]
pub struct Asked<'py> {
    #[pyo3(item)]
    pub schemes: Option<Vec<Bound<'py, PyAny>>>,
    #[pyo3(item)]
    pub neighbors: Vec<Bound<'py, PyAny>>,
    #[pyo3(item)]
    pub inlier_ratios: Option<Vec<f64>>,
    #[pyo3(item)]
    pub oracle_noise: Option<Vec<String>>,
    #[pyo3(item)]
    pub solvers: Option<Vec<Bound<'py, PyAny>>>,
    #[pyo3(item)]
    pub thresholds: Option<Bound<'py, PyAny>>,
    #[pyo3(item)]
    pub k: usize,
    #[pyo3(item)]
    pub source_k: Option<usize>,
    #[pyo3(item)]
    pub tile_points: Option<usize>,
    #[pyo3(item)]
    pub tile: Option<usize>,
    #[pyo3(item)]
    pub delta: Option<f64>,
    #[pyo3(item)]
    pub exact_constraints: bool,
    #[pyo3(item)]
    pub records_alone: bool,
    #[pyo3(item)]
    pub reference: bool,
    #[pyo3(item)]
    pub seed: u64,
    #[pyo3(item)]
    pub repeats: u32,
    #[pyo3(item)]
    pub gates: Vec<String>,
    #[pyo3(item)]
    pub threads: Option<usize>,
}

impl Asked<'_> {
    /// Returns the plan for `prepared`, notes for the user, and doubts about the results.
    pub fn plan(
        &self,
        py: Python<'_>,
        prepared: &Arc<Prepared>,
        by: &Raised,
    ) -> PyResult<(Plan<3>, Vec<String>, Option<String>)> {
        let points = prepared.original.reveal();
        let at_once = self.tile_points.map_or(points.len(), |most| points.len().min(most));
        let usual = Plan::<3>::new(points.unit()).for_map(at_once, self.k);
        let plan = self.with(usual, points.unit(), by)?;
        plan.check(points.len(), prepared.descriptors.is_some()).map_err(raised)?;
        let (prepared, typed) = (Arc::clone(prepared), self.thresholds.is_some());
        work::run(py, self.threads, None, move || {
            let points = prepared.original.reveal();
            let (positions, unit) = (points.positions(), points.unit());
            let said = check_thresholds(positions, unit, &plan.thresholds, typed)?;
            let mut notes: Vec<String> = said.note.into_iter().collect();
            for source in plan.neighbors.iter().filter_map(NeighborsBy::source) {
                if let Some(descriptors) = &prepared.descriptors {
                    source.takes(descriptors)?;
                }
                notes.extend(source.note(points.len()));
            }
            Ok::<_, unlift_audit::Error>((plan, notes, said.doubt))
        })
    }

    /// Returns the plan for images.
    pub fn plan_of_images(&self, by: &Raised) -> PyResult<Plan<2>> {
        let plan = self.with(Plan::<2>::new(Unit::Pixel), Unit::Pixel, by)?;
        let plan = Plan { headline: headline(&plan.thresholds), ..plan };
        plan.check_for_many().map_err(raised)?;
        Ok(plan)
    }

    /// Returns the plan `usual` with these options, for points in `unit`.
    fn with<const D: usize>(&self, usual: Plan<D>, unit: Unit, by: &Raised) -> PyResult<Plan<D>>
    where
        OwnScheme: Scheme<D>,
        OwnSource: Source<D>,
        OwnSolver: Solver<D>,
    {
        let options = SchemeOptions::usual(unit);
        let schemes = match &self.schemes {
            Some(schemes) => schemes
                .iter()
                .map(|given| {
                    let scheme = scheme_of(given, &options, by)?;
                    let taken = SCHEMES.iter().any(|entry| entry.name == scheme.name());
                    of_its_own("schemes", given, scheme.name(), taken)?;
                    Ok(scheme)
                })
                .collect::<PyResult<_>>()?,
            None => usual.schemes.clone(),
        };
        let noise = self.oracle_noise.as_deref().map(|names| named(names, Noise::from_name));
        let solvers = self.solvers.as_deref().map(|given| solvers(given, by));
        let neighbors = self.sources(by)?;
        self.check_about(&neighbors)?;
        Ok(Plan {
            schemes,
            neighbors,
            inlier_ratios: self.inlier_ratios.clone().map_or(usual.inlier_ratios, distinct),
            oracle_noise: noise.transpose()?.unwrap_or(usual.oracle_noise),
            solvers: solvers.transpose()?.unwrap_or(usual.solvers),
            k: self.k,
            delta: delta(self.delta)?,
            exact_constraints: self.exact_constraints,
            records_alone: self.records_alone,
            reference: self.reference,
            thresholds: thresholds(self.thresholds.as_ref(), &usual.thresholds)?,
            seed: self.seed,
            repeats: self.repeats,
            ..usual
        })
    }

    /// Returns an error for an option that applies to none of `sources`, as on the command line.
    fn check_about<const D: usize>(&self, sources: &[NeighborsBy<D>]) -> PyResult<()> {
        let about = |name: &str, expected: &str| {
            let found: Vec<&str> = sources.iter().map(NeighborsBy::name).collect();
            wrong(name, expected, format!("only {}", found.join(", ")))
        };
        let oracle = sources.iter().any(NeighborsBy::is_oracle);
        let of_oracle = [
            ("inlier_ratios", self.inlier_ratios.is_some()),
            ("oracle_noise", self.oracle_noise.is_some()),
        ];
        if let (false, Some((name, _))) = (oracle, of_oracle.iter().find(|(_, given)| *given)) {
            return Err(about(name, "neighbors with \"oracle\""));
        }
        let is_ours =
            |given: &Bound<'_, PyAny>| given.extract::<String>().is_ok_and(|name| name != "oracle");
        if self.source_k.is_some() && !self.neighbors.iter().any(is_ours) {
            // A function determines the length of its lists.
            return Err(about("source_k", "neighbors with a source of unlift's"));
        }
        Ok(())
    }

    /// Returns the sources; each name may occur once.
    fn sources<const D: usize>(&self, by: &Raised) -> PyResult<Vec<NeighborsBy<D>>>
    where
        OwnSource: Source<D>,
    {
        let mut sources: Vec<NeighborsBy<D>> = Vec::new();
        for given in &self.neighbors {
            let source = self.source(given, by)?;
            let ours = ["oracle", "file"].into_iter();
            let mut ours = ours.chain(sources::all().into_iter().map(|entry| entry.name));
            of_its_own("neighbors", given, source.name(), ours.any(|name| name == source.name()))?;
            let is_again = sources.iter().any(|other| other.name() == source.name());
            match (is_again, given.extract::<String>()) {
                (false, _) => sources.push(source),
                // As on the command line.
                (true, Ok(_)) => {}
                (true, Err(_)) => {
                    return Err(wrong("neighbors", "each name once", source.name()));
                }
            }
        }
        Ok(sources)
    }

    /// Returns the source for a name or a function.
    fn source<const D: usize>(
        &self,
        given: &Bound<'_, PyAny>,
        by: &Raised,
    ) -> PyResult<NeighborsBy<D>>
    where
        OwnSource: Source<D>,
    {
        let Ok(name) = given.extract::<String>() else {
            return Ok(NeighborsBy::Source(Arc::new(OwnSource::new(given, by)?)));
        };
        if name == "oracle" {
            return Ok(NeighborsBy::Oracle);
        }
        let named = lists::named(&name, self.source_k)?;
        Ok(NeighborsBy::Source(named.of_dimension().map_err(raised)?))
    }
}

/// Returns an error for a function with a built-in name, because a report would mistake it for the
/// built-in one.
fn of_its_own(what: &str, given: &Bound<'_, PyAny>, name: &str, taken: bool) -> PyResult<()> {
    match taken && given.extract::<String>().is_err() {
        true => Err(wrong(what, "functions with a name that unlift does not use", name)),
        false => Ok(()),
    }
}

/// Returns the solvers for names or functions, without repeated names, as on the command line.
fn solvers<const D: usize>(
    given: &[Bound<'_, PyAny>],
    by: &Raised,
) -> PyResult<Vec<Arc<dyn Solver<D>>>>
where
    OwnSolver: Solver<D>,
{
    let mut kept: Vec<Arc<dyn Solver<D>>> = Vec::new();
    for one in given {
        let solver = solver_of::<D>(one, by)?;
        let is_name = one.extract::<String>().is_ok();
        if !(is_name && kept.iter().any(|other| other.name() == solver.name())) {
            kept.push(solver);
        }
    }
    Ok(kept)
}

/// Returns what `names` stand for, each once.
fn named<T: PartialEq>(
    names: &[String],
    of: impl Fn(&str) -> Result<T, unlift::Error>,
) -> PyResult<Vec<T>> {
    let all = names.iter().map(|name| of(name)).collect::<Result<_, _>>();
    all.map(distinct).map_err(raised)
}

/// Removes items that repeat an earlier one, because an audit has one row per combination.
fn distinct<T: PartialEq>(items: Vec<T>) -> Vec<T> {
    let mut kept = Vec::with_capacity(items.len());
    for item in items {
        if !kept.contains(&item) {
            kept.push(item);
        }
    }
    kept
}

/// Returns thresholds from strings or numbers, or the default.
pub fn thresholds(
    given: Option<&Bound<'_, PyAny>>,
    usual: &[Threshold],
) -> PyResult<Vec<Threshold>> {
    let Some(given) = given else { return Ok(usual.to_vec()) };
    let one = |threshold: PyResult<Bound<'_, PyAny>>| {
        let text = threshold?.str()?.to_string();
        Threshold::parse(&text).map_err(|_| wrong("thresholds", "numbers above 0", text))
    };
    let thresholds = given.try_iter()?.map(one).collect::<PyResult<Vec<_>>>()?;
    for (at, threshold) in thresholds.iter().enumerate() {
        if thresholds[..at].iter().any(|other| other.value == threshold.value) {
            return Err(wrong("thresholds", "each once", format!("{} again", threshold.label)));
        }
    }
    if thresholds.is_empty() {
        return Err(wrong("thresholds", "at least one", "none"));
    }
    Ok(thresholds)
}

/// Returns the distance within which a record supports a position.
pub fn delta(given: Option<f64>) -> PyResult<Delta> {
    match given {
        None => Ok(Delta::Auto),
        Some(length) if length.is_finite() && length > 0.0 => Ok(Delta::Fixed(length)),
        Some(other) => Err(wrong("delta", "a number above 0, or None", other)),
    }
}
