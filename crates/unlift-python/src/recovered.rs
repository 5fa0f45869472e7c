//! Recovery and evaluation.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use unlift::audit::doubts::Checked;
use unlift::audit::{Plan, measure};
use unlift::evaluate::blind;
use unlift::recover::{Builtin, RecoverOptions, Recovered as Found, recover as solve};
use unlift_io::stage::{Kind, read_recovered, write_recovered};

use crate::arrays::{raised, to_array, to_rows};
use crate::audit::thresholds;
use crate::hidden::{Hidden, released_of, save, truth_of};
use crate::lists::Neighborhoods;
use crate::own::{Raised, solver_of};
use crate::threads;

/// Recovered points of a map: a position for every hidden point, or the reason why there is none.
#[pyclass(frozen, module = "unlift")]
pub struct Recovered(pub Arc<Found<3>>);

#[pymethods]
impl Recovered {
    /// Reads recovered points (`.npz`).
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let recovered = py.detach(|| read_recovered::<3>(&path, None)).map_err(raised)?;
        Ok(Self(Arc::new(recovered)))
    }

    /// Writes the points (`.npz`), as `unlift recover` does. Replaces other files only with `force`.
    #[pyo3(signature = (path, *, force=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        save(py, (path, force), Kind::Recovered, |path| write_recovered(path, &self.0))
    }

    fn __len__(&self) -> usize {
        self.0.n_slots()
    }

    fn __repr__(&self) -> String {
        format!("<unlift.Recovered: {} points in {}>", self.0.n_slots(), self.0.unit().name())
    }

    /// Positions `(n_slots, 3)`, NaN where nothing was recovered.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let n = self.0.n_slots();
        let rows = (0..n).map(|slot| self.0.position(slot).unwrap_or([f64::NAN; 3])).collect();
        Ok(to_rows(py, rows)?.into_any())
    }

    /// For each slot "ok", or the reason why nothing was recovered.
    #[getter]
    fn status(&self) -> Vec<&'static str> {
        self.0.status().iter().map(|status| status.name()).collect()
    }

    /// Number of listed records that support each position `(n_slots,)`.
    #[getter]
    fn support<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        to_array(py, self.0.support().to_vec()).into_any()
    }

    /// Distance within which a listed record supports a position.
    #[getter]
    fn delta(&self) -> f64 {
        self.0.delta()
    }

    /// Unit of lengths.
    #[getter]
    fn unit(&self) -> &'static str {
        self.0.unit().name()
    }

    /// Probability that each position lies within `threshold` of the truth `(n_slots,)`, as the attacker computes it; None if unknown.
    fn probability_within<'py>(
        &self,
        py: Python<'py>,
        threshold: f64,
    ) -> Option<Bound<'py, PyAny>> {
        self.0.confidence()?;
        let of = |slot| self.0.probability_within(slot, threshold).unwrap_or(0.0);
        Some(to_array(py, (0..self.0.n_slots()).map(of).collect()).into_any())
    }

    /// Reason why `probability_within` is unknown, or None.
    #[getter]
    fn confidence_unknown(&self) -> Option<&'static str> {
        self.0.confidence_unknown().map(|unknown| unknown.reason())
    }
}

/// Recovers the points of a released map from neighbor lists, without the truth. `solver` is a name in `SOLVERS` or a function;
/// default: "joint". `confidence=False` skips the computation of `probability_within`.
#[pyfunction]
#[pyo3(signature = (released, lists, *, solver=None, seed=0, confidence=true, threads=None))]
#[allow(clippy::too_many_arguments)]
pub fn recover(
    py: Python<'_>,
    released: &Bound<'_, PyAny>,
    lists: &Neighborhoods,
    solver: Option<&Bound<'_, PyAny>>,
    seed: u64,
    confidence: bool,
    threads: Option<usize>,
) -> PyResult<Recovered> {
    let released = released_of(released)?.of_map()?;
    let options = RecoverOptions { seed, confidence, ..RecoverOptions::default() };
    let by = Raised::default();
    let solver = match solver {
        Some(given) => solver_of::<3>(given, &by)?,
        None => Arc::new(Builtin::Joint),
    };
    let lists = Arc::clone(&lists.0);
    let work = move || solve(&released, &lists, &*solver, &options);
    let recovered = threads::run(py, threads, Some(&by.waiting), work);
    Ok(Recovered(Arc::new(recovered.map_err(|error| by.as_cause_of(py, error))?)))
}

/// Compares recovered points with the truth; returns a dict like a row of an audit. With a Hidden it includes the blind baseline.
#[pyfunction]
#[pyo3(signature = (recovered, truth, *, thresholds=None))]
pub fn evaluate<'py>(
    py: Python<'py>,
    recovered: &Recovered,
    truth: &Bound<'py, PyAny>,
    thresholds: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let released = truth.cast::<Hidden>().ok().map(|hidden| hidden.get().released.clone());
    let released = released.map(crate::hidden::Released::of_map).transpose()?;
    let truth = truth_of(truth)?;
    let mut thresholds = self::thresholds(thresholds)?;
    if thresholds.is_empty() {
        thresholds = Plan::<3>::new(truth.original.reveal().unit()).thresholds;
    }
    let (recovered, requested) = (Arc::clone(&recovered.0), thresholds.clone());
    let (row, notes) = threads::run(py, None, None, move || {
        let (original, secret) = (&truth.original, &truth.secret);
        let mut checked = Checked::default();
        checked.add(&recovered, original, secret, released.as_deref())?;
        let notes = checked.notes(&requested, original.reveal().unit())?;
        let baseline = released.map(|released| blind(&released, original, secret));
        let (row, _) = measure(&recovered, original, secret, baseline.as_ref(), &requested)?;
        Ok::<_, unlift::Error>((row, notes))
    })?;
    let figures = unlift_audit::evaluated(&row, &notes).map_err(raised)?;
    let figures = py.import("json")?.call_method1("loads", (figures.to_string(),))?;
    Ok(figures.cast_into::<PyDict>()?)
}
