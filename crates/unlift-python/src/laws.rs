//! The laws of schemes, sources and solvers, for tests in Python.

use std::sync::Arc;

use pyo3::exceptions::PyAssertionError;
use pyo3::prelude::*;
use unlift::guard::caught;

use crate::hidden::released_of;
use crate::lists::Neighborhoods;
use crate::own::{OwnScheme, OwnSolver, OwnSource, Raised};
use crate::work;

/// Runs `laws`; one that is broken is an AssertionError that says which, on which points, and what was found.
fn kept(py: Python<'_>, by: &Raised, laws: impl FnOnce() + Send + 'static) -> PyResult<()> {
    let result = work::run(py, None, Some(by.stop()), move || Ok::<_, String>(caught(laws)))?;
    result.map_err(|text| by.as_cause_of(py, PyAssertionError::new_err(text)))
}

/// Whether a scheme hides every point, on its record, by its key alone, and in an order that tells nothing.
///
/// It is called with 0, 1, 2, 3, 7, 120, 200, 300, 301, 600 and 700 points: of a made-up room, at random, many in one place. By an
/// exception it refuses points, which it may but for 200, 600 and 700 of a room. With `images` with keypoints `(n, 2)` in their place.
#[pyfunction]
#[pyo3(signature = (scheme, *, images=false))]
pub fn check_scheme(py: Python<'_>, scheme: &Bound<'_, PyAny>, images: bool) -> PyResult<()> {
    let by = Raised::default();
    let scheme = OwnScheme::new(scheme, &by)?;
    kept(py, &by, move || match images {
        true => unlift_testkit::scheme_laws::<2>(&scheme),
        false => unlift_testkit::scheme_laws::<3>(&scheme),
    })
}

/// Whether a source gives every hidden point of `released` a list, of records of this map, by its seed alone.
///
/// It is called three times.
#[pyfunction]
pub fn check_source(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    released: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let (by, released) = (Raised::default(), released_of(released)?.of_map()?);
    let source = OwnSource::new(source, &by)?;
    kept(py, &by, move || unlift_testkit::source_laws::<3>(&source, &released))
}

/// Checks that a solver answers for every hidden point of `released`, and gives the same positions again.
///
/// It is called three times, the last time with empty lists.
#[pyfunction]
pub fn check_solver(
    py: Python<'_>,
    solver: &Bound<'_, PyAny>,
    released: &Bound<'_, PyAny>,
    lists: &Neighborhoods,
) -> PyResult<()> {
    let (by, released) = (Raised::default(), released_of(released)?.of_map()?);
    let (solver, lists) = (OwnSolver::new(solver, &by)?, Arc::clone(&lists.0));
    kept(py, &by, move || unlift_testkit::solver_laws::<3>(&solver, &released, &lists))
}
