//! From arguments to a plan: the usual one, with what was asked for.

use std::sync::Arc;

use pyo3::prelude::*;
use unlift::audit::{NeighborsBy, Plan, Threshold};
use unlift::neighbors::oracle::Noise;
use unlift::obfuscate::SchemeOptions;
use unlift::recover::{Delta, Solver};
use unlift_audit::{Prepared, check_thresholds};

use crate::errors::{raised, wrong};
use crate::hidden::scheme_of;
use crate::lists;
use crate::own::{OwnSource, Raised};
use crate::work;

/// What an audit was asked for; `None` is as usual.
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
    pub solvers: Option<Vec<String>>,
    #[pyo3(item)]
    pub thresholds: Option<Bound<'py, PyAny>>,
    #[pyo3(item)]
    pub k: usize,
    #[pyo3(item)]
    pub source_k: Option<usize>,
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
    /// The plan for `prepared`, and what a user should know about it.
    pub fn plan(
        &self,
        py: Python<'_>,
        prepared: &Arc<Prepared>,
        by: &Raised,
    ) -> PyResult<(Plan<3>, Vec<String>)> {
        let points = prepared.original.reveal();
        let usual = Plan::<3>::new(points.unit()).for_map(points.len(), self.k);
        let thresholds = thresholds(self.thresholds.as_ref(), &usual.thresholds)?;
        let options = SchemeOptions::usual(points.unit());
        let schemes = match &self.schemes {
            Some(schemes) => schemes
                .iter()
                .map(|scheme| scheme_of(scheme, &options, by))
                .collect::<PyResult<_>>()?,
            None => usual.schemes.clone(),
        };
        let neighbors = self.neighbors.iter().map(|source| self.source(source, by));
        let neighbors = neighbors.collect::<PyResult<Vec<_>>>()?;
        let noise = self
            .oracle_noise
            .as_ref()
            .map(|names| names.iter().map(|name| Noise::from_name(name)).collect::<Result<_, _>>());
        let solvers = self.solvers.as_ref().map(|names| {
            names.iter().map(|name| Solver::from_name(name)).collect::<Result<_, _>>()
        });
        let plan = Plan {
            schemes,
            neighbors,
            inlier_ratios: self.inlier_ratios.clone().unwrap_or(usual.inlier_ratios),
            oracle_noise: noise.transpose().map_err(raised)?.unwrap_or(usual.oracle_noise),
            solvers: solvers.transpose().map_err(raised)?.unwrap_or(usual.solvers),
            k: self.k,
            delta: delta(self.delta)?,
            exact_constraints: self.exact_constraints,
            records_alone: self.records_alone,
            reference: self.reference,
            thresholds,
            seed: self.seed,
            repeats: self.repeats,
            ..usual
        };
        plan.check(points.len(), prepared.descriptors.is_some()).map_err(raised)?;
        let (prepared, typed) = (Arc::clone(prepared), self.thresholds.is_some());
        work::run(py, self.threads, None, move || {
            let points = prepared.original.reveal();
            let (positions, unit) = (points.positions(), points.unit());
            let note = check_thresholds(positions, unit, &plan.thresholds, typed)?;
            let mut notes: Vec<String> = note.into_iter().collect();
            for source in plan.neighbors.iter().filter_map(NeighborsBy::source) {
                if let Some(descriptors) = &prepared.descriptors {
                    source.takes(descriptors)?;
                }
                notes.extend(source.note(points.len()));
            }
            Ok::<_, unlift_audit::Error>((plan, notes))
        })
    }

    /// A source of neighborhoods, a name or a function.
    fn source(&self, given: &Bound<'_, PyAny>, by: &Raised) -> PyResult<NeighborsBy<3>> {
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

/// Thresholds as they were written, texts or numbers; else the usual ones.
pub fn thresholds(
    given: Option<&Bound<'_, PyAny>>,
    usual: &[Threshold],
) -> PyResult<Vec<Threshold>> {
    let Some(given) = given else { return Ok(usual.to_vec()) };
    let one = |threshold: PyResult<Bound<'_, PyAny>>| {
        let text = threshold?.str()?.to_string();
        Threshold::parse(&text).map_err(|_| wrong("thresholds", "numbers above 0", text))
    };
    given.try_iter()?.map(one).collect()
}

/// The distance that decides support, or the attack's own choice.
pub fn delta(given: Option<f64>) -> PyResult<Delta> {
    match given {
        None => Ok(Delta::Auto),
        Some(length) if length.is_finite() && length > 0.0 => Ok(Delta::Fixed(length)),
        Some(other) => Err(wrong("delta", "a number above 0, or None", other)),
    }
}
