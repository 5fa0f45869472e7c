//! The laws of schemes and sources, for tests in Python.

use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::exceptions::PyAssertionError;
use pyo3::prelude::*;

use crate::hidden::{Released, released_of};
use crate::own::{OwnScheme, OwnSource, Raised};
use crate::work::told;

/// Runs `laws`; one that is broken is an AssertionError that says which, on which points, and what was found.
fn kept(py: Python<'_>, by: &Raised, laws: impl FnOnce() + Send) -> PyResult<()> {
    let result = py.detach(|| catch_unwind(AssertUnwindSafe(laws)).map_err(|panic| told(&*panic)));
    result.map_err(|text| by.as_cause_of(py, PyAssertionError::new_err(text)))
}

/// Whether a scheme hides every point, on its record, by its key alone.
#[pyfunction]
pub fn check_scheme(py: Python<'_>, scheme: &Bound<'_, PyAny>) -> PyResult<()> {
    let by = Raised::default();
    let scheme = OwnScheme::new(scheme, &by)?;
    kept(py, &by, || unlift_testkit::scheme_laws::<3>(&scheme))
}

/// Whether a source gives every hidden point of `released` a list, of records of this map, by its seed alone.
#[pyfunction]
pub fn check_source(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    released: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let (by, Released(released)) = (Raised::default(), released_of(released)?);
    let source = OwnSource::new(source, &by)?;
    kept(py, &by, || unlift_testkit::source_laws::<3>(&source, &released))
}
