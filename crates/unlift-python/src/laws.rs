//! Property tests of schemes, sources and solvers.

use std::sync::Arc;

use pyo3::exceptions::PyAssertionError;
use pyo3::prelude::*;
use unlift::guard::caught;

use crate::hidden::released_of;
use crate::lists::Neighborhoods;
use crate::own::{OwnScheme, OwnSolver, OwnSource, Raised};
use crate::work;

/// Runs `laws`; a failure becomes an AssertionError with the property, the points and the result.
fn kept(py: Python<'_>, by: &Raised, laws: impl FnOnce() + Send + 'static) -> PyResult<()> {
    let result = work::run(py, None, Some(by.stop()), move || Ok::<_, String>(caught(laws)))?;
    result.map_err(|text| by.as_cause_of(py, PyAssertionError::new_err(text)))
}

/// Checks that a scheme hides every point, on its record, by its key alone, and in an order that
/// reveals nothing.
///
/// It calls the scheme with 0, 1, 2, 3, 7, 120, 200, 300, 301, 600 and 700 points: of a made-up
/// room, at random, many in one place; with `images`, keypoints `(n, 2)`. A scheme may refuse
/// points by an exception, except 200, 600 and 700 points of a room.
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

/// Checks that a source returns a list for every hidden point of `released`, of records of this
/// map, by its seed alone.
///
/// It calls the source three times.
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

/// Checks that a solver returns a row for every hidden point of `released`, and the same positions
/// again.
///
/// It calls the solver three times, the last time with empty lists.
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
